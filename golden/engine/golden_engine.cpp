// The golden model: double precision over the snapped scene and the quantised rays, with the tree of the memory image.
// Three walks over one tree: a stack (the yardstick), kd-backtrack with parent links, kd-backtrack with face links.
// Two levels: at a leaf of instances a ray enters each of them through instance_enter, whose rounded ray is exact from there on, and walks the
// object's tree with it. Hits are ordered by (t in the world, instance, t in the object, id).
// Source: Foley & Sugerman 2005; Lee 2007; for the stack Kaplan 1985 and Havran 2000, appendix C; for two levels Wald et al. 2003.
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <tuple>

#include "engine.hpp"
#include "golden/tree/kd_builder.hpp"
#include "instance_ray.hpp"
#include "pixels.hpp"
#include "registry.hpp"
#include "stages/hit_finish.hpp"
#include "stages/instance_enter.hpp"
#include "stages/kd_backtrack.hpp"
#include "stages/kd_descend.hpp"
#include "stages/leaf_exit.hpp"
#include "stages/ray_setup.hpp"
#include "stages/tri_test.hpp"
#include "walk.hpp"

namespace retrace {
namespace {

using namespace golden;

constexpr double kPositionUnit = 1.0 / (1 << contract::kPositionFrac);
constexpr std::size_t kBlock = 1024;  // rays a task takes at a time

/// A node of the image with its plane in double.
struct FastNode {
  double split;
  std::uint32_t child_axis;  // left child or leaf record, times 4, and the axis
  std::uint32_t parent;

  int axis() const { return static_cast<int>(child_axis & 3u); }
  std::uint32_t child() const { return child_axis >> 2; }
  bool is_leaf() const { return axis() == contract::kAxisLeaf; }
};

struct ReferenceRange {
  std::uint32_t first, count;
};

struct LeafGeometry {
  std::array<double, 6> bound;
  std::array<std::int32_t, 6> plane;
  std::array<std::uint32_t, 6> link;
};

/// Last triangles tested by a ray; find() is linear, as in hardware.
class Mailbox {
 public:
  explicit Mailbox(int entries) : entries_(entries) {}
  bool find_or_add(std::uint32_t index) {
    for (int i = 0; i < used_; ++i)
      if (slots_[i] == index) return true;
    slots_[next_] = index;
    next_ = (next_ + 1) % entries_;
    used_ = std::min(used_ + 1, entries_);
    return false;
  }
  static constexpr int kMaxEntries = kMaxMailbox;

 private:
  int entries_, used_ = 0, next_ = 0;
  std::array<std::uint32_t, kMaxEntries> slots_;
};

/// Sees nothing: what every ray but an explained one is traced with.
struct Unwatched {
  static constexpr bool kWatches = false;
};

/// Keeps what the stages do, in the terms of walk.hpp.
struct Watcher {
  static constexpr bool kWatches = true;
  std::vector<StageCall>& calls;

