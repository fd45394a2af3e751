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
#include <optional>
#include <span>
#include <stdexcept>
#include <utility>

#include "sah.hpp"

namespace retrace {
namespace {

using namespace kd;
using contract::LeafRecord;
using contract::NodePairRecord;
using contract::TriangleRecord;

constexpr std::int32_t kClip = contract::kWiden + 1;
constexpr std::int32_t kMargin = contract::kWiden + 1;
constexpr std::uint32_t kInline = contract::kLeafInline;
/// Nodes of at least this many triangles use several threads, and their children are tasks of their own.
constexpr std::size_t kParallel = 4096;
/// Deepest tree, whatever the options say: it bounds the recursion.
/// Allowance of a pass that is not limited node by node.
constexpr std::int64_t kUnlimited = std::numeric_limits<std::int64_t>::max();

/// Integer bounds of a clipped triangle on the three axes, margin included.
struct Extent {
  std::int32_t lo[3], hi[3];
};

/// Extent of the whole triangle.
Extent whole_extent(const GridTriangle& triangle) {
  const auto& v = triangle.vertices;
  Extent extent;
  for (int axis = 0; axis < 3; ++axis) {
    extent.lo[axis] = std::min({v[0][axis], v[1][axis], v[2][axis]}) - kMargin;
    extent.hi[axis] = std::max({v[0][axis], v[1][axis], v[2][axis]}) + kMargin;
  }
  return extent;
}

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

struct BuildNode {
  std::int32_t split = 0;
  std::uint32_t axis = kLeafAxis;
  BuildNode* children = nullptr;              ///< interior: two nodes side by side
  const std::uint32_t* references = nullptr;  ///< leaf: triangles, ascending
  std::uint32_t count = 0;
};

/// Memory that is handed out in order. Finished nodes stay until the end; scratch is given back to a mark, last in,
/// first out.
class Arena {
 public:
  template <typename T>
  T* allocate(std::size_t count) {
    static_assert(std::is_trivially_destructible_v<T> && alignof(T) <= kAlign);
    const std::size_t bytes = (count * sizeof(T) + kAlign - 1) / kAlign * kAlign;
    if (blocks_.empty() || bytes > blocks_[mark_.block].size - mark_.offset) next_block(bytes);
    T* result = reinterpret_cast<T*>(blocks_[mark_.block].memory.get() + mark_.offset);
    mark_.offset += bytes;
    std::uninitialized_default_construct_n(result, count);
    return result;
  }

  struct Mark {
    std::size_t block = 0, offset = 0;
  };
  Mark mark() const { return mark_; }
  void release(Mark mark) { mark_ = mark; }

 private:
  static constexpr std::size_t kAlign = 16, kBlock = std::size_t{1} << 18;
  struct Block {
    std::unique_ptr<std::byte[]> memory;
    std::size_t size;
  };

  /// A block that was released before is used again if it is large enough, and replaced if not: nothing above the mark
  /// is alive.
  void next_block(std::size_t bytes) {
    const std::size_t next = blocks_.empty() ? 0 : mark_.block + 1;
    if (next == blocks_.size() || blocks_[next].size < bytes) {
      const std::size_t size = std::max(bytes, kBlock);
      blocks_.resize(next);
      blocks_.push_back({std::make_unique_for_overwrite<std::byte[]>(size), size});
    }
    mark_ = {next, 0};
  }

  std::vector<Block> blocks_;
  Mark mark_;
};

/// A node that is still to be split: its triangles, ascending, and by axis their events. References in events index
/// `triangles`.
struct Work {
  std::size_t count = 0;
  std::uint32_t* triangles = nullptr;
  std::array<Event*, 3> events{};  ///< 2 * count each, ascending

