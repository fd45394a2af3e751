// Layout and traversals of the bounding volume hierarchies.
//   stack       children sorted by where the ray enters them
//   heap        of all volumes entered so far, open the nearest: T. Kay, J. Kajiya, Ray tracing complex scenes, 1986
//   stackless   parent links and three states: M. Hapala et al., Efficient stack-less BVH traversal for ray tracing,
//               SCCG 2011; order by the sign of the direction, here for any number of children
#include "bvh.hpp"

#include <algorithm>

namespace retrace::accel {

glm::dvec3 slab_normal(int k) {
  static const std::array<glm::dvec3, Bvh::kMaxSlabs> normals{glm::dvec3{1, 0, 0}, {0, 1, 0},   {0, 0, 1}, {1, 1, 1},
                                                              {-1, 1, 1},          {-1, -1, 1}, {1, -1, 1}};
  return normals[k];
}

Bvh::Bvh(const TriangleSet& set, const BvhDraft& draft, int slabs) : slabs_(slabs) {
  if (slabs < 3 || slabs > kMaxSlabs) throw std::invalid_argument("pairs of planes: 3 to 7");
  // Siblings side by side, subtrees depth first; a node's number is above its parent's.
  struct Task {
    std::uint32_t node, draft;
  };
  std::vector<Task> todo;
  nodes_.push_back({0, 0, 0, 0, 0, 0, true});
  todo.push_back({0, draft.root});
  while (!todo.empty()) {
    const Task task = todo.back();
    todo.pop_back();
    const BvhDraft::Node& d = draft.nodes[task.draft];
    nodes_[task.node].leaf = d.is_leaf();
    if (d.is_leaf()) {
      nodes_[task.node].first = static_cast<std::uint32_t>(triangles_.size());
      nodes_[task.node].count = d.count;
      for (std::uint32_t i = 0; i < d.count; ++i) triangles_.push_back(set.triangles[draft.order[d.first + i]]);
      continue;
    }
    const auto first = static_cast<std::uint32_t>(nodes_.size());
    std::uint32_t count = 0;
    for (std::uint32_t c = d.child; c != BvhDraft::kNil; c = draft.nodes[c].sibling, ++count) {
      nodes_.push_back({0, 0, task.node, count, 0, 0, true});
      todo.push_back({first + count, c});
    }
    nodes_[task.node].first = first, nodes_[task.node].count = count;
  }
  planes_.resize(nodes_.size() * 2 * slabs_);
  for (std::size_t i = nodes_.size(); i-- > 0;) {
    double* p = planes_.data() + i * 2 * slabs_;
    for (int k = 0; k < slabs_; ++k) p[2 * k] = kInfinity, p[2 * k + 1] = -kInfinity;
    const Node& n = nodes_[i];
    for (std::uint32_t c = n.first; c < n.first + n.count; ++c) {
      for (int k = 0; k < slabs_; ++k) {
        if (n.leaf) {
          const glm::dvec3 normal = slab_normal(k);
          const double pad = kMargin * (k < 3 ? 1.0 : std::sqrt(3.0));
          for (const glm::dvec3& v : triangles_[c].vertices) {
            const double x = glm::dot(normal, v);
            p[2 * k] = std::min(p[2 * k], x - pad), p[2 * k + 1] = std::max(p[2 * k + 1], x + pad);
          }
        } else {
          p[2 * k] = std::min(p[2 * k], planes(c)[2 * k]), p[2 * k + 1] = std::max(p[2 * k + 1], planes(c)[2 * k + 1]);
        }
      }
    }
  }
  // Siblings in the order of their centres along the axis on which these differ most. Only nodes move within their
  // group, so the numbers of their children stay.
  for (std::uint32_t i = 0; i < nodes_.size(); ++i) {
    Node& n = nodes_[i];
    if (n.leaf || n.count == 0) continue;
    std::vector<std::uint32_t> order(n.count);
    for (std::uint32_t k = 0; k < n.count; ++k) order[k] = n.first + k;
    const auto center = [&](std::uint32_t c, int a) { return planes(c)[2 * a] + planes(c)[2 * a + 1]; };
    double widest = -1.0;
    for (int a = 0; a < 3; ++a) {
      double lo = kInfinity, hi = -kInfinity;
      for (const std::uint32_t c : order) lo = std::min(lo, center(c, a)), hi = std::max(hi, center(c, a));
      if (hi - lo > widest) widest = hi - lo, n.child_axis = static_cast<std::uint8_t>(a);
    }
    std::stable_sort(order.begin(), order.end(), [&](std::uint32_t x, std::uint32_t y) {
      return center(x, n.child_axis) < center(y, n.child_axis);
    });
    std::vector<Node> moved;
    std::vector<double> moved_planes;
    for (const std::uint32_t c : order) {
      moved.push_back(nodes_[c]);
      moved_planes.insert(moved_planes.end(), planes(c), planes(c) + 2 * slabs_);
    }
    for (std::uint32_t k = 0; k < n.count; ++k) {
      moved[k].position = k;
      moved[k].sibling_axis = n.child_axis;
      nodes_[n.first + k] = moved[k];
      if (!moved[k].leaf)
        for (std::uint32_t c = moved[k].first; c < moved[k].first + moved[k].count; ++c) nodes_[c].parent = n.first + k;
    }
    std::copy(moved_planes.begin(), moved_planes.end(), planes_.begin() + std::size_t{n.first} * 2 * slabs_);
  }
}

std::shared_ptr<const Bvh> build_bvh(const TriangleSet& set, BvhBuilder builder, int slabs, BuildSteps* steps) {
  BvhDraft draft;
  BuildSteps work;
  if (set.triangles.empty()) {
    draft.nodes.emplace_back();
  } else if (builder == BvhBuilder::kBinnedSah) {
    draft = draft_binned_sah(set, work);
  } else if (builder == BvhBuilder::kKayKajiya) {
    draft = draft_kay_kajiya(set, work);
  } else {
    draft = draft_goldsmith_salmon(set, work);
  }
  if (steps) *steps = work;
  return std::make_shared<const Bvh>(set, draft, slabs);
}

namespace {

/// Everything a walk needs of ray and hierarchy.
class Walk {
 public:
  Walk(const Bvh& bvh, const Ray& ray, Probe& probe, bool parents)
      : best(no_hit(ray)),
        bvh_(bvh),
        ray_(ray),
        probe_(probe),
        slabs_(bvh.slabs()),
        stride_(bvh.node_bytes(parents)),
        triangle_base_((bvh.nodes().size() * stride_ + 63) & ~std::uint64_t{63}) {
    for (int k = 0; k < slabs_; ++k) {
      offset_[k] = glm::dot(ray.origin, slab_normal(k));
      inverse_[k] = 1.0 / glm::dot(ray.direction, slab_normal(k));
    }
  }
  /// Where the ray enters a volume; infinite if it does not, or not before the best hit. A plane that the ray runs in
  /// gives 0 * inf, which every comparison ignores.
  double enter(std::uint32_t node) {
    ++probe_.work.volumes;
    probe_.touch(node * stride_, static_cast<std::uint32_t>(stride_));
    const double* p = bvh_.planes(node);
    double near = 0.0, far = best.t;
    for (int k = 0; k < slabs_; ++k, p += 2) {
      const bool negative = std::signbit(inverse_[k]);
      const double t0 = (p[negative] - offset_[k]) * inverse_[k], t1 = (p[!negative] - offset_[k]) * inverse_[k];
      if (t0 > near) near = t0;
      if (t1 < far) far = t1;
    }
    return near <= far ? near : kInfinity;
  }
  /// Tests a leaf's triangles; true if the ray is done (any-hit).
  bool leaf(const Bvh::Node& n) {
    ++probe_.work.leaf;
    for (std::uint32_t i = n.first; i < n.first + n.count; ++i) {
      if (probe_.test(ray_, bvh_.triangle(i), i, triangle_base_ + i * std::uint64_t{Probe::kTriangleStride}, best) &&
          ray_.any)
        return true;
    }
    return false;
  }
  void touch_links(std::uint32_t node) { probe_.touch(node * stride_ + 8u * slabs_, 12); }

