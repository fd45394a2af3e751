// Task result of the ring: the best hit of every ray, the end of a leaf, and the end of a ray. Totals of the run go out behind the last ray.
#include "../stages/tri_test.hpp"
#include "../top/trace.hpp"
#include "tasks.hpp"

extern "C" void ring_result(hls::stream<retrace::hls::token_data_t>& in,
                            hls::stream<retrace::hls::ring_word64_t>& result_rays,
                            hls::stream<retrace::hls::token_word_t>& ready,
                            hls::stream<retrace::hls::token_data_t>& finishes,
                            hls::stream<retrace::hls::token_word_t>& works,
                            hls::stream<retrace::hls::ring_word64_t>& totals, ap_uint<32> parent_links,
                            ap_uint<32> write_work) {
  using namespace retrace::hls;
  namespace contract = retrace::contract;
  // clang-format off
#pragma HLS interface mode=axis port=in
#pragma HLS interface mode=axis port=result_rays
#pragma HLS interface mode=axis port=ready
#pragma HLS interface mode=axis port=finishes
#pragma HLS interface mode=axis port=works
#pragma HLS interface mode=axis port=totals
  // clang-format on
  ring_word64_t rays[RETRACE_RING_CONTEXTS];
  token_word_t bests[RETRACE_RING_CONTEXTS];
  token_word_t counts[RETRACE_RING_CONTEXTS];
  RT_LAP(rays)
  RT_LAP(bests)
  RT_LAP(counts)
  ring_word64_t finished = 0, faults = 0, all_down = 0, all_up = 0, all_leaf = 0, all_tests = 0, all_skipped = 0,
                all_steps = 0;
RESULT:
  for (unsigned long long i = 0; i < kRingIterations; ++i) {
    RT_PIPELINE(1)  // one result a token
    const token_data_t bits = in.read();
    token t = unpack_token(token_word_t(bits));
    if (t.phase == kTokenEnd) {
      token_data_t end = 1;
      end <<= kRingEndBit + 256;
      finishes.write(end);
      token_word_t work_end = 1;
      work_end <<= kRingEndBit + 128;
      works.write(work_end);
      break;
    }
    ring_word64_t ray = rays[t.id.to_uint()];
    token_word_t best = bests[t.id.to_uint()];
    token_word_t work = counts[t.id.to_uint()];
    if (t.fresh) {
      ray = result_rays.read();
      rays[t.id.to_uint()] = ray;
      best = 0;
      work = 0;
    }
    const flag_t any = ray >> contract::kTLimitBits;
    const ap_uint<32> index = ray >> (contract::kTLimitBits + 1);
    ring_word64_t b0 = best;
    ring_word64_t b1 = best >> 64;
    ring_word64_t b2 = best >> 128;
    ring_word64_t b3 = best >> 192;
    t_limit_t best_t = b0;
    triangle_id_t best_id = b0 >> contract::kTLimitBits;
    flag_t found = b0 >> (contract::kTLimitBits + contract::kTriangleIdBits);
    if (!found) {
      best_t = ray;
      best_id = contract::kNoTriangle;
    }

    if (t.test && !t.skipped) {
      const tri_test_out_word_t candidate_bits = bits >> 256;
      const tri_test_out_record candidate = read_tri_test_out(candidate_bits);
      if (candidate.hit && is_nearer(candidate.t, candidate.id, best_t, best_id)) {
        found = 1;
        best_t = candidate.t;
        best_id = candidate.id;
        b0 = ring_word64_t(found);
        ring_push(b0, ring_word64_t(best_id), contract::kTriangleIdBits);
        ring_push(b0, ring_word64_t(best_t), contract::kTLimitBits);
        b1 = ring_word64_t(ap_uint<contract::kEdgeBits>(candidate.edge_u));
        b2 = ring_word64_t(ap_uint<contract::kEdgeBits>(candidate.edge_v));
        b3 = ring_word64_t(candidate.exponent_v);
        ring_push(b3, ring_word64_t(candidate.exponent_u), contract::kExponentBits);
        ring_push(b3, ring_word64_t(ap_uint<contract::kRowDirectionBits>(candidate.dz)), contract::kRowDirectionBits);
        if (any) t.phase = kTokenFinish;
      }
    }
    // All references of the leaf are done: finished, or on through the exit face.
    if (t.phase == kTokenTest && t.last) {
      if (!t.exits || best_t <= t.t_exit) {
        t.phase = kTokenFinish;
      } else {
        t.t = t.t_exit;
        if (parent_links != 0) {
          t.phase = kTokenUp;
          if (t.node == 0) t.phase = kTokenFinish;  // the root itself is the leaf
        } else {
          t.node = t.way;
          t.phase = kTokenDown;
          if (t.way == 0) t.phase = kTokenFinish;
        }
      }
    }

    ring_word64_t k0 = work;
    ring_word64_t k1 = work >> 64;
    ring_word64_t k2 = work >> 128;
    work_count_t down = k0;
    work_count_t up = k0 >> contract::kWorkCountBits;
    work_count_t leaf = k1;
    work_count_t tests = k1 >> contract::kWorkCountBits;
    work_count_t skipped = k2;
    const flag_t tested = t.test & ~t.skipped;
    down += t.down;
    up += t.up;
    leaf += t.arrive;
    tests += tested;
    skipped += t.skipped;

    if (t.phase == kTokenFinish) {
      hit_finish_in_record hit;
      hit.status = t.status;
      if (t.status == contract::kStatusMiss && found) hit.status = contract::kStatusHit;
      hit.t = best_t;
      hit.id = best_id;
      hit.edge_u = b1;
      hit.edge_v = b2;
      hit.dz = b3;
      hit.exponent_u = b3 >> contract::kRowDirectionBits;
      hit.exponent_v = b3 >> (contract::kRowDirectionBits + contract::kExponentBits);
      token_data_t finish = index;
      finish <<= 256;
      finish |= token_data_t(write_hit_finish_in(hit));
      finishes.write(finish);
      if (write_work != 0) {
        work_record record;
        record.down = down;
        record.up = up;
        record.leaf = leaf;
        record.tests = tests;
        record.skipped = skipped;
        word_t words[kWorkWords];
        pack_work(record, words);
        token_word_t out = index;
        out <<= 128;
        out |= token_word_t(words[0]);
        works.write(out);
      }
      finished += 1;
      if (hit.status > contract::kStatusHit) faults += 1;
      all_down += down;
      all_up += up;
      all_leaf += leaf;
      all_tests += tests;
      all_skipped += skipped;
      all_steps += t.steps;
      if (t.status == contract::kStatusStepLimit) all_steps += 1;  // the step that was not made
      t.phase = kTokenIdle;
    }
    bests[t.id.to_uint()] = ring_join(b0, b1, b2, b3);
    k0 = ring_word64_t(up);
    ring_push(k0, ring_word64_t(down), contract::kWorkCountBits);
    k1 = ring_word64_t(tests);
    ring_push(k1, ring_word64_t(leaf), contract::kWorkCountBits);
    k2 = ring_word64_t(skipped);
    counts[t.id.to_uint()] = ring_join(k0, k1, k2, ring_word64_t(0));
    ready.write(pack_token(t));
  }
  totals.write(finished);
  totals.write(faults);
  totals.write(all_down);
  totals.write(all_up);
  totals.write(all_leaf);
  totals.write(all_tests);
  totals.write(all_skipped);
  totals.write(all_steps);
}
