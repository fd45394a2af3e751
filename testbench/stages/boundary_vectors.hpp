// tri_test vectors that lie exactly on the boundaries of its decisions, and one code to either side: what random
// triangles meet with a probability of 2^-26 or less.
#pragma once
#include "golden/contract/contract_records.hpp"
#include "testbench/kit/random.hpp"

namespace retrace::cosim {

/// U, V, W at the ends of their tolerances, -o'z at 0 and at 2 d'z, d'z at 0. Rows and origin are such that o' and d'
/// can be chosen freely.
contract::TriTestInRecord tri_test_boundary_vector(Random& random);

/// Sums of row products that end in exactly one half, and next to it.
contract::TriTestInRecord tri_test_rounding_vector(Random& random);

}  // namespace retrace::cosim