  Hit best;

 private:
  const Bvh& bvh_;
  const Ray& ray_;
  Probe& probe_;
  int slabs_;
  std::uint64_t stride_, triangle_base_;
  std::array<double, Bvh::kMaxSlabs> offset_, inverse_;
};

class BvhStructure : public Structure {
 public:
  BvhStructure(std::shared_ptr<const Bvh> bvh, bool parents) : bvh_(std::move(bvh)), parents_(parents) {}
  std::size_t size() const override { return bvh_->triangles(); }
  Footprint footprint() const override { return bvh_->footprint(parents_); }

 protected:
  std::shared_ptr<const Bvh> bvh_;
  bool parents_;
};

struct Entry {
  double t;
  std::uint32_t node;
  bool operator>(const Entry& e) const { return t > e.t; }
};

class QueueWalk final : public BvhStructure {
 public:
  QueueWalk(std::shared_ptr<const Bvh> bvh, bool heap) : BvhStructure(std::move(bvh), false), heap_(heap) {}

  Hit trace(const Ray& ray, Probe& probe) const override {
    probe.begin_ray();
    Walk walk(*bvh_, ray, probe, parents_);
    thread_local std::vector<Entry> queue;
    queue.clear();
    if (const double t = walk.enter(0); t < kInfinity) queue.push_back({t, 0});
    while (!queue.empty()) {
      if (heap_) std::pop_heap(queue.begin(), queue.end(), std::greater<>());
      const Entry e = queue.back();
      queue.pop_back();
      if (e.t > walk.best.t) {
        if (heap_) break;
        continue;
      }
      const Bvh::Node& n = bvh_->nodes()[e.node];
      if (n.leaf) {
        if (walk.leaf(n)) return walk.best;
        continue;
      }
      ++probe.work.down;
      const auto base = static_cast<std::ptrdiff_t>(queue.size());
      for (std::uint32_t c = n.first; c < n.first + n.count; ++c) {
        const double t = walk.enter(c);
        if (!(t < kInfinity)) continue;
        queue.push_back({t, c});
        if (heap_) std::push_heap(queue.begin(), queue.end(), std::greater<>());
      }
      if (!heap_) std::sort(queue.begin() + base, queue.end(), std::greater<>());
    }
    return finished(walk.best);
  }

