// kd-tree builder: a full sweep of the surface area heuristic at every node (MacDonald & Booth 1990) over events that
// are sorted once and kept sorted (Wald & Havran 2006, section 4.3), with triangles clipped to their cells ("perfect
// splits"). Subtrees run in parallel on oneTBB; what a node becomes depends on that node alone, so the image is the
// same for any number of threads.
//
// Conservative references. Let W(c) be cell c widened by kWiden. A triangle T must be referenced from every leaf L with
// T and W(L) touching. At each ancestor A of L the builder keeps, for T, integer bounds on each axis
//     lo = floor(min) - kMargin,   hi = ceil(max) + kMargin      min, max: extent of T clipped to A widened by kClip
// and sends T left of a split s iff lo < s, right iff hi > s. With p a common point of T and W(L):
//   - kClip = kWiden + 1, so p lies deeper inside the clipping box than the error of the clipping (see clip_extent),
//   and min is at most
//     p + 2^-20. If L is on the left, p <= s + kWiden, hence floor(min) <= s + kWiden and lo <= s - 1 < s. The same on
//     the right.
//   - bounds that are inherited from an ancestor of A belong to a larger box, so they are looser.
// By induction T reaches L. A wall in the plane x = X has lo = X - kMargin, hi = X + kMargin on x: a split at either is
// clean, the wall is on one side of it, and there is no third "planar" case.
#include "kd_builder.hpp"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_invoke.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <limits>
#include <memory>

