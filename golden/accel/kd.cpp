// kd-tree traversals over the project's memory image, in double precision. All read the same nodes, leaves and
// triangles; they differ in how they find the next leaf:
//   stack                        MacDonald & Booth 1990; V. Havran, Heuristic ray shooting algorithms, 2000
//   short stack, push-down       D. Horn et al., Interactive k-d tree GPU raytracing, I3D 2007
//   restart, backtrack by boxes  T. Foley, J. Sugerman, KD-tree acceleration structures for a GPU raytracer, GH 2005
//   backtrack by plane match     this project's (docs/memory-image.md)
//   face links                   this project's, too
//
// Bytes: 16 a node pair on the way down and up; of a leaf record what the walk needs (KdTree::LeafUse), 0 to 24 with a
// stack and 40 to 64 without; 4 a reference beyond the record's; 48 a triangle; 24 a node box, which only the backtrack
// with boxes needs.
#include "kd.hpp"

#include <algorithm>

namespace retrace::accel {

KdTree::KdTree(const MemoryImage& image, const TriangleSet& set) {
  const contract::HeaderRecord& header = image.header();
  constexpr std::uint64_t line = MemoryImage::kLineWords * 8;
  pair_base_ = header.pair_offset * line, leaf_base_ = header.leaf_offset * line,
  list_base_ = header.list_offset * line;
  triangle_base_ = header.triangle_offset * line, box_base_ = header.lines * line;
  for (int a = 0; a < 3; ++a) {
    box_.lower[a] = static_cast<std::int32_t>(header.box[2 * a]) * 0x1p-24;
    box_.upper[a] = static_cast<std::int32_t>(header.box[2 * a + 1]) * 0x1p-24;
  }
  for (std::uint32_t i = 0; i < header.pair_count; ++i) {
    const contract::NodePairRecord p = image.pair(i);
    nodes_.push_back({p.left_split * 0x1p-24, p.left_child, static_cast<std::uint8_t>(p.left_axis)});
    nodes_.push_back({p.right_split * 0x1p-24, p.right_child, static_cast<std::uint8_t>(p.right_axis)});
    parents_.push_back(p.parent);
  }
  for (std::uint32_t i = 0; i < header.leaf_count; ++i) {
    const contract::LeafRecord r = image.leaf(i);
    Leaf leaf{};
    for (int f = 0; f < 6; ++f) leaf.bound[f] = r.bound[f] * 0x1p-24, leaf.link[f] = r.link[f];
    leaf.parent = r.parent, leaf.count = r.count, leaf.list_base = r.list_base;
    leaf.first = static_cast<std::uint32_t>(references_.size());
    for (std::uint32_t k = 0; k < r.count; ++k) references_.push_back(image.reference(r, k));
    leaves_.push_back(leaf);
  }
  for (std::uint32_t i = 0; i < header.triangle_count; ++i) {
    const std::uint32_t id = image.triangle(i).id;
    const Triangle* triangle = find_triangle(set.triangles, id);
    if (triangle == nullptr) throw Error("kd-tree: the image is of another scene");
    triangles_.push_back(*triangle);
  }
  node_boxes_.resize(nodes_.size(), box_);
  std::vector<std::uint32_t> todo{0};
  while (!todo.empty()) {
    const std::uint32_t i = todo.back();
    todo.pop_back();
    const Node& n = nodes_[i];
    if (n.is_leaf()) continue;
    node_boxes_[n.left()] = node_boxes_[n.left() + 1] = node_boxes_[i];
    node_boxes_[n.left()].upper[n.axis] = node_boxes_[n.left() + 1].lower[n.axis] = n.split;
    todo.push_back(n.left()), todo.push_back(n.left() + 1);
  }
}

Footprint KdTree::footprint(bool boxes) const {
  std::uint64_t list = 0;
  for (const Leaf& leaf : leaves_) list += leaf.count > contract::kLeafInline ? leaf.count - contract::kLeafInline : 0;
  return {.nodes = parents_.size() * 16 + (boxes ? nodes_.size() * 24 : 0),
          .leaves = leaves_.size() * 64,
          .references = list * 4,
          .triangles = triangles_.size() * Probe::kTriangleStride};
}

std::shared_ptr<const KdTree> decode_kd(const MemoryImage& image, const TriangleSet& set) {
  return std::make_shared<const KdTree>(image, set);
}

namespace {

constexpr std::size_t kDeepest = 256;  // above what the builder allows

/// A ray as the walks see it.
struct Walk {
  const Ray& ray;
  glm::dvec3 inverse;
  double t_plane(int axis, double plane) const { return (plane - ray.origin[axis]) * inverse[axis]; }
  /// The child the ray meets first: 0 left, 1 right. With d = 0 the one that holds the ray; a ray in the plane counts
  /// as right.
  int near_side(const KdTree::Node& n) const {
    const double d = ray.direction[n.axis];
    return d > 0.0 ? 0 : d < 0.0 ? 1 : ray.origin[n.axis] < n.split ? 0 : 1;
  }
  /// Where the ray leaves a box: the smallest t of the three exit sides; the lowest axis on a tie.
  double exit(const double* lower_upper, int& face) const {
    double t = kInfinity;
    face = -1;
    for (int a = 0; a < 3; ++a) {
      const double d = ray.direction[a];
      if (d == 0.0) continue;
      const int f = 2 * a + (d > 0.0 ? 1 : 0);
      const double x = t_plane(a, lower_upper[f]);
      if (x < t) t = x, face = f;
    }
    return t;
  }
};

class KdStructure : public Structure {
 public:
  explicit KdStructure(std::shared_ptr<const KdTree> tree, bool boxes) : tree_(std::move(tree)), boxes_(boxes) {}
  bool duplicates_references() const override { return true; }
  std::size_t size() const override { return tree_->triangles(); }
  std::size_t references() const override { return tree_->references(); }
  Footprint footprint() const override { return tree_->footprint(boxes_); }

