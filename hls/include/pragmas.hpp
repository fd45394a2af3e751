// Directives of the vendor's compiler (__SYNTHESIS__) as macros; other compilers see none. What Bambu (__BAMBU__)
// has to see, the interfaces, is written out at each port: it takes no directive out of a macro.
// Directive names are in lower case: ap_types define a macro INLINE.
#pragma once

// clang-format off
#if defined(__SYNTHESIS__) && !defined(__BAMBU__)
#define RT_VENDOR(text) RT_DO_PRAGMA(text)
#define RT_DO_PRAGMA(text) _Pragma(#text)
#else
#define RT_VENDOR(text)
#endif

#define RT_PIPELINE(interval) RT_VENDOR(HLS pipeline II=interval)
#define RT_UNROLL RT_VENDOR(HLS unroll)
#define RT_INLINE RT_VENDOR(HLS inline)
#define RT_FREE_RUNNING RT_VENDOR(HLS interface mode=ap_ctrl_none port=return)
#define RT_MEMORY(name, group, words) \
  RT_VENDOR(HLS interface mode=m_axi port=name offset=slave bundle=group depth=words) \
  RT_VENDOR(HLS interface mode=s_axilite port=name bundle=control)
#define RT_CONTROL(name) RT_VENDOR(HLS interface mode=s_axilite port=name bundle=control)
#define RT_INDEPENDENT(name, far) RT_VENDOR(HLS dependence variable=name type=inter dependent=true distance=far)
#define RT_PARTITION(name) RT_VENDOR(HLS array_partition variable=name type=complete)
// clang-format on