  void allocate(Arena& arena, std::size_t n) {
    count = n;
    triangles = arena.allocate<std::uint32_t>(n);
    allocate_events(arena);
  }
  /// One more than needed: distribute() writes where the next event may go before it knows whether there is one.
  void allocate_events(Arena& arena) {
    for (auto& e : events) e = arena.allocate<Event>(2 * count + 1);
  }
  std::span<const Event> sorted(int axis) const { return {events[axis], 2 * count}; }
};

/// The largest fraction that was reported so far: a second pass reports only what is beyond the first.
class ProgressMark {
 public:
  explicit ProgressMark(const std::function<void(double)>& progress) : progress_(progress) {}
  void raise(double fraction) {
    if (!progress_) return;
    const int percent = static_cast<int>(std::floor(std::min(fraction, 1.0) * 100));
    int before = percent_.load();
    while (percent > before) {
      if (percent_.compare_exchange_weak(before, percent)) return progress_(std::min(fraction, 1.0));
    }
  }

 private:
  const std::function<void(double)>& progress_;
  std::atomic<int> percent_{0};
};

/// One pass over the scene. A split costs one unit of the budget, and one more for each triangle that it sends to both
/// children.
///   kShared   splits are chosen by the heuristic alone; the pass fails as soon as all of them together exceed the
///             budget. The sum does not depend on the order of the nodes, so neither does the outcome.
///   kByNode   each node has a budget of its own, pays for its split and leaves the rest to its children. It takes the
///             best split that it can pay for, so this pass always succeeds.
class Builder {
 public:
  enum class Limit { kShared, kByNode };

  Builder(const GridScene& scene, const BuildOptions& options, Limit limit, std::int64_t budget, ProgressMark& progress)
      : scene_(scene), options_(options), limit_(limit), budget_(budget), progress_(progress) {
    const double n = static_cast<double>(std::max<std::size_t>(scene.triangles.size(), 1));
    const int deepest =
        options.max_depth > 0 ? options.max_depth : static_cast<int>(std::lround(6 + 1.2 * std::log2(n)));
    max_depth_ = std::min(deepest, kMaxTreeDepth);
  }

  /// False if the budget was exceeded; `root` is of no use then.
  bool run(BuildNode& root) {
    const std::size_t n = scene_.triangles.size();
    Arena arena;
    Work work;
    work.allocate(arena, n);
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, n, kParallel), [&](const auto& range) {
      for (std::size_t i = range.begin(); i != range.end(); ++i) {
        const auto reference = static_cast<std::uint32_t>(i);
        work.triangles[i] = reference;
        const Extent whole = whole_extent(scene_.triangles[i]);
        for (int axis = 0; axis < 3; ++axis) {
          work.events[axis][2 * i] = make_event(whole.lo[axis], true, reference);
          work.events[axis][2 * i + 1] = make_event(whole.hi[axis], false, reference);
        }
      }
    });
    for (Event* events : work.events) tbb::parallel_sort(events, events + 2 * n);
    const std::int64_t allowance = limit_ == Limit::kShared ? kUnlimited : budget_;
    build_large(root, work, std::move(arena), scene_.box, {0, allowance, 1.0});
    return !exceeded_;
  }

  /// Adds what this pass did.
  void count(BuildWork& work) {
    for (const Local& local : local_) {
      work.candidates += local.work.candidates;
      work.moved_events += local.work.moved_events;
      work.clipped += local.work.clipped;
    }
  }

 private:
  /// Memory of one thread.
  struct Local {
    Arena nodes;      ///< finished nodes and references of leaves
    Arena scratch;    ///< work of the nodes between the current one and the root of its subtree
    Arena temporary;  ///< of one call of distribute()
    BuildWork work;
  };

  /// What a node is given besides its triangles and its box.
  struct Place {
    int depth;
    std::int64_t allowance;  ///< units of the budget for this node and all below it
    double share;            ///< of the whole work, for the progress
  };

  // -------------------------------------------------------------------------------------------- recursion