  void add(Stage stage, std::vector<StageValue> values) { calls.push_back({stage, std::move(values), {}, {}}); }
  void setup(const RayState& ray) {
    add(Stage::kRaySetup, {{"origin_x", ray.origin.x, false},
                           {"origin_y", ray.origin.y, false},
                           {"origin_z", ray.origin.z, false},
                           {"direction_x", ray.direction.x, false},
                           {"direction_y", ray.direction.y, false},
                           {"direction_z", ray.direction.z, false},
                           {"valid", 1.0, true}});
  }
  void descend(double split, double t, std::uint32_t node) {
    add(Stage::kKdDescend, {{"split", split, false}, {"t", t, false}, {"node", double(node), true}});
  }
  void exit(const LeafGeometry& leaf, double t, const LeafExit& exit) {
    const auto& b = leaf.bound;
    add(Stage::kLeafExit, {{"low_x", b[0], false},
                           {"high_x", b[1], false},
                           {"low_y", b[2], false},
                           {"high_y", b[3], false},
                           {"low_z", b[4], false},
                           {"high_z", b[5], false},
                           {"t", t, false},
                           {"t_exit", exit.t_exit, false},
                           {"face", double(exit.face), true}});
  }
  /// A stage of the hardware knows nothing of the best hit so far, so the test is made without a limit.
  void test(const Triangle& triangle, const RayState& ray) {
    constexpr double kReach = 8.0;  // t codes end there
    RayState whole = ray;
    whole.t_max = std::nextafter(kReach, 0.0);
    Candidate candidate;
    const bool hit = tri_test(triangle, whole, whole.t_max, candidate);
    add(Stage::kTriTest, {{"triangle", double(triangle.id), true}, {"hit", hit ? 1.0 : 0.0, true}});
    if (hit) calls.back().values.push_back({"t", candidate.t, false});
  }
  void enter(const contract::InstanceEnterInRecord& in, const contract::InstanceEnterOutRecord& entry,
             std::span<const contract::InstanceRecord> records) {
    std::array<std::uint64_t, contract::InstanceEnterInRecord::kWords> input;
    std::array<std::uint64_t, contract::InstanceEnterOutRecord::kWords> output;
    in.pack(input.data());
    entry.pack(output.data());
    calls.push_back(read_stage_call(Stage::kInstanceEnter, input, output));
    calls.back().input.clear();
    calls.back().output.clear();
    name_instance(calls.back(), in, records);
  }
  void climb(std::uint32_t from, std::uint32_t parent, bool matched, std::uint32_t node) {
    add(Stage::kKdBacktrack,
        {{"from", double(from), true}, {"parent", double(parent), true}, {"matched", matched ? 1.0 : 0.0, true}});
    if (matched) calls.back().values.push_back({"node", double(node), true});
  }
  void finish(const Hit& hit) {
    add(Stage::kHitFinish, {{"status", double(hit.status), true}});
    if (!hit.hit()) return;
    auto& values = calls.back().values;
    values.push_back({"triangle", double(hit.id), true});
    values.push_back({"t", hit.t, false});
    values.push_back({"u", hit.u, false});
    values.push_back({"v", hit.v, false});
  }
};

class GoldenEngine final : public Engine {
 public:
  GoldenEngine(const GridScene& scene, const MemoryImage& image) {
    const auto& header = image.header();
    if (scene.two_levels != image.two_levels()) throw Error("golden engine: scene and image differ in their levels");
    nodes_.resize(2 * header.pair_count);
    for (std::uint32_t i = 0; i < header.pair_count; ++i) {
      const auto pair = image.pair(i);
      nodes_[2 * i] = make_node(pair.left_split, pair.left_axis, pair.left_child, pair.parent);
      nodes_[2 * i + 1] = make_node(pair.right_split, pair.right_axis, pair.right_child, pair.parent);
    }
    ranges_.reserve(header.leaf_count);
    leaves_.reserve(header.leaf_count);
    for (std::uint32_t i = 0; i < header.leaf_count; ++i) {
      const auto leaf = image.leaf(i);
      LeafGeometry geometry;
      for (int face = 0; face < 6; ++face) geometry.bound[face] = leaf.bound[face] * kPositionUnit;
      geometry.plane = leaf.bound;
      geometry.link = leaf.link;
      leaves_.push_back(geometry);
      ranges_.push_back({static_cast<std::uint32_t>(references_.size()), leaf.count});
      for (std::uint32_t r = 0; r < leaf.count; ++r) references_.push_back(image.reference(leaf, r));
    }
    triangles_.resize(header.triangle_count);
    top_ = {0, real_box(scene.box), header.max_depth};
    if (!scene.two_levels) {
      for (std::uint32_t i = 0; i < header.triangle_count; ++i) add_triangle(scene, image, i);
      return;
    }
    if (scene.instances.size() != header.instance_count)
      throw Error("golden engine: the image has other instances than the scene");
    std::vector<Tree> objects(scene.objects.size());
    std::vector<bool> known(scene.objects.size());
    for (std::uint32_t i = 0; i < header.instance_count; ++i) {
      const auto record = image.instance(i);
      const std::uint32_t object = scene.instances[i].record.root;
      if (!known[object]) {
        known[object] = true;
        objects[object] = {2 * record.root, real_box(scene.objects[object].box), 0};
        add_object(scene.objects[object], image, objects[object]);
      }
      instances_.push_back({record, objects[object]});
    }
  }

  std::string name() const override { return "golden"; }

