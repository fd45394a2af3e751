// The generated C++ of both sides of the contract: host records and kernel records hold the same bits.
#include "hls/include/contract.hpp"

#include <gtest/gtest.h>

#include "golden/contract/contract_records.hpp"
#include "hls/include/contract_types.hpp"
#include "testbench/kit/stage_vectors.hpp"

namespace retrace {
namespace {

/// Host words -> kernel record -> kernel words must be the host's words again.
template <typename Host, int kWords, typename Unpack, typename Pack>
void expect_same_bits(Unpack unpack, Pack pack) {
  const std::uint64_t seed = test_seed();
  Random random(seed);
  for (int i = 0; i < 2000; ++i) {
    const Host host = directed_record<Host>(random);
    ASSERT_TRUE(host.fits());
    std::uint64_t raw[Host::kWords + 2 * kWords]{};
    host.pack(raw);
    ASSERT_EQ(Host::unpack(raw), host) << "seed " << seed << " record " << i;
    hls::word_t words[kWords], again[kWords];
    for (int w = 0; w < kWords; ++w) {
      words[w] = raw[2 * w + 1];
      words[w] <<= 64;
      words[w] |= hls::word_t(ap_uint<64>(raw[2 * w]));
    }
    pack(unpack(words), again);
    for (int w = 0; w < kWords; ++w)
      ASSERT_TRUE(words[w] == again[w]) << "seed " << seed << " record " << i << " word " << w;
  }
}

#define SAME_BITS(Host, record)                                                                              \
  TEST(Contract, record##_has_the_same_bits_in_both_rooms) {                                                 \
    expect_same_bits<contract::Host##Record, hls::k##Host##Words>(hls::unpack_##record, hls::pack_##record); \
  }
SAME_BITS(NodePair, node_pair)
SAME_BITS(Leaf, leaf)
SAME_BITS(Triangle, triangle)
SAME_BITS(Ray, ray)
SAME_BITS(Hit, hit)
SAME_BITS(Work, work)
SAME_BITS(Header, header)
SAME_BITS(RaySetupIn, ray_setup_in)
SAME_BITS(RaySetupOut, ray_setup_out)
SAME_BITS(KdDescendIn, kd_descend_in)
SAME_BITS(KdDescendOut, kd_descend_out)
SAME_BITS(LeafExitIn, leaf_exit_in)
SAME_BITS(LeafExitOut, leaf_exit_out)
SAME_BITS(KdBacktrackIn, kd_backtrack_in)
SAME_BITS(KdBacktrackOut, kd_backtrack_out)
SAME_BITS(TriTestIn, tri_test_in)
SAME_BITS(TriTestOut, tri_test_out)
SAME_BITS(HitFinishIn, hit_finish_in)
SAME_BITS(Instance, instance)
SAME_BITS(InstanceEnterIn, instance_enter_in)
SAME_BITS(InstanceEnterOut, instance_enter_out)
#undef SAME_BITS

TEST(Contract, fits_says_what_a_field_cannot_hold) {
  contract::NodePairRecord pair;
  EXPECT_TRUE(pair.fits());
  pair.left_split = 1 << (contract::kPositionBits - 1);
  EXPECT_FALSE(pair.fits());
  pair.left_split = -(1 << (contract::kPositionBits - 1));
  EXPECT_TRUE(pair.fits());
  pair.parent = 1u << contract::kNodeIndexBits;
  EXPECT_FALSE(pair.fits());
}

TEST(Contract, widths_of_kernel_types_are_those_of_the_description) {
  static_assert(hls::position_t::width == contract::kPositionBits);
  static_assert(hls::t_t::width == contract::kTBits);
  static_assert(hls::edge_t::width == contract::kEdgeBits);
  static_assert(hls::barycentric_t::width == contract::kBarycentricBits);
}

}  // namespace
}  // namespace retrace
