// See walk_picture.hpp. Colours run from blue at the origin of the ray to red at the end of the walk.
#include "testbench/program/walk_picture.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <map>
#include <utility>

#include "golden/base/text.hpp"

namespace retrace::cli {
namespace {

constexpr int kWidth = 1000, kHeight = 900, kMargin = 60, kTop = 80, kChart = 240, kGap = 90;

template <typename... Values>
std::string format(const char* pattern, Values... values) {
  char text[512];
  std::snprintf(text, sizeof text, pattern, values...);
  return text;
}

/// One leaf that the walk passes, and where it stood in the order.
struct Cell {
  double t, t_exit;
  std::uint32_t depth;
  std::array<double, 6> bound;
};
struct Test {
  std::uint32_t triangle;
  bool hit;
  double t;
  std::size_t cell;
};
struct Point {
  double t;
  std::uint32_t depth;
  bool climbing;
};

/// The walk in terms of the drawing.
class Course {
 public:
  Course(const Walk& walk, const MemoryImage& image) {
    double t = 0;
    path.push_back({0.0, 0, false});
    bool back = false;
    for (const StageCall& call : walk.calls) {
      // Of two levels the top one is drawn, each leaf once.
      if (call.level > 0) {
        back = true;
        continue;
      }
      if (std::exchange(back, false) && call.stage == Stage::kLeafExit) continue;
      switch (call.stage) {
        case Stage::kRaySetup:
          for (std::size_t i = 0; i < 3; ++i) {
            origin[i] = call.values[i].value;
            direction[i] = call.values[i + 3].value;
          }
          break;
        case Stage::kKdDescend: {
          const std::uint32_t depth = depth_of(static_cast<std::uint32_t>(call.value("node")), image);
          if (path.back().depth + 1 != depth) path.push_back({t, depth - 1, true});  // a face link goes straight there
          path.push_back({t, depth, false});
          break;
        }
        case Stage::kLeafExit: {
          constexpr std::array<const char*, 6> kBound = {"low_x", "high_x", "low_y", "high_y", "low_z", "high_z"};
          Cell cell{call.value("t"), call.value("t_exit"), 0, {}};
          for (std::size_t face = 0; face < 6; ++face) cell.bound[face] = call.value(kBound[face]);
          cell.depth = leaf_depth(cell.bound, image);
          if (path.back().depth != cell.depth) path.push_back({t, cell.depth, true});
          cells.push_back(cell);
          t = cell.t_exit;
          path.push_back({t, cell.depth, false});
          break;
        }
        case Stage::kTriTest:
          tests.push_back({static_cast<std::uint32_t>(call.value("triangle")), call.value("hit") != 0, call.value("t"),
                           cells.size()});
          break;
        case Stage::kKdBacktrack:
          path.push_back({t, depth_of(static_cast<std::uint32_t>(call.value("parent")), image), true});
          break;
        case Stage::kInstanceEnter:
          entries += call.value("enters") != 0;
          break;
        case Stage::kHitFinish:
          break;
      }
    }
    for (const Cell& cell : cells) end = std::max(end, cell.t_exit);
    if (walk.hit.hit()) end = std::max(end, walk.hit.t);
    if (!(end > 0 && std::isfinite(end))) end = 1.0;
    for (const Point& point : path) deepest = std::max(deepest, point.depth);
  }

  static std::uint32_t depth_of(std::uint32_t node, const MemoryImage& image) {
    std::uint32_t depth = 0;
    for (; node != 0 && depth < 256; ++depth) node = image.pair(node / 2).parent;
    return depth;
  }

  /// Of the leaf with these bounds; 0 if there is none.
  static std::uint32_t leaf_depth(const std::array<double, 6>& bound, const MemoryImage& image) {
    std::array<std::int32_t, 6> codes;
    for (std::size_t face = 0; face < 6; ++face)
      codes[face] = static_cast<std::int32_t>(std::lround(bound[face] * (1 << contract::kPositionFrac)));
    for (std::uint32_t i = 0; i < image.header().leaf_count; ++i) {
      if (const auto leaf = image.leaf(i); leaf.bound == codes)
        return image.header().leaf_count == 1 ? 0 : depth_of(leaf.parent, image) + 1;
    }
    return 0;
  }

