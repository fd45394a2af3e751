// Checking a memory image (docs/memory-image.md).
//
// check() trusts nothing. It works in two passes over the image, without recursion and with memory proportional to the
// image: first the header, then the tree from the root with the cell and the face links of the node it is at, so that
// every leaf record can be compared with what it must say. Of two levels: first the top level, then the instance records, and the tree of each
// object when its first instance leads there. All trees share the marks of what was reached, so no two of them share a record.
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <map>
#include <string_view>
#include <vector>

#include "instance.hpp"
#include "memory_image_layout.hpp"
#include "memory_image_walk.hpp"

namespace retrace {
namespace image {
namespace {

template <typename T>
void expect(bool ok, std::string_view record, std::string_view field, const T& value, const std::string& wanted) {
  if (!ok)
    fail(std::string(record) + ": " + std::string(field) + " is " + std::to_string(value) + ", expected " + wanted);
}

void expect_count(std::uint64_t count, std::uint64_t most, std::string_view field) {
  expect(count <= most, "header", field, count, "at most " + std::to_string(most));
}

std::string pair_name(std::uint64_t node) {
  return "node pair " + std::to_string(node >> 1) + (node & 1 ? " (right)" : " (left)");
}
std::string element(const char* field, std::uint64_t i) { return std::string(field) + '[' + std::to_string(i) + ']'; }

}  // namespace

void check_header(const HeaderRecord& h, std::uint64_t words) {
  expect(h.magic == static_cast<std::uint32_t>(contract::kImageMagic), "header", "magic", h.magic,
         std::to_string(contract::kImageMagic) + "; this is no memory image");
  const bool two_levels = h.version == static_cast<std::uint32_t>(contract::kImageVersionTwoLevels);
  expect(two_levels || h.version == static_cast<std::uint32_t>(contract::kImageVersion), "header", "version", h.version,
         std::to_string(contract::kImageVersion) + ", or " + std::to_string(contract::kImageVersionTwoLevels) +
             " (two levels)");
  expect(std::uint64_t{h.lines} * MemoryImage::kLineWords == words, "header", "lines", h.lines,
         std::to_string(words * 8) + " bytes' worth");
  expect(h.pair_count >= 1, "header", "pair_count", h.pair_count, "at least 1");
  expect(h.leaf_count >= 1, "header", "leaf_count", h.leaf_count, "at least 1");
  expect_count(h.pair_count, kMaxPairs, "pair_count");
  expect_count(h.leaf_count, kMaxLeaves, "leaf_count");
  expect_count(h.list_count, kMaxList, "list_count");
  expect_count(h.triangle_count, kMaxTriangles, "triangle_count");
  expect_count(h.instance_count, two_levels ? kMaxInstances : 0, "instance_count");
  const Layout at = layout_of(h.pair_count, h.leaf_count, h.list_count, h.triangle_count, h.instance_count);
  if (!two_levels) {
    expect(h.pair_offset == at.pairs, "header", "pair_offset", h.pair_offset, std::to_string(at.pairs));
    expect(h.leaf_offset == at.leaves, "header", "leaf_offset", h.leaf_offset, std::to_string(at.leaves));
    expect(h.list_offset == at.list, "header", "list_offset", h.list_offset, std::to_string(at.list));
    expect(h.triangle_offset == at.triangles, "header", "triangle_offset", h.triangle_offset,
           std::to_string(at.triangles));
    expect(h.lines == at.end, "header", "lines", h.lines, std::to_string(at.end));
    expect(h.instance_offset == 0, "header", "instance_offset", h.instance_offset, "0");
  } else {
    // Node pairs, leaf records and the list may have lines to spare behind them.
    expect(h.pair_offset == at.pairs, "header", "pair_offset", h.pair_offset, std::to_string(at.pairs));
    const auto expect_behind = [&](std::uint64_t offset, std::uint64_t end, const char* field) {
      expect(offset >= end, "header", field, offset, "at least " + std::to_string(end));
      expect(offset <= h.lines, "header", field, offset, "at most lines = " + std::to_string(h.lines));
    };
    expect_behind(h.leaf_offset, h.pair_offset + (at.leaves - at.pairs), "leaf_offset");
    expect_behind(h.list_offset, h.leaf_offset + (at.list - at.leaves), "list_offset");
    expect_behind(h.triangle_offset, h.list_offset + (at.triangles - at.list), "triangle_offset");
    const std::uint64_t instances = h.triangle_offset + (at.instances - at.triangles),
                        end = instances + (at.end - at.instances);
    expect(h.instance_offset == instances, "header", "instance_offset", h.instance_offset, std::to_string(instances));
    expect(h.lines == end, "header", "lines", h.lines, std::to_string(end));
  }
  for (std::uint32_t x : h.reserved_2) expect(x == 0, "header", "reserved_2", x, "0");
  for (int axis = 0; axis < 3; ++axis) {
    const auto low = static_cast<std::int32_t>(h.box[2 * axis]), high = static_cast<std::int32_t>(h.box[2 * axis + 1]);
    expect(low >= -kUnit && low < high && high <= kUnit, "header", element("box", 2 * axis), low,
           "to be below " + element("box", 2 * axis + 1) + " = " + std::to_string(high) + " and both in [-2^24, 2^24]");
  }
  const double scale = std::bit_cast<double>(h.scale);
  expect(std::isfinite(scale) && scale > 0, "header", "scale", scale, "a finite positive number");
  for (std::uint64_t bits : h.center) {
    const double center = std::bit_cast<double>(bits);
    expect(std::isfinite(center), "header", "center", center, "finite numbers");
  }
}

std::array<std::int32_t, 6> outermost_box(const MemoryImage& image, std::uint32_t root) {
  const HeaderRecord& h = image.header();
  std::array<std::int32_t, 6> box{};
  for (const bool right : {false, true}) {
    std::uint32_t node = 2 * root;
    for (std::uint32_t steps = 0;; ++steps) {
      const Side side = side_of(image.pair(node >> 1), node & 1);
      if (side.child >= (side.leaf() ? h.leaf_count : h.pair_count))
        expect(false, pair_name(node), "child", side.child,
               side.leaf() ? "below leaf_count = " + std::to_string(h.leaf_count)
                           : "below pair_count = " + std::to_string(h.pair_count));
      if (side.leaf()) {
        const LeafRecord leaf = image.leaf(side.child);
        for (std::size_t axis = 0; axis < 3; ++axis) {
          const std::size_t face = 2 * axis + (right ? 1 : 0);
          box[face] = leaf.bound[face];
        }
        break;
      }
      if (steps >= h.pair_count) fail(pair_name(2 * root) + ": the way down from it does not end");
      node = 2 * side.child + (right ? 1 : 0);
    }
  }
  return box;
}

namespace {

/// Bits that belong to no field must be 0: a record packs to what it was unpacked from.
template <typename Record>
bool has_stray_bits(const Record& record, const std::uint64_t* words) {
  std::uint64_t packed[Record::kWords];
  record.pack(packed);
  return std::memcmp(packed, words, sizeof packed) != 0;
}

/// What the leaves of a tree must be.
struct LeafKind {
  std::uint32_t kind, records;  ///< how many records references may name
  const char *name, *count;
};

void check_leaf(const MemoryImage& image, std::uint32_t index, const Cell& cell, const LeafKind& kind) {
  const LeafRecord leaf = image.leaf(index);
  if (has_stray_bits(leaf, image.leaf_words() + std::size_t{index} * LeafRecord::kWords))
    fail(leaf_name(index) + ": reserved bits are not 0");
  for (int face = 0; face < 6; ++face) {
    if (leaf.bound[face] != cell.bound[face])
      expect(false, leaf_name(index), element("bound", face), leaf.bound[face], std::to_string(cell.bound[face]));
    if (leaf.link[face] != cell.link[face])
      expect(false, leaf_name(index), element("link", face), leaf.link[face], std::to_string(cell.link[face]));
  }
  if (leaf.parent != cell.parent) expect(false, leaf_name(index), "parent", leaf.parent, std::to_string(cell.parent));
  if (leaf.kind != kind.kind)
    expect(false, leaf_name(index), "kind", leaf.kind, std::to_string(kind.kind) + " (" + kind.name + ")");
  for (std::uint32_t i = 0; i < kInline; ++i) {
    const bool used = i < leaf.count;
    if (used ? leaf.refs[i] >= kind.records : leaf.refs[i] != 0)
      expect(false, leaf_name(index), element("refs", i), leaf.refs[i],
             used ? std::string("below ") + kind.count + " = " + std::to_string(kind.records) : "0 beyond count");
  }
}

std::int64_t squared_norm(const std::array<std::int32_t, 3>& row) {
  std::int64_t sum = 0;
  for (std::int64_t x : row) sum += x * x;
  return sum;
}

void check_triangle(const MemoryImage& image, std::uint32_t index) {
  // Norms in units of 2^-26; the rounding of three coefficients moves a norm by less than one unit. The upper end is
  // what keeps o'u, o'v, o'z, d'u, d'v, d'z inside their formats.
  constexpr double kOne = 1 << contract::kCoefficientFrac;
  constexpr double kMost = kOne * (1 - 0x1p-22) + 1, kLeast = kOne / 2 * (1 - 0x1p-22) - 1;
  static_assert(kMost < kOne);
  constexpr std::int64_t kMaxOffset = 929887697;  // ceil(sqrt(3) * 2^29)
  const TriangleRecord t = image.triangle(index);
  if (has_stray_bits(t, image.triangle_words() + std::size_t{index} * TriangleRecord::kWords))
    fail(triangle_name(index) + ": reserved bits are not 0");
  const auto check_row = [&](const char* name, const std::array<std::int32_t, 3>& row, double least) {
    const double norm = std::sqrt(static_cast<double>(squared_norm(row)));
    if (norm > kMost || norm < least)
      expect(false, triangle_name(index), std::string("the norm of row ") + name, norm / kOne,
             least == kLeast ? "in (1/2, 1 - 2^-22]" : "1 - 2^-22");
  };
  check_row("u", t.u, kLeast);
  check_row("v", t.v, kLeast);
  check_row("n", t.n, kMost - 2);
  const auto check_offset = [&](const char* name, std::int64_t offset) {
    if (std::abs(offset) > kMaxOffset)
      expect(false, triangle_name(index), name, offset, "at most sqrt(3) * 2^29 in size");
  };
  check_offset("offset_u", t.offset_u);
  check_offset("offset_v", t.offset_v);
  check_offset("offset_n", t.offset_n);
  if (t.exponent_u > static_cast<std::uint32_t>(contract::kExponentMax))
    expect(false, triangle_name(index), "exponent_u", t.exponent_u,
           "at most " + std::to_string(contract::kExponentMax));
  if (t.exponent_v > t.exponent_u)
    expect(false, triangle_name(index), "exponent_v", t.exponent_v,
           "at most exponent_u = " + std::to_string(t.exponent_u));
}

/// What lies between the sections is 0.
void check_padding(const MemoryImage& image) {
  const HeaderRecord& h = image.header();
  const auto expect_zero = [&](std::uint64_t word, std::uint64_t end_line, const char* section) {
    for (; word < end_line * MemoryImage::kLineWords; ++word)
      if (image.words()[word] != 0)
        fail(std::string(section) + ": padding in word " + std::to_string(word) + " is not 0");
  };
  const std::uint64_t list_word = std::uint64_t{h.list_offset} * MemoryImage::kLineWords;
  expect_zero(std::uint64_t{h.leaf_offset} * MemoryImage::kLineWords + std::uint64_t{h.leaf_count} * LeafRecord::kWords,
              h.list_offset, "leaf records");
  expect_zero(
      std::uint64_t{h.pair_offset} * MemoryImage::kLineWords + std::uint64_t{h.pair_count} * NodePairRecord::kWords,
      h.leaf_offset, "node pairs");
  expect_zero(list_word + (std::uint64_t{h.list_count} + 1) / 2, h.triangle_offset, "reference list");
  if (h.list_count % 2 == 1 && image.list(h.list_count) != 0)
    fail("reference list: padding after the last entry is not 0");
}

struct TreeTotals {
  std::uint64_t pairs = 1, leaves = 0, references = 0, leaf_depths = 0;
  std::uint32_t max_depth = 0;
  std::uint32_t steps() const { return MemoryImage::step_limit(pairs, leaves, references, leaf_depths); }
};

/// What the trees of an image have reached so far.
struct Reached {
  std::vector<bool> pairs, leaves;
  std::vector<std::uint32_t> last_leaves;  ///< those of the last tree
};

/// The tree whose root is the left node of pair `root`: every pair and leaf record belongs to one node, parents, splits, bounds and links are
/// what the way down says.
TreeTotals check_tree(const MemoryImage& image, std::uint32_t root, const std::array<std::int32_t, 6>& box,
                      const LeafKind& kind, Reached& reached) {
  const HeaderRecord& h = image.header();
  const NodePairRecord pair = image.pair(root);
  const Side left = side_of(pair, false), right = side_of(pair, true);
  const std::string name = "node pair " + std::to_string(root);
  expect(pair.parent == 2 * root, name, "parent", pair.parent, std::to_string(2 * root) + ", as that of a root");
  expect(right.split == left.split, name, "right_split", right.split, "the root's " + std::to_string(left.split));
  expect(right.axis == left.axis, name, "right_axis", right.axis, "the root's " + std::to_string(left.axis));
  expect(right.child == left.child, name, "right_child", right.child, "the root's " + std::to_string(left.child));

  TreeTotals totals;
  reached.pairs[root] = true;
  reached.last_leaves.clear();
  const auto on_interior = [&](std::uint32_t node, const Side& side, const Cell& cell) {
    const std::int32_t low = cell.bound[2 * side.axis], high = cell.bound[2 * side.axis + 1];
    if (side.split <= low || side.split >= high)
      expect(false, pair_name(node), "split", side.split,
             "strictly between " + std::to_string(low) + " and " + std::to_string(high));
    if (side.child >= h.pair_count)
      expect(false, pair_name(node), "child", side.child, "below pair_count = " + std::to_string(h.pair_count));
    if (reached.pairs[side.child])
      expect(false, pair_name(node), "child", side.child, "a pair that no other node leads to");
    reached.pairs[side.child] = true;
    ++totals.pairs;
    const std::uint32_t parent = image.pair(side.child).parent;
    if (parent != node)
      expect(false, "node pair " + std::to_string(side.child), "parent", parent, std::to_string(node));
  };
  const auto on_leaf = [&](std::uint32_t node, const Side& side, const Cell& cell) {
    if (side.child >= h.leaf_count)
      expect(false, pair_name(node), "child", side.child, "below leaf_count = " + std::to_string(h.leaf_count));
    const std::uint32_t size = std::min<std::uint32_t>(image.leaf(side.child).count, contract::kLeafLong);
    if (side.split != static_cast<std::int32_t>(size))
      expect(false, pair_name(node), "split", side.split,
             std::to_string(size) + ", the size code of " + leaf_name(side.child));
    if (reached.leaves[side.child])
      expect(false, pair_name(node), "child", side.child, "a leaf record that no other node leads to");
    reached.leaves[side.child] = true;
    reached.last_leaves.push_back(side.child);
    check_leaf(image, side.child, cell, kind);
    ++totals.leaves;
    totals.references += image.leaf(side.child).count;
    totals.leaf_depths += cell.depth;
    totals.max_depth = std::max(totals.max_depth, cell.depth);
  };
  walk(image, 2 * root, box, on_interior, on_leaf);
  return totals;
}

/// All pairs and leaf records belong to a tree.
void check_reached(const MemoryImage& image, const Reached& reached) {
  const auto count = [](const std::vector<bool>& marks) {
    return static_cast<std::uint64_t>(std::count(marks.begin(), marks.end(), true));
  };
  const HeaderRecord& h = image.header();
  const char* of = image.two_levels() ? ", as many as the trees have" : ", as many as the tree has";
  const std::uint64_t pairs = count(reached.pairs), leaves = count(reached.leaves);
  expect(pairs == h.pair_count, "header", "pair_count", h.pair_count, std::to_string(pairs) + of);
  expect(leaves == h.leaf_count, "header", "leaf_count", h.leaf_count, std::to_string(leaves) + of);
}

/// The list belongs to the leaf records in their order, without gaps: no two share an entry, so the image bounds the
/// references. What entries name is up to the leaf.
void check_lists(const MemoryImage& image) {
  const HeaderRecord& h = image.header();
  std::uint64_t used = 0;
  for (std::uint32_t i = 0; i < h.leaf_count; ++i) {
    const LeafRecord leaf = image.leaf(i);
    const std::uint64_t beyond = leaf.count > kInline ? leaf.count - kInline : 0;
    const std::uint64_t base = beyond > 0 ? used : 0, left = h.list_count - used;
    if (leaf.list_base != base) expect(false, leaf_name(i), "list_base", leaf.list_base, std::to_string(base));
    if (beyond > left)
      expect(false, leaf_name(i), "count", leaf.count,
             "at most " + std::to_string(kInline + left) + ", the list ends after " + std::to_string(left) + " more");
    used += beyond;
  }
  expect(used == h.list_count, "header", "list_count", h.list_count,
         std::to_string(used) + ", as many as the leaves need");
  for (std::uint32_t i = 0; i < h.leaf_count; ++i) {
    const LeafRecord leaf = image.leaf(i);
    const bool instances = leaf.kind == static_cast<std::uint32_t>(contract::kKindInstance);
    const std::uint32_t records = instances ? h.instance_count : h.triangle_count;
    for (std::uint32_t r = kInline; r < leaf.count; ++r) {
      const std::uint32_t entry = leaf.list_base + r - static_cast<std::uint32_t>(kInline);
      if (image.list(entry) >= records)
        expect(false, "reference list", "entry " + std::to_string(entry), image.list(entry),
               std::string("below ") + (instances ? "instance_count" : "triangle_count") + " = " +
                   std::to_string(records));
    }
  }
}

/// What the instances of an object ask of it.
struct CheckedObject {
  std::array<std::int32_t, 6> box{};
  std::uint32_t steps = 0, last_id = 0;
};

CheckedObject check_object(const MemoryImage& image, std::uint32_t root, Reached& reached) {
  const HeaderRecord& h = image.header();
  CheckedObject object;
  object.box = outermost_box(image, root);
  constexpr auto kReach = static_cast<std::int32_t>(kObjectReach * kUnit);
  const std::string name = "object at node pair " + std::to_string(root);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::int32_t low = object.box[2 * axis], high = object.box[2 * axis + 1];
    expect(low >= -kReach && low < high && high <= kReach, name, element("box", 2 * axis), low,
           "to be below " + element("box", 2 * axis + 1) + " = " + std::to_string(high) + " and both within 7/8");
  }
  const LeafKind kind{static_cast<std::uint32_t>(contract::kKindTriangles), h.triangle_count, "triangles, in an object",
                      "triangle_count"};
  object.steps = check_tree(image, root, object.box, kind, reached).steps();
  for (const std::uint32_t index : reached.last_leaves) {
    const LeafRecord leaf = image.leaf(index);
    for (std::uint32_t r = 0; r < leaf.count; ++r)
      object.last_id = std::max(object.last_id, image.triangle(image.reference(leaf, r)).id);
  }
  return object;
}

void check_instance(const MemoryImage& image, std::uint32_t index, const CheckedObject& object) {
  const InstanceRecord record = image.instance(index);
  const std::string name = instance_name(index);
  for (std::size_t row = 0; row < 3; ++row) {
    if (record.e[row] > static_cast<std::uint32_t>(contract::kRowExponentMax))
      expect(false, name, element("e", row), record.e[row], "at most " + std::to_string(contract::kRowExponentMax));
    std::array<std::int64_t, 3> m{};
    for (std::size_t j = 0; j < 3; ++j) m[j] = record.m[3 * row + j];
    const double norm = std::sqrt(static_cast<double>(m[0] * m[0]) + static_cast<double>(m[1] * m[1]) +
                                  static_cast<double>(m[2] * m[2]));
    constexpr double kOne = std::int64_t{1} << contract::kInstanceCoefficientFrac;
    if (norm >= kOne) expect(false, name, "the norm of row " + std::to_string(row), norm / kOne, "below 1");
  }
  const std::array<std::int32_t, 6> box = coarse_box(object.box);
  for (std::size_t face = 0; face < 6; ++face)
    if (record.box[face] != box[face])
      expect(false, name, element("box", face), record.box[face],
             std::to_string(box[face]) + ", that of its object, rounded outward");
  if (std::uint64_t{record.first_id} + object.last_id >= contract::kNoTriangle)
    expect(false, name, "first_id", record.first_id,
           "triangle ids to stay below 2^32 - 1, the object has " + std::to_string(object.last_id));
  // Rounding moves the stretch by less than 2^-20 of it.
  const double stretch = largest_stretch(glm::inverse(object_from_world(record).linear));
  if (!(stretch <= kInstanceStretch * (1 + 0x1p-20)))
    expect(false, name, "its largest stretch", stretch, "at most " + std::to_string(kInstanceStretch));
  const std::array<std::int32_t, 6> reach = world_box(record, object.box), world = root_box(image.header());
  for (std::size_t face = 0; face < 6; ++face)
    if (face % 2 ? reach[face] > world[face] : reach[face] < world[face])
      expect(false, name, "face " + std::to_string(face) + " of what it fills", reach[face],
             "inside the root box, which ends at " + std::to_string(world[face]));
}

/// Instance records and the trees that they lead to. Gives the steps by instance: an object, and back to the leaf.
std::vector<std::uint32_t> check_instances(const MemoryImage& image, Reached& reached) {
  const HeaderRecord& h = image.header();
  std::map<std::uint32_t, CheckedObject> objects;
  std::vector<std::uint32_t> steps(h.instance_count);
  for (std::uint32_t i = 0; i < h.instance_count; ++i) {
    const InstanceRecord record = image.instance(i);
    if (has_stray_bits(record, image.instance_words() + std::size_t{i} * InstanceRecord::kWords))
      fail(instance_name(i) + ": reserved bits are not 0");
    if (record.root >= h.pair_count)
      expect(false, instance_name(i), "root", record.root, "below pair_count = " + std::to_string(h.pair_count));
    auto found = objects.find(record.root);
    if (found == objects.end()) {
      if (reached.pairs[record.root])
        expect(false, instance_name(i), "root", record.root,
               "the root of an object's tree, not a pair of the top level or inside an object");
      found = objects.emplace(record.root, check_object(image, record.root, reached)).first;
    }
    check_instance(image, i, found->second);
    steps[i] = found->second.steps;
  }
  return steps;
}

/// References and steps of a walk that enters each instance at each reference of the top level.
std::uint32_t two_level_steps(const MemoryImage& image, std::uint32_t top,
                              const std::vector<std::uint32_t>& object_steps) {
  std::uint64_t steps = top;
  for (std::uint32_t i = 0; i < image.header().leaf_count; ++i) {
    const LeafRecord leaf = image.leaf(i);
    if (leaf.kind != static_cast<std::uint32_t>(contract::kKindInstance)) continue;
    for (std::uint32_t r = 0; r < leaf.count; ++r) steps += std::uint64_t{object_steps[image.reference(leaf, r)]} + 1;
  }
  return static_cast<std::uint32_t>(std::min<std::uint64_t>(steps, 0xffffffffu));
}

}  // namespace
}  // namespace image

