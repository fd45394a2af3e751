// Objects, instances, top level and the engine over them. The top level is a binned-SAH hierarchy over instance boxes,
// one instance a leaf.
#include "two_level.hpp"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "bvh.hpp"
#include "golden/base/clock.hpp"
#include "golden/gltf/gltf_document.hpp"

namespace retrace::accel {
namespace {

class Watch {
 public:
  /// Seconds since the last call.
  double lap() {
    const double last = std::exchange(last_, now());
    return last_ - last;
  }

 private:
  double last_ = now();
};

constexpr std::uint32_t kTopNodeBytes = 32;   // box and child or instance, in 4-byte words
constexpr std::uint32_t kInstanceBytes = 64;  // 12 coefficients, root of the object, first id
constexpr double kSingular = 1e-12;           // of the determinant, relative to the product of the columns' lengths

std::uint32_t triangle_count(const Mesh& mesh) {
  std::size_t n = 0;
  for (const Primitive& p : mesh.primitives) n += p.triangles.size();
  return static_cast<std::uint32_t>(n);
}

/// Where a ray enters a box, infinite if it does not before t_max. A margin of rounding is in the box.
double enter(const Ray& ray, const glm::dvec3& inverse, const Box& box, double t_max) {
  double near = 0.0, far = t_max;
  for (int a = 0; a < 3; ++a) {
    const bool negative = std::signbit(inverse[a]);
    const double t0 = ((negative ? box.upper : box.lower)[a] - ray.origin[a]) * inverse[a];
    const double t1 = ((negative ? box.lower : box.upper)[a] - ray.origin[a]) * inverse[a];
    if (t0 > near) near = t0;
    if (t1 < far) far = t1;
  }
  return near <= far ? near : kInfinity;
}

}  // namespace

TwoLevel::TwoLevel(const AnimatedScene& scene, const BuildOptions& options) : scene_(scene), options_(options) {
  Watch watch;
  const Scene& s = scene.scene();
  std::vector<std::uint32_t> uses(s.meshes.size(), 0);
  const std::vector<std::uint32_t> order = s.reachable();
  for (const std::uint32_t node : order)
    if (s.nodes[node].mesh != kNone) ++uses[s.nodes[node].mesh];

  instance_of_.assign(s.nodes.size(), kNone);
  std::vector<std::uint32_t> object_of(s.meshes.size(), kNone);
  std::uint32_t static_object = kNone;
  const auto add_object = [&](std::uint32_t node) {
    objects_.emplace_back();
    objects_.back().nodes.push_back(node);
    return static_cast<std::uint32_t>(objects_.size() - 1);
  };
  for (const std::uint32_t node : order) {
    const std::uint32_t mesh = s.nodes[node].mesh;
    if (mesh == kNone) continue;
    const std::uint32_t count = triangle_count(s.meshes[mesh]);
    const auto first = static_cast<std::uint32_t>(triangles_);
    triangles_ += count;
    if (triangles_ >= contract::kNoTriangle) throw Error("the scene has 2^32 instanced triangles or more");
    if (count == 0) continue;
    spans_.push_back({first, node});
    std::uint32_t object;
    if (scene.motion(node) == Motion::kStatic && uses[mesh] == 1) {
      if (static_object == kNone) {
        static_object = add_object(node);
        objects_[static_object].world_space = true;
        instance_of_[node] = static_cast<std::uint32_t>(instances_.size());
        instances_.push_back({static_object, kNone, 0, glm::dmat3(1.0), glm::dvec3(0.0), {}});
      } else {
        objects_[static_object].nodes.push_back(node);
        instance_of_[node] = instance_of_[objects_[static_object].nodes.front()];
      }
      for (std::uint32_t i = 0; i < count; ++i) objects_[static_object].ids.push_back(first + i);
      continue;
    }
    if (object_of[mesh] == kNone) object_of[mesh] = add_object(node);
    object = object_of[mesh];
    objects_[object].deforms = scene.motion(node) == Motion::kUnstructured && scene.deforms(node);
    instance_of_[node] = static_cast<std::uint32_t>(instances_.size());
    instances_.push_back({object, node, first, glm::dmat3(1.0), glm::dvec3(0.0), {}});
  }
  for (Object& object : objects_) build_object(object);
  build_s_ = watch.lap();
  place_instances();
  first_.transforms_s = watch.lap();
  build_top();
  first_.top_s = watch.lap();
}

TwoLevel::~TwoLevel() = default;

void TwoLevel::build_object(Object& object) {
  const Scene& s = scene_.scene();
  WorldTriangles triangles;
  std::vector<glm::dmat4> world;
  if (object.world_space) world = s.mesh_transforms();
  for (const std::uint32_t node : object.nodes) {
    for (const Primitive& p : s.meshes[s.nodes[node].mesh].primitives) {
      for (const glm::uvec3& t : p.triangles) {
        std::array<glm::dvec3, 3> v;
        for (int c = 0; c < 3; ++c) {
          v[c] = glm::dvec3(p.positions[t[c]]);
          if (object.world_space) v[c] = glm::dvec3(world[node] * glm::dvec4(v[c], 1.0));
        }
        triangles.vertices.push_back(v);
      }
    }
  }
  triangles.sources.resize(triangles.vertices.size(), TriangleSource{});
  const GridScene grid = snap(triangles);
  object.triangles = static_cast<std::uint32_t>(triangles.vertices.size());
  object.dropped = grid.degenerate;
  object.grid = grid.transform;
  object.set = from_grid(grid);
  object.tree = decode_kd(build_kd(grid, options_), object.set);
  object.walk = make_kd(object.tree, KdTraversal::kFaceLinks);
}

void TwoLevel::place_instances() {
  const Scene& s = scene_.scene();
  const std::vector<glm::dmat4> world = s.mesh_transforms();
  for (Instance& instance : instances_) {
    const Object& object = objects_[instance.object];
    const glm::dmat4 m = instance.node == kNone ? glm::dmat4(1.0) : world[instance.node];
    const glm::dmat3 linear(m);
    const double det = glm::determinant(linear),
                 size = glm::length(linear[0]) * glm::length(linear[1]) * glm::length(linear[2]);
    if (!(std::abs(det) > kSingular * size) || !std::isfinite(1.0 / det) || !std::isfinite(size))
      throw Error("node " + std::to_string(instance.node) + gltf::quote_name(s.nodes[instance.node].name) +
                  ": the instance's matrix is singular, rays cannot be transformed into its space");
    const glm::dmat3 inverse = glm::inverse(linear);
    instance.linear = object.grid.scale * inverse;
    instance.offset = -object.grid.scale * (inverse * glm::dvec3(m[3]) + object.grid.center);
    instance.box = Box{};
    for (int corner = 0; corner < 8; ++corner) {
      const glm::dvec3 g{(corner & 1 ? object.set.box.upper : object.set.box.lower).x,
                         (corner & 2 ? object.set.box.upper : object.set.box.lower).y,
                         (corner & 4 ? object.set.box.upper : object.set.box.lower).z};
      instance.box.add(glm::dvec3(m * glm::dvec4(object.grid.to_world(g), 1.0)));
    }
    const glm::dvec3 pad = 1e-12 * glm::max(glm::abs(instance.box.lower), glm::abs(instance.box.upper));
    instance.box.lower -= pad, instance.box.upper += pad;
  }
}

void TwoLevel::build_top() {
  std::vector<Box> boxes;
  for (const Instance& i : instances_) boxes.push_back(i.box);
  top_.clear();
  order_.clear();
  if (boxes.empty()) return;
  BuildSteps steps;
  const BvhDraft draft = draft_binned_sah(boxes, 1, steps);
  order_ = draft.order;
  top_.resize(draft.nodes.size());
  for (std::size_t n = draft.nodes.size(); n-- > 0;) {  // the builder numbers children above their parent, side by side
    const BvhDraft::Node& d = draft.nodes[n];
    TopNode& t = top_[n];
    t.leaf = d.is_leaf();
    t.first = t.leaf ? d.first : d.child;
    t.count = t.leaf ? d.count : 2;
    for (std::uint32_t c = t.first; c < t.first + t.count; ++c) t.box.add(t.leaf ? boxes[order_[c]] : top_[c].box);
  }
}

TwoLevelUpdate TwoLevel::update() {
  TwoLevelUpdate result;
  Watch watch;
  for (Object& object : objects_) {
    if (!object.deforms) continue;
    build_object(object);
    ++result.objects_rebuilt;
  }
  result.objects_s = watch.lap();
  place_instances();
  result.transforms_s = watch.lap();
  build_top();
  result.top_s = watch.lap();
  return result;
}

std::uint32_t TwoLevel::global_id(const Instance& instance, std::uint32_t local) const {
  const Object& object = objects_[instance.object];
  return object.ids.empty() ? instance.first_id + local : object.ids[local];
}

Ray TwoLevel::into(const Instance& instance, const Ray& ray, double t_max) {
  return {instance.linear * ray.origin + instance.offset, instance.linear * ray.direction, t_max, ray.any};
}

Hit TwoLevel::trace(const Ray& ray, Probe& probe) const {
  probe.begin_ray();
  Hit best = no_hit(ray);
  if (top_.empty()) return Hit{};
  const glm::dvec3 inverse = 1.0 / ray.direction;
  struct Entry {
    double t;
    std::uint32_t node;
  };
  thread_local std::vector<Entry> stack;
  stack.clear();
  const auto visit = [&](std::uint32_t node) {
    ++probe.work.volumes;
    probe.touch(std::uint64_t{node} * kTopNodeBytes, kTopNodeBytes);
    return enter(ray, inverse, top_[node].box, best.t);
  };
  if (const double t = visit(0); t < kInfinity) stack.push_back({t, 0});
  while (!stack.empty()) {
    const Entry e = stack.back();
    stack.pop_back();
    if (e.t > best.t) continue;
    const TopNode& n = top_[e.node];
    if (!n.leaf) {
      ++probe.work.down;
      const double t0 = visit(n.first), t1 = visit(n.first + 1);
      const std::uint32_t near = t1 < t0 ? 1 : 0;
      if (std::max(t0, t1) < kInfinity) stack.push_back({std::max(t0, t1), n.first + 1 - near});
      if (std::min(t0, t1) < kInfinity) stack.push_back({std::min(t0, t1), n.first + near});
      continue;
    }
    for (std::uint32_t k = n.first; k < n.first + n.count; ++k) {
      const Instance& instance = instances_[order_[k]];
      probe.touch(top_.size() * kTopNodeBytes + std::uint64_t{order_[k]} * kInstanceBytes, kInstanceBytes);
      probe.nest(true);
      const Hit hit = objects_[instance.object].walk->trace(into(instance, ray, best.t), probe);
      probe.nest(false);
      if (!hit.hit()) continue;
      const std::uint32_t id = global_id(instance, hit.id);
      if (!closer(hit.t, id, best)) continue;
      best = {hit.t, id, hit.u, hit.v};
      if (ray.any) return best;
    }
  }
  return finished(best);
}

Hit TwoLevel::brute_force(const Ray& ray, Probe& probe) const {
  probe.begin_ray();
  Hit best = no_hit(ray);
  for (const Instance& instance : instances_) {
    const Ray local = into(instance, ray, best.t);
    Hit hit = no_hit(local);
    for (const Triangle& t : objects_[instance.object].set.triangles) {
      ++probe.work.tests;
      intersect(local, t, hit);
    }
    if (!hit.hit()) continue;
    const std::uint32_t id = global_id(instance, hit.id);
    if (closer(hit.t, id, best)) best = {hit.t, id, hit.u, hit.v};
  }
  return finished(best);
}

bool TwoLevel::test(const Ray& ray, std::uint32_t id, Probe& probe, Hit& best) const {
  const auto span =
      std::upper_bound(spans_.begin(), spans_.end(), id, [](std::uint32_t x, const Span& s) { return x < s.first_id; });
  if (span == spans_.begin()) return false;
  const Instance& instance = instances_[instance_of_[std::prev(span)->node]];
  const Object& object = objects_[instance.object];
  std::uint32_t local = id - instance.first_id;
  if (!object.ids.empty())
    local = static_cast<std::uint32_t>(std::lower_bound(object.ids.begin(), object.ids.end(), id) - object.ids.begin());
  // Triangles without area on the object's grid are not in its set.
  const auto& triangles = object.set.triangles;
  const auto found = object.dropped == 0 && local < triangles.size()
                         ? triangles.begin() + local
                         : std::lower_bound(triangles.begin(), triangles.end(), local,
                                            [](const Triangle& t, std::uint32_t x) { return t.id < x; });
  if (found == triangles.end() || found->id != local) return false;
  ++probe.work.tests;
  const Ray inside = into(instance, ray, best.t);
  Hit hit = no_hit(inside);
  if (!intersect(inside, *found, hit) || !closer(hit.t, id, best)) return false;
  best = {hit.t, id, hit.u, hit.v};
  return true;
}

Footprint TwoLevel::footprint() const {
  Footprint sum;
  sum.nodes = top_.size() * kTopNodeBytes + instances_.size() * kInstanceBytes;
  for (const Object& object : objects_) {
    const Footprint f = object.tree->footprint(false);
    sum.nodes += f.nodes, sum.leaves += f.leaves, sum.references += f.references, sum.triangles += f.triangles;
  }
  return sum;
}

std::size_t TwoLevel::size() const {
  std::size_t n = 0;
  for (const Object& object : objects_) n += object.set.triangles.size();
  return n;
}

FlatFrame::FlatFrame(const Scene& frame, const TwoLevel& triangles, const BuildOptions& options)
    : triangles_(triangles) {
  Watch watch;
  const WorldTriangles world = flatten(frame);
  flatten_s = watch.lap();
  const GridScene grid = snap(world);
  snap_s = watch.lap();
  build(grid, options);
}

FlatFrame::FlatFrame(const GridScene& frame, const TwoLevel& triangles, const BuildOptions& options)
    : triangles_(triangles) {
  build(frame, options);
}

void FlatFrame::build(const GridScene& frame, const BuildOptions& options) {
  Watch watch;
  const MemoryImage image = build_kd(frame, options);
  build_s = watch.lap();
  degenerate = frame.degenerate;
  grid_ = frame.transform;
  tree_ = decode_kd(image, from_grid(frame));
}

Hit FlatFrame::trace(const Ray& world, Probe& probe) const {
  probe.begin_ray();
  Hit best = no_hit(world);
  const Ray ray{grid_.to_grid(world.origin), world.direction * grid_.scale, world.t_max, world.any};
  const ClippedRay clip(ray, tree_->box());
  if (!clip.ok) return Hit{};
  struct Entry {
    std::uint32_t node;
    double t_min, t_max;
  };
  std::vector<Entry> stack{{0, clip.t_min, clip.t_max}};
  while (!stack.empty()) {
    auto [node, t_min, t_max] = stack.back();
    stack.pop_back();
    while (!tree_->node(node).is_leaf()) {
      const KdTree::Node& n = tree_->node(node);
      ++probe.work.down;
      const double d = ray.direction[n.axis];
      const std::uint32_t near = d > 0.0 ? 0 : d < 0.0 ? 1 : ray.origin[n.axis] < n.split ? 0 : 1;
      const double t = d == 0.0 ? kInfinity : (n.split - ray.origin[n.axis]) * clip.inverse[n.axis];
      if (t <= t_min) {
        node = n.left() + 1 - near;
      } else {
        if (t < t_max) stack.push_back({n.left() + 1 - near, t, t_max});
        node = n.left() + near;
        t_max = std::min(t, t_max);
      }
    }
    const KdTree::Leaf& leaf = tree_->leaf(tree_->node(node).child);
    ++probe.work.leaf;
    for (std::uint32_t i = 0; i < leaf.count; ++i)
      if (triangles_.test(world, tree_->triangle(tree_->reference(leaf, i)).id, probe, best) && world.any) return best;
    if (best.t <= t_max) break;
  }
  return finished(best);
}

namespace {

/// Rays of a frame's grid through a structure that takes rays in world units.
template <class World>
class WorldEngine final : public Engine {
 public:
  WorldEngine(const World& scene, const GridScene& grid, std::string name)
      : scene_(scene), grid_(grid), name_(std::move(name)) {}
  std::string name() const override { return name_; }

