// The memory image: the one form in which every engine, in software or in hardware, sees a scene.
// Layout: header (2 lines), node pairs, leaf records, reference list, triangle records, and in an image of two levels
// instance records, each section starting on a 64-byte line. Records: scripts/contract/contract.toml,
// docs/number-contract.md. Design: docs/memory-image.md.
#pragma once
#include <cstdint>
#include <filesystem>
#include <iosfwd>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "golden/contract/contract_records.hpp"
#include "golden/scene/geometry.hpp"
#include "hls/include/contract.hpp"

namespace retrace {

/// Lines left free behind sections of an image of two levels, so that the top level may grow where it stands.
struct SectionRoom {
  std::uint32_t pairs = 0, leaves = 0, list = 0;
};

class MemoryImage {
 public:
  static constexpr std::size_t kLineWords = 8;  ///< 64-bit words in a 64-byte line

  MemoryImage() = default;
  /// Takes the words as they are and checks them (see check()). Throws Error.
  explicit MemoryImage(std::vector<std::uint64_t> words);
  /// Lays out the sections, fills offsets, counts, lines and checksum of the header. `list` holds 32-bit entries. The image has one level
  /// unless the header's version says two. Throws Error if a count exceeds its index type.
  static MemoryImage assemble(contract::HeaderRecord header, std::span<const contract::NodePairRecord> pairs,
                              std::span<const contract::LeafRecord> leaves, std::span<const std::uint32_t> list,
                              std::span<const contract::TriangleRecord> triangles,
                              std::span<const contract::InstanceRecord> instances = {}, const SectionRoom& room = {});

  /// Checksum that the header must hold for these words (its own word counts as 0).
  static std::uint32_t checksum(std::span<const std::uint64_t> words);
  /// Header field step_limit: no walk, in any mode, takes more steps. `leaf_depths` is the sum of the leaves' depths.
  static std::uint32_t step_limit(std::uint64_t pairs, std::uint64_t leaves, std::uint64_t references,
                                  std::uint64_t leaf_depths);

  /// Reads a file written by save(). Throws Error that names the file and what is wrong with it.
  static MemoryImage load(const std::filesystem::path& path);
  /// Writes file_bytes() (golden/base/output_file.hpp). Throws Error.
  void save(const std::filesystem::path& path) const;
  /// The image as it stands in a file.
  std::string_view file_bytes() const { return {reinterpret_cast<const char*>(words_.data()), bytes()}; }

  const contract::HeaderRecord& header() const { return header_; }
  std::span<const std::uint64_t> words() const { return words_; }
  std::size_t bytes() const { return words_.size() * 8; }
  GridTransform transform() const;
  bool two_levels() const { return header_.version == static_cast<std::uint32_t>(contract::kImageVersionTwoLevels); }

  // Pointers to the sections; two 64-bit words a node pair, eight a leaf, triangle or instance record.
  const std::uint64_t* pair_words() const { return words_.data() + header_.pair_offset * kLineWords; }
  const std::uint64_t* leaf_words() const { return words_.data() + header_.leaf_offset * kLineWords; }
  const std::uint64_t* triangle_words() const { return words_.data() + header_.triangle_offset * kLineWords; }
  const std::uint64_t* instance_words() const { return words_.data() + header_.instance_offset * kLineWords; }
  const std::uint64_t* list_words() const { return words_.data() + header_.list_offset * kLineWords; }

  contract::NodePairRecord pair(std::size_t i) const { return contract::NodePairRecord::unpack(pair_words() + 2 * i); }
  contract::LeafRecord leaf(std::size_t i) const { return contract::LeafRecord::unpack(leaf_words() + 8 * i); }
  contract::TriangleRecord triangle(std::size_t i) const {
    return contract::TriangleRecord::unpack(triangle_words() + 8 * i);
  }
  contract::InstanceRecord instance(std::size_t i) const {
    return contract::InstanceRecord::unpack(instance_words() + 8 * i);
  }
  std::uint32_t list(std::size_t i) const { return static_cast<std::uint32_t>(list_words()[i / 2] >> (32 * (i % 2))); }
  /// Reference `i` of a leaf, inline or from the list.
  std::uint32_t reference(const contract::LeafRecord& leaf, std::uint32_t i) const {
    return i < contract::kLeafInline ? leaf.refs[i] : list(leaf.list_base + i - contract::kLeafInline);
  }

  /// What a walk needs in order to be safe and to end: magic, version, checksum, sections inside the image, every index
  /// inside its table, a tree (each pair reached once, parents right), splits inside their cells, leaf bounds and links
  /// that equal what the walk down the tree gives, exponents in order, box inside [-1, 1], depth and step limit; of an image of two levels each
  /// tree, and that instances lead to trees of objects, stand in the world and have the boxes of their objects. Throws Error naming the record.
  void check() const;

 private:
  friend class TwoLevelImage;  // writes frames over each other

  std::vector<std::uint64_t> words_;
  contract::HeaderRecord header_;
};

/// What `retrace info` prints.
struct ImageStatistics {
  std::uint64_t nodes = 0, interior = 0, leaves = 0, empty_leaves = 0, triangles = 0, references = 0;
  double references_per_triangle = 0, references_per_leaf = 0;
  double sah_cost = 0;  ///< with the builder's default costs
  std::uint32_t max_depth = 0, max_leaf = 0;
  std::vector<std::uint64_t> depth_histogram;      ///< leaves by depth
  std::vector<std::uint64_t> leaf_size_histogram;  ///< leaves by number of references, last entry: that many or more
  std::size_t bytes = 0, pair_bytes = 0, leaf_bytes = 0, list_bytes = 0, triangle_bytes = 0, instance_bytes = 0;
  /// Of two levels. All counts above are over all trees then, each object's counted once; a reference to an instance costs what its object costs.
  std::uint64_t instances = 0, objects = 0, instanced_triangles = 0;
  std::uint64_t instance_references = 0;  ///< of `references`, those of the top level
};
ImageStatistics describe(const MemoryImage& image);

}  // namespace retrace
