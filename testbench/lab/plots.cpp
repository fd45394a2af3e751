// Plots as SVG documents, written by hand: bars and lines with axes, legible on light and dark pages. Colours: the
// eight of M. Okabe and K. Ito's palette for all kinds of colour vision.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>

#include "golden/accel/probe.hpp"
#include "golden/base/text.hpp"
#include "lab.hpp"

namespace retrace::lab {
namespace {

using accel::Mailbox;

constexpr const char* kColors[] = {"#0072b2", "#e69f00", "#009e73", "#d55e00",
                                   "#cc79a7", "#56b4e9", "#f0e442", "#7f7f7f"};

double per_ray(std::uint64_t total, const KindResult& kind) {
  return kind.rays ? static_cast<double>(total) / static_cast<double>(kind.rays) : 0.0;
}

std::string format(const char* pattern, double a) {
  char text[64];
  std::snprintf(text, sizeof text, pattern, a);
  return text;
}

/// 1, 2 or 5 times a power of ten, so that about `ticks` of them reach `top`.
double nice_step(double top, int ticks) {
  if (!(top > 0.0)) return 1.0;
  const double raw = top / ticks, power = std::pow(10.0, std::floor(std::log10(raw))), m = raw / power;
  return power * (m <= 1.0 ? 1.0 : m <= 2.0 ? 2.0 : m <= 5.0 ? 5.0 : 10.0);
}

class Svg {
 public:
  Svg(int width, int height, const std::string& title) : height_(height) {
    out_ = "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 " + std::to_string(width) + " " +
           std::to_string(height) + "\" width=\"" + std::to_string(width) + "\" height=\"" + std::to_string(height) +
           "\" font-family=\"sans-serif\" font-size=\"11\" role=\"img\"><title>" + escape_xml(title) +
           "</title>\n<rect width=\"100%\" height=\"100%\" fill=\"#ffffff\"/>\n";
    text(width / 2.0, 18, title, "middle", "font-size=\"13\" font-weight=\"bold\"");
  }
  void text(double x, double y, const std::string& t, const char* anchor = "start", const std::string& more = "") {
    out_ += "<text x=\"" + format("%.1f", x) + "\" y=\"" + format("%.1f", y) + "\" text-anchor=\"" + anchor +
            "\" fill=\"#222222\" " + more + ">" + escape_xml(t) + "</text>\n";
  }
  void rect(double x, double y, double w, double h, const char* color, const std::string& hint) {
    out_ += "<rect x=\"" + format("%.1f", x) + "\" y=\"" + format("%.1f", y) + "\" width=\"" + format("%.2f", w) +
            "\" height=\"" + format("%.1f", h) + "\" fill=\"" + color + "\"><title>" + escape_xml(hint) +
            "</title></rect>\n";
  }
  void line(double x0, double y0, double x1, double y1, const std::string& style) {
    out_ += "<line x1=\"" + format("%.1f", x0) + "\" y1=\"" + format("%.1f", y0) + "\" x2=\"" + format("%.1f", x1) +
            "\" y2=\"" + format("%.1f", y1) + "\" " + style + "/>\n";
  }
  void circle(double x, double y, const char* color, const std::string& hint) {
    out_ += "<circle cx=\"" + format("%.1f", x) + "\" cy=\"" + format("%.1f", y) + "\" r=\"3\" fill=\"" + color +
            "\"><title>" + escape_xml(hint) + "</title></circle>\n";
  }
  std::string finish() { return out_ + "</svg>\n"; }