  /// A node whose work lies in an arena of its own, which is freed before the children are built. Its children are
  /// tasks.
  void build_large(BuildNode& node, const Work& work, Arena arena, const Box& box, const Place& place) {
    if (work.count < kParallel) return build_small(node, work, box, place);
    const SplitChoice choice = choose(work, box, place, local_.local());
    if (choice.axis == kLeafAxis) {
      make_leaf(node, work, local_.local());
      return report(place.share);
    }
    const std::array<Box, 2> boxes = child_boxes(box, choice);
    Work children[2];
    Arena arenas[2];
    std::int64_t price;
    {
      Arena scratch;
      price = distribute(work, choice, boxes, children, {&arenas[0], &arenas[1]}, scratch, local_.local().work);
    }
    if (exceeded_) return;
    arena = Arena();
    make_interior(node, choice, local_.local());
    const std::array<Place, 2> places = child_places(place, price, children, boxes);
    const auto child = [&](int side) {
      build_large(node.children[side], children[side], std::move(arenas[side]), boxes[side], places[side]);
    };
    tbb::parallel_invoke([&] { child(0); }, [&] { child(1); });
  }

  /// A node that one thread builds to the end. The work of its descendants lies in the thread's scratch memory.
  void build_small(BuildNode& node, const Work& work, const Box& box, const Place& place) {
    build_serial(node, work, box, place, local_.local());
    report(place.share);
  }

  void build_serial(BuildNode& node, const Work& work, const Box& box, const Place& place, Local& local) {
    const SplitChoice choice = choose(work, box, place, local);
    if (choice.axis == kLeafAxis) return make_leaf(node, work, local);
    const std::array<Box, 2> boxes = child_boxes(box, choice);
    const Arena::Mark mark = local.scratch.mark();
    Work children[2];
    const std::int64_t price =
        distribute(work, choice, boxes, children, {&local.scratch, &local.scratch}, local.temporary, local.work);
    if (exceeded_) return;
    make_interior(node, choice, local);
    const std::array<Place, 2> places = child_places(place, price, children, boxes);
    for (int side = 0; side < 2; ++side)
      build_serial(node.children[side], children[side], boxes[side], places[side], local);
    local.scratch.release(mark);
  }

  static std::array<Box, 2> child_boxes(const Box& box, const SplitChoice& choice) {
    std::array<Box, 2> boxes{box, box};
    boxes[0][2 * choice.axis + 1] = choice.position;
    boxes[1][2 * choice.axis] = choice.position;
    return boxes;
  }

  /// Shares go by the number of triangles. So does half of what is left of the allowance; the other half goes by the
  /// expected number of tests, because that is what further splits save.
  static std::array<Place, 2> child_places(const Place& place, std::int64_t price, const Work children[2],
                                           const std::array<Box, 2>& boxes) {
    const double left = static_cast<double>(children[0].count), right = static_cast<double>(children[1].count);
    const double share = (left + 1) / (left + right + 2);
    std::array<Place, 2> places;
    places.fill({place.depth + 1, place.allowance, place.share * share});
    places[1].share = place.share * (1 - share);
    if (place.allowance == kUnlimited) return places;
    const std::int64_t rest = place.allowance - price;
    double part = 0;
    if (left + right > 0) {
      const double tests_left = left * half_area(boxes[0]), tests_right = right * half_area(boxes[1]);
      part = 0.5 * left / (left + right) + 0.5 * tests_left / (tests_left + tests_right);
    }
    places[0].allowance = std::min(rest, static_cast<std::int64_t>(static_cast<double>(rest) * part));
    places[1].allowance = rest - places[0].allowance;
    return places;
  }

  static double half_area(const Box& box) {
    const double x = box[1] - box[0], y = box[3] - box[2], z = box[5] - box[4];
    return x * y + y * z + z * x;
  }

  static void make_interior(BuildNode& node, const SplitChoice& choice, Local& local) {
    node.split = choice.position;
    node.axis = choice.axis;
    node.children = local.nodes.allocate<BuildNode>(2);
  }

  static void make_leaf(BuildNode& node, const Work& work, Local& local) {
    std::uint32_t* references = local.nodes.allocate<std::uint32_t>(work.count);
    std::copy_n(work.triangles, work.count, references);
    node.references = references;
    node.count = static_cast<std::uint32_t>(work.count);
  }

  /// Calls f(axis) for the three axes, in parallel where there is enough to do.
  template <typename F>
  static void for_axes(std::size_t count, F&& f) {
    if (count < kParallel)
      for (int axis = 0; axis < 3; ++axis) f(axis);
    else
      tbb::parallel_for(0, 3, f);
  }