 private:
  bool heap_;
};

class StacklessWalk final : public BvhStructure {
 public:
  explicit StacklessWalk(std::shared_ptr<const Bvh> bvh) : BvhStructure(std::move(bvh), true) {}

  Hit trace(const Ray& ray, Probe& probe) const override {
    probe.begin_ray();
    Walk walk(*bvh_, ray, probe, parents_);
    const auto& nodes = bvh_->nodes();
    std::uint32_t at = 0;
    bool from_child = false;
    for (;;) {
      const Bvh::Node& n = nodes[at];
      if (from_child) {
        ++probe.work.up;
        walk.touch_links(at);
      } else if (walk.enter(at) < kInfinity) {
        if (!n.leaf) {
          ++probe.work.down;
          if (n.count > 0) {
            at = n.first + (ray.direction[n.child_axis] < 0.0 ? n.count - 1 : 0);
            continue;
          }
        } else if (walk.leaf(n)) {
          return walk.best;
        }
      }
      if (at == 0) break;
      // Done with this subtree: the next sibling, or the parent after the last.
      const bool backward = ray.direction[n.sibling_axis] < 0.0;
      const bool last = backward ? n.position == 0 : n.position + 1 == nodes[n.parent].count;
      from_child = last;
      at = last ? n.parent : backward ? at - 1 : at + 1;
    }
    return finished(walk.best);
  }
};

}  // namespace

std::unique_ptr<Structure> make_bvh(std::shared_ptr<const Bvh> bvh, BvhTraversal traversal) {
  if (traversal == BvhTraversal::kStackless) return std::make_unique<StacklessWalk>(std::move(bvh));
  return std::make_unique<QueueWalk>(std::move(bvh), traversal == BvhTraversal::kHeap);
}

}  // namespace retrace::accel