 protected:
  std::shared_ptr<const KdTree> tree_;
  bool boxes_;
};

/// Stack of `Entries` entries (0: as deep as a tree can be); a short one drops its oldest entry
/// when full and the walk restarts when an entry is missing. 0 entries and `restart` is kd-restart.
class StackWalk final : public KdStructure {
 public:
  enum class Mode { kFull, kShort, kRestart };
  StackWalk(std::shared_ptr<const KdTree> tree, Mode mode, int entries)
      : KdStructure(std::move(tree), false), mode_(mode), entries_(entries) {}

  Hit trace(const Ray& ray, Probe& probe) const override {
    probe.begin_ray();
    Hit best = no_hit(ray);
    const ClippedRay clip(ray, tree_->box());
    if (!clip.ok) return Hit{};
    const Walk walk{ray, clip.inverse};
    struct Entry {
      std::uint32_t node;
      double t_min, t_max;
    };
    std::array<Entry, kDeepest> stack;  // ring of entries_ in short mode
    std::uint32_t top = 0, held = 0;
    bool lost = false;  // an entry was dropped, so an empty stack does not mean the end
    std::uint32_t start = 0, node = 0;
    double t_min = clip.t_min, t_max = clip.t_max;
    bool push_down = mode_ == Mode::kShort;
    for (;;) {
      for (;;) {
        const KdTree::Node& n = tree_->node(node);
        tree_->touch_pair(probe, node);
        if (n.is_leaf()) break;
        ++probe.work.down;
        const int near = walk.near_side(n);
        const double d = ray.direction[n.axis];
        const double t = d == 0.0 ? kInfinity : walk.t_plane(n.axis, n.split);
        if (t <= t_min) {
          node = n.left() + (1 - near);
        } else if (t >= t_max) {
          node = n.left() + near;
        } else {
          const Entry far{n.left() + (1 - near), t, t_max};
          if (mode_ == Mode::kFull) {
            if (held == stack.size()) throw Error("kd-tree: deeper than any the builder makes");
            stack[held++] = far;
          } else if (mode_ == Mode::kShort) {
            stack[top] = far;
            top = (top + 1) % entries_;
            if (held == static_cast<std::uint32_t>(entries_))
              lost = true;
            else
              ++held;
          } else {
            lost = true;
          }
          push_down = false;
          node = n.left() + near;
          t_max = t;
        }
        if (push_down) start = node;
      }
      const KdTree::Leaf& leaf = tree_->leaf(tree_->node(node).child);
      ++probe.work.leaf;
      tree_->touch_leaf(probe, tree_->node(node).child, KdTree::LeafUse::kReferences);
      if (tree_->test_leaf(ray, leaf, probe, best)) return best;
      if (best.t <= t_max) break;
      if (held > 0) {
        Entry e;
        if (mode_ == Mode::kFull) {
          e = stack[--held];
        } else {
          top = (top + entries_ - 1) % entries_;
          --held;
          e = stack[top];
        }
        node = e.node, t_min = e.t_min, t_max = e.t_max;
        push_down = false;
      } else if (lost && t_max < clip.t_max) {
        ++probe.work.restarts;
        node = start, t_min = t_max, t_max = clip.t_max;
        push_down = mode_ == Mode::kShort;
        lost = false;
      } else {
        break;
      }
    }
    return finished(best);
  }

