// Checking a memory image (docs/memory-image.md).
//
// check() trusts nothing. It works in two passes over the image, without recursion and with memory proportional to the
// image: first the header, then the tree from the root with the cell and the face links of the node it is at, so that
// every leaf record can be compared with what it must say.
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <string_view>
#include <vector>

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
  expect(h.version == static_cast<std::uint32_t>(contract::kImageVersion), "header", "version", h.version,
         std::to_string(contract::kImageVersion));
  expect(std::uint64_t{h.lines} * MemoryImage::kLineWords == words, "header", "lines", h.lines,
         std::to_string(words * 8) + " bytes' worth");
  expect(h.pair_count >= 1, "header", "pair_count", h.pair_count, "at least 1");
  expect(h.leaf_count >= 1, "header", "leaf_count", h.leaf_count, "at least 1");
  expect_count(h.pair_count, kMaxPairs, "pair_count");
  expect_count(h.leaf_count, kMaxLeaves, "leaf_count");
  expect_count(h.list_count, kMaxList, "list_count");
  expect_count(h.triangle_count, kMaxTriangles, "triangle_count");
  const Layout at = layout_of(h.pair_count, h.leaf_count, h.list_count, h.triangle_count);
  expect(h.pair_offset == at.pairs, "header", "pair_offset", h.pair_offset, std::to_string(at.pairs));
  expect(h.leaf_offset == at.leaves, "header", "leaf_offset", h.leaf_offset, std::to_string(at.leaves));
  expect(h.list_offset == at.list, "header", "list_offset", h.list_offset, std::to_string(at.list));
  expect(h.triangle_offset == at.triangles, "header", "triangle_offset", h.triangle_offset,
         std::to_string(at.triangles));
  expect(h.lines == at.end, "header", "lines", h.lines, std::to_string(at.end));
  expect(h.instance_offset == 0, "header", "instance_offset", h.instance_offset, "0");
  expect(h.instance_count == 0, "header", "instance_count", h.instance_count, "0");
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

namespace {

/// Bits that belong to no field must be 0: a record packs to what it was unpacked from.
template <typename Record>
bool has_stray_bits(const Record& record, const std::uint64_t* words) {
  std::uint64_t packed[Record::kWords];
  record.pack(packed);
  return std::memcmp(packed, words, sizeof packed) != 0;
}

void check_leaf(const MemoryImage& image, std::uint32_t index, const Cell& cell) {
  const HeaderRecord& h = image.header();
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
  if (leaf.kind != static_cast<std::uint32_t>(contract::kKindTriangles))
    expect(false, leaf_name(index), "kind", leaf.kind, std::to_string(contract::kKindTriangles) + " (triangles)");
  for (std::uint32_t i = 0; i < kInline; ++i) {
    const bool used = i < leaf.count;
    if (used ? leaf.refs[i] >= h.triangle_count : leaf.refs[i] != 0)
      expect(false, leaf_name(index), element("refs", i), leaf.refs[i],
             used ? "below triangle_count = " + std::to_string(h.triangle_count) : "0 beyond count");
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
};

/// The tree: every pair and leaf record belongs to one node, parents, splits, bounds and links are what the way down
/// says.
TreeTotals check_tree(const MemoryImage& image) {
  const HeaderRecord& h = image.header();
  const NodePairRecord root = image.pair(0);
  const Side left = side_of(root, false), right = side_of(root, true);
  expect(root.parent == 0, "node pair 0", "parent", root.parent, "0");
  expect(right.split == left.split, "node pair 0", "right_split", right.split,
         "the root's " + std::to_string(left.split));
  expect(right.axis == left.axis, "node pair 0", "right_axis", right.axis, "the root's " + std::to_string(left.axis));
  expect(right.child == left.child, "node pair 0", "right_child", right.child,
         "the root's " + std::to_string(left.child));

  TreeTotals totals;
  std::vector<bool> pair_reached(h.pair_count), leaf_reached(h.leaf_count);
  pair_reached[0] = true;
  const auto on_interior = [&](std::uint32_t node, const Side& side, const Cell& cell) {
    const std::int32_t low = cell.bound[2 * side.axis], high = cell.bound[2 * side.axis + 1];
    if (side.split <= low || side.split >= high)
      expect(false, pair_name(node), "split", side.split,
             "strictly between " + std::to_string(low) + " and " + std::to_string(high));
    if (side.child >= h.pair_count)
      expect(false, pair_name(node), "child", side.child, "below pair_count = " + std::to_string(h.pair_count));
    if (pair_reached[side.child])
      expect(false, pair_name(node), "child", side.child, "a pair that no other node leads to");
    pair_reached[side.child] = true;
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
    if (leaf_reached[side.child])
      expect(false, pair_name(node), "child", side.child, "a leaf record that no other node leads to");
    leaf_reached[side.child] = true;
    check_leaf(image, side.child, cell);
    ++totals.leaves;
    totals.references += image.leaf(side.child).count;
    totals.leaf_depths += cell.depth;
    totals.max_depth = std::max(totals.max_depth, cell.depth);
  };
  walk(image, on_interior, on_leaf);
  expect(totals.pairs == h.pair_count, "header", "pair_count", h.pair_count,
         std::to_string(totals.pairs) + ", as many as the tree has");
  expect(totals.leaves == h.leaf_count, "header", "leaf_count", h.leaf_count,
         std::to_string(totals.leaves) + ", as many as the tree has");
  return totals;
}

/// The list belongs to the leaf records in their order, without gaps: no two share an entry, so the image bounds the
/// references.
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
  for (std::uint32_t i = 0; i < h.list_count; ++i)
    if (image.list(i) >= h.triangle_count)
      expect(false, "reference list", "entry " + std::to_string(i), image.list(i),
             "below triangle_count = " + std::to_string(h.triangle_count));
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
  const TreeTotals totals = check_tree(*this);
  check_lists(*this);
  expect(header_.max_depth == totals.max_depth, "header", "max_depth", header_.max_depth,
         std::to_string(totals.max_depth));
  const std::uint32_t steps = step_limit(totals.pairs, totals.leaves, totals.references, totals.leaf_depths);
  expect(header_.step_limit == steps, "header", "step_limit", header_.step_limit, std::to_string(steps));
  for (std::uint32_t i = 0; i < header_.triangle_count; ++i) check_triangle(*this, i);
}

}  // namespace retrace