  void trace(std::span<const GridRay> rays, std::span<Hit> hits, std::span<RayWork> work,
             const TraceOptions& options) override {
    if (hits.size() != rays.size() || (!work.empty() && work.size() != rays.size()))
      throw Error("golden engine: sizes of rays, hits and work differ");
    check_mailbox(options);
    in_parallel(rays.size(), options, [&](std::size_t i) {
      RayWork count;
      std::uint32_t number = 0;
      hits[i] = rays[i].outside ? Hit{} : trace_one(rays[i].record, options, count, number);
      if (!work.empty()) work[i] = count;
    });
  }

  /// Rays that enter the root box, into hits as a core gives them: t rounded down, with the number of the instance.
  void trace_placed(std::span<const contract::RayRecord> rays, std::span<contract::PlacedHitRecord> hits,
                    const TraceOptions& options) const {
    check_mailbox(options);
    in_parallel(rays.size(), options, [&](std::size_t i) {
      RayWork count;
      std::uint32_t number = 0;
      const Hit hit = trace_one(rays[i], options, count, number);
      hits[i] = {};
      hits[i].status = hit.status;
      hits[i].id = hit.id;
      if (!hit.hit()) return;
      hits[i].t = static_cast<std::uint32_t>(std::floor(std::ldexp(hit.t, contract::kTLimitFrac)));
      hits[i].number = number;
    });
  }

  Walk walk(const GridRay& ray, const TraceOptions& options) override {
    check_mailbox(options);
    if (options.way_up == WayUp::kStack) throw Error("golden engine: a walk is shown with parent or face links");
    Walk walk;
    const RayState state = ray_setup(ray.record);
    Candidate best{};
    best.t = state.t_max;
    RayWork work;
    Mailbox mailbox(options.mailbox);
    Watcher watcher{walk.calls};
    watcher.setup(state);
    if (!instances_.empty()) {
      std::uint32_t number = 0;
      walk.hit = trace_instances(ray.record, state, options, work, watcher, number);
      watcher.finish(walk.hit);
      find_levels(walk.calls);
      return walk;
    }
    walk_without_stack(
        top_, state, options.way_up == WayUp::kParentLinks, work, watcher,
        [&](std::uint32_t leaf) {
          return test_leaf(leaf, state, best, work, options.mailbox > 0 ? &mailbox : nullptr, watcher);
        },
        best.t);
    if (best.triangle != nullptr) walk.hit = hit_finish(best);
    watcher.finish(walk.hit);
    return walk;
  }

 private:
  /// `trace(i)` for every ray, on the threads that the options give.
  template <typename Trace>
  static void in_parallel(std::size_t rays, const TraceOptions& options, const Trace& trace) {
    tbb::task_arena arena(options.threads > 0 ? options.threads : tbb::task_arena::automatic);
    arena.execute([&] {
      tbb::parallel_for(tbb::blocked_range<std::size_t>(0, rays, kBlock), [&](const auto& range) {
        for (std::size_t i = range.begin(); i != range.end(); ++i) trace(i);
        if (options.done) *options.done += range.size();
      });
    });
  }

  static void check_mailbox(const TraceOptions& options) {
    if (options.mailbox < 0 || options.mailbox > Mailbox::kMaxEntries)
      throw Error("golden engine: mailbox must have 0 to " + std::to_string(Mailbox::kMaxEntries) + " entries");
  }

  static FastNode make_node(std::int32_t split, std::uint32_t axis, std::uint32_t child, std::uint32_t parent) {
    const bool leaf = axis == contract::kAxisLeaf;
    return {split * kPositionUnit, (leaf ? child : 2 * child) * 4 + axis, parent};
  }

  /// `number`: of the instance that is hit, where there are any.
  Hit trace_one(const contract::RayRecord& record, const TraceOptions& options, RayWork& work,
                std::uint32_t& number) const {
    const RayState ray = ray_setup(record);
    if (!instances_.empty()) return trace_instances(record, ray, options, work, Unwatched{}, number);
    Candidate best{};
    best.t = ray.t_max;
    search(top_, ray, options, best, work, Unwatched{});
    return best.triangle == nullptr ? Hit{} : hit_finish(best);
  }

  /// A tree of the image: its root, the cell of the root, and its depth.
  struct Tree {
    std::uint32_t root = 0;
    std::array<double, 6> box{};
    std::size_t depth = 0;
  };
  struct Instance {
    contract::InstanceRecord record;
    Tree tree;
  };

