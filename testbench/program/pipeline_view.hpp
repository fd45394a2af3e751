// A picture that explains a run of the RTL core: for each unit a bar with the share of the clocks it was busy, starved, blocked.
#pragma once
#include <span>
#include <string>

#include "golden/render/raster.hpp"

namespace retrace::cli {

/// Shares of the clocks, 0 .. 1, sum 1: did something useful; had nothing to work on; had work, but a miss or a full stage in the way.
struct UnitShares {
  std::string name;
  double busy = 0, starved = 0, blocked = 0;
};
/// One run: what it was, and its units from the front of the pipeline to its end.
struct PipelineRun {
  std::string title;
  std::vector<UnitShares> units;
};

/// sRGB-encoded, three channels; the runs one below the other.
Raster pipeline_view(std::span<const PipelineRun> runs);

}  // namespace retrace::cli