namespace retrace {
namespace {

using contract::LeafRecord;
using contract::NodePairRecord;
using contract::TriangleRecord;

constexpr std::int32_t kClip = contract::kWiden + 1;
constexpr std::int32_t kMargin = contract::kWiden + 1;
constexpr std::uint32_t kLeafAxis = contract::kAxisLeaf;
constexpr std::uint32_t kInline = contract::kLeafInline;
/// Nodes of at least this many triangles use several threads, and their children are tasks of their own.
constexpr std::size_t kParallel = 4096;
/// Deepest tree, whatever the options say: it bounds the recursion.
constexpr int kDeepest = 192;
/// Leaf size of the two median structures.
constexpr std::size_t kMedianLeaf = 4;

using Box = std::array<std::int32_t, 6>;  ///< by face

/// Integer bounds of a clipped triangle on the three axes, margin included.
struct Extent {
  std::int32_t lo[3], hi[3];
};

/// Extent of the triangle inside `cell` widened by kClip; false if the two do not touch.
///
/// Error (Sutherland & Hodgman 1974, in double). Coordinates are below 2^25 in size. A new vertex is a + t (b - a) with
/// a and b taken as exact; t has a relative error below 2^-50, so the vertex is off by less than 2^-24 however the edge
/// lies. The clipped polygon is therefore within 6 * 2^-24 of the exactly clipped one of the previous polygon, for six
/// planes: any point of the triangle that is one code inside the clipping box has a point of the computed polygon
/// within 2^-20.
bool clip_extent(const GridTriangle& triangle, const Box& cell, Extent& extent) {
  double buffer[2][9][3];
  double(*polygon)[3] = buffer[0];
  double(*next)[3] = buffer[1];
  int count = 3;
  double low[3], high[3];
  for (int axis = 0; axis < 3; ++axis) {
    low[axis] = high[axis] = polygon[0][axis] = triangle.vertices[0][axis];
    for (int i = 1; i < 3; ++i) {
      polygon[i][axis] = triangle.vertices[i][axis];
      low[axis] = std::min(low[axis], polygon[i][axis]);
      high[axis] = std::max(high[axis], polygon[i][axis]);
    }
  }
  bool cut = false;
  for (int face = 0; face < 6; ++face) {
    const int axis = face / 2;
    const bool upper = face & 1;
    const double plane = upper ? cell[face] + kClip : cell[face] - kClip;
    if (upper ? high[axis] <= plane : low[axis] >= plane) continue;
    if (upper ? low[axis] > plane : high[axis] < plane) return false;
    cut = true;
    // Positive: inside.
    const double sign = upper ? -1.0 : 1.0;
    int kept = 0;
    const double* a = polygon[count - 1];
    double inside_a = sign * (a[axis] - plane);
    for (int i = 0; i < count; ++i) {
      const double* b = polygon[i];
      const double inside_b = sign * (b[axis] - plane);
      if ((inside_a < 0) != (inside_b < 0)) {
        const double t = inside_a / (inside_a - inside_b);
        double* v = next[kept++];
        for (int k = 0; k < 3; ++k) v[k] = a[k] + t * (b[k] - a[k]);
        v[axis] = plane;
      }
      if (inside_b >= 0) {
        double* v = next[kept++];
        for (int k = 0; k < 3; ++k) v[k] = b[k];
      }
      a = b;
      inside_a = inside_b;
    }
    std::swap(polygon, next);
    count = kept;
    if (count == 0) return false;
    for (int k = 0; k < 3; ++k) {
      low[k] = high[k] = polygon[0][k];
      for (int i = 1; i < count; ++i) {
        low[k] = std::min(low[k], polygon[i][k]);
        high[k] = std::max(high[k], polygon[i][k]);
      }
    }
  }
  for (int axis = 0; axis < 3; ++axis) {
    extent.lo[axis] = static_cast<std::int32_t>(cut ? std::floor(low[axis]) : low[axis]) - kMargin;
    extent.hi[axis] = static_cast<std::int32_t>(cut ? std::ceil(high[axis]) : high[axis]) + kMargin;
  }
  return true;
}

/// One end of a triangle's bounds on one axis, as a number that sorts: position, then ends before starts, then the
/// triangle. Ends come first because a triangle that ends at s is not right of it, and one that starts at s not left of
/// it.
using Event = std::uint64_t;
constexpr std::uint32_t kEventBias = 1u << 26;
constexpr Event make_event(std::int32_t position, bool start, std::uint32_t reference) {
  return (static_cast<Event>(static_cast<std::uint32_t>(position) + kEventBias) << 33) |
         (static_cast<Event>(start) << 32) | reference;
}
constexpr std::int32_t position_of(Event event) {
  return static_cast<std::int32_t>(static_cast<std::uint32_t>(event >> 33) - kEventBias);
}
constexpr bool is_start(Event event) { return (event >> 32) & 1; }
constexpr std::uint32_t reference_of(Event event) { return static_cast<std::uint32_t>(event); }
constexpr Event with_reference(Event event, std::uint32_t reference) {
  return (event & ~Event{0xffffffffu}) | reference;
}

struct BuildNode {
  std::int32_t split = 0;
  std::uint32_t axis = kLeafAxis;
  BuildNode* children = nullptr;              ///< interior: two nodes side by side
  const std::uint32_t* references = nullptr;  ///< leaf: triangles, ascending
  std::uint32_t count = 0;
};

/// Memory of finished nodes and leaves; freed as a whole.
class Arena {
 public:
  template <typename T>
  T* allocate(std::size_t count) {
    const std::size_t bytes = (count * sizeof(T) + 15) / 16 * 16;
    if (bytes > left_) {
      const std::size_t block = std::max(bytes, kBlock);
      blocks_.push_back(std::make_unique_for_overwrite<std::byte[]>(block));
      at_ = blocks_.back().get();
      left_ = block;
    }
    T* result = reinterpret_cast<T*>(at_);
    at_ += bytes;
    left_ -= bytes;
    return std::uninitialized_default_construct_n(result, count), result;
  }

