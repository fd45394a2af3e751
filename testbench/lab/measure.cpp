// Rays, runs and counts. Structures are built one after the other (the kd builder uses all cores, the others one), then
// all rows are measured in parallel, one thread a row, so that counts do not depend on the number of threads.
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "golden/accel/catalogue.hpp"
#include "golden/accel/probe.hpp"
#include "golden/base/clock.hpp"
#include "golden/gltf/animation.hpp"
#include "golden/render/lighting.hpp"
#include "golden/render/renderer.hpp"
#include "golden/render/sampling.hpp"
#include "golden/render/view.hpp"
#include "lab.hpp"
#include "scenes/open_scene.hpp"

namespace retrace::lab {
namespace {

using accel::Mailbox;
using accel::Probe;

constexpr int kTile = 8;
constexpr char kReference[] = "bvh-sah/stack";

/// Pixels in 8x8 tiles, as a core with ray contexts would be fed.
std::vector<std::uint32_t> tiled_pixels(int width, int height) {
  std::vector<std::uint32_t> order;
  for (int y0 = 0; y0 < height; y0 += kTile)
    for (int x0 = 0; x0 < width; x0 += kTile)
      for (int y = y0; y < std::min(y0 + kTile, height); ++y)
        for (int x = x0; x < std::min(x0 + kTile, width); ++x)
          order.push_back(static_cast<std::uint32_t>(y * width + x));
  return order;
}

bool has_heat_map(const std::string& key) {
  static const char* const kKeys[] = {"grid-woo",
                                      "grid-pharr",
                                      "kd-sah/stack",
                                      "kd-sah/short-stack-4",
                                      "kd-sah/restart",
                                      "kd-sah/backtrack-boxes",
                                      "kd-sah/backtrack-plane",
                                      "kd-sah/face-links",
                                      "kd-spatial/face-links",
                                      "kd-object/face-links",
                                      "bvh-kk3/heap",
                                      "bvh-kk7/heap",
                                      "bvh-gs/stack",
                                      "bvh-sah/stack",
                                      "bvh-sah/stackless"};
  return std::find(std::begin(kKeys), std::end(kKeys), key) != std::end(kKeys);
}

/// Mailboxes that a technique is measured with. All traversals of one tree test the same triangles in the same order,
/// so one of each tree stands for all.
std::vector<int> mailboxes(const accel::Technique& technique) {
  const bool sweep = technique.key.starts_with("grid-") || technique.key.ends_with("/face-links");
  if (!technique.duplicates || !sweep) return {0};
  return {0, 2, 4, 8, 16, 32, 64, Mailbox::kExact};
}

/// Mailboxes between these change the traffic little; the cache model would only cost time.
bool has_caches(int mailbox) { return mailbox == 0 || mailbox == 8 || mailbox == Mailbox::kExact; }

bool wanted(const std::string& key, const std::vector<std::string>& only) {
  return only.empty() ||
         std::any_of(only.begin(), only.end(), [&](const std::string& o) { return key.starts_with(o); });
}

bool same(const accel::Ray& ray, const accel::Hit& a, const accel::Hit& b) {
  return ray.any ? a.hit() == b.hit() : a == b;
}

void run_row(Row& row, const accel::Structure& structure, const std::array<RayBatch, kKinds>& rays,
             const std::array<std::vector<accel::Hit>, kKinds>& expected, const LabOptions& options) {
  const bool heat = row.mailbox == 0 && has_heat_map(row.key);
  for (int kind = 0; kind < kKinds; ++kind) {
    const RayBatch& batch = rays[kind];
    KindResult& result = row.kinds[kind];
    result.rays = batch.rays.size();
    std::vector<accel::Hit> hits(batch.rays.size());
    {
      Probe probe(Mailbox(row.mailbox, structure.size()));
      const double start = now();
      for (std::size_t i = 0; i < hits.size(); ++i) hits[i] = structure.trace(batch.rays[i], probe);
      result.seconds = now() - start;
      result.work = probe.work;
    }
    for (std::size_t i = 0; i < hits.size(); ++i) {
      result.hits += hits[i].hit();
      result.different += !same(batch.rays[i], expected[kind][i], hits[i]);
    }
    if (!has_caches(row.mailbox)) continue;
    accel::AccessLog log;
    Probe probe(Mailbox(row.mailbox, structure.size()), &log);
    const bool map = heat && kind == kPrimary;
    if (map) {
      const auto pixels = static_cast<std::size_t>(options.width) * options.height;
      row.heat_visits.assign(pixels, 0.0f), row.heat_tests.assign(pixels, 0.0f);
    }
    for (std::size_t i = 0; i < hits.size(); ++i) {
      const accel::Work before = probe.work;
      structure.trace(batch.rays[i], probe);
      if (!map) continue;
      row.heat_visits[batch.pixel[i]] = static_cast<float>(probe.work.visits() - before.visits());
      row.heat_tests[batch.pixel[i]] = static_cast<float>(probe.work.tests - before.tests);
    }
    std::vector<accel::CacheModel> caches;
    for (const accel::CacheShape& shape : options.caches) caches.emplace_back(shape);
    accel::replay(log, static_cast<std::size_t>(options.contexts), caches);
    for (const accel::CacheModel& cache : caches) result.caches.push_back({cache.accesses(), cache.misses()});
  }
}

/// Compares the reference with brute force on rays spread evenly over each batch.
void check(SceneReport& report, const std::array<RayBatch, kKinds>& rays,
           const std::array<std::vector<accel::Hit>, kKinds>& expected, const accel::TriangleSet& set,
           const LabOptions& options) {
  const auto brute = accel::make_brute_force(set);
  const double budget =
      options.check_tests / kKinds / static_cast<double>(std::max<std::size_t>(set.triangles.size(), 1));
  for (int kind = 0; kind < kKinds; ++kind) {
    const std::size_t n = rays[kind].rays.size();
    const auto count = std::min(n, static_cast<std::size_t>(std::max(budget, 16.0)));
    std::vector<std::uint8_t> wrong(count);
    tbb::parallel_for(std::size_t{0}, count, [&](std::size_t k) {
      const std::size_t i = k * n / count;
      Probe probe;
      wrong[k] = !same(rays[kind].rays[i], brute->trace(rays[kind].rays[i], probe), expected[kind][i]);
    });
    report.checked[kind] = count;
    report.wrong[kind] = static_cast<std::uint64_t>(std::count(wrong.begin(), wrong.end(), 1));
  }
}

}  // namespace

std::array<RayBatch, kKinds> make_rays(const TracedScene& scene, const LabOptions& options, std::string& camera_name,
                                       std::string& light) {
  const ViewCamera camera = default_view(scene.scene, scene.world, options.camera);
  camera_name = camera.name;
  const Surfaces surfaces(scene.scene, scene.world, scene.grid);
  const std::unique_ptr<Engine> golden = make_golden_engine(scene.grid, scene.image);
  const Lighting lighting(surfaces, camera, LightChoice::kAuto,
                          is_indoors(surfaces, camera, scene.grid.box, *golden, {}));
  light = lighting.describe();

  const accel::TriangleSet set = accel::from_grid(scene.grid);
  const auto tracer =
      accel::make_bvh(accel::build_bvh(set, accel::BvhBuilder::kBinnedSah), accel::BvhTraversal::kStack);
  std::array<RayBatch, kKinds> batches;
  const auto add = [&](Kind kind, const WorldRay& ray, std::uint32_t pixel) -> const accel::Ray* {
    const GridRay grid = quantise(ray, scene.grid.transform, scene.grid.box, kind == kShadow);
    if (grid.outside) return nullptr;
    batches[kind].grid.push_back(grid);
    batches[kind].rays.push_back(accel::from_grid(grid));
    batches[kind].pixel.push_back(pixel);
    return &batches[kind].rays.back();
  };
  Probe probe;
  std::vector<LightSample> samples;
  for (const std::uint32_t pixel : tiled_pixels(options.width, options.height)) {
    const int x = static_cast<int>(pixel) % options.width, y = static_cast<int>(pixel) / options.width;
    const WorldRay ray = camera.ray(x + 0.5, y + 0.5, options.width, options.height);
    const accel::Ray* primary = add(kPrimary, ray, pixel);
    if (!primary) continue;
    const accel::Hit hit = tracer->trace(*primary, probe);
    if (!hit.hit()) continue;
    SurfacePoint point;
    point.id = hit.id;
    point.position = (primary->origin + hit.t * primary->direction) / scene.grid.transform.scale;
    const glm::dvec3 a = surfaces.vertex(hit.id, 0), b = surfaces.vertex(hit.id, 1), c = surfaces.vertex(hit.id, 2);
    point.geometric = glm::normalize(glm::cross(b - a, c - a));
    if (glm::dot(point.geometric, ray.direction) > 0.0) point.geometric = -point.geometric;
    point.normal = point.geometric;
    samples.clear();
    lighting.sample(point, 1, pixel, hash_mix(pixel), samples);
    for (const LightSample& s : samples) {
      if (glm::dot(s.direction, point.geometric) <= 0.0) continue;
      add(kShadow, surfaces.leave(point, s.direction, s.distance), pixel);
      break;
    }
    const glm::dvec3 bounce = to_cosine_hemisphere(sample_2d(pixel, 7u), point.geometric);
    if (glm::dot(bounce, point.geometric) > 1e-6) add(kBounce, surfaces.leave(point, bounce, accel::kInfinity), pixel);
  }
  return batches;
}

const Row* SceneReport::find(const std::string& key, int mailbox) const {
  for (const Row& row : rows)
    if (row.key == key && row.mailbox == mailbox) return &row;
  return nullptr;
}

std::uint64_t LabReport::differences() const {
  std::uint64_t sum = 0;
  for (const SceneReport& scene : scenes) {
    for (const std::uint64_t w : scene.wrong) sum += w;
    for (const FrameResult& frame : scene.animation.frames) sum += frame.different;
    for (const Row& row : scene.rows)
      for (const KindResult& kind : row.kinds) sum += kind.different;
  }
  return sum;
}

std::string label(const Row& row) {
  std::string text = row.structure + ", " + row.traversal;
  if (row.mailbox == Mailbox::kExact) text += ", exact mailbox";
  if (row.mailbox > 0) text += ", mailbox " + std::to_string(row.mailbox);
  return text;
}

std::string scene_name(const std::string& spec) {
  return std::filesystem::exists(spec) ? std::filesystem::path(spec).stem().string() : spec;
}

void check_structures(const std::vector<std::string>& only) {
  for (const std::string& o : only) {
    bool known = false;
    for (const accel::Technique& t : accel::catalogue())
      known = known || (t.key != "brute-force" && t.key.starts_with(o));
    if (!known) {
      std::string keys;
      for (const accel::Technique& t : accel::catalogue())
        if (t.key != "brute-force") keys += (keys.empty() ? "" : ", ") + t.key;
      throw UsageError("--only: no structure '" + o + "'; there are: " + keys);
    }
  }
}

SceneReport measure(const std::string& spec, const LabOptions& options) {
  const double start = now();
  const std::string name = scene_name(spec);
  const auto say = [&](const std::string& text) {
    if (options.say) options.say(name + ": " + text);
  };
  SceneReport report;
  report.name = name;
  if (options.frames > 0 && std::filesystem::is_regular_file(spec) && count_animations(spec) > 0) {
    say("following the animation");
    report.animation = measure_animation(spec, options);
  }
  if (!options.structures) {
    if (report.animation.frames.empty()) throw Error(spec + ": holds no animation");
    report.seconds = now() - start;
    return report;
  }
  say("loading");
  TracedScene scene = snap_scene(open_scene(spec));
  report.triangles = scene.grid.triangles.size();
  report.degenerate = scene.grid.degenerate;

  accel::Workshop workshop(scene.grid);
  scene.image = build_kd(scene.grid);
  const auto rays = make_rays(scene, options, report.camera, report.light);
  for (int kind = 0; kind < kKinds; ++kind) report.rays[kind] = rays[kind].rays.size();

  std::vector<std::shared_ptr<const accel::Structure>> structures;
  std::string building;
  for (const accel::Technique& technique : accel::catalogue()) {
    if (technique.key == "brute-force" || !wanted(technique.key, options.only)) continue;
    const std::string group = technique.key.substr(0, technique.key.find('/'));
    if (group != building) say("building " + group), building = group;
    Row row{technique.key, technique.structure, technique.traversal, technique.source, 0, 0.0, {}, 0.0, {}, {}, {}};
    const auto structure = technique.make(workshop, row.build_s);
    row.footprint = structure->footprint();
    row.references =
        static_cast<double>(structure->references()) / static_cast<double>(std::max<std::size_t>(structure->size(), 1));
    for (const int entries : mailboxes(technique)) {
      row.mailbox = entries;
      report.rows.push_back(row);
      structures.push_back(structure);
    }
  }

  say("tracing the reference");
  std::array<std::vector<accel::Hit>, kKinds> expected;
  {
    double seconds;
    const auto reference =
        std::find_if(accel::catalogue().begin(), accel::catalogue().end(), [](const accel::Technique& t) {
          return t.key == kReference;
        })->make(workshop, seconds);
    Probe probe;
    for (int kind = 0; kind < kKinds; ++kind)
      for (const accel::Ray& ray : rays[kind].rays) expected[kind].push_back(reference->trace(ray, probe));
  }
  say("comparing it with brute force");
  check(report, rays, expected, workshop.set(), options);

  std::atomic<std::size_t> done = 0;
  tbb::parallel_for(std::size_t{0}, report.rows.size(), [&](std::size_t i) {
    run_row(report.rows[i], *structures[i], rays, expected, options);
    const std::size_t n = ++done, all = report.rows.size();
    if (n * 10 / all != (n - 1) * 10 / all) say("measured " + std::to_string(n) + " of " + std::to_string(all));
  });
  report.seconds = now() - start;
  return report;
}

}  // namespace retrace::lab