  // -------------------------------------------------------------------------------------------- where to split

  SplitChoice choose(const Work& work, const Box& box, const Place& place, Local& local) const {
    if (place.depth >= max_depth_ || work.count == 0 || place.allowance < 1 || exceeded_) return {};
    local.work.candidates += 6 * work.count;
    if (options_.split != BuildOptions::Split::kSah) {
      const int axis = widest_axis(box);
      return options_.split == BuildOptions::Split::kSpatialMedian
                 ? spatial_median_split(work.sorted(axis), box, axis, place.allowance)
                 : object_median_split(work.sorted(axis), box, axis, place.allowance);
    }
    SplitChoice best[3];
    for_axes(work.count,
             [&](int axis) { best[axis] = sah_split(work.sorted(axis), box, axis, place.allowance, options_); });
    SplitChoice choice = best[0];
    for (int axis = 1; axis < 3; ++axis)
      if (best[axis].cost < choice.cost) choice = best[axis];
    return choice.cost < options_.intersection_cost * static_cast<double>(work.count) ? choice : SplitChoice{};
  }

  // -------------------------------------------------------------------------------------------- splitting

  /// What becomes of a triangle: where it goes, and its number there. A straddling one goes nowhere, its parts are new.
  static constexpr std::uint32_t kStraddles = 0, kLeft = 1u << 30, kRight = 1u << 31, kNumber = kLeft - 1;

  /// Splits triangles and events between the children. Triangles stay in ascending order, so events stay sorted when
  /// their references are renumbered; only those of straddling triangles are new, and are merged in. Returns what the
  /// split costs; if that exceeds the shared budget, the children are left as they are.
  std::int64_t distribute(const Work& work, const SplitChoice& choice, const std::array<Box, 2>& boxes,
                          Work children[2], const std::array<Arena*, 2>& arenas, Arena& temporary,
                          BuildWork& counters) {
    const Arena::Mark mark = temporary.mark();
    std::uint32_t* fate = temporary.allocate<std::uint32_t>(work.count);
    // Events that sort before `middle` are left of the split, or end at it. An end among them belongs to a triangle on
    // the left, a start among the others to one on the right. The last write to a triangle decides, and of a straddling
    // one only the far halves are seen.
    const std::span<const Event> events = work.sorted(static_cast<int>(choice.axis));
    const auto middle = std::lower_bound(events.begin(), events.end(), make_event(choice.position, true, 0));
    for (auto e = events.begin(); e != middle; ++e) fate[reference_of(*e)] = is_start(*e) ? kStraddles : kLeft;
    for (auto e = events.end(); e != middle;) {
      --e;
      fate[reference_of(*e)] = is_start(*e) ? kRight : kStraddles;
    }
    std::size_t straddling = 0, most[2] = {0, 0};
    for (std::size_t i = 0; i < work.count; ++i) {
      straddling += fate[i] == kStraddles;
      most[0] += fate[i] != kRight;
      most[1] += fate[i] != kLeft;
    }
    const std::int64_t price = static_cast<std::int64_t>(straddling) + 1;
    if (limit_ == Limit::kShared && spent_.fetch_add(price) + price > budget_) exceeded_ = true;
    if (exceeded_) {
      temporary.release(mark);
      return price;
    }
    counters.moved_events += 6 * work.count;
    counters.clipped += 2 * straddling;

    Event* fresh[2][3];
    std::size_t fresh_count[2] = {0, 0};
    for (int side = 0; side < 2; ++side) {
      children[side].triangles = arenas[side]->allocate<std::uint32_t>(most[side]);
      for (Event*& f : fresh[side]) f = temporary.allocate<Event>(2 * straddling);
    }
    for (std::size_t i = 0; i < work.count; ++i) {
      const std::uint32_t triangle = work.triangles[i];
      if (fate[i] != kStraddles) {
        Work& child = children[fate[i] == kRight];
        fate[i] |= static_cast<std::uint32_t>(child.count);
        child.triangles[child.count++] = triangle;
        continue;
      }
      for (int side = 0; side < 2; ++side) {
        Extent extent;
        if (!options_.clip) {
          extent = whole_extent(scene_.triangles[triangle]);
        } else if (!clip_extent(scene_.triangles[triangle], boxes[side], extent)) {
          continue;
        }
        Work& child = children[side];
        const auto reference = static_cast<std::uint32_t>(child.count);
        child.triangles[child.count++] = triangle;
        for (int axis = 0; axis < 3; ++axis) {
          fresh[side][axis][fresh_count[side]] = make_event(extent.lo[axis], true, reference);
          fresh[side][axis][fresh_count[side] + 1] = make_event(extent.hi[axis], false, reference);
        }
        fresh_count[side] += 2;
      }
    }
    for (int side = 0; side < 2; ++side) children[side].allocate_events(*arenas[side]);

    for_axes(work.count, [&](int axis) {
      Event* const left = children[0].events[axis];
      Event* const right = children[1].events[axis];
      std::size_t left_count = 0, right_count = 0;
      for (const Event event : work.sorted(axis)) {
        const std::uint32_t to = fate[reference_of(event)];
        const Event moved = with_reference(event, to & kNumber);
        left[left_count] = moved;
        left_count += (to & kLeft) != 0;
        right[right_count] = moved;
        right_count += (to & kRight) != 0;
      }
      merge(left, left_count, fresh[0][axis], fresh_count[0]);
      merge(right, right_count, fresh[1][axis], fresh_count[1]);
    });
    temporary.release(mark);
    return price;
  }

