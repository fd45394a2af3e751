// Bounding volume hierarchy of the lab: any number of children, volumes of 3 to 7 pairs of parallel planes (3: boxes).
// Builders give a tree of triangles; Bvh adds the volumes and lays nodes out with siblings side by side, triangles in
// leaf order.
//
// Layout for bytes: a node is its planes (8 bytes a pair), first child or triangle and count (8 bytes), and, for the
// stackless walk, a parent link (4 bytes). Triangle records stand in leaf order, so there is no reference list.
#pragma once
#include <vector>

#include "probe.hpp"
#include "structures.hpp"

namespace retrace::accel {

/// What a builder hands over: a left-child, right-sibling tree.
struct BvhDraft {
  static constexpr std::uint32_t kNil = 0xffffffffu;
  struct Node {
    std::uint32_t child = kNil, sibling = kNil;  ///< first child; next sibling
    std::uint32_t first = 0, count = 0;          ///< leaf: order[first ... first + count)
    bool is_leaf() const { return child == kNil; }
  };
  std::vector<Node> nodes;
  std::vector<std::uint32_t> order;  ///< triangle numbers of the set
  std::uint32_t root = 0;
};

BvhDraft draft_binned_sah(const TriangleSet& set, BuildSteps& steps);
/// The same over boxes of anything, with at most `max_leaf` of them a leaf.
BvhDraft draft_binned_sah(const std::vector<Box>& boxes, std::uint32_t max_leaf, BuildSteps& steps);
BvhDraft draft_kay_kajiya(const TriangleSet& set, BuildSteps& steps);
BvhDraft draft_goldsmith_salmon(const TriangleSet& set, BuildSteps& steps);

/// Median cut (bvh_kay_kajiya.cpp) of order[first ... last) below `node`, with at most `max_leaf` a leaf. The other
/// builders end with it where their own rule would take too long: it is balanced whatever the triangles are.
void cut_at_medians(BvhDraft& draft, std::uint32_t node, std::uint32_t first, std::uint32_t last,
                    const std::vector<glm::dvec3>& centers, std::uint32_t max_leaf, BuildSteps& steps);

class Bvh {
 public:
  static constexpr int kMaxSlabs = 7;
  struct Node {
    std::uint32_t first, count;      ///< children or triangles
    std::uint32_t parent, position;  ///< position among the siblings
    std::uint8_t sibling_axis;       ///< siblings are sorted along this axis
    std::uint8_t child_axis;
    bool leaf;
  };
  Bvh(const TriangleSet& set, const BvhDraft& draft, int slabs);

  int slabs() const { return slabs_; }
  const std::vector<Node>& nodes() const { return nodes_; }
  const Triangle& triangle(std::uint32_t i) const { return triangles_[i]; }
  std::size_t triangles() const { return triangles_.size(); }
  Footprint footprint(bool parents) const {
    return {.nodes = nodes_.size() * node_bytes(parents), .triangles = triangles_.size() * Probe::kTriangleStride};
  }
  std::uint32_t node_bytes(bool parents) const { return 8u * slabs_ + 8u + (parents ? 4u : 0u); }
  const double* planes(std::uint32_t node) const { return planes_.data() + std::size_t{node} * 2 * slabs_; }

 private:
  int slabs_;
  std::vector<Node> nodes_;     // 0 is the root
  std::vector<double> planes_;  // lower, upper by pair, by node
  std::vector<Triangle> triangles_;
};

/// Normals of the pairs of planes: the axes, then the diagonals (Kay & Kajiya 1986, section 2), not normalised.
glm::dvec3 slab_normal(int k);

}  // namespace retrace::accel
