// Input vectors of the stages, random and directed at the rounding and saturation boundaries of the contract; the same
// for C simulation and for the RTL.
#pragma once
#include "golden/contract/contract_records.hpp"
#include "random.hpp"

namespace retrace {

/// A value of `bits` bits: uniform, or small, or next to a power of two, or at an end of the range.
std::int64_t directed_value(Random& random, int bits, bool is_signed);

/// A record of directed values; every bit pattern can occur.
template <typename Record>
Record directed_record(Random& random) {
  Record record;
  record.visit([&](const char*, auto& value, int bits) {
    using Value = std::remove_reference_t<decltype(value)>;
    value = static_cast<Value>(directed_value(random, bits, std::is_signed_v<Value>));
  });
  return record;
}

// Vectors as a walk meets them, mixed with directed records. Each stays inside the stage's stated input range.
contract::RaySetupInRecord ray_setup_vector(Random& random);
contract::KdDescendInRecord kd_descend_vector(Random& random);
contract::LeafExitInRecord leaf_exit_vector(Random& random);
contract::KdBacktrackInRecord kd_backtrack_vector(Random& random);
contract::TriTestInRecord tri_test_vector(Random& random);
contract::HitFinishInRecord hit_finish_vector(Random& random);
contract::InstanceEnterInRecord instance_enter_vector(Random& random);

}  // namespace retrace
