// What the tests of the stages share: vectors run through the kernel's stage function, with host records on both sides.
#pragma once
#include <gtest/gtest.h>

#include "golden/contract/contract_records.hpp"
#include "hls/include/contract_types.hpp"
#include "testbench/kit/stage_vectors.hpp"

namespace retrace {

/// Runs a stage on a host record: pack, unpack as the kernel does, call, and back.
template <typename HostOut, int kInWords, int kOutWords, typename HostIn, typename Unpack, typename Stage,
          typename Pack>
HostOut run_stage(const HostIn& in, Unpack unpack, Stage stage, Pack pack) {
  std::uint64_t raw[HostIn::kWords + 2 * kInWords]{};
  in.pack(raw);
  hls::word_t words[kInWords], out[kOutWords];
  for (int w = 0; w < kInWords; ++w) {
    words[w] = raw[2 * w + 1];
    words[w] <<= 64;
    words[w] |= hls::word_t(ap_uint<64>(raw[2 * w]));
  }
  pack(stage(unpack(words)), out);
  std::uint64_t result[HostOut::kWords + 2 * kOutWords]{};
  for (int w = 0; w < kOutWords; ++w) {
    result[2 * w] = ap_uint<64>(out[w]).to_uint64();
    const hls::word_t high = out[w] >> 64;
    result[2 * w + 1] = ap_uint<64>(high).to_uint64();
  }
  return HostOut::unpack(result);
}

#define RETRACE_RUN_STAGE(In, in_name, Out, out_name, stage, value)                                                 \
  run_stage<contract::Out##Record, hls::k##In##Words, hls::k##Out##Words>(value, hls::unpack_##in_name, hls::stage, \
                                                                          hls::pack_##out_name)

}  // namespace retrace
