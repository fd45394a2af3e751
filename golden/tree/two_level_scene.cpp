#include "golden/tree/two_level_scene.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "hls/include/contract.hpp"

namespace retrace {
namespace {

constexpr double kUnit = 1 << contract::kPositionFrac;

/// Codes by which boxes grow: what a walk over the top tree is off by (docs/error-bounds.md, "instance_enter") and the doubles here.
constexpr double kTopPad = 4.0;

std::array<std::int32_t, 6> root_box(const MemoryImage& image) {
  std::array<std::int32_t, 6> box{};
  for (std::size_t face = 0; face < 6; ++face) box[face] = static_cast<std::int32_t>(image.header().box[face]);
  return box;
}

}  // namespace

std::array<std::int32_t, 6> world_box(const contract::InstanceRecord& record,
                                      const std::array<std::int32_t, 6>& root_box) {
  glm::dmat3 linear;  // of the record: world to object
  glm::dvec3 offset;
  for (int row = 0; row < 3; ++row) {
    const auto at = static_cast<std::size_t>(row);
    const int shift = static_cast<int>(record.e[at]) - contract::kInstanceCoefficientFrac;
    for (int column = 0; column < 3; ++column)
      linear[column][row] = std::ldexp(record.m[3 * at + static_cast<std::size_t>(column)], shift);
    offset[row] = std::ldexp(static_cast<double>(record.b[at]), shift);
  }
  const glm::dmat3 back = glm::inverse(linear);
  glm::dvec3 lower(1e30), upper(-1e30);
  for (unsigned corner = 0; corner < 8; ++corner) {
    glm::dvec3 point;
    for (unsigned axis = 0; axis < 3; ++axis)
      point[static_cast<int>(axis)] = root_box[2 * axis + (corner >> axis & 1)] / kUnit;
    const glm::dvec3 world = back * (point - offset);
    lower = glm::min(lower, world);
    upper = glm::max(upper, world);
  }
  std::array<std::int32_t, 6> box{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const int i = static_cast<int>(axis);
    box[2 * axis] = static_cast<std::int32_t>(std::floor(lower[i] * kUnit - kTopPad));
    box[2 * axis + 1] = static_cast<std::int32_t>(std::ceil(upper[i] * kUnit + kTopPad));
  }
  return box;
}

TwoLevelScene build_two_levels(std::span<const GridScene> objects, std::span<const PlacedObject> placed) {
  TwoLevelScene scene;
  std::vector<std::uint32_t> sizes;
  for (const GridScene& object : objects) {
    scene.objects.push_back(build_kd(object));
    std::uint32_t ids = 0;
    for (const GridTriangle& triangle : object.triangles) ids = std::max(ids, triangle.id + 1);
    sizes.push_back(ids);
  }
  GridScene world;
  world.box = {1 << 30, -(1 << 30), 1 << 30, -(1 << 30), 1 << 30, -(1 << 30)};
  std::uint32_t first_id = 0;
  for (const PlacedObject& one : placed) {
    const auto number = static_cast<std::uint32_t>(scene.instances.size());
    if (one.object >= scene.objects.size()) throw Error("instance " + std::to_string(number) + ": no such object");
    const auto root = root_box(scene.objects[one.object]);
    const auto record = make_instance(one.to_world, root, one.object, first_id);
    if (!record) throw Error("instance " + std::to_string(number) + ": no record can place its object so");
    const auto box = world_box(*record, root);
    // Three corners of the box: with BuildOptions::clip off, a triangle counts as its bounding box.
    const GridPoint low(box[0], box[2], box[4]), high(box[1], box[3], box[5]);
    world.triangles.push_back({{low, high, GridPoint(low.x, high.y, low.z)}, number});
    for (std::size_t face = 0; face < 6; ++face) {
      const std::int32_t padded = box[face] + (face % 2 ? contract::kBoxPad : -contract::kBoxPad);
      world.box[face] = face % 2 ? std::max(world.box[face], padded) : std::min(world.box[face], padded);
    }
    scene.instances.push_back(*record);
    scene.object_of.push_back(one.object);
    first_id += sizes[one.object];
  }
  if (placed.empty()) world.box = {-1024, 1024, -1024, 1024, -1024, 1024};
  BuildOptions options;
  options.clip = false;
  scene.top = build_kd(world, options);
  return scene;
}

namespace {

/// Trees one after the other, indices moved to where their records stand.
struct Sections {
  std::vector<contract::NodePairRecord> pairs;
  std::vector<contract::LeafRecord> leaves;
  std::vector<std::uint32_t> list;
  std::vector<contract::TriangleRecord> triangles;

