// Two-level structures on a scene that moves: every frame followed by the top level, and built anew from nothing; one
// set of camera rays through both.
#include "golden/accel/probe.hpp"
#include "golden/accel/two_level.hpp"
#include "golden/base/clock.hpp"
#include "golden/gltf/gltf_loader.hpp"
#include "golden/render/view.hpp"
#include "lab.hpp"

namespace retrace::lab {

double AnimationReport::update_s() const {
  double sum = 0.0;
  for (const FrameResult& f : frames) sum += f.update_s();
  return frames.empty() ? 0.0 : sum / static_cast<double>(frames.size());
}

double AnimationReport::rebuild_s() const {
  double sum = 0.0;
  for (const FrameResult& f : frames) sum += f.rebuild_s();
  return frames.empty() ? 0.0 : sum / static_cast<double>(frames.size());
}

namespace {

AnimationReport follow(AnimatedScene scene, const std::string& path, const LabOptions& options) {
  AnimationReport report;
  report.duration = scene.duration();
  const ViewCamera camera = default_view(scene.at(0.0), flatten(scene.scene()), options.camera);
  accel::TwoLevel two(scene);
  report.instances = two.instances(), report.objects = two.objects();
  report.triangles = two.size(), report.instanced_triangles = two.instanced_triangles();
  report.bytes = two.footprint().total(), report.build_s = two.build_s();
  std::vector<accel::Ray> rays;
  for (int y = 0; y < options.height; ++y) {
    for (int x = 0; x < options.width; ++x) {
      const WorldRay ray = camera.ray(x + 0.5, y + 0.5, options.width, options.height);
      rays.push_back({ray.origin, ray.direction});
    }
  }
  for (int i = 0; i < options.frames; ++i) {
    FrameResult frame;
    frame.time = scene.duration() * (i + 0.5) / options.frames;
    double start = now();
    const Scene& pose = scene.at(frame.time);
    frame.pose_s = now() - start;
    const accel::TwoLevelUpdate update = two.update();
    frame.transforms_s = update.transforms_s, frame.objects_s = update.objects_s, frame.top_s = update.top_s;
    frame.objects_rebuilt = update.objects_rebuilt;
    const accel::FlatFrame flat(pose, two);
    frame.flatten_s = flat.flatten_s, frame.snap_s = flat.snap_s, frame.build_s = flat.build_s;
    report.degenerate = std::max<std::uint64_t>(report.degenerate, flat.degenerate);
    std::vector<accel::Hit> a(rays.size()), b(rays.size());
    accel::Probe probe;
    start = now();
    for (std::size_t k = 0; k < rays.size(); ++k) a[k] = two.trace(rays[k], probe);
    frame.two_level_s = now() - start;
    start = now();
    for (std::size_t k = 0; k < rays.size(); ++k) b[k] = flat.trace(rays[k], probe);
    frame.flat_s = now() - start;
    frame.rays = rays.size();
    for (std::size_t k = 0; k < rays.size(); ++k) frame.hits += a[k].hit(), frame.different += a[k] != b[k];
    report.frames.push_back(frame);
    if (options.say) options.say(path + ": frame " + std::to_string(i + 1) + " of " + std::to_string(options.frames));
  }
  return report;
}

}  // namespace

AnimationReport measure_animation(const std::string& path, const LabOptions& options) {
  Scene loaded = load_gltf(path, {.scene = {}, .textures = false});
  Animation animation = load_animation(path, loaded);
  try {
    return follow(AnimatedScene(std::move(loaded), std::move(animation)), path, options);
  } catch (const Error& e) {  // of the scene as it moves: a singular matrix
    throw Error(path + ": " + e.what());
  }
}

}  // namespace retrace::lab
