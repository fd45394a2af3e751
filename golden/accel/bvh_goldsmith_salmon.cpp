// J. Goldsmith, J. Salmon, Automatic creation of object hierarchies for ray tracing, IEEE CG&A 7(5), 1987: triangles
// are inserted one by one, in random order, each where it adds least to the expected number of volume tests (a node
// with k children and surface A adds k A). On the way down from the root the path follows the child whose surface would
// grow least; along it,
//   as a further child of a node:      k (A' - A) + A'
//   beside a leaf, under a new node:   2 A(union)
//   further down:                      k (A' - A), inherited by everything below
// and the cheapest place on the path is taken. Ties go to the child whose centre is nearest, as the paper suggests.
//
// Nothing in this rule bounds the number of children or the depth: coincident triangles all become children of one
// node. When kSteps N log2 2N children have been weighed, the triangles that are left, cut at medians, become one
// more child of the root.
#include <algorithm>
#include <cmath>
#include <numeric>

#include "bvh.hpp"

namespace retrace::accel {
namespace {

constexpr auto kNil = BvhDraft::kNil;
constexpr double kSteps = 32;

class Inserter {
 public:
  Inserter(const TriangleSet& set, BuildSteps& steps) : set_(set), steps_(steps) {
    draft.order.resize(set.triangles.size());
    std::iota(draft.order.begin(), draft.order.end(), 0u);
    // Random order with a fixed generator, so that the tree is the same everywhere.
    std::uint64_t state = 0x9e3779b97f4a7c15ull;
    for (std::size_t i = draft.order.size(); i > 1; --i) {
      state ^= state << 13, state ^= state >> 7, state ^= state << 17;
      std::swap(draft.order[i - 1], draft.order[state % i]);
    }
    draft.root = add_node({});
    const double n = static_cast<double>(std::max<std::size_t>(set.triangles.size(), 1));
    const auto most = static_cast<std::uint64_t>(kSteps * n * std::log2(2.0 * n));
    std::uint32_t done = 0;
    while (done < draft.order.size() && weighed_ < most) insert(done++);
    steps_.steps += weighed_;
    if (done < draft.order.size()) add_rest(done);
  }
  BvhDraft draft;

 private:
  std::uint32_t add_node(const Box& box) {
    draft.nodes.emplace_back();
    boxes_.push_back(box);
    children_.push_back(0);
    return static_cast<std::uint32_t>(draft.nodes.size() - 1);
  }
  static double united(const Box& a, const Box& b) {
    Box u = a;
    u.add(b);
    return u.half_area();
  }

  void add_rest(std::uint32_t first) {
    std::vector<glm::dvec3> centers;
    for (const Triangle& t : set_.triangles) centers.push_back(t.box().center());
    const std::uint32_t rest = add_node({});
    draft.nodes[rest].sibling = draft.nodes[draft.root].child;
    draft.nodes[draft.root].child = rest;
    cut_at_medians(draft, rest, first, static_cast<std::uint32_t>(draft.order.size()), centers, 1, steps_);
  }

  void insert(std::uint32_t slot) {
    const Box box = set_.triangles[draft.order[slot]].box();
    const std::uint32_t leaf = add_node(box);
    draft.nodes[leaf].first = slot, draft.nodes[leaf].count = 1;

    path_.clear();
    double inherited = 0.0, best_cost = kInfinity;
    std::size_t best_depth = 0;         // the node at this depth of the path takes it
    std::uint32_t best_partner = kNil;  // or shares a new node with this leaf child of it
    for (std::uint32_t at = draft.root;;) {
      path_.push_back(at);
      const double grown = united(boxes_[at], box), old = boxes_[at].half_area();
      const double wider = children_[at] * (grown - old);
      if (const double cost = inherited + wider + grown; cost < best_cost) {
        best_cost = cost, best_depth = path_.size() - 1, best_partner = kNil;
      }
      inherited += wider;
      std::uint32_t next = kNil;
      double least = kInfinity, nearest = kInfinity;
      for (std::uint32_t c = draft.nodes[at].child; c != kNil; c = draft.nodes[c].sibling) {
        ++weighed_;
        const double growth = united(boxes_[c], box) - boxes_[c].half_area();
        const glm::dvec3 away = boxes_[c].center() - box.center();
        const double distance = glm::dot(away, away);
        if (growth < least || (growth == least && distance < nearest)) least = growth, nearest = distance, next = c;
      }
      if (next == kNil) break;
      if (draft.nodes[next].is_leaf()) {
        if (const double cost = inherited + 2.0 * united(boxes_[next], box); cost < best_cost) {
          best_cost = cost, best_depth = path_.size() - 1, best_partner = next;
        }
        break;
      }
      at = next;
    }

    const std::uint32_t node = path_[best_depth];
    if (best_partner == kNil) {
      draft.nodes[leaf].sibling = draft.nodes[node].child;
      draft.nodes[node].child = leaf;
      ++children_[node];
    } else {
      Box both = boxes_[best_partner];
      both.add(box);
      const std::uint32_t pair = add_node(both);
      std::uint32_t* link = &draft.nodes[node].child;
      while (*link != best_partner) link = &draft.nodes[*link].sibling;
      *link = pair;
      draft.nodes[pair].sibling = draft.nodes[best_partner].sibling;
      draft.nodes[pair].child = best_partner;
      draft.nodes[best_partner].sibling = leaf;
      children_[pair] = 2;
    }
    for (std::size_t i = 0; i <= best_depth; ++i) boxes_[path_[i]].add(box);
  }

  const TriangleSet& set_;
  BuildSteps& steps_;
  std::uint64_t weighed_ = 0;  ///< children compared on the way down
  std::vector<Box> boxes_;
  std::vector<std::uint32_t> children_, path_;
};

}  // namespace

BvhDraft draft_goldsmith_salmon(const TriangleSet& set, BuildSteps& steps) { return Inserter(set, steps).draft; }

}  // namespace retrace::accel
