// Stacked bars, see pipeline_view.hpp.
#include "testbench/program/pipeline_view.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

namespace retrace::cli {
namespace {

constexpr int kScale = 2, kMargin = 16, kNameWidth = 150, kBarWidth = 600, kBarHeight = 26, kGap = 8;
const glm::vec3 kPaper(1.0f), kInk(0.1f), kLight(0.98f);

struct Part {
  const char* name;
  double UnitShares::*share;
  glm::vec3 color, text;
};
const std::array<Part, 3> kParts = {{{"busy", &UnitShares::busy, {0.12f, 0.47f, 0.35f}, kLight},
                                     {"starved", &UnitShares::starved, {0.83f, 0.84f, 0.86f}, kInk},
                                     {"blocked", &UnitShares::blocked, {0.78f, 0.33f, 0.16f}, kLight}}};

void draw_bar(Raster& raster, int x, int y, const UnitShares& unit) {
  double before = 0;
  for (const Part& part : kParts) {
    const double share = unit.*part.share;
    // Ends are rounded, not widths: the bar has no gaps and ends where it should.
    const int from = x + static_cast<int>(std::lround(before * kBarWidth));
    before += share;
    const int to = x + static_cast<int>(std::lround(before * kBarWidth));
    fill(raster, from, y, to - from, kBarHeight, part.color);
    char text[16];
    std::snprintf(text, sizeof text, "%.0f", 100 * share);
    const int width = text_width(text, kScale);
    if (to - from > width + kGap)
      draw_text(raster, from + (to - from - width) / 2, y + (kBarHeight - text_height(kScale)) / 2, text, part.text,
                kScale);
  }
}

}  // namespace

Raster pipeline_view(std::span<const PipelineRun> runs) {
  const int line = text_height(kScale) + 2 * kGap, bar = kBarHeight + kGap;
  int height = 2 * kMargin + line, width = 2 * kMargin + kNameWidth + kBarWidth;
  for (const PipelineRun& run : runs) {
    height += line + bar * static_cast<int>(run.units.size()) + kGap;
    width = std::max(width, 2 * kMargin + text_width(run.title, kScale));
  }
  Raster raster(width, height, 3, 1.0f);
  fill(raster, 0, 0, width, height, kPaper);
  int x = kMargin;
  for (const Part& part : kParts) {
    fill(raster, x, kMargin, kBarHeight, text_height(kScale), part.color);
    x += kBarHeight + kGap;
    draw_text(raster, x, kMargin, part.name, kInk, kScale);
    x += text_width(part.name, kScale) + 3 * kGap;
  }
  draw_text(raster, x, kMargin, "% of the clocks", kInk, kScale);
  int y = kMargin + line;
  for (const PipelineRun& run : runs) {
    draw_text(raster, kMargin, y, run.title, kInk, kScale);
    y += line;
    for (const UnitShares& unit : run.units) {
      draw_text(raster, kMargin, y + (kBarHeight - text_height(kScale)) / 2, unit.name, kInk, kScale);
      draw_bar(raster, kMargin + kNameWidth, y, unit);
      y += bar;
    }
    y += kGap;
  }
  return raster;
}

}  // namespace retrace::cli