  /// `top`: references become numbers of instances, and the stand-ins are left out.
  void append(const MemoryImage& image, bool top) {
    const auto first_pair = static_cast<std::uint32_t>(pairs.size()), first_node = 2 * first_pair;
    const auto first_leaf = static_cast<std::uint32_t>(leaves.size());
    const auto first_triangle = static_cast<std::uint32_t>(triangles.size());
    const auto& header = image.header();
    const auto child = [&](std::uint32_t axis, std::uint32_t index) {
      return index + (axis == static_cast<std::uint32_t>(contract::kAxisLeaf) ? first_leaf : first_pair);
    };
    for (std::uint32_t i = 0; i < header.pair_count; ++i) {
      auto pair = image.pair(i);
      pair.left_child = child(pair.left_axis, pair.left_child);
      pair.right_child = child(pair.right_axis, pair.right_child);
      pair.parent += first_node;
      pairs.push_back(pair);
    }
    for (std::uint32_t i = 0; i < header.leaf_count; ++i) {
      auto leaf = image.leaf(i);
      std::vector<std::uint32_t> references;
      for (std::uint32_t r = 0; r < leaf.count; ++r) {
        const std::uint32_t index = image.reference(leaf, r);
        references.push_back(top ? image.triangle(index).id : index + first_triangle);
      }
      for (std::uint32_t& link : leaf.link)
        if (link != 0) link += first_node;
      leaf.parent += first_node;
      leaf.kind = static_cast<std::uint32_t>(top ? contract::kKindInstance : contract::kKindTriangles);
      leaf.refs = {};
      leaf.list_base = static_cast<std::uint32_t>(list.size());
      for (std::size_t r = 0; r < references.size(); ++r) {
        if (r < leaf.refs.size()) {
          leaf.refs[r] = references[r];
        } else {
          list.push_back(references[r]);
        }
      }
      leaves.push_back(leaf);
    }
    if (top) return;
    for (std::uint32_t i = 0; i < header.triangle_count; ++i) triangles.push_back(image.triangle(i));
  }
};

}  // namespace

std::vector<std::uint64_t> assemble_two_levels(const TwoLevelScene& scene) {
  Sections sections;
  sections.append(scene.top, true);
  std::vector<std::uint32_t> roots;
  for (const MemoryImage& object : scene.objects) {
    roots.push_back(static_cast<std::uint32_t>(sections.pairs.size()));
    sections.append(object, false);
  }
  if (sections.pairs.size() > std::size_t{1} << contract::kPairIndexBits ||
      sections.leaves.size() > std::size_t{1} << contract::kPairIndexBits ||
      sections.list.size() > std::size_t{1} << contract::kListIndexBits ||
      sections.triangles.size() > std::size_t{1} << contract::kTriangleIndexBits ||
      scene.instances.size() > std::size_t{1} << contract::kTriangleIndexBits)
    throw Error("scene of two levels: more records than indices can name");

  contract::HeaderRecord header = scene.top.header();
  header.version = contract::kImageVersionTwoLevels;
  header.checksum = 0;
  std::vector<std::uint64_t> words(contract::HeaderRecord::kWords);
  const auto section = [&](const auto& records, std::uint32_t& offset, std::uint32_t& count) {
    words.resize((words.size() + MemoryImage::kLineWords - 1) / MemoryImage::kLineWords * MemoryImage::kLineWords);
    offset = static_cast<std::uint32_t>(words.size() / MemoryImage::kLineWords);
    count = static_cast<std::uint32_t>(records.size());
    for (const auto& record : records) {
      words.resize(words.size() + record.kWords);
      record.pack(words.data() + words.size() - record.kWords);
    }
  };
  section(sections.pairs, header.pair_offset, header.pair_count);
  section(sections.leaves, header.leaf_offset, header.leaf_count);
  words.resize((words.size() + MemoryImage::kLineWords - 1) / MemoryImage::kLineWords * MemoryImage::kLineWords);
  header.list_offset = static_cast<std::uint32_t>(words.size() / MemoryImage::kLineWords);
  header.list_count = static_cast<std::uint32_t>(sections.list.size());
  for (std::size_t i = 0; i < sections.list.size(); ++i) {
    if (i % 2 == 0) words.push_back(0);
    words.back() |= std::uint64_t{sections.list[i]} << (32 * (i % 2));
  }
  section(sections.triangles, header.triangle_offset, header.triangle_count);
  auto instances = scene.instances;
  for (contract::InstanceRecord& instance : instances) instance.root = roots[instance.root];
  section(instances, header.instance_offset, header.instance_count);
  words.resize((words.size() + MemoryImage::kLineWords - 1) / MemoryImage::kLineWords * MemoryImage::kLineWords);
  header.lines = static_cast<std::uint32_t>(words.size() / MemoryImage::kLineWords);

  // A ray walks the top tree once, and at each of its references at most an object and back to the leaf.
  std::uint64_t steps = scene.top.header().step_limit;
  for (std::uint32_t i = 0; i < scene.top.header().leaf_count; ++i) {
    const auto leaf = scene.top.leaf(i);
    for (std::uint32_t r = 0; r < leaf.count; ++r) {
      const std::uint32_t number = scene.top.triangle(scene.top.reference(leaf, r)).id;
      steps += std::uint64_t{scene.objects[scene.object_of[number]].header().step_limit} + 1;
    }
  }
  header.step_limit = static_cast<std::uint32_t>(std::min<std::uint64_t>(steps, 0xffffffffu));
  header.pack(words.data());
  header.checksum = MemoryImage::checksum(words);
  header.pack(words.data());
  return words;
}

}  // namespace retrace