  static std::array<double, 6> real_box(const std::array<std::int32_t, 6>& codes) {
    std::array<double, 6> box{};
    for (std::size_t face = 0; face < 6; ++face) box[face] = codes[face] * kPositionUnit;
    return box;
  }

  void add_triangle(const GridScene& scene, const MemoryImage& image, std::uint32_t index) {
    const std::uint32_t id = image.triangle(index).id;
    const GridTriangle* found = find_triangle(scene.triangles, id);
    if (found == nullptr)
      throw Error("golden engine: triangle " + std::to_string(id) + " of the image is not in the scene");
    std::array<int, 3> order;
    make_unit_triangle(*found, &order);
    triangles_[index] = make_triangle(*found, order);
  }

  /// The triangles that the tree of an object refers to, and its depth.
  void add_object(const GridScene& object, const MemoryImage& image, Tree& tree) {
    struct Entry {
      std::uint32_t node;
      std::size_t depth;
    };
    std::vector<Entry> stack{{tree.root, 0}};
    while (!stack.empty()) {
      const auto [node, depth] = stack.back();
      stack.pop_back();
      tree.depth = std::max(tree.depth, depth);
      const FastNode& at = nodes_[node];
      if (!at.is_leaf()) {
        stack.push_back({at.child(), depth + 1});
        stack.push_back({at.child() + 1, depth + 1});
        continue;
      }
      const auto [first, count] = ranges_[at.child()];
      for (std::uint32_t i = first; i < first + count; ++i)
        if (triangles_[references_[i]].slack_depth == 0.0) add_triangle(object, image, references_[i]);
    }
  }

  /// The nearest hit of one tree that comes before `best`.
  template <typename Watch>
  void search(const Tree& tree, const RayState& ray, const TraceOptions& options, Candidate& best, RayWork& work,
              Watch watch) const {
    if (options.mailbox > 0) {
      Mailbox mailbox(options.mailbox);
      walk(
          tree, ray, options.way_up, work, watch,
          [&](std::uint32_t leaf) { return test_leaf(leaf, ray, best, work, &mailbox, watch); }, best.t);
    } else {
      walk(
          tree, ray, options.way_up, work, watch,
          [&](std::uint32_t leaf) { return test_leaf(leaf, ray, best, work, static_cast<Mailbox*>(nullptr), watch); },
          best.t);
    }
  }

  /// Two levels.
  template <typename Watch>
  Hit trace_instances(const contract::RayRecord& record, const RayState& ray, const TraceOptions& options,
                      RayWork& work, Watch watch, std::uint32_t& number_of_hit) const {
    constexpr int kInstanceMailbox = 4;
    Hit best;
    best.t = ray.t_max;
    double object_t = 0.0;
    std::uint32_t holder = contract::kNoTriangle, object_id = 0;
    Mailbox mailbox(kInstanceMailbox);
    std::vector<contract::InstanceRecord> records;
    if constexpr (Watch::kWatches)
      for (const Instance& instance : instances_) records.push_back(instance.record);
    /// Whether the ray went in.
    const auto enter = [&](std::uint32_t number) {
      const Instance& instance = instances_[number];
      // The whole ray: what is nearer than the best hit so far is decided in doubles.
      const auto in = instance_enter_in(instance.record, record, record.t_max + 1);
      const auto entry = instance_enter(in);
      if (!entry.enters) {
        if constexpr (Watch::kWatches) watch.enter(in, {}, records);
        return false;
      }
      RayState inside = ray_setup(object_ray(entry));
      inside.any = ray.any;
      const double start = entry.start * (1.0 / (1 << contract::kEntryStartFrac));
      Candidate candidate{};
      // A hit as near as the best one may still win.
      candidate.t = std::min(inside.t_max, std::ldexp(best.t, static_cast<int>(entry.scale)) - start);
      if constexpr (Watch::kWatches) watch.enter(in, candidate.t < 0.0 ? decltype(entry){} : entry, records);
      if (candidate.t < 0.0) return false;
      search(instance.tree, inside, options, candidate, work, watch);
      if (candidate.triangle == nullptr) return true;
      const double t = world_t(candidate.t, entry);
      const auto key = [](double world, std::uint32_t i, double object, std::uint32_t id) {
        return std::tuple(world, i, object, id);
      };
      if (best.hit() && key(t, number, candidate.t, candidate.triangle->id) > key(best.t, holder, object_t, object_id))
        return true;
      holder = number;
      object_t = candidate.t;
      object_id = candidate.triangle->id;
      best = hit_finish(candidate);
      best.id += instance.record.first_id;
      best.t = t;
      return true;
    };
    walk(
        top_, ray, options.way_up, work, watch,
        [&](std::uint32_t leaf) {
          ++work.leaf;
          StageCall at_leaf;
          if constexpr (Watch::kWatches) at_leaf = watch.calls.back();
          const auto [first, count] = ranges_[leaf];
          for (std::uint32_t i = first; i < first + count; ++i) {
            const std::uint32_t number = references_[i];
            // The object of the best hit has been searched to its end.
            if (number == holder || (options.mailbox > 0 && mailbox.find_or_add(number))) {
              ++work.skipped;
              continue;
            }
            const bool entered = enter(number);
            if (ray.any && best.hit()) return true;
            // Back from the object the leaf is read again, and left again.
            if constexpr (Watch::kWatches)
              if (entered) watch.calls.push_back(at_leaf);
          }
          return false;
        },
        best.t);
    if (!best.hit()) return {};
    number_of_hit = holder;
    return best;
  }

