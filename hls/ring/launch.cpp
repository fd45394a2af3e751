// Task launch of the ring: merges new rays into the ring. Fills the ring with its tokens, gives a token that has no ray the next one, and sends its constants to the
// units before it. When there are no more rays and every token has come back without one, it takes the tokens out and sends the end.
#include "tasks.hpp"

namespace retrace::hls {

// Origin and direction of an axis.
inline ring_word64_t pack_lines(const ray_setup_out_record& ray, int axis) {
  RT_INLINE
  ring_word64_t w = ring_word64_t(ap_uint<contract::kDirectionBits>(ray.direction[axis]));
  ring_push(w, ring_word64_t(ap_uint<contract::kPositionBits>(ray.origin[axis])), contract::kPositionBits);
  return w;
}

}  // namespace retrace::hls

extern "C" void ring_launch(
    hls::stream<retrace::hls::ray_setup_out_word_t>& setups, hls::stream<retrace::hls::token_word_t>& ready,
    hls::stream<retrace::hls::token_word_t>& step_rays, hls::stream<retrace::hls::token_word_t>& step_rays_2,
    hls::stream<retrace::hls::token_word_t>& exit_rays, hls::stream<retrace::hls::token_word_t>& test_rays,
    hls::stream<retrace::hls::ring_word64_t>& result_rays, hls::stream<retrace::hls::token_word_t>& tokens,
    ap_uint<32> ray_count, ap_uint<32> contexts) {
  using namespace retrace::hls;
  namespace contract = retrace::contract;
  // clang-format off
#pragma HLS interface mode=axis port=setups
#pragma HLS interface mode=axis port=ready
#pragma HLS interface mode=axis port=step_rays
#pragma HLS interface mode=axis port=step_rays_2
#pragma HLS interface mode=axis port=exit_rays
#pragma HLS interface mode=axis port=test_rays
#pragma HLS interface mode=axis port=result_rays
#pragma HLS interface mode=axis port=tokens
  // clang-format on
  ap_uint<32> next_ray = 0;
  ap_uint<32> idle = 0;  // tokens without a ray, in a row
LAUNCH:
  for (unsigned long long i = 0; i < kRingIterations; ++i) {
    RT_PIPELINE(1)  // one token a clock, the rate of the ring
    token t = unpack_token(token_word_t(0));
    t.id = i;
    if (i >= contexts.to_uint()) t = unpack_token(ready.read());
    t.fresh = 0;
    t.down = 0;
    t.up = 0;
    t.arrive = 0;
    t.test = 0;
    t.skipped = 0;
    t.last = 0;
    if (t.phase == kTokenIdle && next_ray != ray_count) {
      const ray_setup_out_record ray = read_ray_setup_out(setups.read());
      step_rays.write(ring_join(pack_slab(ray, 0), pack_slab(ray, 1), pack_slab(ray, 2), ring_word64_t(0)));
      step_rays_2.write(ring_join(pack_slab(ray, 0), pack_slab(ray, 1), pack_slab(ray, 2), ring_word64_t(0)));
      exit_rays.write(ring_join(pack_slab(ray, 0), pack_slab(ray, 1), pack_slab(ray, 2), ring_word64_t(0)));
      test_rays.write(ring_join(pack_lines(ray, 0), pack_lines(ray, 1), pack_lines(ray, 2), ring_word64_t(0)));
      ring_word64_t rest = ring_word64_t(next_ray);
      ring_push(rest, ring_word64_t(ray.any), 1);
      ring_push(rest, ring_word64_t(ray.t_max), contract::kTLimitBits);
      result_rays.write(rest);
      next_ray += 1;
      t.fresh = 1;
      t.phase = kTokenDown;
      t.node = 0;
      t.t = 0;
      t.steps = 0;
      t.status = contract::kStatusMiss;
      if (!ray.valid) token_fails(t, contract::kStatusBadRay);
    }
    if (t.phase == kTokenIdle) {
      idle += 1;
    } else {
      idle = 0;
    }
    // The order of the tokens never changes, so as many idle ones in a row as there are tokens are all of them; they go round once more and stay here.
    if (idle <= contexts) {
      tokens.write(pack_token(t));
    } else if (idle == contexts + contexts) {
      t.phase = kTokenEnd;
      tokens.write(pack_token(t));
      break;
    }
  }
}
