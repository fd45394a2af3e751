// Directives of HLS compilers as macros. The vendor's compiler (__SYNTHESIS__) takes all of them; Bambu (__BAMBU__) knows the interfaces only,
// wants AXI masters with offset=direct, and gets one master a port: words of different widths then never share one. Other compilers see none.
// Directive names are in lower case: ap_types define a macro INLINE.
#pragma once

// clang-format off
#define RT_DO_PRAGMA(text) _Pragma(#text)

#if defined(__BAMBU__)
#define RT_VENDOR(text)
#define RT_AXIS(name) RT_DO_PRAGMA(HLS interface mode=axis port=name)
#define RT_MEMORY(name, group, words) RT_DO_PRAGMA(HLS interface mode=m_axi port=name offset=direct bundle=bus_##name)
#elif defined(__SYNTHESIS__)
#define RT_VENDOR(text) RT_DO_PRAGMA(text)
#define RT_AXIS(name) RT_DO_PRAGMA(HLS interface mode=axis port=name)
#define RT_MEMORY(name, group, words) \
  RT_DO_PRAGMA(HLS interface mode=m_axi port=name offset=slave bundle=group depth=words) \
  RT_DO_PRAGMA(HLS interface mode=s_axilite port=name bundle=control)
#else
#define RT_VENDOR(text)
#define RT_AXIS(name)
#define RT_MEMORY(name, group, words)
#endif

#define RT_PIPELINE(interval) RT_VENDOR(HLS pipeline II=interval)
#define RT_UNROLL RT_VENDOR(HLS unroll)
#define RT_INLINE RT_VENDOR(HLS inline)
#define RT_FREE_RUNNING RT_VENDOR(HLS interface mode=ap_ctrl_none port=return)
#define RT_CONTROL(name) RT_VENDOR(HLS interface mode=s_axilite port=name bundle=control)
#define RT_INDEPENDENT(name, far) RT_VENDOR(HLS dependence variable=name type=inter dependent=true distance=far)
#define RT_PARTITION(name) RT_VENDOR(HLS array_partition variable=name type=complete)
// clang-format on
