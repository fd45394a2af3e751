// libFuzzer target: any bytes as a memory image. The checksum is put right first, or nothing but the checksum would
// ever be tested. An image that passes the check is then walked whole, the way an engine does, without a single test of
// an index: whatever is wrong with one that passed shows as an access outside (AddressSanitizer) or as one of the
// aborts below.
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <vector>

#include "golden/tree/memory_image.hpp"

extern "C" std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t max_size);

namespace {

using namespace retrace;
using contract::HeaderRecord;
using contract::LeafRecord;
using contract::NodePairRecord;
using contract::TriangleRecord;

void require(bool ok) {
  if (!ok) std::abort();
}

/// Depth first along child indices, and out of every leaf along its links. Counts must stay below what the header
/// promises.
void walk(const MemoryImage& image) {
  const HeaderRecord& h = image.header();
  std::uint64_t steps = 0, references = 0;
  std::vector<std::uint32_t> stack{0};
  while (!stack.empty()) {
    const std::uint32_t node = stack.back();
    stack.pop_back();
    require(++steps <= h.step_limit);
    const NodePairRecord pair = image.pair(node >> 1);
    const std::uint32_t axis = node & 1 ? pair.right_axis : pair.left_axis,
                        child = node & 1 ? pair.right_child : pair.left_child;
    if (axis != static_cast<std::uint32_t>(contract::kAxisLeaf)) {
      stack.push_back(2 * child + 1);
      stack.push_back(2 * child);
      continue;
    }
    const LeafRecord leaf = image.leaf(child);
    for (std::uint32_t r = 0; r < leaf.count; ++r) {
      const TriangleRecord triangle = image.triangle(image.reference(leaf, r));
      require(triangle.exponent_u >= triangle.exponent_v && ++references <= h.step_limit);
    }
    for (int face = 0; face < 6; ++face) {
      // The way out through a face: down again from the linked node to a leaf that begins at that plane.
      std::uint32_t next = leaf.link[face];
      if (next == 0) continue;
      std::uint32_t depth = 0;
      for (;;) {
        const NodePairRecord p = image.pair(next >> 1);
        const std::uint32_t a = next & 1 ? p.right_axis : p.left_axis, c = next & 1 ? p.right_child : p.left_child;
        if (a == static_cast<std::uint32_t>(contract::kAxisLeaf)) break;
        require(++depth <= h.max_depth);
        // Towards the face on its axis, to the left elsewhere.
        next = 2 * c + (static_cast<int>(a) == face / 2 && face % 2 == 0 ? 1 : 0);
      }
      const LeafRecord neighbour =
          image.leaf(next & 1 ? image.pair(next >> 1).right_child : image.pair(next >> 1).left_child);
      require(neighbour.bound[face ^ 1] == leaf.bound[face]);
    }
    for (std::uint32_t up = leaf.parent, depth = 0; up != 0; up = image.pair(up >> 1).parent)
      require(++depth <= h.max_depth);
  }
  const ImageStatistics statistics = describe(image);
  require(statistics.references == references && statistics.max_depth == h.max_depth);
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
  switch (seed / 3 % 4) {
    case 0:
      mutate_record<HeaderRecord>(words, 0, 1, random);
      break;
    case 1:
      mutate_record<NodePairRecord>(words, h.pair_offset, h.pair_count, random);
      break;
    case 2:
      mutate_record<LeafRecord>(words, h.leaf_offset, h.leaf_count, random);
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
    header.version = static_cast<std::uint32_t>(contract::kImageVersion);
    header.pack(words.data());
    header.checksum = MemoryImage::checksum(words);
    header.pack(words.data());
  }
  try {
    const MemoryImage image(std::move(words));
    walk(image);
  } catch (const Error&) {
    // One clear line; anything else ends the fuzzer.
  }
  return 0;
}
