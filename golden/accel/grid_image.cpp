// See grid_image.hpp.
#include "grid_image.hpp"

#include <algorithm>
#include <string>

#include "golden/tree/kd_builder.hpp"
#include "golden/tree/memory_image.hpp"
#include "structures.hpp"

namespace retrace::accel {
namespace {

using contract::GridHeaderRecord;
using contract::TriangleRecord;

constexpr std::uint64_t kMaxTriangles = std::uint64_t{1} << contract::kTriangleIndexBits;
constexpr std::uint64_t kMaxList = std::uint64_t{1} << contract::kListIndexBits;
constexpr std::uint32_t kLast = std::uint32_t{1} << contract::kGridLastLog2;
constexpr int kMaxVoxels = (1 << contract::kVoxelBits) - 1;  // an axis

[[noreturn]] void fail(const std::string& what) { throw Error("grid image: " + what); }

std::uint64_t lines_of(std::uint64_t count, std::uint64_t bytes) { return (count * bytes + 63) / 64; }

std::uint64_t voxels_of(const GridHeaderRecord& header) {
  return std::uint64_t{header.resolution[0]} * header.resolution[1] * header.resolution[2];
}

/// A ray pierces at most so many voxels, and tests at most every reference.
std::uint64_t steps_of(const GridHeaderRecord& header) {
  return std::uint64_t{header.resolution[0]} + header.resolution[1] + header.resolution[2] + header.list_count;
}

}  // namespace

GridImage::GridImage(std::vector<std::uint64_t> words) : words_(std::move(words)) {
  if (words_.size() < GridHeaderRecord::kWords || words_.size() % kLineWords != 0)
    fail("header: " + std::to_string(bytes()) + " bytes are no whole number of lines, or none");
  header_ = GridHeaderRecord::unpack(words_.data());
  check();
}

std::size_t GridImage::voxels() const { return voxels_of(header_); }

std::uint32_t GridImage::checksum(std::span<const std::uint64_t> words) { return MemoryImage::checksum(words); }

GridImage GridImage::build(const GridScene& scene) {
  if (scene.two_levels) fail("a grid holds one level of triangles");
  if (scene.triangles.size() > kMaxTriangles)
    fail(std::to_string(scene.triangles.size()) + " triangles are more than the format holds, " +
         std::to_string(kMaxTriangles));
  TriangleSet set = from_grid(scene);
  GridHeaderRecord header{};
  glm::ivec3 resolution = glm::min(grid_resolution(set), glm::ivec3(kMaxVoxels));
  VoxelLists lists;
  for (;;) {
    // Sides are rounded up to whole codes, so the grid may be a little larger than the box.
    for (int a = 0; a < 3; ++a) {
      const std::int64_t extent = std::int64_t{scene.box[2 * a + 1]} - scene.box[2 * a];
      header.lower[a] = scene.box[2 * a];
      header.side[a] = static_cast<std::int32_t>((extent + resolution[a] - 1) / resolution[a]);
      set.box.lower[a] = header.lower[a] * 0x1p-24;
      set.box.upper[a] = (header.lower[a] + std::int64_t{header.side[a]} * resolution[a]) * 0x1p-24;
    }
    lists = list_voxels(set, resolution);
    if (lists.resolution == resolution) break;
    resolution = lists.resolution;
  }
  for (int a = 0; a < 3; ++a) header.resolution[a] = static_cast<std::uint32_t>(resolution[a]);
  if (lists.references.size() > kMaxList)
    fail(std::to_string(lists.references.size()) + " references are more than the format holds, " +
         std::to_string(kMaxList));

  header.magic = contract::kGridMagic;
  header.version = contract::kGridVersion;
  header.list_count = static_cast<std::uint32_t>(lists.references.size());
  header.triangle_count = static_cast<std::uint32_t>(scene.triangles.size());
  header.step_limit = static_cast<std::uint32_t>(steps_of(header));
  const std::uint64_t voxel_count = voxels_of(header);
  header.voxel_offset = contract::kGridHeaderBytes / 64;
  header.list_offset = header.voxel_offset + static_cast<std::uint32_t>(lines_of(voxel_count, 4));
  header.triangle_offset = header.list_offset + static_cast<std::uint32_t>(lines_of(header.list_count, 4));
  header.lines =
      header.triangle_offset + static_cast<std::uint32_t>(lines_of(header.triangle_count, contract::kTriangleBytes));

  std::vector<std::uint64_t> words(header.lines * kLineWords);
  const auto put = [&](std::uint32_t offset, std::size_t i, std::uint32_t value) {
    words[offset * kLineWords + i / 2] |= std::uint64_t{value} << (32 * (i % 2));
  };
  for (std::size_t v = 0; v < voxel_count; ++v) {
    const std::uint32_t begin = lists.offsets[v], end = lists.offsets[v + 1];
    put(header.voxel_offset, v, begin == end ? contract::kGridEmpty : begin);
    for (std::uint32_t i = begin; i < end; ++i)
      put(header.list_offset, i, lists.references[i] | (i + 1 == end ? kLast : 0));
  }
  for (std::size_t i = 0; i < scene.triangles.size(); ++i)
    make_unit_triangle(scene.triangles[i]).pack(&words[(header.triangle_offset + i) * kLineWords]);
  header.pack(words.data());
  header.checksum = checksum(words);
  header.pack(words.data());
  return GridImage(std::move(words));
}

void GridImage::check() const {
  const GridHeaderRecord& h = header_;
  if (h.magic != static_cast<std::uint32_t>(contract::kGridMagic)) fail("header: this is no grid image");
  if (h.version != static_cast<std::uint32_t>(contract::kGridVersion))
    fail("header: version " + std::to_string(h.version) + ", expected " + std::to_string(contract::kGridVersion));
  if (h.lines * std::uint64_t{kLineWords} != words_.size())
    fail("header: " + std::to_string(h.lines) + " lines, there are " + std::to_string(words_.size() / kLineWords));
  if (const std::uint32_t sum = checksum(words_); h.checksum != sum)
    fail("header: checksum " + std::to_string(h.checksum) + ", the words give " + std::to_string(sum));
  for (int a = 0; a < 3; ++a) {
    if (h.resolution[a] == 0) fail("header: no voxels on axis " + std::to_string(a));
    if (h.side[a] <= 0) fail("header: side " + std::to_string(h.side[a]) + " on axis " + std::to_string(a));
    const std::int64_t upper = h.lower[a] + std::int64_t{h.side[a]} * h.resolution[a];
    // A voxel of the root box may reach beyond it by less than its side.
    if (h.lower[a] < -(1 << contract::kPositionFrac) || upper > 3 * (std::int64_t{1} << contract::kPositionFrac))
      fail("header: the grid leaves the box of positions on axis " + std::to_string(a));
  }
  if (h.list_count > kMaxList || h.triangle_count > kMaxTriangles) fail("header: counts beyond the index types");
  const std::uint64_t voxel_end = h.voxel_offset + lines_of(voxels(), 4),
                      list_end = h.list_offset + lines_of(h.list_count, 4),
                      triangle_end = h.triangle_offset + lines_of(h.triangle_count, contract::kTriangleBytes);
  if (h.voxel_offset < contract::kGridHeaderBytes / 64 || voxel_end > h.list_offset || list_end > h.triangle_offset ||
      triangle_end != h.lines)
    fail("header: the sections overlap or leave the image");
  if (h.step_limit != std::min<std::uint64_t>(steps_of(h), 0xffffffffu))
    fail("header: step limit " + std::to_string(h.step_limit) + ", expected " + std::to_string(steps_of(h)));
  if (h.list_count > 0 && !(list(h.list_count - 1) & kLast))
    fail("list entry " + std::to_string(h.list_count - 1) + ": the last list does not end");
  for (std::size_t i = 0; i < h.list_count; ++i)
    if ((list(i) & ~kLast) >= h.triangle_count)
      fail("list entry " + std::to_string(i) + ": triangle " + std::to_string(list(i) & ~kLast) + " of " +
           std::to_string(h.triangle_count));
  // Lists stand in the order of their voxels, one behind the other, so that no two share entries and none is out of reach.
  std::uint64_t next = 0;
  for (std::size_t v = 0; v < voxels(); ++v) {
    const std::uint32_t first = voxel(v);
    if (first == contract::kGridEmpty) continue;
    if (first != next || next >= h.list_count)
      fail("voxel " + std::to_string(v) + ": its list begins at " + std::to_string(first) + ", expected " +
           std::to_string(next));
    while (!(list(next) & kLast)) ++next;
    ++next;
  }
  if (next != h.list_count)
    fail("voxels: lists of " + std::to_string(next) + " entries, there are " + std::to_string(h.list_count));
  for (std::size_t i = 0; i < h.triangle_count; ++i) {
    const TriangleRecord record = triangle(i);
    if (record.exponent_u < record.exponent_v || record.exponent_u > static_cast<std::uint32_t>(contract::kExponentMax))
      fail("triangle record " + std::to_string(i) + ": exponents " + std::to_string(record.exponent_u) + " and " +
           std::to_string(record.exponent_v));
  }
}

}  // namespace retrace::accel