  /// `test(leaf)`: whether the ray is finished; `nearest`: how far the tree has to be searched.
  template <typename Watch, typename Test>
  void walk(const Tree& tree, const RayState& ray, WayUp way_up, RayWork& work, Watch watch, Test test,
            const double& nearest) const {
    if (way_up == WayUp::kStack) {
      walk_with_stack(tree, ray, work, test, nearest);
    } else {
      walk_without_stack(tree, ray, way_up == WayUp::kParentLinks, work, watch, test, nearest);
    }
  }

  /// Tests the references of a leaf. True if the ray is finished (any-hit).
  template <typename Watch>
  bool test_leaf(std::uint32_t leaf, const RayState& ray, Candidate& best, RayWork& work, Mailbox* mailbox,
                 Watch watch) const {
    const auto [first, count] = ranges_[leaf];
    ++work.leaf;
    for (std::uint32_t i = first; i < first + count; ++i) {
      const std::uint32_t index = references_[i];
      if (mailbox && mailbox->find_or_add(index)) {
        ++work.skipped;
        continue;
      }
      ++work.tests;
      const Triangle& triangle = triangles_[index];
      if constexpr (Watch::kWatches) watch.test(triangle, ray);
      if (&triangle == best.triangle) continue;  // the best hit so far, met again in the next leaf
      Candidate candidate;
      if (!tri_test(triangle, ray, best.t, candidate) || !is_nearer(candidate, best, ray)) continue;
      best = candidate;
      if (ray.any) return true;
    }
    return false;
  }

  /// The customary walk: far children that the segment reaches go on a stack with the segment's end.
  template <typename Test>
  void walk_with_stack(const Tree& tree, const RayState& ray, RayWork& work, Test test, const double& nearest) const {
    struct Entry {
      std::uint32_t node;
      double t, t_end;
    };
    constexpr std::size_t kInlineDepth = 96;
    std::array<Entry, kInlineDepth> small;
    std::vector<Entry> large;
    Entry* stack = small.data();
    if (tree.depth > kInlineDepth) {
      large.resize(tree.depth);
      stack = large.data();
    }
    std::size_t height = 0;
    std::uint32_t node = tree.root;
    double t = 0.0, t_end = leaf_exit(ray, tree.box).t_exit;
    while (true) {
      const FastNode& at = nodes_[node];
      if (!at.is_leaf()) {
        ++work.down;
        const int axis = at.axis();
        const double plane = t_plane(ray, axis, at.split);
        node = kd_descend(ray, axis, plane, at.child(), t);
        if (t < plane && plane < t_end) {
          stack[height++] = {node ^ 1u, plane, t_end};
          t_end = plane;
        }
        continue;
      }
      if (test(at.child()) || nearest <= t_end || height == 0) return;
      const Entry& entry = stack[--height];
      node = entry.node;
      t = entry.t;
      t_end = entry.t_end;
    }
  }

