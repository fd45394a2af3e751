// Task ray_reader of the ring: the rays of the run, in order, one a clock.
#include "tasks.hpp"

extern "C" void ring_ray_reader(hls::stream<retrace::hls::token_word_t>& rays_out,
                                const retrace::hls::token_word_t* rays, ap_uint<32> ray_count) {
  using namespace retrace::hls;
  // clang-format off
#pragma HLS interface mode=axis port=rays_out
#if defined(__BAMBU__)
#pragma HLS interface mode=m_axi port=rays offset=direct bundle=bus_rays
#endif
  // clang-format on
RAY_READER:
  for (unsigned long long i = 0; i < kRingIterations; ++i) {
    RT_PIPELINE(1)  // one read a ray
    if (i == ray_count.to_uint()) break;
    rays_out.write(rays[i]);
  }
}