  void trace(std::span<const GridRay> rays, std::span<retrace::Hit> hits, std::span<RayWork> work,
             const TraceOptions& options) override {
    if (hits.size() != rays.size() || (!work.empty() && work.size() != rays.size())) throw Error("trace: sizes differ");
    const auto run = [&](const tbb::blocked_range<std::size_t>& range) {
      Probe probe;
      for (std::size_t i = range.begin(); i < range.end(); ++i) {
        hits[i] = retrace::Hit{};
        probe.work = Work{};
        if (!rays[i].outside) hits[i] = one(rays[i], probe);
        if (!work.empty()) {
          const auto narrow = [](std::uint64_t x) { return static_cast<std::uint32_t>(x); };
          work[i] = {narrow(probe.work.down), narrow(probe.work.up), narrow(probe.work.leaf), narrow(probe.work.tests),
                     narrow(probe.work.skipped)};
        }
      }
      if (options.done) options.done->fetch_add(range.size());
    };
    tbb::task_arena arena(options.threads > 0 ? options.threads : tbb::task_arena::automatic);
    arena.execute([&] { tbb::parallel_for(tbb::blocked_range<std::size_t>(0, rays.size(), 256), run); });
  }

 private:
  retrace::Hit one(const GridRay& quantised, Probe& probe) const {
    const Ray grid = from_grid(quantised);
    const Ray world{grid_.transform.to_world(grid.origin), grid.direction / grid_.transform.scale, grid.t_max,
                    grid.any};
    const Hit hit = scene_.trace(world, probe);
    retrace::Hit out;
    if (!hit.hit()) return out;
    const auto it = std::lower_bound(grid_.triangles.begin(), grid_.triangles.end(), hit.id,
                                     [](const GridTriangle& t, std::uint32_t x) { return t.id < x; });
    // A triangle that has no area on the grid of the whole scene cannot be shaded; golden does not see it either.
    if (it == grid_.triangles.end() || it->id != hit.id) return out;
    std::array<int, 3> order;
    make_unit_triangle(*it, &order);
    const double file[3] = {1.0 - hit.u - hit.v, hit.u, hit.v};
    out.status = contract::kStatusHit;
    out.id = hit.id, out.t = hit.t;
    out.u = file[order[1]], out.v = file[order[2]];
    return out;
  }

  const World& scene_;
  const GridScene& grid_;
  std::string name_;
};

}  // namespace

std::unique_ptr<Engine> make_two_level_engine(const TwoLevel& scene, const GridScene& grid) {
  return std::make_unique<WorldEngine<TwoLevel>>(scene, grid, "two-level");
}

std::unique_ptr<Engine> make_flat_engine(const FlatFrame& frame, const GridScene& grid) {
  return std::make_unique<WorldEngine<FlatFrame>>(frame, grid, "one tree");
}

}  // namespace retrace::accel