  /// kd-backtrack: no stack, no boxes; the exit face of the leaf names the ancestor to turn at.
  template <typename Watch, typename Test>
  void walk_without_stack(const Tree& tree, const RayState& ray, bool parent_links, RayWork& work, Watch watch,
                          Test test, const double& nearest) const {
    std::uint32_t node = tree.root;
    double t = 0.0;
    while (true) {
      while (!nodes_[node].is_leaf()) {
        ++work.down;
        const FastNode& at = nodes_[node];
        const int axis = at.axis();
        node = kd_descend(ray, axis, t_plane(ray, axis, at.split), at.child(), t);
        if constexpr (Watch::kWatches) watch.descend(at.split, t, node);
      }
      const std::uint32_t leaf = nodes_[node].child();
      const LeafExit exit = leaf_exit(ray, leaves_[leaf].bound);
      if constexpr (Watch::kWatches) watch.exit(leaves_[leaf], t, exit);
      // An object's ray may pass its root box by, within the tolerance of the entry.
      if (exit.t_exit < t) {
        assert(tree.root != 0);
        return;
      }
      if (test(leaf) || nearest <= exit.t_exit) return;
      t = exit.t_exit;
      if (parent_links) {
        if (!climb(tree.root, leaves_[leaf].plane[exit.face], exit.face, node, work, watch)) return;
      } else {
        node = leaves_[leaf].link[exit.face];
        if (node == 0) return;
      }
    }
  }

  /// Follows parent links from `node` to the far child of the ancestor whose plane is the exit face; false past the root.
  template <typename Watch>
  bool climb(std::uint32_t root, std::int32_t plane, int face, std::uint32_t& node, RayWork& work, Watch watch) const {
    while (node != root) {
      const std::uint32_t parent = nodes_[node].parent;
      const FastNode& at = nodes_[parent];
      ++work.up;
      const bool matched =
          kd_backtrack(face, plane, node, at.axis(), static_cast<std::int32_t>(at.split / kPositionUnit));
      const std::uint32_t far = at.child() + static_cast<std::uint32_t>(face & 1);
      if constexpr (Watch::kWatches) watch.climb(node, parent, matched, far);
      if (matched) {
        node = far;
        return true;
      }
      node = parent;
    }
    return false;
  }

  std::vector<FastNode> nodes_;
  std::vector<ReferenceRange> ranges_;
  std::vector<LeafGeometry> leaves_;
  std::vector<std::uint32_t> references_;
  std::vector<Triangle> triangles_;
  std::vector<Instance> instances_;
  Tree top_;
};

/// Rays and pixels are those of the unit in every bit; what is hit is what is true.
class GoldenPixels final : public PixelEngine {
 public:
  GoldenPixels(const GridScene& scene, const MemoryImage& image, const ShadeTable& table)
      : engine_(scene, image), box_(scene.box), table_(table) {}

  std::vector<std::uint32_t> draw(const contract::CameraRecord& camera, const contract::FrameRecord& frame,
                                  const TraceOptions& options) override {
    return draw_golden(
        camera, frame, box_, table_,
        [&](std::span<const contract::RayRecord> rays, std::span<contract::PlacedHitRecord> hits) {
          engine_.trace_placed(rays, hits, options);
        },
        &totals_);
  }
  const PixelTotals& totals() const override { return totals_; }

 private:
  GoldenEngine engine_;
  std::array<std::int32_t, 6> box_;
  ShadeTable table_;
  PixelTotals totals_;
};

}  // namespace

std::unique_ptr<Engine> make_golden_engine(const GridScene& scene, const MemoryImage& image) {
  return std::make_unique<GoldenEngine>(scene, image);
}

std::unique_ptr<PixelEngine> make_golden_pixels(const GridScene& scene, const MemoryImage& image,
                                                const ShadeTable& table) {
  return std::make_unique<GoldenPixels>(scene, image, table);
}

EngineKind golden_engine_kind() {
  EngineKind kind;
  kind.name = "golden";
  kind.help = "double precision on all cores: what is true";
  kind.fixed_point = false;
  kind.stack = true;
  kind.any_mailbox = true;
  kind.two_level = true;
  kind.instances = true;
  kind.shows_walks = true;
  kind.shows_entries = true;
  kind.make = [](const GridScene& scene, const MemoryImage& image, const std::string&) {
    return make_golden_engine(scene, image);
  };
  kind.make_pixels = [](const GridScene& scene, const MemoryImage& image, const ShadeTable& table, const std::string&) {
    return make_golden_pixels(scene, image, table);
  };
  return kind;
}

}  // namespace retrace
