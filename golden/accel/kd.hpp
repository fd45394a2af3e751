// The memory image, decoded once for the double-precision traversals of kd.cpp (and the trees of two_level.cpp).
#pragma once
#include "golden/tree/memory_image.hpp"
#include "probe.hpp"
#include "structures.hpp"

namespace retrace::accel {

class KdTree {
 public:
  struct Node {
    double split;         ///< interior: grid units
    std::uint32_t child;  ///< interior: pair of the children; leaf: leaf record
    std::uint8_t axis;    ///< contract::kAxisLeaf for a leaf
    bool is_leaf() const { return axis == contract::kAxisLeaf; }
    std::uint32_t left() const { return child * 2; }
  };
  struct Leaf {
    std::array<double, 6> bound;
    std::array<std::uint32_t, 6> link;
    std::uint32_t parent, first, count, list_base;  ///< references_[first ...]
  };

  KdTree(const MemoryImage& image, const TriangleSet& set);

  const Node& node(std::uint32_t i) const { return nodes_[i]; }
  std::uint32_t parent(std::uint32_t node) const { return parents_[node >> 1]; }
  const Leaf& leaf(std::uint32_t i) const { return leaves_[i]; }
  const Box& box() const { return box_; }
  /// Box of an interior node or leaf (kd-backtrack with boxes holds them; the image does not).
  const Box& node_box(std::uint32_t node) const { return node_boxes_[node]; }
  std::size_t triangles() const { return triangles_.size(); }
  std::size_t references() const { return references_.size(); }
  const Triangle& triangle(std::uint32_t i) const { return triangles_[i]; }
  std::uint32_t reference(const Leaf& leaf, std::uint32_t i) const { return references_[leaf.first + i]; }

  // Reading memory: what a walk touches, at the image's own addresses.
  void touch_pair(Probe& probe, std::uint32_t node) const { probe.touch(pair_base_ + (node >> 1) * 16ull, 16); }
  void touch_box(Probe& probe, std::uint32_t node) const { probe.touch(box_base_ + node * 24ull, 24); }
  /// What a walk needs of a leaf record. Planes and links stand first, then the parent, then the references; a node says
  /// how many there are (docs/memory-image.md), so a short leaf is read in part, in units of 8 bytes.
  enum class LeafUse { kReferences, kFaceLinks, kParent };
  void touch_leaf(Probe& probe, std::uint32_t leaf, LeafUse use) const {
    const std::uint32_t count = leaves_[leaf].count;
    const std::uint32_t end = count == 0 ? (use == LeafUse::kParent ? 48 : 40) : count <= 2 ? 48 : count <= 4 ? 56 : 64;
    const std::uint32_t begin = use == LeafUse::kReferences ? 40 : 0;
    if (end > begin) probe.touch(leaf_base_ + leaf * 64ull + begin, end - begin);
  }
  /// Tests all references of a leaf. True if the ray is done (any-hit).
  bool test_leaf(const Ray& ray, const Leaf& leaf, Probe& probe, Hit& best) const {
    for (std::uint32_t i = 0; i < leaf.count; ++i) {
      if (i >= contract::kLeafInline) probe.touch(list_base_ + (leaf.list_base + i - contract::kLeafInline) * 4ull, 4);
      const std::uint32_t t = references_[leaf.first + i];
      if (probe.test(ray, triangles_[t], t, triangle_base_ + t * std::uint64_t{Probe::kTriangleStride}, best) &&
          ray.any)
        return true;
    }
    return false;
  }
  Footprint footprint(bool boxes) const;

 private:
  std::vector<Node> nodes_;
  std::vector<std::uint32_t> parents_;  // by pair
  std::vector<Leaf> leaves_;
  std::vector<std::uint32_t> references_;
  std::vector<Triangle> triangles_;  // in the image's order
  std::vector<Box> node_boxes_;
  Box box_;
  std::uint64_t pair_base_, leaf_base_, list_base_, triangle_base_, box_base_;
};

}  // namespace retrace::accel