void MemoryImage::check() const {
  using namespace image;
  if (words_.size() < HeaderRecord::kWords) fail("header: the image is empty");
  check_header(header_, words_.size());
  const std::uint32_t sum = checksum(words_);
  expect(header_.checksum == sum, "header", "checksum", header_.checksum, std::to_string(sum));
  check_padding(*this);
  Reached reached{std::vector<bool>(header_.pair_count), std::vector<bool>(header_.leaf_count), {}};
  const LeafKind kind = two_levels() ? LeafKind{static_cast<std::uint32_t>(contract::kKindInstance),
                                                header_.instance_count, "instances, on the top level", "instance_count"}
                                     : LeafKind{static_cast<std::uint32_t>(contract::kKindTriangles),
                                                header_.triangle_count, "triangles", "triangle_count"};
  const TreeTotals totals = check_tree(*this, 0, root_box(header_), kind, reached);
  std::uint32_t steps = totals.steps();
  if (two_levels()) {
    check_lists(*this);  // before references are followed
    steps = two_level_steps(*this, steps, check_instances(*this, reached));
  }
  check_reached(*this, reached);
  if (!two_levels()) check_lists(*this);
  expect(header_.max_depth == totals.max_depth, "header", "max_depth", header_.max_depth,
         std::to_string(totals.max_depth) + (two_levels() ? ", that of the top level" : ""));
  expect(header_.step_limit == steps, "header", "step_limit", header_.step_limit, std::to_string(steps));
  for (std::uint32_t i = 0; i < header_.triangle_count; ++i) check_triangle(*this, i);
}

}  // namespace retrace
