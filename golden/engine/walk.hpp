// The walk of one ray, stage by stage: what each engine shows to `retrace explain`, in terms that all of them share.
#pragma once
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "engine.hpp"
#include "golden/contract/contract_records.hpp"

namespace retrace {

/// The stages of the datapath, in the order in which a ray meets them; then that of two levels. The probes of the RTL use these numbers.
enum class Stage : std::uint8_t {
  kRaySetup,
  kKdDescend,
  kLeafExit,
  kTriTest,
  kKdBacktrack,
  kHitFinish,
  kInstanceEnter
};
inline constexpr std::size_t kStages = 7;
const char* to_string(Stage stage);

/// A value that a stage was given or gave. A choice is a whole number that decides where the walk goes on (a node, a face, a triangle, a
/// status); a measure is a length in grid units or a barycentric coordinate.
struct StageValue {
  const char* name;
  double value;
  bool choice;
};

/// One call of a stage. Fixed-point engines leave its records, packed as the contract says; golden has none.
struct StageCall {
  Stage stage = Stage::kRaySetup;
  std::vector<StageValue> values;
  std::vector<std::uint64_t> input, output;

  /// Level of the tree in which the ray stood: 1 in an object of a scene of two levels.
  int level = 0;

  /// The value of that name; nullptr if the stage has none.
  const StageValue* find(std::string_view name) const;
  /// Its number; 0 if the stage has none.
  double value(std::string_view name) const;
};

struct Walk {
  std::vector<StageCall> calls;
  Hit hit;
};

/// The call that these records describe, 64-bit words of the contract's layout. Bits beyond a record's fields are ignored.
StageCall read_stage_call(Stage stage, std::span<const std::uint64_t> input, std::span<const std::uint64_t> output);

/// Writes the levels of the calls of one walk: an entry leads into an object, and a leaf_exit at the leaf that held the instance, as before, out.
void find_levels(std::vector<StageCall>& calls);

/// The instance records of an image, as far as it has them; it need not have been checked.
std::vector<contract::InstanceRecord> instances_of(std::span<const std::uint64_t> image);

/// Says which instance a call of instance_enter is about: the first of those that stand at the same place, which its records do not tell apart.
void name_instance(StageCall& call, const contract::InstanceEnterInRecord& in,
                   std::span<const contract::InstanceRecord> instances);

/// Words of the records of a stage.
struct StageWords {
  std::size_t input, output;
};
StageWords words_of(Stage stage);

/// Two walks held against each other, call by call.
struct Parting {
  std::size_t step = 0;  ///< the first call at which they part; the number of calls if they do not
  bool parts = false;
  std::string why;  ///< the value or the stage that differs, with both values
};
/// Fixed-point walks must agree in every bit of every record, but for what hit_finish is given with a ray that hits nothing: only the status counts.
bool agree_in_bits(const StageCall& a, const StageCall& b);
Parting first_parting_in_bits(const Walk& a, const Walk& b);
/// Walks of engines of different arithmetic: the same stages with the same choices.
Parting first_parting_in_choices(const Walk& a, const Walk& b);

}  // namespace retrace