 private:
  static constexpr std::size_t kBlock = std::size_t{1} << 18;
  std::vector<std::unique_ptr<std::byte[]>> blocks_;
  std::byte* at_ = nullptr;
  std::size_t left_ = 0;
};

/// A node that is still to be split: its triangles and, by axis, their events. References in events index `triangles`.
struct Work {
  std::vector<std::uint32_t> triangles;
  std::vector<Event> events[3];
};

struct SplitChoice {
  double cost = std::numeric_limits<double>::infinity();
  std::uint32_t axis = kLeafAxis;
  std::int32_t position = 0;
};

constexpr std::uint8_t kLeft = 1, kRight = 2, kBoth = 3;

class Builder {
 public:
  Builder(const GridScene& scene, const BuildOptions& options) : scene_(scene), options_(options) {
    const double n = static_cast<double>(std::max<std::size_t>(scene.triangles.size(), 1));
    const int deepest =
        options.max_depth > 0 ? options.max_depth : static_cast<int>(std::lround(6 + 1.2 * std::log2(n)));
    max_depth_ = std::min(deepest, kDeepest);
  }

  void run(BuildNode& root) {
    const std::size_t n = scene_.triangles.size();
    Work work;
    work.triangles.resize(n);
    for (auto& events : work.events) events.resize(2 * n);
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, n, kParallel), [&](const auto& range) {
      for (std::size_t i = range.begin(); i != range.end(); ++i) {
        work.triangles[i] = static_cast<std::uint32_t>(i);
        const auto& v = scene_.triangles[i].vertices;
        for (int axis = 0; axis < 3; ++axis) {
          const std::int32_t lo = std::min({v[0][axis], v[1][axis], v[2][axis]}) - kMargin;
          const std::int32_t hi = std::max({v[0][axis], v[1][axis], v[2][axis]}) + kMargin;
          work.events[axis][2 * i] = make_event(lo, true, static_cast<std::uint32_t>(i));
          work.events[axis][2 * i + 1] = make_event(hi, false, static_cast<std::uint32_t>(i));
        }
      }
    });
    for (auto& events : work.events) tbb::parallel_sort(events.begin(), events.end());
    build(root, std::move(work), scene_.box, 0, 1.0);
  }

 private:
  void build(BuildNode& node, Work&& work, const Box& box, int depth, double share) {
    const std::size_t n = work.triangles.size();
    const SplitChoice choice = depth < max_depth_ ? choose(work, box) : SplitChoice{};
    if (choice.axis == kLeafAxis) {
      std::uint32_t* references = arenas_.local().allocate<std::uint32_t>(n);
      std::copy(work.triangles.begin(), work.triangles.end(), references);
      node.references = references;
      node.count = static_cast<std::uint32_t>(n);
      return report(share);
    }
    Box boxes[2] = {box, box};
    boxes[0][2 * choice.axis + 1] = choice.position;
    boxes[1][2 * choice.axis] = choice.position;
    Work children[2];
    distribute(work, choice, boxes, children);
    work = Work();

    node.split = choice.position;
    node.axis = choice.axis;
    node.children = arenas_.local().allocate<BuildNode>(2);
    const double left = static_cast<double>(children[0].triangles.size()),
                 right = static_cast<double>(children[1].triangles.size());
    const double left_share = share * (left + 1) / (left + right + 2);
    const auto build_child = [&](int side, double part) {
      build(node.children[side], std::move(children[side]), boxes[side], depth + 1, part);
    };
    if (n >= kParallel) {
      tbb::parallel_invoke([&] { build_child(0, left_share); }, [&] { build_child(1, share - left_share); });
    } else {
      build_child(0, left_share);
      build_child(1, share - left_share);
    }
  }

  SplitChoice choose(const Work& work, const Box& box) const {
    switch (options_.split) {
      case BuildOptions::Split::kSpatialMedian:
        return choose_spatial(work, box);
      case BuildOptions::Split::kObjectMedian:
        return choose_object(work, box);
      case BuildOptions::Split::kSah:
        break;
    }
    return choose_sah(work, box);
  }