  std::array<double, 3> origin{}, direction{};
  std::vector<Point> path;
  std::vector<Cell> cells;
  std::vector<Test> tests;
  std::size_t entries = 0;
  double end = 0;
  std::uint32_t deepest = 1;
};

std::string color_of(std::size_t i, std::size_t count) {
  return format("hsl(%.0f,75%%,45%%)",
                220.0 - 220.0 * static_cast<double>(i) / static_cast<double>(std::max<std::size_t>(count, 2) - 1));
}

std::string text(double x, double y, const std::string& words, const char* more = "") {
  return format("<text x=\"%.1f\" y=\"%.1f\" %s>", x, y, more) + escape_xml(words) + "</text>\n";
}

/// Depth in the tree (downwards) over t (to the right).
std::string draw_chart(const Course& course, const Walk& walk) {
  const double width = kWidth - 2 * kMargin;
  const auto x = [&](double t) { return kMargin + width * std::clamp(t / course.end, 0.0, 1.0); };
  const auto y = [&](std::uint32_t depth) { return kTop + (kChart - 20.0) * depth / std::max(course.deepest, 1u); };
  std::string out = text(kMargin, kTop - 14,
                         "Depth in the tree along the ray: steps down (blue), up (orange), leaves (bars), tests (dots, "
                         "full where the triangle is hit)");
  const std::uint32_t every = course.deepest > 24 ? 4 : course.deepest > 10 ? 2 : 1;
  for (std::uint32_t depth = 0; depth <= course.deepest; depth += every) {
    out += format("<path d=\"M%d %.1fH%d\" stroke=\"#ddd\"/>\n", kMargin, y(depth), kWidth - kMargin);
    out += text(kMargin - 8, y(depth) + 4, std::to_string(depth), "text-anchor=\"end\"");
  }
  for (std::size_t i = 1; i < course.path.size(); ++i) {
    const Point &from = course.path[i - 1], &to = course.path[i];
    out += format("<path d=\"M%.1f %.1fL%.1f %.1f\" stroke=\"%s\" stroke-width=\"1.5\" fill=\"none\"/>\n", x(from.t),
                  y(from.depth), x(to.t), y(to.depth), to.climbing ? "#e69f00" : "#0072b2");
  }
  for (std::size_t i = 0; i < course.cells.size(); ++i) {
    const Cell& cell = course.cells[i];
    out +=
        format("<rect x=\"%.1f\" y=\"%.1f\" width=\"%.1f\" height=\"8\" fill=\"%s\"/>\n", x(cell.t), y(cell.depth) - 4,
               std::max(x(cell.t_exit) - x(cell.t), 1.5), color_of(i, course.cells.size()).c_str());
  }
  for (std::size_t i = 0; i < course.tests.size(); ++i) {
    const Test& test = course.tests[i];
    if (test.cell == 0) continue;
    const Cell& cell = course.cells[test.cell - 1];
    std::size_t first = i, last = i;
    while (first > 0 && course.tests[first - 1].cell == test.cell) --first;
    while (last + 1 < course.tests.size() && course.tests[last + 1].cell == test.cell) ++last;
    const double place = static_cast<double>(i - first + 1) / static_cast<double>(last - first + 2);
    const double at = test.hit ? test.t : cell.t + place * (cell.t_exit - cell.t);
    out += format("<circle cx=\"%.1f\" cy=\"%.1f\" r=\"3.5\" fill=\"%s\" stroke=\"#222\"/>\n", x(at),
                  y(cell.depth) + 11, test.hit ? "#222" : "none");
  }
  if (walk.hit.hit()) {
    out += format("<path d=\"M%.1f %dV%d\" stroke=\"#d55e00\" stroke-dasharray=\"4 3\"/>\n", x(walk.hit.t), kTop,
                  kTop + kChart);
    const bool right = 2 * x(walk.hit.t) > kWidth;
    out += text(x(walk.hit.t), kTop + kChart + 30, format("hit: triangle %u, t %.6f", walk.hit.id, walk.hit.t),
                right ? "text-anchor=\"end\" fill=\"#d55e00\"" : "fill=\"#d55e00\"");
  }
  out += text(kMargin, kTop + kChart + 14, "t = 0");
  out += text(kWidth - kMargin, kTop + kChart + 14, format("t = %.6f", course.end), "text-anchor=\"end\"");
  return out;
}

/// Cells, triangles and the ray on two axes.
std::string draw_space(const Course& course, const Walk& walk, const GridScene& scene) {
  std::array<std::size_t, 3> order{0, 1, 2};
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return std::abs(course.direction[a]) > std::abs(course.direction[b]);
  });
  const std::size_t across = std::min(order[0], order[1]), upward = std::max(order[0], order[1]);
  constexpr double kUnit = 1.0 / (1 << contract::kPositionFrac);
  // What is shown: the ray from its origin to the end of the walk, with the cells, and some room.
  double low[2] = {1e9, 1e9}, high[2] = {-1e9, -1e9};
  const auto include = [&](double a, double b) {
    low[0] = std::min(low[0], a), high[0] = std::max(high[0], a);
    low[1] = std::min(low[1], b), high[1] = std::max(high[1], b);
  };
  const auto at = [&](double t, std::size_t axis) { return course.origin[axis] + t * course.direction[axis]; };
  for (const double t : {0.0, course.end}) include(at(t, across), at(t, upward));
  for (const Cell& cell : course.cells)
    for (std::size_t side = 0; side < 2; ++side) include(cell.bound[2 * across + side], cell.bound[2 * upward + side]);
  const double left = kMargin, top = kTop + kChart + kGap, width = kWidth - 2 * kMargin, height = kHeight - top - 30;
  const double scale = std::min(width / std::max(high[0] - low[0], 1e-9), height / std::max(high[1] - low[1], 1e-9));
  const double offset = left + (width - scale * (high[0] - low[0])) / 2;
  const auto x = [&](double a) { return offset + scale * (a - low[0]); };
  const auto y = [&](double b) { return top + scale * (high[1] - b); };
  constexpr std::array<char, 3> kAxis = {'x', 'y', 'z'};
  std::string out = text(
      kMargin, top - 14,
      format(
          "The cells of the leaves on the axes %c (to the right) and %c (upwards), the triangles tested, and the ray",
          kAxis[across], kAxis[upward]));
  out += format(
      "<clipPath id=\"space\"><rect x=\"%.1f\" y=\"%.1f\" width=\"%.1f\" height=\"%.1f\"/></clipPath><g "
      "clip-path=\"url(#space)\">\n",
      left - 2, top - 2, width + 4, height + 4);
  for (std::size_t i = 0; i < course.cells.size(); ++i) {
    const auto& b = course.cells[i].bound;
    const std::string color = color_of(i, course.cells.size());
    out += format(
        "<rect x=\"%.2f\" y=\"%.2f\" width=\"%.2f\" height=\"%.2f\" fill=\"%s\" fill-opacity=\"0.10\" "
        "stroke=\"%s\"/>\n",
        x(b[2 * across]), y(b[2 * upward + 1]), scale * (b[2 * across + 1] - b[2 * across]),
        scale * (b[2 * upward + 1] - b[2 * upward]), color.c_str(), color.c_str());
  }
  std::map<std::uint32_t, bool> tested;
  for (const Test& test : course.tests) tested[test.triangle] = test.hit;
  for (const auto& [id, hit] : tested) {
    const GridTriangle* found = find_triangle(scene.triangles, id);
    if (found == nullptr) continue;
    std::string points;
    for (const GridPoint& p : found->vertices)
      points += format("%.2f,%.2f ", x(p[static_cast<int>(across)] * kUnit), y(p[static_cast<int>(upward)] * kUnit));
    out += "<polygon points=\"" + points + "\" fill=\"" + (hit ? "#d55e00" : "#888") + "\" fill-opacity=\"" +
           (hit ? "0.35" : "0.08") + "\" stroke=\"" + (hit ? "#d55e00" : "#888") + "\"/>\n";
  }
  const double stop = walk.hit.hit() ? walk.hit.t : course.end;
  out += format("<path d=\"M%.2f %.2fL%.2f %.2f\" stroke=\"#222\" stroke-width=\"2\"/>\n", x(at(0, across)),
                y(at(0, upward)), x(at(stop, across)), y(at(stop, upward)));
  out += format("<circle cx=\"%.2f\" cy=\"%.2f\" r=\"4\" fill=\"#222\"/>\n", x(at(0, across)), y(at(0, upward)));
  if (walk.hit.hit())
    out += format("<circle cx=\"%.2f\" cy=\"%.2f\" r=\"5\" fill=\"#d55e00\" stroke=\"#222\"/>\n", x(at(stop, across)),
                  y(at(stop, upward)));
  return out + "</g>\n";
}

}  // namespace