 private:
  int height_;
  std::string out_;
};

struct Bar {
  std::string name;
  std::vector<double> parts;
};

/// Horizontal stacked bars. Bars more than `cut` times the median are cut off and carry their value.
std::string bars(const std::string& title, const std::vector<std::string>& parts, const std::vector<Bar>& rows,
                 const std::string& axis) {
  const int left = 330, right = 70, top = 50, step = 17;
  const int width = 900, height = top + step * static_cast<int>(rows.size()) + 40;
  Svg svg(width, height, title);
  std::vector<double> sums;
  for (const Bar& bar : rows) {
    double s = 0;
    for (const double p : bar.parts) s += p;
    sums.push_back(s);
  }
  std::vector<double> sorted = sums;
  std::sort(sorted.begin(), sorted.end());
  const double largest = sorted.empty() ? 1.0 : sorted.back(),
               middle = sorted.empty() ? 1.0 : sorted[sorted.size() / 2];
  const double limit = largest > 6 * middle && middle > 0 ? 4 * middle : std::max(largest, 1e-9);
  const double scale = (width - left - right) / limit, tick = nice_step(limit, 6);
  double x = left;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    svg.rect(x, 28, 10, 10, kColors[i], parts[i]);
    svg.text(x + 14, 37, parts[i]);
    x += 24 + 6.5 * static_cast<double>(parts[i].size());
  }
  const double bottom = top + step * static_cast<double>(rows.size());
  for (double v = 0; v <= limit * 1.0001; v += tick) {
    svg.line(left + v * scale, top, left + v * scale, bottom, "stroke=\"#dddddd\"");
    svg.text(left + v * scale, bottom + 14, format("%g", v), "middle");
  }
  svg.text(left + (width - left - right) / 2.0, bottom + 30, axis, "middle");
  for (std::size_t r = 0; r < rows.size(); ++r) {
    const double y = top + step * static_cast<double>(r);
    svg.text(left - 6, y + 12, rows[r].name, "end");
    double at = 0;
    for (std::size_t i = 0; i < rows[r].parts.size(); ++i) {
      const double end = std::min(at + rows[r].parts[i], limit);
      if (end > at) {
        svg.rect(left + at * scale, y + 2, (end - at) * scale, step - 4, kColors[i],
                 rows[r].name + ": " + parts[i] + " " + format("%.2f", rows[r].parts[i]));
      }
      at = std::max(at, end);
    }
    svg.text(left + at * scale + 4, y + 12, (sums[r] > limit * 1.0001 ? "… " : "") + format("%.1f", sums[r]));
  }
  return svg.finish();
}

struct Series {
  std::string name;
  std::vector<double> y;
  bool level = false;  ///< one value for all x, drawn dashed
};

/// Lines over named positions.
std::string lines(const std::string& title, const std::vector<std::string>& x_names, const std::vector<Series>& series,
                  const std::string& x_axis, const std::string& y_axis) {
  const int left = 60, right = 300, top = 34, bottom = 46, width = 820, height = 330;
  Svg svg(width, height, title);
  double largest = 0;
  for (const Series& s : series)
    for (const double y : s.y) largest = std::max(largest, y);
  const double tick = nice_step(largest, 6), limit = tick * std::max(1.0, std::ceil(largest / tick));
  const double plot_width = width - left - right, plot_height = height - top - bottom;
  const auto py = [&](double v) { return top + plot_height * (1.0 - v / limit); };
  const auto px = [&](std::size_t i) {
    return left +
           plot_width * (x_names.size() > 1 ? static_cast<double>(i) / static_cast<double>(x_names.size() - 1) : 0.5);
  };
  for (double v = 0; v <= limit * 1.0001; v += tick) {
    svg.line(left, py(v), left + plot_width, py(v), "stroke=\"#dddddd\"");
    svg.text(left - 6, py(v) + 4, format("%g", v), "end");
  }
  for (std::size_t i = 0; i < x_names.size(); ++i) svg.text(px(i), top + plot_height + 16, x_names[i], "middle");
  svg.text(left + plot_width / 2, height - 10, x_axis, "middle");
  svg.text(16, top + plot_height / 2, y_axis, "middle",
           "transform=\"rotate(-90 16 " + format("%.1f", top + plot_height / 2) + ")\"");
  for (std::size_t k = 0; k < series.size(); ++k) {
    const char* color = kColors[k % std::size(kColors)];
    const std::string style = "stroke=\"" + std::string(color) + "\" stroke-width=\"2\"";
    const Series& s = series[k];
    if (s.level) {
      svg.line(left, py(s.y[0]), left + plot_width, py(s.y[0]), style + " stroke-dasharray=\"6 4\"");
    } else {
      for (std::size_t i = 0; i + 1 < s.y.size(); ++i) svg.line(px(i), py(s.y[i]), px(i + 1), py(s.y[i + 1]), style);
      for (std::size_t i = 0; i < s.y.size(); ++i)
        svg.circle(px(i), py(s.y[i]), color, s.name + ", " + x_names[i] + ": " + format("%.2f", s.y[i]));
    }
    const double y = top + 12 + 16.0 * static_cast<double>(k);
    svg.line(left + plot_width + 14, y - 4, left + plot_width + 34, y - 4,
             style + (s.level ? " stroke-dasharray=\"6 4\"" : ""));
    svg.text(left + plot_width + 40, y, s.name);
  }
  return svg.finish();
}

}  // namespace

