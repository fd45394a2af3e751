// Directives of the vendor's HLS compiler as macros, so that another compiler, which rejects some of them, sees none.
#pragma once

#if defined(__SYNTHESIS__) && !defined(__BAMBU__)
#define RT_DO_PRAGMA(text) _Pragma(#text)
#else
#define RT_DO_PRAGMA(text)
#endif

#define RT_PIPELINE(interval) RT_DO_PRAGMA(HLS PIPELINE II = interval)
#define RT_UNROLL RT_DO_PRAGMA(HLS UNROLL)
#define RT_INLINE RT_DO_PRAGMA(HLS INLINE)
#define RT_AXIS(name) RT_DO_PRAGMA(HLS INTERFACE mode = axis port = name)
#define RT_FREE_RUNNING RT_DO_PRAGMA(HLS INTERFACE mode = ap_ctrl_none port = return)
#define RT_MEMORY(name, group) RT_DO_PRAGMA(HLS INTERFACE mode = m_axi port = name bundle = group offset = slave)
#define RT_CONTROL(name) RT_DO_PRAGMA(HLS INTERFACE mode = s_axilite port = name)
#define RT_INDEPENDENT(name, far) RT_DO_PRAGMA(HLS DEPENDENCE variable = name type = inter dependent = true distance = far)
#define RT_PARTITION(name) RT_DO_PRAGMA(HLS ARRAY_PARTITION variable = name type = complete)