std::string draw_walk(const DrawnWalk& drawn, const std::string& title, const GridScene& scene,
                      const MemoryImage& image) {
  const Course course(*drawn.walk, image);
  std::string out = format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 %d %d\" width=\"%d\" height=\"%d\" "
      "font-family=\"sans-serif\" "
      "font-size=\"12\" fill=\"#222\">\n<rect width=\"100%%\" height=\"100%%\" fill=\"#fff\"/>\n",
      kWidth, kHeight, kWidth, kHeight);
  out += text(kMargin, 30, title, "font-size=\"16\" font-weight=\"bold\"");
  std::size_t down = 0, up = 0;
  for (const StageCall& call : drawn.walk->calls) {
    down += call.level == 0 && call.stage == Stage::kKdDescend;
    up += call.level == 0 && call.stage == Stage::kKdBacktrack;
  }
  out += text(kMargin, 48,
              format("%s: %zu steps down, %zu up, %zu leaves, %zu tests", drawn.engine.c_str(), down, up,
                     course.cells.size(), course.tests.size()) +
                  (course.entries > 0 ? format("; %zu instances entered", course.entries) : std::string()));
  out += draw_chart(course, *drawn.walk);
  out += draw_space(course, *drawn.walk, scene);
  return out + "</svg>\n";
}

}  // namespace retrace::cli