std::map<std::string, std::string> to_plots(const SceneReport& scene, const LabOptions& options) {
  std::map<std::string, std::string> plots;
  for (int kind = 0; kind < kKinds; ++kind) {
    std::vector<Bar> work;
    for (const Row& row : scene.rows) {
      if (row.mailbox != 0 || (row.key.find("short-stack") != std::string::npos && !row.key.ends_with("-4"))) continue;
      const KindResult& k = row.kinds[kind];
      const std::string name = row.structure + ", " + row.traversal;
      work.push_back(
          {name, {per_ray(k.work.down, k), per_ray(k.work.up, k), per_ray(k.work.leaf, k), per_ray(k.work.tests, k)}});
    }
    plots["work-" + std::string(kKindNames[kind])] =
        bars(scene.name + ": node visits and triangle tests, " + kKindNames[kind] + " rays",
             {"down", "up", "leaves or voxels", "tests"}, work, "per ray");
  }
  const auto traffic = [&](std::vector<std::string> keys) {
    std::vector<Series> series;
    for (const std::string& key : keys) {
      const Row* row = scene.find(key);
      if (!row) continue;
      Series s{row->structure + ", " + row->traversal, {}};
      for (const CacheResult& c : row->kinds[kPrimary].caches)
        s.y.push_back(64.0 * per_ray(c.misses, row->kinds[kPrimary]));
      series.push_back(s);
    }
    return series;
  };
  std::vector<std::string> sizes;
  for (const accel::CacheShape& c : options.caches) sizes.push_back(std::to_string(c.bytes / 1024) + " KB");
  plots["caches"] = lines(scene.name + ": bytes from memory behind a cache, primary rays", sizes,
                          traffic({"grid-pharr", "kd-sah/stack", "kd-sah/face-links", "kd-spatial/face-links",
                                   "bvh-kk3/heap", "bvh-gs/stack", "bvh-sah/stack", "bvh-sah/stackless"}),
                          "cache size (4 ways, 64-byte lines)", "bytes per ray");

  std::vector<int> entries;
  for (const Row& row : scene.rows)
    if (row.mailbox != 0 && std::find(entries.begin(), entries.end(), row.mailbox) == entries.end())
      entries.push_back(row.mailbox);
  if (!entries.empty()) {
    std::vector<std::string> names{"none"};
    for (const int n : entries) names.push_back(n == Mailbox::kExact ? "exact" : std::to_string(n));
    std::vector<Series> series;
    for (const Row& row : scene.rows) {
      if (row.mailbox != 0 || !scene.find(row.key, entries.back())) continue;
      Series s{row.structure, {per_ray(row.kinds[kPrimary].work.tests, row.kinds[kPrimary])}};
      for (const int n : entries) {
        const KindResult& k = scene.find(row.key, n)->kinds[kPrimary];
        s.y.push_back(per_ray(k.work.tests, k));
      }
      series.push_back(s);
    }
    plots["mailboxes"] = lines(scene.name + ": triangle tests by size of the mailbox, primary rays", names, series,
                               "entries of the mailbox", "tests per ray");
  }

  std::vector<std::string> depths;
  Series shorts{"short stack", {}};
  for (int n = 2; n <= 8; ++n) {
    const Row* row = scene.find("kd-sah/short-stack-" + std::to_string(n));
    if (!row) continue;
    depths.push_back(std::to_string(n));
    shorts.y.push_back(per_ray(row->kinds[kPrimary].work.visits(), row->kinds[kPrimary]));
  }
  if (!depths.empty()) {
    std::vector<Series> series{shorts};
    for (const char* key : {"stack", "restart", "backtrack-boxes", "backtrack-plane", "face-links"}) {
      const Row* row = scene.find("kd-sah/" + std::string(key));
      if (row)
        series.push_back({row->traversal, {per_ray(row->kinds[kPrimary].work.visits(), row->kinds[kPrimary])}, true});
    }
    plots["ways-up"] = lines(scene.name + ": node visits of the kd-tree (SAH) by way of going on, primary rays", depths,
                             series, "entries of the short stack", "visits per ray");
  }
  return plots;
}

}  // namespace retrace::lab
