// Task ray_setup of the ring: reciprocals of a ray and whether it can be traced.
#include "../stages/ray_setup.hpp"
#include "tasks.hpp"

extern "C" void ring_ray_setup(hls::stream<retrace::hls::token_word_t>& rays_in,
                               hls::stream<retrace::hls::ray_setup_out_word_t>& setups, ap_uint<32> box_0,
                               ap_uint<32> box_1, ap_uint<32> box_2, ap_uint<32> box_3, ap_uint<32> box_4,
                               ap_uint<32> box_5, ap_uint<32> ray_count) {
  using namespace retrace::hls;
  // clang-format off
#pragma HLS interface mode=axis port=rays_in
#pragma HLS interface mode=axis port=setups
  // clang-format on
RAY_SETUP:
  for (unsigned long long i = 0; i < kRingIterations; ++i) {
    RT_PIPELINE(8)  // three dividers shared in time; a ray takes more laps than that
    if (i == ray_count.to_uint()) break;
    const token_word_t bits = rays_in.read();
    word_t words[kRayWords];
    words[0] = bits;
    words[1] = bits >> 128;
    const ray_record ray = unpack_ray(words);
    ray_setup_in_record in;
  COPY_RAY:
    for (int axis = 0; axis < 3; ++axis) {
      RT_UNROLL
      in.origin[axis] = ray.origin[axis];
      in.direction[axis] = ray.direction[axis];
    }
    in.box[0] = box_0;
    in.box[1] = box_1;
    in.box[2] = box_2;
    in.box[3] = box_3;
    in.box[4] = box_4;
    in.box[5] = box_5;
    in.t_max = ray.t_max;
    in.any = ray.any;
    setups.write(write_ray_setup_out(ray_setup(in)));
  }
}
