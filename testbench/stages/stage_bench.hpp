// A verilated stage against its HLS function: the same vectors into both, every output bit compared, under three
// patterns of stalls.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

namespace retrace::cosim {

/// The stages in the order of a ray's way through them.
const std::vector<std::string>& stage_names();

struct SceneVectors;

enum class StallMode {
  kNone,          ///< both sides always active: the stage must take an input every interval
  kRandom,        ///< both sides held off at random
  kBackPressure,  ///< input always waiting, output blocked in long stretches: the stage fills up and drains again
};
const std::vector<std::string>& stall_mode_names();

struct StageRun {
  std::string stage;
  StallMode mode = StallMode::kNone;
  std::uint64_t seed = 0;
  std::uint64_t vectors = 0;
  const SceneVectors* scene = nullptr;  ///< if given, its vectors are used first, once each
};

struct StageResult {
  std::uint64_t vectors = 0;  ///< compared
  std::uint64_t clocks = 0;
  std::uint64_t latency = 0;  ///< of the first vector, acceptance to valid output
  std::uint64_t bubbles =
      0;  ///< clocks in which the output was ready and empty although the stage should have had something
  double interval = 0.0;  ///< clocks between acceptances; meaningful without stalls
  bool refused = false;   ///< the stage did hold off its input at some point
  std::string failure;    ///< empty, or what went wrong, with the vector
};

/// Vectors that a scene holds for a stage.
std::uint64_t vectors_of(const SceneVectors& scene, const std::string& stage);

/// Runs one model in the calling thread. The same StageRun gives the same vectors and stalls. Throws
/// std::invalid_argument for an unknown stage.
StageResult run_stage(const StageRun& run);

/// The command that repeats a run.
std::string command_of(const StageRun& run);

}  // namespace retrace::cosim
