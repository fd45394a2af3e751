// The page of `retrace lab --html`: page.html (compiled in) with the report, the plots and the heat maps put into it.
// Maps are PNGs, written into memory, as data URIs.
#include <algorithm>
#include <cmath>

#include "golden/base/base64.hpp"
#include "golden/picture/picture_codec.hpp"
#include "golden/render/colormap.hpp"
#include "golden/scene/scene.hpp"
#include "lab.hpp"
#include "page.hpp"

namespace retrace::lab {
namespace {

using nlohmann::ordered_json;

std::string png_uri(const std::vector<float>& values, int width, int height, float top) {
  std::vector<unsigned char> pixels;
  pixels.reserve(values.size() * 3);
  for (const float v : values) {
    const glm::vec3 color = map_color(ColorMap::kInferno, v / top);
    for (int c = 0; c < 3; ++c)
      pixels.push_back(static_cast<unsigned char>(std::lround(std::clamp(color[c], 0.0f, 1.0f) * 255.0f)));
  }
  const std::vector<std::uint8_t> file = picture_codec().encode_png(width, height, 3, pixels.data(), {});
  return "data:image/png;base64," + encode_base64(file);
}

/// A round number above nearly all values of most maps, so that a few extreme pixels and structures do not flatten the
/// rest.
float common_top(const std::vector<const std::vector<float>*>& maps) {
  std::vector<float> tops;
  for (const auto* map : maps) {
    std::vector<float> sorted = *map;
    const auto at = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() * 99 / 100);
    std::nth_element(sorted.begin(), at, sorted.end());
    tops.push_back(*at);
  }
  if (tops.empty()) return 1.0f;
  std::sort(tops.begin(), tops.end());
  const float raw = std::max(1.0f, tops[tops.size() / 2]);
  const float power = std::pow(10.0f, std::floor(std::log10(raw)));
  return std::ceil(raw / power * 2.0f) / 2.0f * power;
}

double mean(const std::vector<float>& values) {
  double sum = 0;
  for (const float v : values) sum += v;
  return values.empty() ? 0.0 : sum / static_cast<double>(values.size());
}

}  // namespace

std::string to_html(const LabReport& report) {
  ordered_json maps = ordered_json::array(), plots = ordered_json::array(), colors = ordered_json::array();
  for (int i = 0; i <= 16; ++i) {
    const glm::vec3 c = map_color(ColorMap::kInferno, static_cast<float>(i) / 16.0f) * 255.0f;
    colors.push_back("rgb(" + std::to_string(std::lround(c.x)) + "," + std::to_string(std::lround(c.y)) + "," +
                     std::to_string(std::lround(c.z)) + ")");
  }
  for (const SceneReport& scene : report.scenes) {
    std::vector<const std::vector<float>*> visits, tests;
    for (const Row& row : scene.rows)
      if (!row.heat_visits.empty()) visits.push_back(&row.heat_visits), tests.push_back(&row.heat_tests);
    const float top_visits = common_top(visits), top_tests = common_top(tests);
    ordered_json list = ordered_json::array();
    for (const Row& row : scene.rows) {
      if (row.heat_visits.empty()) continue;
      const int w = report.options.width, h = report.options.height;
      list.push_back({{"name", row.structure + ", " + row.traversal},
                      {"visits", png_uri(row.heat_visits, w, h, top_visits)},
                      {"tests", png_uri(row.heat_tests, w, h, top_tests)},
                      {"top_visits", top_visits},
                      {"top_tests", top_tests},
                      {"mean_visits", mean(row.heat_visits)},
                      {"mean_tests", mean(row.heat_tests)}});
    }
    maps.push_back(list);
    ordered_json drawn = ordered_json::array();
    const auto svgs = to_plots(scene, report.options);
    for (const char* name : {"work-primary", "ways-up", "mailboxes", "caches", "work-shadow", "work-bounce"})
      if (const auto it = svgs.find(name); it != svgs.end() && !scene.rows.empty()) drawn.push_back(it->second);
    plots.push_back(drawn);
  }
  const ordered_json data = {{"report", to_json(report)}, {"maps", maps}, {"plots", plots}, {"colors", colors}};
  // Inside <script>, "</" would end it whatever the JSON says; "<\/" means the same to JSON.
  std::string text = data.dump(-1, ' ', false, ordered_json::error_handler_t::replace), safe;
  for (std::size_t i = 0; i < text.size(); ++i) {
    safe += text[i];
    if (text[i] == '<' && i + 1 < text.size() && text[i + 1] == '/') safe += '\\';
  }
  std::string page = kPage;
  const std::string mark = "@DATA@";
  page.replace(page.find(mark), mark.size(), safe);
  return page;
}

}  // namespace retrace::lab
