// LabReport as JSON and as Markdown.
#include <cmath>
#include <cstdio>
#include <thread>

#include "golden/accel/probe.hpp"
#include "lab.hpp"

namespace retrace::lab {
namespace {

using accel::Mailbox;
using nlohmann::ordered_json;

double per_ray(std::uint64_t total, const KindResult& kind) {
  return kind.rays ? static_cast<double>(total) / static_cast<double>(kind.rays) : 0.0;
}

std::string number(double value, int digits) {
  char text[64];
  std::snprintf(text, sizeof text, "%.*f", digits, value);
  return text;
}

ordered_json mailbox_json(int entries) {
  if (entries == Mailbox::kExact) return "exact";
  return entries;
}

std::string cache_name(const accel::CacheShape& shape) { return std::to_string(shape.bytes / 1024) + " KB"; }

double hit_percent(const CacheResult& cache) {
  return cache.accesses ? 100.0 * (1.0 - static_cast<double>(cache.misses) / static_cast<double>(cache.accesses)) : 0.0;
}

void main_table(const SceneReport& scene, const LabOptions& options, std::string& out) {
  out += "| structure | traversal | build s | MB | references | visits | volumes | tests | bytes |";
  for (const accel::CacheShape& cache : options.caches) out += " hits " + cache_name(cache) + " |";
  out +=
      " shadow: visits | volumes | tests | bounce: visits | volumes | tests "
      "|\n|---|---|---:|---:|---:|---:|---:|---:|---:|";
  for (std::size_t i = 0; i < options.caches.size() + 6; ++i) out += "---:|";
  out += "\n";
  for (const Row& row : scene.rows) {
    // One short stack stands for all here; the table of ways up has the others.
    if (row.mailbox != 0 || (row.key.find("short-stack") != std::string::npos && !row.key.ends_with("-4"))) continue;
    const KindResult& p = row.kinds[kPrimary];
    out += "| " + row.structure + " | " + row.traversal + " | " + number(row.build_s, 2) + " | " +
           number(static_cast<double>(row.footprint.total()) / 1e6, 1) + " | " + number(row.references, 1) + " | " +
           number(per_ray(p.work.visits(), p), 1) + " | " + number(per_ray(p.work.volumes, p), 1) + " | " +
           number(per_ray(p.work.tests, p), 2) + " | " + number(per_ray(p.work.bytes, p), 0) + " |";
    for (const CacheResult& cache : p.caches) out += " " + number(hit_percent(cache), 1) + " % |";
    for (const Kind kind : {kShadow, kBounce}) {
      const KindResult& k = row.kinds[kind];
      out += " " + number(per_ray(k.work.visits(), k), 1) + " | " + number(per_ray(k.work.volumes, k), 1) + " | " +
             number(per_ray(k.work.tests, k), 2) + " |";
    }
    out += "\n";
  }
}

void mailbox_table(const SceneReport& scene, std::string& out) {
  std::vector<int> sizes;
  for (const Row& row : scene.rows)
    if (row.mailbox != 0 && std::find(sizes.begin(), sizes.end(), row.mailbox) == sizes.end())
      sizes.push_back(row.mailbox);
  if (sizes.empty()) return;
  out +=
      "\nTests a primary ray with a mailbox of so many entries, and what the exact one saves of the tests of all three "
      "kinds of ray:\n\n";
  out += "| structure | none |";
  for (const int n : sizes) out += n == Mailbox::kExact ? std::string(" exact |") : " " + std::to_string(n) + " |";
  out += " saved: primary | shadow | bounce |\n|---|---:|";
  for (std::size_t i = 0; i < sizes.size() + 3; ++i) out += "---:|";
  out += "\n";
  for (const Row& row : scene.rows) {
    if (row.mailbox != 0 || !scene.find(row.key, Mailbox::kExact)) continue;
    out +=
        "| " + row.structure + " | " + number(per_ray(row.kinds[kPrimary].work.tests, row.kinds[kPrimary]), 2) + " |";
    for (const int n : sizes) {
      const KindResult& k = scene.find(row.key, n)->kinds[kPrimary];
      out += " " + number(per_ray(k.work.tests, k), 2) + " |";
    }
    for (int kind = 0; kind < kKinds; ++kind) {
      const accel::Work& w = scene.find(row.key, Mailbox::kExact)->kinds[kind].work;
      const double all = static_cast<double>(w.tests + w.skipped);
      out += " " + number(all > 0 ? 100.0 * static_cast<double>(w.skipped) / all : 0.0, 0) + " % |";
    }
    out += "\n";
  }
}

void ways_table(const SceneReport& scene, std::string& out) {
  for (const char* tree : {"kd-sah", "kd-unclipped", "kd-spatial", "kd-object"}) {
    const Row* stack = scene.find(std::string(tree) + "/stack");
    if (!stack) continue;
    out += "\nNode visits relative to the stack's, " + stack->structure +
           ": interior nodes only, and with leaves:\n\n| traversal | primary: interior | primary: all | shadow: all | "
           "bounce: all |\n"
           "|---|---:|---:|---:|---:|\n";
    for (const Row& row : scene.rows) {
      if (!row.key.starts_with(std::string(tree) + "/") || row.mailbox != 0) continue;
      const auto ratio = [](std::uint64_t a, std::uint64_t b) {
        return number(b ? static_cast<double>(a) / static_cast<double>(b) : 0.0, 2);
      };
      const accel::Work &w = row.kinds[kPrimary].work, &s = stack->kinds[kPrimary].work;
      out += "| " + row.traversal + " | " + ratio(w.down + w.up, s.down) + " |";
      for (int kind = 0; kind < kKinds; ++kind)
        out += " " + ratio(row.kinds[kind].work.visits(), stack->kinds[kind].work.visits()) + " |";
      out += "\n";
    }
  }
}

void animation_table(const AnimationReport& animation, std::string& out) {
  if (animation.frames.empty()) return;
  out += "\nTwo-level structure: " + std::to_string(animation.instances) + " instances of " +
         std::to_string(animation.objects) + " objects, " + std::to_string(animation.triangles) + " triangles held, " +
         std::to_string(animation.instanced_triangles) + " instanced, " +
         number(static_cast<double>(animation.bytes) / 1e6, 1) + " MB; objects built once in " +
         number(animation.build_s, 2) +
         " s. A full rebuild is flattening, snapping and one kd-tree (SAH) over all world triangles. Following a frame "
         "is " +
         number(animation.rebuild_s() / std::max(animation.update_s(), 1e-9), 0) +
         " times cheaper. Times in milliseconds.\n\n";
  out +=
      "| at s | pose | transforms | objects rebuilt | objects | top level | full rebuild | rays | other hits | trace "
      "two-level | trace one tree |\n";
  out += "|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|\n";
  for (const FrameResult& f : animation.frames) {
    out += "| " + number(f.time, 2) + " | " + number(f.pose_s * 1e3, 2) + " | " + number(f.transforms_s * 1e3, 2) +
           " | " + std::to_string(f.objects_rebuilt) + " | " + number(f.objects_s * 1e3, 2) + " | " +
           number(f.top_s * 1e3, 2) + " | " + number(f.rebuild_s() * 1e3, 0) + " | " + std::to_string(f.rays) + " | " +
           std::to_string(f.different) + " | " + number(f.two_level_s * 1e3, 0) + " | " + number(f.flat_s * 1e3, 0) +
           " |\n";
  }
}

ordered_json animation_json(const AnimationReport& animation) {
  if (animation.frames.empty()) return nullptr;
  ordered_json frames = ordered_json::array();
  for (const FrameResult& f : animation.frames) {
    frames.push_back(
        {{"time", f.time},
         {"pose_s", f.pose_s},
         {"update",
          {{"transforms_s", f.transforms_s},
           {"objects_s", f.objects_s},
           {"top_level_s", f.top_s},
           {"objects_rebuilt", f.objects_rebuilt},
           {"total_s", f.update_s()}}},
         {"full_rebuild",
          {{"flatten_s", f.flatten_s}, {"snap_s", f.snap_s}, {"build_s", f.build_s}, {"total_s", f.rebuild_s()}}},
         {"rays", f.rays},
         {"hits", f.hits},
         {"different", f.different},
         {"trace_two_level_s", f.two_level_s},
         {"trace_one_tree_s", f.flat_s}});
  }
  return {{"instances", animation.instances},
          {"objects", animation.objects},
          {"triangles", animation.triangles},
          {"instanced_triangles", animation.instanced_triangles},
          {"bytes", animation.bytes},
          {"degenerate", animation.degenerate},
          {"duration", animation.duration},
          {"build_s", animation.build_s},
          {"update_s", animation.update_s()},
          {"full_rebuild_s", animation.rebuild_s()},
          {"frames", frames}};
}

}  // namespace

ordered_json to_json(const LabReport& report) {
  ordered_json caches = ordered_json::array();
  for (const accel::CacheShape& c : report.options.caches)
    caches.push_back({{"bytes", c.bytes}, {"ways", c.ways}, {"line", 64}});
  ordered_json scenes = ordered_json::array();
  for (const SceneReport& scene : report.scenes) {
    ordered_json rows = ordered_json::array();
    for (const Row& row : scene.rows) {
      ordered_json kinds;
      for (int kind = 0; kind < kKinds; ++kind) {
        const KindResult& k = row.kinds[kind];
        ordered_json hits = ordered_json::array();
        for (const CacheResult& c : k.caches) hits.push_back({{"accesses", c.accesses}, {"misses", c.misses}});
        kinds[kKindNames[kind]] = {{"rays", k.rays},
                                   {"hits", k.hits},
                                   {"different", k.different},
                                   {"seconds", k.seconds},
                                   {"per_ray",
                                    {{"down", per_ray(k.work.down, k)},
                                     {"up", per_ray(k.work.up, k)},
                                     {"leaf", per_ray(k.work.leaf, k)},
                                     {"visits", per_ray(k.work.visits(), k)},
                                     {"volumes", per_ray(k.work.volumes, k)},
                                     {"restarts", per_ray(k.work.restarts, k)},
                                     {"tests", per_ray(k.work.tests, k)},
                                     {"skipped", per_ray(k.work.skipped, k)},
                                     {"bytes", per_ray(k.work.bytes, k)}}},
                                   {"caches", hits}};
      }
      rows.push_back({{"key", row.key},
                      {"structure", row.structure},
                      {"traversal", row.traversal},
                      {"source", row.source},
                      {"mailbox", mailbox_json(row.mailbox)},
                      {"build_s", row.build_s},
                      {"references_per_triangle", row.references},
                      {"bytes",
                       {{"nodes", row.footprint.nodes},
                        {"leaves", row.footprint.leaves},
                        {"references", row.footprint.references},
                        {"triangles", row.footprint.triangles},
                        {"total", row.footprint.total()}}},
                      {"rays", kinds}});
    }
    ordered_json checks;
    for (int kind = 0; kind < kKinds; ++kind) {
      checks[kKindNames[kind]] = {{"rays", scene.checked[kind]}, {"wrong", scene.wrong[kind]}};
    }
    scenes.push_back({{"name", scene.name},
                      {"triangles", scene.triangles},
                      {"degenerate", scene.degenerate},
                      {"camera", scene.camera},
                      {"light", scene.light},
                      {"brute_force", checks},
                      {"seconds", scene.seconds},
                      {"animation", animation_json(scene.animation)},
                      {"structures", rows}});
  }
  return {{"width", report.options.width},       {"height", report.options.height},
          {"contexts", report.options.contexts}, {"caches", caches},
          {"differences", report.differences()}, {"seconds", report.seconds},
          {"cpu_seconds", report.cpu_seconds},   {"scenes", scenes}};
}

std::string to_markdown(const LabReport& report) {
  std::string out = "Everything took " + number(report.cpu_seconds, 0) + " seconds of processor time, " +
                    number(report.seconds, 0) + " on the clock of a machine with " +
                    std::to_string(std::thread::hardware_concurrency()) +
                    " processors. Build times are processor time, those of animations are on the clock.\n";
  for (const SceneReport& scene : report.scenes) {
    out += "\n";
    out += "### " + scene.name + "\n";
    if (scene.rows.empty()) {
      animation_table(scene.animation, out);
      continue;
    }
    out += "\n";
    out += std::to_string(scene.triangles) + " triangles, camera " + scene.camera + ", light: " + scene.light + ". ";
    for (int kind = 0; kind < kKinds; ++kind)
      out += std::to_string(scene.rays[kind]) + " " + kKindNames[kind] + (kind + 1 < kKinds ? ", " : " rays at ");
    out += std::to_string(report.options.width) + "x" + std::to_string(report.options.height) + ". ";
    std::uint64_t different = 0;
    for (const Row& row : scene.rows)
      for (const KindResult& k : row.kinds) different += k.different;
    out += "Rays on which a structure differs from another: " + std::to_string(different) + "; from brute force: ";
    std::uint64_t wrong = 0, checked = 0;
    for (int kind = 0; kind < kKinds; ++kind) wrong += scene.wrong[kind], checked += scene.checked[kind];
    out += std::to_string(wrong) + " of " + std::to_string(checked) + " checked.\n\n";
    main_table(scene, report.options, out);
    ways_table(scene, out);
    mailbox_table(scene, out);
    animation_table(scene.animation, out);
  }
  return out;
}

}  // namespace retrace::lab
