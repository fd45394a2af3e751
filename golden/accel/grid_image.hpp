// The grid image: what the streaming machine (hls/streaming) sees of a scene. Header, voxels, triangle lists, triangle records, each section from a
// 64-byte line of its own; records: docs/number-contract.md (grid_header, triangle). Resolution and lists are those of the grid kPharrExact of
// grid.cpp, with voxels whose sides are whole position codes, so that every plane of the grid is one.
#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "golden/contract/contract_records.hpp"
#include "golden/scene/geometry.hpp"
#include "hls/include/contract.hpp"

namespace retrace::accel {

class GridImage {
 public:
  static constexpr std::size_t kLineWords = 8;  ///< 64-bit words in a 64-byte line

  /// Takes the words as they are and checks them. Throws Error.
  explicit GridImage(std::vector<std::uint64_t> words);
  /// Builds the grid. Throws Error for a scene of two levels, or when an index type is too small.
  static GridImage build(const GridScene& scene);
  /// Checksum that the header must hold for these words.
  static std::uint32_t checksum(std::span<const std::uint64_t> words);

  const contract::GridHeaderRecord& header() const { return header_; }
  std::span<const std::uint64_t> words() const { return words_; }
  std::size_t bytes() const { return words_.size() * 8; }
  std::size_t voxels() const;
  /// Entry of a voxel: where its list begins, or grid_empty.
  std::uint32_t voxel(std::size_t i) const { return entry(header_.voxel_offset, i); }
  /// Entry of the lists: a triangle, and at grid_last_log2 whether it is the last of its list.
  std::uint32_t list(std::size_t i) const { return entry(header_.list_offset, i); }
  contract::TriangleRecord triangle(std::size_t i) const {
    return contract::TriangleRecord::unpack(words_.data() + (header_.triangle_offset + i) * kLineWords);
  }

  /// Magic, version, length, checksum, sections in the image and apart, a grid inside the format of positions, every entry inside its section, lists
  /// that end, exponents in order, the step limit. Throws Error naming the record.
  void check() const;

 private:
  std::uint32_t entry(std::uint32_t offset, std::size_t i) const {
    return static_cast<std::uint32_t>(words_[offset * kLineWords + i / 2] >> (32 * (i % 2)));
  }

  std::vector<std::uint64_t> words_;
  contract::GridHeaderRecord header_;
};

}  // namespace retrace::accel