  SplitChoice choose_sah(const Work& work, const Box& box) const {
    const std::size_t n = work.triangles.size();
    if (n == 0) return {};
    SplitChoice best[3];
    const auto sweep_axis = [&](int axis) { best[axis] = sweep(work.events[axis], n, box, axis); };
    if (n >= kParallel)
      tbb::parallel_for(0, 3, sweep_axis);
    else
      for (int axis = 0; axis < 3; ++axis) sweep_axis(axis);
    SplitChoice choice = best[0];
    for (int axis = 1; axis < 3; ++axis)
      if (best[axis].cost < choice.cost) choice = best[axis];
    return choice.cost < options_.intersection_cost * static_cast<double>(n) ? choice : SplitChoice{};
  }

  SplitChoice sweep(const std::vector<Event>& events, std::size_t n, const Box& box, int axis) const {
    const std::int32_t low = box[2 * axis], high = box[2 * axis + 1];
    const int b = (axis + 1) % 3, c = (axis + 2) % 3;
    const double size_b = box[2 * b + 1] - box[2 * b], size_c = box[2 * c + 1] - box[2 * c];
    // Half area of a slab of width x: cap + x * rim. Costs are kept times the half area of the box until the end.
    const double cap = size_b * size_c, rim = size_b + size_c;
    const double inverse = options_.intersection_cost / (cap + (static_cast<double>(high) - low) * rim);
    const double bonus = options_.empty_bonus;
    SplitChoice best;
    std::size_t left = 0, right = n;
    for (std::size_t i = 0; i < events.size();) {
      const std::int32_t at = position_of(events[i]);
      while (i < events.size() && position_of(events[i]) == at && !is_start(events[i])) --right, ++i;
      if (at > low && at < high) {
        const double x = static_cast<double>(at) - low, y = static_cast<double>(high) - at;
        const double sum = (cap + x * rim) * static_cast<double>(left) + (cap + y * rim) * static_cast<double>(right);
        double cost = options_.traversal_cost + sum * inverse;
        if (left == 0 || right == 0) cost *= bonus;
        if (cost < best.cost) best = {cost, static_cast<std::uint32_t>(axis), at};
      }
      while (i < events.size() && position_of(events[i]) == at) ++left, ++i;
    }
    return best;
  }

  static int widest_axis(const Box& box) {
    int widest = 0;
    for (int axis = 1; axis < 3; ++axis)
      if (box[2 * axis + 1] - box[2 * axis] > box[2 * widest + 1] - box[2 * widest]) widest = axis;
    return widest;
  }

  /// A median split, unless it lies on a side of the box or mostly duplicates triangles: coincident ones never part.
  static SplitChoice unless_useless(const Work& work, const Box& box, int axis, std::int32_t position) {
    if (position <= box[2 * axis] || position >= box[2 * axis + 1]) return {};
    std::size_t references = 0;
    for (Event event : work.events[axis])
      references += is_start(event) ? position_of(event) < position : position_of(event) > position;
    if (2 * references > 3 * work.triangles.size()) return {};
    return {0.0, static_cast<std::uint32_t>(axis), position};
  }

  /// The middle of the longest side.
  static SplitChoice choose_spatial(const Work& work, const Box& box) {
    if (work.triangles.size() <= kMedianLeaf) return {};
    const int axis = widest_axis(box);
    return unless_useless(work, box, axis, box[2 * axis] + (box[2 * axis + 1] - box[2 * axis]) / 2);
  }

  /// The median of the ends of the triangles' bounds along the longest side.
  static SplitChoice choose_object(const Work& work, const Box& box) {
    const std::size_t n = work.triangles.size();
    if (n <= kMedianLeaf) return {};
    const int axis = widest_axis(box);
    return unless_useless(work, box, axis, position_of(work.events[axis][n]));
  }

