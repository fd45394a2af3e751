// libFuzzer target: any bytes as a memory image. The checksum is put right first, or nothing but the checksum would
// ever be tested. An image that passes the check is then walked whole, the way an engine does, without a single test of
// an index: whatever is wrong with one that passed shows as an access outside (AddressSanitizer) or as one of the
// aborts below. Of two levels: the top level, and from each instance its object.
#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <set>
#include <vector>

#include "golden/tree/memory_image.hpp"

extern "C" std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t max_size);

namespace {

using namespace retrace;
using contract::HeaderRecord;
using contract::InstanceRecord;
using contract::LeafRecord;
using contract::NodePairRecord;
using contract::TriangleRecord;

void require(bool ok) {
  if (!ok) std::abort();
}

/// What a walk of a tree has met.
struct Met {
  std::uint64_t steps = 0, references = 0;
  std::uint32_t depth = 0;
};

/// Depth first along child indices, and out of every leaf along its links. Counts must stay below what the header
/// promises. `on_instance(number)`: of each reference of the top level.
template <typename OnInstance>
Met walk(const MemoryImage& image, std::uint32_t root, bool top, OnInstance&& on_instance) {
  const HeaderRecord& h = image.header();
  Met met;
  struct Entry {
    std::uint32_t node, depth;
  };
  std::vector<Entry> stack{{root, 0}};
  while (!stack.empty()) {
    const auto [node, depth] = stack.back();
    stack.pop_back();
    require(++met.steps <= h.step_limit);
    met.depth = std::max(met.depth, depth);
    const NodePairRecord pair = image.pair(node >> 1);
    const std::uint32_t axis = node & 1 ? pair.right_axis : pair.left_axis,
                        child = node & 1 ? pair.right_child : pair.left_child;
    if (axis != static_cast<std::uint32_t>(contract::kAxisLeaf)) {
      stack.push_back({2 * child + 1, depth + 1});
      stack.push_back({2 * child, depth + 1});
      continue;
    }
    const LeafRecord leaf = image.leaf(child);
    require(leaf.kind == static_cast<std::uint32_t>(top ? contract::kKindInstance : contract::kKindTriangles));
    for (std::uint32_t r = 0; r < leaf.count; ++r) {
      require(++met.references <= h.step_limit);
      if (top) {
        on_instance(image.reference(leaf, r));
        continue;
      }
      const TriangleRecord triangle = image.triangle(image.reference(leaf, r));
      require(triangle.exponent_u >= triangle.exponent_v);
    }
    for (int face = 0; face < 6; ++face) {
      // The way out through a face: down again from the linked node to a leaf that begins at that plane.
      std::uint32_t next = leaf.link[face];
      if (next == 0) continue;
      for (std::uint64_t steps = 0;;) {
        const NodePairRecord p = image.pair(next >> 1);
        const std::uint32_t a = next & 1 ? p.right_axis : p.left_axis, c = next & 1 ? p.right_child : p.left_child;
        if (a == static_cast<std::uint32_t>(contract::kAxisLeaf)) break;
        require(++steps <= h.pair_count);
        // Towards the face on its axis, to the left elsewhere.
        next = 2 * c + (static_cast<int>(a) == face / 2 && face % 2 == 0 ? 1 : 0);
      }
      const LeafRecord neighbour =
          image.leaf(next & 1 ? image.pair(next >> 1).right_child : image.pair(next >> 1).left_child);
      require(neighbour.bound[face ^ 1] == leaf.bound[face]);
    }
    std::uint64_t climbed = 0;
    for (std::uint32_t up = leaf.parent; up != root; up = image.pair(up >> 1).parent)
      require(++climbed <= h.pair_count);
  }
  return met;
}

void walk_all(const MemoryImage& image) {
  const HeaderRecord& h = image.header();
  std::set<std::uint32_t> roots;
  const Met top = walk(image, 0, image.two_levels(), [&](std::uint32_t number) {
    const InstanceRecord record = image.instance(number);
    require(record.root < h.pair_count && record.root != 0);
  });
  std::uint64_t references = top.references;
  std::uint32_t depth = top.depth;
  for (std::uint32_t i = 0; i < h.instance_count; ++i) {
    const std::uint32_t root = image.instance(i).root;
    if (!roots.insert(root).second) continue;
    const Met object = walk(image, 2 * root, false, [](std::uint32_t) {});
    references += object.references;
    depth = std::max(depth, object.depth);
  }
  const ImageStatistics statistics = describe(image);
  require(statistics.references == references && statistics.max_depth == depth && top.depth == h.max_depth);
}

/// Changes one bit of one field of one record of the section that stands at these lines.
template <typename Record>
void mutate_record(std::vector<std::uint64_t>& words, std::uint64_t line, std::uint64_t count, unsigned& random) {
  if (count == 0) return;
  const std::uint64_t at = line * MemoryImage::kLineWords + random % count * Record::kWords;
  if (at + Record::kWords > words.size()) return;
  Record record = Record::unpack(words.data() + at);
  int fields = 0;
  record.visit([&](const char*, auto&, int) { ++fields; });
  random = random * 1664525u + 1013904223u;
  int chosen = static_cast<int>((random >> 8) % static_cast<unsigned>(fields));
  record.visit([&](const char*, auto& value, int bits) {
    using Value = std::remove_reference_t<decltype(value)>;
    if (chosen-- == 0) value = static_cast<Value>(value ^ (Value{1} << (random >> 20) % static_cast<unsigned>(bits)));
  });
  record.pack(words.data() + at);
}

std::vector<std::uint64_t> to_words(const std::uint8_t* data, std::size_t size) {
  std::vector<std::uint64_t> words(size / 8);
  if (!words.empty()) std::memcpy(words.data(), data, words.size() * 8);
  return words;
}

}  // namespace

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t max_size,
                                               unsigned seed) {
  std::vector<std::uint64_t> words = to_words(data, size);
  if (seed % 3 == 0 || words.size() < HeaderRecord::kWords) return LLVMFuzzerMutate(data, size, max_size);
  const HeaderRecord h = HeaderRecord::unpack(words.data());
  unsigned random = seed * 2654435761u;
  switch (seed / 3 % 5) {
    case 0:
      mutate_record<HeaderRecord>(words, 0, 1, random);
      break;
    case 1:
      mutate_record<NodePairRecord>(words, h.pair_offset, h.pair_count, random);
      break;
    case 2:
      mutate_record<LeafRecord>(words, h.leaf_offset, h.leaf_count, random);
      break;
    case 3:
      mutate_record<InstanceRecord>(words, h.instance_offset, h.instance_count, random);
      break;
    default:
      mutate_record<TriangleRecord>(words, h.triangle_offset, h.triangle_count, random);
  }
  std::memcpy(data, words.data(), words.size() * 8);
  return size;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::vector<std::uint64_t> words = to_words(data, size);
  if (words.size() >= HeaderRecord::kWords) {
    HeaderRecord header = HeaderRecord::unpack(words.data());
    header.magic = static_cast<std::uint32_t>(contract::kImageMagic);
    if (header.version != static_cast<std::uint32_t>(contract::kImageVersionTwoLevels))
      header.version = static_cast<std::uint32_t>(contract::kImageVersion);
    header.pack(words.data());
    header.checksum = MemoryImage::checksum(words);
    header.pack(words.data());
  }
  try {
    const MemoryImage image(std::move(words));
    walk_all(image);
  } catch (const Error&) {
    // One clear line; anything else ends the fuzzer.
  }
  return 0;
}
