// Where the sections of a memory image stand, and what its records are called in messages. For the sources of this folder.
#pragma once
#include <array>
#include <cstdint>
#include <string>

#include "memory_image.hpp"

namespace retrace::image {

using contract::HeaderRecord;
using contract::InstanceRecord;
using contract::LeafRecord;
using contract::NodePairRecord;
using contract::TriangleRecord;

constexpr std::uint64_t kLineBytes = MemoryImage::kLineWords * 8;
constexpr std::uint64_t kHeaderLines = contract::kHeaderBytes / kLineBytes;
constexpr std::uint64_t kMaxPairs = std::uint64_t{1} << contract::kPairIndexBits;
constexpr std::uint64_t kMaxLeaves = std::uint64_t{1} << contract::kPairIndexBits;
constexpr std::uint64_t kMaxList = std::uint64_t{1} << contract::kListIndexBits;
constexpr std::uint64_t kMaxTriangles = std::uint64_t{1} << contract::kTriangleIndexBits;
constexpr std::uint64_t kMaxInstances = std::uint64_t{1} << contract::kTriangleIndexBits;
constexpr std::uint64_t kInline = contract::kLeafInline;
constexpr std::int32_t kUnit = std::int32_t{1} << contract::kPositionFrac;  ///< position code of 1.0
static_assert(contract::kNodePairBytes == NodePairRecord::kWords * 8 && contract::kLeafBytes == LeafRecord::kWords * 8);
static_assert(contract::kTriangleBytes == TriangleRecord::kWords * 8 &&
              contract::kHeaderBytes == HeaderRecord::kWords * 8);
static_assert(contract::kInstanceBytes == InstanceRecord::kWords * 8);

constexpr std::uint64_t lines_of(std::uint64_t count, std::uint64_t bytes) {
  return (count * bytes + kLineBytes - 1) / kLineBytes;
}

/// Where the sections of an image with these counts stand: one after the other, each from a line of its own.
struct Layout {
  std::uint64_t pairs, leaves, list, triangles, instances, end;
};
constexpr Layout layout_of(std::uint64_t pairs, std::uint64_t leaves, std::uint64_t list, std::uint64_t triangles,
                           std::uint64_t instances = 0, const SectionRoom& room = {}) {
  Layout at{};
  at.pairs = kHeaderLines;
  at.leaves = at.pairs + lines_of(pairs, contract::kNodePairBytes) + room.pairs;
  at.list = at.leaves + lines_of(leaves, contract::kLeafBytes) + room.leaves;
  at.triangles = at.list + lines_of(list, 4) + room.list;
  at.instances = at.triangles + lines_of(triangles, contract::kTriangleBytes);
  at.end = at.instances + lines_of(instances, contract::kInstanceBytes);
  return at;
}
constexpr std::uint64_t kMaxLines = layout_of(kMaxPairs, kMaxLeaves, kMaxList, kMaxTriangles, kMaxInstances).end;
static_assert(kMaxLines <= 0xffffffffu);

[[noreturn]] inline void fail(const std::string& what) { throw Error("memory image: " + what); }

inline std::string leaf_name(std::uint64_t leaf) { return "leaf record " + std::to_string(leaf); }
inline std::string instance_name(std::uint64_t instance) { return "instance record " + std::to_string(instance); }
inline std::string triangle_name(std::uint64_t triangle) { return "triangle record " + std::to_string(triangle); }

/// What does not depend on the tree: everything in the header but depth and step limit. Throws Error.
void check_header(const HeaderRecord& header, std::uint64_t words);

/// The root box of an object's tree, of which no record says it: its leftmost leaf has the lower faces, its rightmost one the upper faces.
/// Throws Error where the way to them leads out of the tables or does not end.
std::array<std::int32_t, 6> outermost_box(const MemoryImage& image, std::uint32_t root);

}  // namespace retrace::image