  /// Splits triangles and events between the children. Both lists stay in ascending order of triangle, so events stay
  /// sorted when their references are renumbered; only those of straddling triangles are new and are merged in.
  void distribute(const Work& work, const SplitChoice& choice, const Box boxes[2], Work children[2]) const {
    const std::size_t n = work.triangles.size();
    std::vector<std::uint8_t> sides(n, kBoth);
    for (Event event : work.events[choice.axis]) {
      if (is_start(event) ? position_of(event) >= choice.position : false) sides[reference_of(event)] = kRight;
      if (!is_start(event) && position_of(event) <= choice.position) sides[reference_of(event)] = kLeft;
    }
    std::vector<std::uint32_t> renumber(n);
    std::vector<Event> fresh[2][3];
    for (std::size_t i = 0; i < n; ++i) {
      const std::uint32_t triangle = work.triangles[i];
      if (sides[i] != kBoth) {
        Work& child = children[sides[i] == kRight];
        renumber[i] = static_cast<std::uint32_t>(child.triangles.size());
        child.triangles.push_back(triangle);
        continue;
      }
      for (int side = 0; side < 2; ++side) {
        Extent extent;
        if (!clip_extent(scene_.triangles[triangle], boxes[side], extent)) continue;
        const auto reference = static_cast<std::uint32_t>(children[side].triangles.size());
        children[side].triangles.push_back(triangle);
        for (int axis = 0; axis < 3; ++axis) {
          fresh[side][axis].push_back(make_event(extent.lo[axis], true, reference));
          fresh[side][axis].push_back(make_event(extent.hi[axis], false, reference));
        }
      }
    }
    const auto split_axis = [&](int axis) {
      for (int side = 0; side < 2; ++side) {
        auto& to = children[side].events[axis];
        auto& extra = fresh[side][axis];
        std::sort(extra.begin(), extra.end());
        to.reserve(2 * children[side].triangles.size());
        auto next = extra.begin();
        const std::uint8_t wanted = side == 0 ? kLeft : kRight;
        for (Event event : work.events[axis]) {
          const std::uint32_t reference = reference_of(event);
          if (sides[reference] != wanted) continue;
          const Event moved = with_reference(event, renumber[reference]);
          while (next != extra.end() && *next < moved) to.push_back(*next++);
          to.push_back(moved);
        }
        to.insert(to.end(), next, extra.end());
      }
    };
    if (n >= kParallel)
      tbb::parallel_for(0, 3, split_axis);
    else
      for (int axis = 0; axis < 3; ++axis) split_axis(axis);
  }

  void report(double share) {
    if (!options_.progress) return;
    const double before = done_.fetch_add(share), after = before + share;
    if (std::floor(after * 100) > std::floor(before * 100)) options_.progress(std::min(after, 1.0));
  }

  const GridScene& scene_;
  const BuildOptions& options_;
  int max_depth_;
  std::atomic<double> done_{0.0};
  tbb::enumerable_thread_specific<Arena> arenas_;
};

/// Numbers nodes, leaves and triangles depth first and writes the records.
class Emitter {
 public:
  explicit Emitter(const GridScene& scene) : scene_(scene), triangle_index_(scene.triangles.size(), kNone) {}

