// hls::stream of the compiler at hand. A synthesizing compiler brings its own header, and so does an include path with the vendor's headers.
// Only where there is none (open ap_types without one), C simulation takes the testbench's bounded stream.
#pragma once

#if defined(__SYNTHESIS__) || defined(__BAMBU__)
#include <hls_stream.h>
#elif __has_include(<hls_stream.h>)
#include <hls_stream.h>
#else
#include "../../testbench/csim/include/hls_stream.h"
#endif