 private:
  Mode mode_;
  int entries_;
};

/// No stack: after a leaf the walk goes on from where it left the cell, found by parent links or a link of the leaf.
class LinkWalk final : public KdStructure {
 public:
  LinkWalk(std::shared_ptr<const KdTree> tree, KdTraversal mode)
      : KdStructure(std::move(tree), mode == KdTraversal::kBacktrackBoxes), mode_(mode) {}

  Hit trace(const Ray& ray, Probe& probe) const override {
    probe.begin_ray();
    Hit best = no_hit(ray);
    const ClippedRay clip(ray, tree_->box());
    if (!clip.ok) return Hit{};
    const Walk walk{ray, clip.inverse};
    std::uint32_t node = 0;
    double t = clip.t_min;
    for (;;) {
      for (;;) {
        const KdTree::Node& n = tree_->node(node);
        tree_->touch_pair(probe, node);
        if (n.is_leaf()) break;
        ++probe.work.down;
        const int near = walk.near_side(n);
        const bool far = ray.direction[n.axis] != 0.0 && walk.t_plane(n.axis, n.split) <= t;
        node = n.left() + (far ? 1 - near : near);
      }
      const std::uint32_t leaf_index = tree_->node(node).child;
      const KdTree::Leaf& leaf = tree_->leaf(leaf_index);
      ++probe.work.leaf;
      tree_->touch_leaf(probe, leaf_index,
                        mode_ == KdTraversal::kFaceLinks ? KdTree::LeafUse::kFaceLinks : KdTree::LeafUse::kParent);
      if (tree_->test_leaf(ray, leaf, probe, best)) return best;
      int face;
      const double t_exit = walk.exit(leaf.bound.data(), face);
      if (best.t <= t_exit || face < 0) break;
      if (t_exit < t)
        throw Error("kd-backtrack: a cell ends before it begins; bounds and planes of the image contradict each other");
      t = t_exit;
      if (mode_ == KdTraversal::kFaceLinks) {
        node = leaf.link[face];
        if (node == 0) break;
      } else if (mode_ == KdTraversal::kBacktrackPlane) {
        if (!climb_to_plane(walk, leaf.bound[face], face, probe, node)) break;
      } else {
        if (!climb_to_box(walk, t, probe, node)) break;
      }
    }
    return finished(best);
  }

 private:
  /// From a leaf up to the ancestor whose split is the plane and of which we are the near child; on to its far child.
  bool climb_to_plane(const Walk& walk, double plane, int face, Probe& probe, std::uint32_t& node) const {
    std::uint32_t at = node;
    while (at != 0) {
      const std::uint32_t parent = tree_->parent(at);
      tree_->touch_pair(probe, parent);
      ++probe.work.up;
      const KdTree::Node& p = tree_->node(parent);
      const int near = walk.near_side(p);
      if (p.axis == face / 2 && p.split == plane && at == p.left() + near) {
        node = p.left() + (1 - near);
        return true;
      }
      at = parent;
    }
    return false;
  }
  /// Up to the first ancestor whose box the ray has not left at t.
  bool climb_to_box(const Walk& walk, double t, Probe& probe, std::uint32_t& node) const {
    std::uint32_t at = node;
    while (at != 0) {
      at = tree_->parent(at);
      tree_->touch_pair(probe, at);
      tree_->touch_box(probe, at);
      ++probe.work.up;
      ++probe.work.volumes;
      const Box& b = tree_->node_box(at);
      const double faces[6] = {b.lower.x, b.upper.x, b.lower.y, b.upper.y, b.lower.z, b.upper.z};
      int face;
      if (walk.exit(faces, face) > t) {
        node = at;
        return true;
      }
    }
    return false;
  }

  KdTraversal mode_;
};

}  // namespace

std::unique_ptr<Structure> make_kd(std::shared_ptr<const KdTree> tree, KdTraversal traversal, int entries) {
  switch (traversal) {
    case KdTraversal::kStack:
      return std::make_unique<StackWalk>(std::move(tree), StackWalk::Mode::kFull, 0);
    case KdTraversal::kRestart:
      return std::make_unique<StackWalk>(std::move(tree), StackWalk::Mode::kRestart, 0);
    case KdTraversal::kShortStack:
      if (entries < 1 || entries > 64) throw std::invalid_argument("short stack of 1 to 64 entries");
      return std::make_unique<StackWalk>(std::move(tree), StackWalk::Mode::kShort, entries);
    default:
      return std::make_unique<LinkWalk>(std::move(tree), traversal);
  }
}

}  // namespace retrace::accel