  MemoryImage run(const BuildNode& root) {
    for (int face = 0; face < 6; ++face) bound_[face] = scene_.box[face];
    pairs_.emplace_back();
    emit(root, 0, 0, 0);
    pairs_[0].right_split = pairs_[0].left_split;
    pairs_[0].right_axis = pairs_[0].left_axis;
    pairs_[0].right_child = pairs_[0].left_child;

    std::vector<TriangleRecord> triangles(order_.size());
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, order_.size(), kParallel), [&](const auto& range) {
      for (std::size_t i = range.begin(); i != range.end(); ++i)
        triangles[i] = make_unit_triangle(scene_.triangles[order_[i]]);
    });

    contract::HeaderRecord header;
    header.max_depth = max_depth_;
    header.step_limit = MemoryImage::step_limit(pairs_.size(), leaves_.size(), references_, leaf_depths_);
    for (int face = 0; face < 6; ++face) header.box[face] = static_cast<std::uint32_t>(scene_.box[face]);
    header.scale = std::bit_cast<std::uint64_t>(scene_.transform.scale);
    for (int i = 0; i < 3; ++i) header.center[i] = std::bit_cast<std::uint64_t>(scene_.transform.center[i]);
    return MemoryImage::assemble(header, pairs_, leaves_, list_, triangles);
  }

 private:
  void emit(const BuildNode& node, std::uint32_t index, std::uint32_t parent, std::uint32_t depth) {
    const bool leaf = node.axis == kLeafAxis;
    const auto child = static_cast<std::uint32_t>(leaf ? leaves_.size() : pairs_.size());
    if (child >= 1u << contract::kPairIndexBits)
      throw Error("kd-tree: more than " + std::to_string(1u << contract::kPairIndexBits) +
                  " node pairs or leaves, too many for a memory image");
    NodePairRecord& pair = pairs_[index >> 1];
    if (index & 1) {
      pair.right_split = node.split;
      pair.right_axis = node.axis;
      pair.right_child = child;
    } else {
      pair.left_split = node.split;
      pair.left_axis = node.axis;
      pair.left_child = child;
    }
    if (leaf) return emit_leaf(node, parent, depth);
    pairs_.emplace_back().parent = index;
    const std::uint32_t lower = 2 * node.axis, upper = lower + 1;
    for (std::uint32_t side = 0; side < 2; ++side) {
      // The left child ends at the split, beyond it lies the right child; and the other way round.
      const std::uint32_t face = side == 0 ? upper : lower;
      const std::int32_t bound = std::exchange(bound_[face], node.split);
      const std::uint32_t link = std::exchange(link_[face], 2 * child + 1 - side);
      emit(node.children[side], 2 * child + side, index, depth + 1);
      bound_[face] = bound;
      link_[face] = link;
    }
  }

  void emit_leaf(const BuildNode& node, std::uint32_t parent, std::uint32_t depth) {
    LeafRecord& leaf = leaves_.emplace_back();
    leaf.bound = bound_;
    leaf.link = link_;
    leaf.parent = parent;
    leaf.kind = contract::kKindTriangles;
    leaf.count = node.count;
    if (node.count > kInline) leaf.list_base = static_cast<std::uint32_t>(list_.size());
    for (std::uint32_t i = 0; i < node.count; ++i) {
      std::uint32_t& index = triangle_index_[node.references[i]];
      if (index == kNone) {
        index = static_cast<std::uint32_t>(order_.size());
        order_.push_back(node.references[i]);
      }
      if (i < kInline)
        leaf.refs[i] = index;
      else
        list_.push_back(index);
    }
    references_ += node.count;
    leaf_depths_ += depth;
    max_depth_ = std::max(max_depth_, depth);
  }

  const GridScene& scene_;
  std::array<std::int32_t, 6> bound_{};
  std::array<std::uint32_t, 6> link_{};
  std::vector<NodePairRecord> pairs_;
  std::vector<LeafRecord> leaves_;
  std::vector<std::uint32_t> list_;
  std::vector<std::uint32_t> triangle_index_;  ///< by scene triangle: its record
  std::vector<std::uint32_t> order_;           ///< by record: its scene triangle
  std::uint64_t references_ = 0, leaf_depths_ = 0;
  std::uint32_t max_depth_ = 0;
};

}  // namespace

MemoryImage build_kd(const GridScene& scene, const BuildOptions& options) {
  // A leaf's count has to fit as well as a triangle's index.
  constexpr std::size_t kMost = (std::size_t{1} << contract::kTriangleIndexBits) - 1;
  if (scene.triangles.size() > kMost)
    throw Error("kd-tree: " + std::to_string(scene.triangles.size()) + " triangles, a memory image holds at most " +
                std::to_string(kMost));
  BuildNode root;
  Builder builder(scene, options);
  builder.run(root);
  MemoryImage image = Emitter(scene).run(root);
  if (options.progress) options.progress(1.0);
  return image;
}

}  // namespace retrace