  /// Merges `fresh` into the sorted `events`, which have room for them, from the back.
  static void merge(Event* events, std::size_t count, Event* fresh, std::size_t fresh_count) {
    std::sort(fresh, fresh + fresh_count);
    std::size_t to = count + fresh_count;
    while (fresh_count > 0) {
      if (count > 0 && events[count - 1] > fresh[fresh_count - 1])
        events[--to] = events[--count];
      else
        events[--to] = fresh[--fresh_count];
    }
  }

  void report(double share) { progress_.raise(done_.fetch_add(share) + share); }

  const GridScene& scene_;
  const BuildOptions& options_;
  const Limit limit_;
  const std::int64_t budget_;
  ProgressMark& progress_;
  int max_depth_;
  std::atomic<double> done_{0.0};
  std::atomic<std::int64_t> spent_{0};  ///< of the shared budget
  std::atomic<bool> exceeded_{false};
  tbb::enumerable_thread_specific<Local> local_;
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
    // A leaf's split is its size code.
    const auto split =
        leaf ? static_cast<std::int32_t>(std::min<std::uint32_t>(node.count, contract::kLeafLong)) : node.split;
    NodePairRecord& pair = pairs_[index >> 1];
    if (index & 1) {
      pair.right_split = split;
      pair.right_axis = node.axis;
      pair.right_child = child;
    } else {
      pair.left_split = split;
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

MemoryImage build_kd(const GridScene& scene, const BuildOptions& options, BuildWork* counters) {
  // A leaf's count has to fit as well as a triangle's index.
  constexpr std::size_t kMost = (std::size_t{1} << contract::kTriangleIndexBits) - 1;
  if (scene.triangles.size() > kMost)
    throw Error("kd-tree: " + std::to_string(scene.triangles.size()) + " triangles, a memory image holds at most " +
                std::to_string(kMost));
  const double budget = options.budget * static_cast<double>(std::max<std::size_t>(scene.triangles.size(), 1));
  if (!(budget >= 0 && budget < 0x1p62))
    throw std::invalid_argument("budget of a kd-tree: a multiple of the triangles");
  ProgressMark progress(options.progress);
  BuildWork work;
  BuildNode root;
  std::optional<Builder> builder;
  for (const Builder::Limit limit : {Builder::Limit::kShared, Builder::Limit::kByNode}) {
    root = {};
    builder.emplace(scene, options, limit, static_cast<std::int64_t>(budget), progress);
    const bool done = builder->run(root);
    builder->count(work);
    if (done) break;
    work.limited = true;
  }
  MemoryImage image = Emitter(scene).run(root);
  if (options.progress) options.progress(1.0);
  if (counters) *counters = work;
  return image;
}

}  // namespace retrace
