// Laying out, checking, loading and saving the memory image (docs/memory-image.md).
//
// check() trusts nothing. It works in two passes over the image, without recursion and with memory proportional to the
// image: first the header, then the tree from the root with the cell and the face links of the node it is at, so that
// every leaf record can be compared with what it must say.
#include "memory_image.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zlib.h>

#include <algorithm>
#include <bit>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <limits>
#include <string_view>
#include <system_error>
#include <utility>

#include "golden/base/output_file.hpp"
#include "kd_builder.hpp"

namespace retrace {
namespace {

using contract::HeaderRecord;
using contract::LeafRecord;
using contract::NodePairRecord;
using contract::TriangleRecord;

static_assert(std::endian::native == std::endian::little, "words are stored and checksummed as they lie in memory");

constexpr std::uint64_t kLineBytes = MemoryImage::kLineWords * 8;
constexpr std::uint64_t kHeaderLines = contract::kHeaderBytes / kLineBytes;
constexpr std::uint64_t kMaxPairs = std::uint64_t{1} << contract::kPairIndexBits;
constexpr std::uint64_t kMaxLeaves = std::uint64_t{1} << contract::kPairIndexBits;
constexpr std::uint64_t kMaxList = std::uint64_t{1} << contract::kListIndexBits;
constexpr std::uint64_t kMaxTriangles = std::uint64_t{1} << contract::kTriangleIndexBits;
constexpr std::uint64_t kInline = contract::kLeafInline;
constexpr std::int32_t kUnit = std::int32_t{1} << contract::kPositionFrac;  ///< position code of 1.0
static_assert(contract::kNodePairBytes == NodePairRecord::kWords * 8 && contract::kLeafBytes == LeafRecord::kWords * 8);
static_assert(contract::kTriangleBytes == TriangleRecord::kWords * 8 &&
              contract::kHeaderBytes == HeaderRecord::kWords * 8);

constexpr std::uint64_t lines_of(std::uint64_t count, std::uint64_t bytes) {
  return (count * bytes + kLineBytes - 1) / kLineBytes;
}

/// Where the sections of an image with these counts stand: one after the other, each from a line of its own.
struct Layout {
  std::uint64_t pairs, leaves, list, triangles, end;
};
constexpr Layout layout_of(std::uint64_t pairs, std::uint64_t leaves, std::uint64_t list, std::uint64_t triangles) {
  Layout at{};
  at.pairs = kHeaderLines;
  at.leaves = at.pairs + lines_of(pairs, contract::kNodePairBytes);
  at.list = at.leaves + lines_of(leaves, contract::kLeafBytes);
  at.triangles = at.list + lines_of(list, 4);
  at.end = at.triangles + lines_of(triangles, contract::kTriangleBytes);
  return at;
}
constexpr std::uint64_t kMaxLines = layout_of(kMaxPairs, kMaxLeaves, kMaxList, kMaxTriangles).end;
static_assert(kMaxLines <= 0xffffffffu);

[[noreturn]] void fail(const std::string& what) { throw Error("memory image: " + what); }

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
std::string leaf_name(std::uint64_t leaf) { return "leaf record " + std::to_string(leaf); }
std::string element(const char* field, std::uint64_t i) { return std::string(field) + '[' + std::to_string(i) + ']'; }
std::string triangle_name(std::uint64_t triangle) { return "triangle record " + std::to_string(triangle); }

/// What does not depend on the tree: everything in the header but depth and step limit.
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

/// One side of a node pair.
struct Side {
  std::int32_t split;
  std::uint32_t axis, child;
  bool leaf() const { return axis == static_cast<std::uint32_t>(contract::kAxisLeaf); }
};
Side side_of(const NodePairRecord& pair, bool right) {
  return right ? Side{pair.right_split, pair.right_axis, pair.right_child}
               : Side{pair.left_split, pair.left_axis, pair.left_child};
}

/// Where a walk down the tree stands: the cell of the current node, and by face the far child of the ancestor that made
/// it.
struct Cell {
  std::array<std::int32_t, 6> bound;
  std::array<std::uint32_t, 6> link{};
  std::uint32_t parent = 0, depth = 0;
};

/// Walks the tree depth first. `on_interior(node, side, cell)` must throw unless `side.child` is a pair that was not
/// reached before and the split lies inside the cell; `on_leaf(node, side, cell)`. No recursion: the stack undoes what
/// the way down changed.
template <typename OnInterior, typename OnLeaf>
void walk(const MemoryImage& image, OnInterior&& on_interior, OnLeaf&& on_leaf) {
  struct Frame {
    std::uint32_t node;
    std::uint32_t parent;     ///< its parent, restored on the way up
    std::int32_t bound;       ///< what the child on the way changed, restored on the way up
    std::uint32_t link : 31;  ///< 24 bits
    std::uint32_t right : 1;  ///< which child is on the way
  };
  std::vector<Frame> stack;
  Cell cell;
  for (int face = 0; face < 6; ++face) cell.bound[face] = static_cast<std::int32_t>(image.header().box[face]);
  std::uint32_t node = 0;
  for (;;) {
    for (;;) {
      const Side side = side_of(image.pair(node >> 1), node & 1);
      if (side.leaf()) {
        on_leaf(node, side, cell);
        break;
      }
      on_interior(node, side, cell);
      const int upper = static_cast<int>(2 * side.axis + 1);
      stack.push_back({node, cell.parent, cell.bound[upper], cell.link[upper], 0});
      cell.bound[upper] = side.split;
      cell.link[upper] = 2 * side.child + 1;
      cell.parent = node;
      ++cell.depth;
      node = 2 * side.child;
    }
    for (;;) {
      if (stack.empty()) return;
      Frame& frame = stack.back();
      const Side side = side_of(image.pair(frame.node >> 1), frame.node & 1);
      const int lower = static_cast<int>(2 * side.axis), upper = lower + 1;
      if (frame.right == 0) {
        cell.bound[upper] = frame.bound;
        cell.link[upper] = frame.link;
        frame.bound = cell.bound[lower];
        frame.link = cell.link[lower];
        frame.right = 1;
        cell.bound[lower] = side.split;
        cell.link[lower] = 2 * side.child;
        cell.parent = frame.node;
        node = 2 * side.child + 1;
        break;
      }
      cell.bound[lower] = frame.bound;
      cell.link[lower] = frame.link;
      cell.parent = frame.parent;
      --cell.depth;
      stack.pop_back();
    }
  }
}

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

std::string errno_text() { return std::error_code(errno, std::generic_category()).message(); }

/// A file descriptor that closes itself.
struct File {
  int descriptor = -1;
  explicit File(int d) : descriptor(d) {}
  File(const File&) = delete;
  File& operator=(const File&) = delete;
  ~File() {
    if (descriptor >= 0) ::close(descriptor);
  }
};

}  // namespace

MemoryImage::MemoryImage(std::vector<std::uint64_t> words) : words_(std::move(words)) {
  if (words_.size() < HeaderRecord::kWords)
    fail("header: " + std::to_string(bytes()) + " bytes are too few, expected at least " +
         std::to_string(contract::kHeaderBytes));
  header_ = HeaderRecord::unpack(words_.data());
  check();
}

std::uint32_t MemoryImage::checksum(std::span<const std::uint64_t> words) {
  constexpr std::size_t kAt = 12, kSize = 4;  // of the checksum word itself, which counts as 0
  const auto* bytes = reinterpret_cast<const Bytef*>(words.data());
  const Bytef zero[kSize] = {};
  if (words.size_bytes() < kAt + kSize) return 0;
  uLong crc = crc32_z(0, bytes, kAt);
  crc = crc32_z(crc, zero, kSize);
  return static_cast<std::uint32_t>(crc32_z(crc, bytes + kAt + kSize, words.size_bytes() - kAt - kSize));
}

std::uint32_t MemoryImage::step_limit(std::uint64_t pairs, std::uint64_t leaves, std::uint64_t references,
                                      std::uint64_t leaf_depths) {
  // A walk is a depth-first one: it goes down through a node once, into a leaf once, tests a reference once, and from a
  // leaf climbs at most to the root.
  const std::uint64_t steps = 2 * pairs - 1 + leaves + references + leaf_depths;
  return static_cast<std::uint32_t>(std::min<std::uint64_t>(steps, std::numeric_limits<std::uint32_t>::max()));
}

MemoryImage MemoryImage::assemble(HeaderRecord header, std::span<const NodePairRecord> pairs,
                                  std::span<const LeafRecord> leaves, std::span<const std::uint32_t> list,
                                  std::span<const TriangleRecord> triangles) {
  const auto expect_room = [](std::uint64_t count, std::uint64_t most, const char* what) {
    if (count > most)
      fail(std::to_string(count) + " " + what + " are more than the format holds, " + std::to_string(most));
  };
  expect_room(pairs.size(), kMaxPairs, "node pairs");
  expect_room(leaves.size(), kMaxLeaves, "leaf records");
  expect_room(list.size(), kMaxList, "list entries");
  expect_room(triangles.size(), kMaxTriangles, "triangles");
  const Layout at = layout_of(pairs.size(), leaves.size(), list.size(), triangles.size());

  MemoryImage image;
  image.words_.resize(at.end * kLineWords);
  header.magic = static_cast<std::uint32_t>(contract::kImageMagic);
  header.version = static_cast<std::uint32_t>(contract::kImageVersion);
  header.lines = static_cast<std::uint32_t>(at.end);
  header.checksum = 0;
  header.pair_offset = static_cast<std::uint32_t>(at.pairs);
  header.pair_count = static_cast<std::uint32_t>(pairs.size());
  header.leaf_offset = static_cast<std::uint32_t>(at.leaves);
  header.leaf_count = static_cast<std::uint32_t>(leaves.size());
  header.list_offset = static_cast<std::uint32_t>(at.list);
  header.list_count = static_cast<std::uint32_t>(list.size());
  header.triangle_offset = static_cast<std::uint32_t>(at.triangles);
  header.triangle_count = static_cast<std::uint32_t>(triangles.size());

  const auto pack_all = [&](auto records, std::uint64_t line, auto name) {
    std::uint64_t* to = image.words_.data() + line * kLineWords;
    for (std::size_t i = 0; i < records.size(); ++i) {
      if (!records[i].fits()) fail(name(i) + ": a field does not fit its bits");
      records[i].pack(to);
      to += records[i].kWords;
    }
  };
  pack_all(pairs, at.pairs, [](std::size_t i) { return "node pair " + std::to_string(i); });
  pack_all(leaves, at.leaves, leaf_name);
  pack_all(triangles, at.triangles, triangle_name);
  if (!list.empty()) std::memcpy(image.words_.data() + at.list * kLineWords, list.data(), list.size_bytes());
  header.pack(image.words_.data());
  header.checksum = checksum(image.words_);
  header.pack(image.words_.data());
  image.header_ = header;
  return image;
}

MemoryImage MemoryImage::load(const std::filesystem::path& path) {
  const auto fail_file = [&](const std::string& what) { throw Error(path.string() + ": " + what); };
  // O_NONBLOCK: opening a pipe that nobody writes must not hang.
  File file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  if (file.descriptor < 0) fail_file("cannot open: " + errno_text());
  struct stat status;
  if (::fstat(file.descriptor, &status) != 0) fail_file("cannot read: " + errno_text());
  if (!S_ISREG(status.st_mode)) fail_file("not a regular file");
  const auto size = static_cast<std::uint64_t>(status.st_size);

  const auto read_exactly = [&](std::uint64_t* to, std::uint64_t count) {
    auto* bytes = reinterpret_cast<char*>(to);
    for (std::uint64_t done = 0; done < count;) {
      const ssize_t got = ::read(file.descriptor, bytes + done, std::min<std::uint64_t>(count - done, 1u << 30));
      if (got < 0 && errno == EINTR) continue;
      if (got < 0) fail_file("cannot read: " + errno_text());
      if (got == 0) fail_file("file ends after " + std::to_string(done) + " bytes");
      done += static_cast<std::uint64_t>(got);
    }
  };
  if (size < contract::kHeaderBytes)
    fail_file("file has " + std::to_string(size) + " bytes, a memory image at least " +
              std::to_string(contract::kHeaderBytes));
  std::vector<std::uint64_t> words(HeaderRecord::kWords);
  read_exactly(words.data(), contract::kHeaderBytes);
  const HeaderRecord header = HeaderRecord::unpack(words.data());
  if (header.magic != static_cast<std::uint32_t>(contract::kImageMagic)) fail_file("not a memory image (magic)");
  if (header.version != static_cast<std::uint32_t>(contract::kImageVersion))
    fail_file("memory image of version " + std::to_string(header.version) + ", expected " +
              std::to_string(contract::kImageVersion));
  if (size != header.lines * kLineBytes)
    fail_file("file has " + std::to_string(size) + " bytes, its header says " +
              std::to_string(header.lines * kLineBytes));
  try {
    check_header(header, size / 8);  // bounds the size before anything that large is allocated
    words.resize(size / 8);
    read_exactly(words.data() + HeaderRecord::kWords, size - contract::kHeaderBytes);
    return MemoryImage(std::move(words));
  } catch (const Error& error) {
    throw Error(path.string() + ": " + error.what());
  }
}

void MemoryImage::save(const std::filesystem::path& path) const {
  OutputFile file(path);
  file.refer(file_bytes());
  file.commit();
}

GridTransform MemoryImage::transform() const {
  GridTransform transform;
  transform.scale = std::bit_cast<double>(header_.scale);
  for (int i = 0; i < 3; ++i) transform.center[i] = std::bit_cast<double>(header_.center[i]);
  return transform;
}

void MemoryImage::check() const {
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

ImageStatistics describe(const MemoryImage& image) {
  constexpr std::size_t kLeafSizes = 17;
  const HeaderRecord& h = image.header();
  const BuildOptions costs;
  ImageStatistics s;
  s.triangles = h.triangle_count;
  s.depth_histogram.resize(std::size_t{h.max_depth} + 1);
  s.leaf_size_histogram.resize(kLeafSizes);
  const auto area = [](const Cell& cell) {
    const double x = cell.bound[1] - cell.bound[0], y = cell.bound[3] - cell.bound[2],
                 z = cell.bound[5] - cell.bound[4];
    return x * y + y * z + z * x;
  };
  double total = 0, root_area = 0;
  walk(
      image,
      [&](std::uint32_t node, const Side&, const Cell& cell) {
        ++s.interior;
        if (node == 0) root_area = area(cell);
        total += costs.traversal_cost * area(cell);
      },
      [&](std::uint32_t node, const Side& side, const Cell& cell) {
        const std::uint32_t count = image.leaf(side.child).count;
        ++s.leaves;
        s.empty_leaves += count == 0;
        s.references += count;
        s.max_leaf = std::max(s.max_leaf, count);
        s.max_depth = std::max(s.max_depth, cell.depth);
        ++s.depth_histogram[cell.depth];
        ++s.leaf_size_histogram[std::min<std::size_t>(count, kLeafSizes - 1)];
        if (node == 0) root_area = area(cell);
        total += costs.intersection_cost * count * area(cell);
      });
  s.nodes = s.interior + s.leaves;
  s.sah_cost = total / root_area;
  s.references_per_triangle = s.triangles ? static_cast<double>(s.references) / static_cast<double>(s.triangles) : 0.0;
  s.references_per_leaf = static_cast<double>(s.references) / static_cast<double>(s.leaves);
  s.bytes = image.bytes();
  s.pair_bytes = std::size_t{h.pair_count} * contract::kNodePairBytes;
  s.leaf_bytes = std::size_t{h.leaf_count} * contract::kLeafBytes;
  s.list_bytes = std::size_t{h.list_count} * 4;
  s.triangle_bytes = std::size_t{h.triangle_count} * contract::kTriangleBytes;
  return s;
}

}  // namespace retrace
