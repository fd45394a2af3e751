#include "golden/tree/two_level_scene.hpp"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <string>
#include <utility>

#include "golden/base/clock.hpp"
#include "hls/include/contract.hpp"
#include "memory_image_layout.hpp"
#include "memory_image_walk.hpp"

namespace retrace {
namespace {

using namespace image;

/// Grows the root box by that of an instance.
void enclose(std::array<std::int32_t, 6>& root, const std::array<std::int32_t, 6>& box) {
  for (std::size_t face = 0; face < 6; ++face) {
    const std::int32_t padded = box[face] + (face % 2 ? contract::kBoxPad : -contract::kBoxPad);
    root[face] = face % 2 ? std::max(root[face], padded) : std::min(root[face], padded);
  }
}
constexpr std::array<std::int32_t, 6> kNothing{1 << 30, -(1 << 30), 1 << 30, -(1 << 30), 1 << 30, -(1 << 30)};
constexpr std::array<std::int32_t, 6> kSmallBox{-contract::kBoxPad, contract::kBoxPad,  -contract::kBoxPad,
                                                contract::kBoxPad,  -contract::kBoxPad, contract::kBoxPad};

/// Cost of a reference to an instance, in steps down: a measured choice (docs/memory-image.md, "Two levels").
constexpr double kEntryCost = 4.0;

/// The tree over the boxes of the instances. Its triangles are stand-ins with the numbers of instances as ids.
MemoryImage build_top(std::span<const contract::InstanceRecord> instances, std::span<const MemoryImage> objects,
                      const GridTransform& transform, BuildOptions options) {
  GridScene world;
  world.transform = transform;
  world.box = kNothing;
  for (std::uint32_t number = 0; number < instances.size(); ++number) {
    const contract::InstanceRecord& record = instances[number];
    const auto box = world_box(record, root_box(objects[record.root].header()));
    // Three corners of the box: with BuildOptions::clip off, a triangle counts as its bounding box.
    const GridPoint low(box[0], box[2], box[4]), high(box[1], box[3], box[5]);
    world.triangles.push_back({{low, high, GridPoint(low.x, high.y, low.z)}, number});
    enclose(world.box, box);
  }
  if (instances.empty()) world.box = kSmallBox;
  options.clip = false;
  options.intersection_cost = kEntryCost;
  options.progress = {};
  return build_kd(world, options);
}

}  // namespace

std::array<std::int32_t, 6> top_level_box(std::span<const GridScene> objects, std::span<const GridInstance> instances) {
  std::array<std::int32_t, 6> box = instances.empty() ? kSmallBox : kNothing;
  for (const GridInstance& instance : instances)
    enclose(box, world_box(instance.record, objects[instance.record.root].box));
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
  std::uint32_t first_id = 0;
  for (const PlacedObject& one : placed) {
    const auto number = static_cast<std::uint32_t>(scene.instances.size());
    if (one.object >= scene.objects.size()) throw Error("instance " + std::to_string(number) + ": no such object");
    const auto record = make_instance(one.to_world, root_box(scene.objects[one.object].header()), one.object, first_id);
    if (!record) throw Error("instance " + std::to_string(number) + ": no record can place its object so");
    scene.instances.push_back(*record);
    scene.object_of.push_back(one.object);
    first_id += sizes[one.object];
  }
  scene.top = build_top(scene.instances, scene.objects, {}, {});
  return scene;
}

namespace {

/// Records of several trees in tables that they share: indices are moved to where the records stand.
struct Tables {
  std::vector<contract::NodePairRecord> pairs;
  std::vector<contract::LeafRecord> leaves;
  std::vector<std::uint32_t> list;
  std::vector<contract::TriangleRecord> triangles;
};

/// Appends a tree, without its triangle records. `place(pair)`: where a pair of the image goes; `first_leaf`, `first_list`: where its leaf
/// records and list go; `reference(index)`: what becomes of a reference. The root pair goes to `root` if that is given.
template <typename Place, typename Reference>
void append_tree(const MemoryImage& image, contract::NodePairRecord* root, int kind, Place place,
                 std::uint32_t first_leaf, std::uint32_t first_list, Reference reference, Tables& to) {
  const auto& header = image.header();
  const auto child = [&](std::uint32_t axis, std::uint32_t index) {
    return axis == static_cast<std::uint32_t>(contract::kAxisLeaf) ? index + first_leaf : place(index);
  };
  const auto node = [&](std::uint32_t index) { return 2 * place(index >> 1) + (index & 1); };
  for (std::uint32_t i = 0; i < header.pair_count; ++i) {
    auto pair = image.pair(i);
    pair.left_child = child(pair.left_axis, pair.left_child);
    pair.right_child = child(pair.right_axis, pair.right_child);
    pair.parent = node(pair.parent);
    if (i == 0 && root) {
      *root = pair;
    } else {
      to.pairs.push_back(pair);
    }
  }
  for (std::uint32_t i = 0; i < header.leaf_count; ++i) {
    auto leaf = image.leaf(i);
    for (std::uint32_t& link : leaf.link)
      if (link != 0) link = node(link);
    leaf.parent = node(leaf.parent);
    leaf.kind = static_cast<std::uint32_t>(kind);
    const std::uint32_t base = std::exchange(leaf.list_base, 0), count = leaf.count;
    for (std::uint32_t r = 0; r < std::min<std::uint32_t>(count, kInline); ++r) leaf.refs[r] = reference(leaf.refs[r]);
    if (count > kInline) {
      leaf.list_base = first_list + static_cast<std::uint32_t>(to.list.size());
      for (std::uint32_t r = 0; r < count - kInline; ++r) to.list.push_back(reference(image.list(base + r)));
    }
    to.leaves.push_back(leaf);
  }
}

/// The objects as they stand in an image of two levels, behind pair 0, and where the root pair of each is.
Tables objects_of(const TwoLevelScene& scene, std::vector<std::uint32_t>& roots) {
  Tables tables;
  tables.pairs.emplace_back();  // the root of the top level
  roots.clear();
  for (const MemoryImage& object : scene.objects) {
    const auto first_pair = static_cast<std::uint32_t>(tables.pairs.size());
    const auto first_triangle = static_cast<std::uint32_t>(tables.triangles.size());
    roots.push_back(first_pair);
    append_tree(
        object, nullptr, contract::kKindTriangles, [&](std::uint32_t pair) { return first_pair + pair; },
        static_cast<std::uint32_t>(tables.leaves.size()), 0, [&](std::uint32_t r) { return first_triangle + r; },
        tables);
    for (std::uint32_t i = 0; i < object.header().triangle_count; ++i) tables.triangles.push_back(object.triangle(i));
  }
  return tables;
}

/// The top level behind tables of these sizes; `root` is pair 0.
Tables top_of(const TwoLevelScene& scene, std::size_t pairs, std::size_t leaves, std::size_t list,
              contract::NodePairRecord& root) {
  const MemoryImage& top = scene.top;
  Tables tables;
  append_tree(
      top, &root, contract::kKindInstance,
      [&](std::uint32_t pair) { return pair == 0 ? 0 : static_cast<std::uint32_t>(pairs) + pair - 1; },
      static_cast<std::uint32_t>(leaves), static_cast<std::uint32_t>(list),
      [&](std::uint32_t r) { return top.triangle(r).id; }, tables);
  return tables;
}

/// A ray walks the top tree once, and at each of its references at most an object and back to the leaf.
std::uint32_t two_level_step_limit(const TwoLevelScene& scene) {
  std::uint64_t steps = scene.top.header().step_limit;
  for (std::uint32_t i = 0; i < scene.top.header().leaf_count; ++i) {
    const auto leaf = scene.top.leaf(i);
    for (std::uint32_t r = 0; r < leaf.count; ++r) {
      const std::uint32_t number = scene.top.triangle(scene.top.reference(leaf, r)).id;
      steps += std::uint64_t{scene.objects[scene.object_of[number]].header().step_limit} + 1;
    }
  }
  return static_cast<std::uint32_t>(std::min<std::uint64_t>(steps, 0xffffffffu));
}

std::vector<contract::InstanceRecord> rooted(const TwoLevelScene& scene, std::span<const std::uint32_t> roots) {
  auto instances = scene.instances;
  for (std::size_t i = 0; i < instances.size(); ++i) instances[i].root = roots[scene.object_of[i]];
  return instances;
}

/// `at`: where the top level begins in each table.
MemoryImage lay_out_two_levels(const TwoLevelScene& scene, bool moves, std::vector<std::uint32_t>& roots,
                               std::array<std::size_t, 3>& at) {
  Tables tables = objects_of(scene, roots);
  at = {tables.pairs.size(), tables.leaves.size(), tables.list.size()};
  const Tables top = top_of(scene, at[0], at[1], at[2], tables.pairs[0]);
  tables.pairs.insert(tables.pairs.end(), top.pairs.begin(), top.pairs.end());
  tables.leaves.insert(tables.leaves.end(), top.leaves.begin(), top.leaves.end());
  tables.list.insert(tables.list.end(), top.list.begin(), top.list.end());
  SectionRoom room;
  if (moves) {
    // A top level of twice the size still fits.
    constexpr std::uint32_t kLeast = 4;
    room.pairs = kLeast + static_cast<std::uint32_t>(lines_of(top.pairs.size(), contract::kNodePairBytes));
    room.leaves = kLeast + static_cast<std::uint32_t>(lines_of(top.leaves.size(), contract::kLeafBytes));
    room.list = kLeast + static_cast<std::uint32_t>(lines_of(top.list.size() + scene.instances.size(), 4));
  }
  contract::HeaderRecord header = scene.top.header();
  header.version = static_cast<std::uint32_t>(contract::kImageVersionTwoLevels);
  header.step_limit = two_level_step_limit(scene);
  return MemoryImage::assemble(header, tables.pairs, tables.leaves, tables.list, tables.triangles, rooted(scene, roots),
                               room);
}

}  // namespace

MemoryImage make_two_level_image(const TwoLevelScene& scene) {
  std::vector<std::uint32_t> roots;
  std::array<std::size_t, 3> at{};
  return lay_out_two_levels(scene, false, roots, at);
}

std::vector<std::uint64_t> assemble_two_levels(const TwoLevelScene& scene) {
  const MemoryImage image = make_two_level_image(scene);
  return {image.words().begin(), image.words().end()};
}

// ------------------------------------------------------------------------------------------------ an image that moves

namespace {

void take_instances(TwoLevelScene& to, const GridScene& from) {
  to.instances.clear();
  to.object_of.clear();
  for (const GridInstance& instance : from.instances) {
    to.instances.push_back(instance.record);
    to.object_of.push_back(instance.record.root);
  }
}

std::uint32_t crc_of(std::span<const std::uint64_t> words, std::size_t begin, std::size_t end) {
  const auto* bytes = reinterpret_cast<const Bytef*>(words.data());
  return static_cast<std::uint32_t>(crc32_z(0, bytes + begin, end - begin));
}

std::size_t lines_between(std::size_t first_byte, std::size_t end_byte) {
  constexpr std::size_t kLine = MemoryImage::kLineWords * 8;
  return end_byte <= first_byte ? 0 : (end_byte + kLine - 1) / kLine - first_byte / kLine;
}

}  // namespace

TwoLevelImage::TwoLevelImage(const GridScene& scene, bool moves, const BuildOptions& options)
    : options_(options), moves_(moves) {
  if (!scene.two_levels) throw Error("a scene of one level has no instances");
  first_ = update(scene);
}

TwoLevelFrame TwoLevelImage::update(const GridScene& scene, std::span<const std::uint32_t> changed) {
  TwoLevelFrame frame;
  double lap = now();
  const auto step = [&] {
    const double last = std::exchange(lap, now());
    return lap - last;
  };
  const bool all = scene.objects.size() != scene_.objects.size();
  if (all) scene_.objects.resize(scene.objects.size());
  const auto rebuild = [&](std::uint32_t object) {
    BuildOptions options = options_;
    if (options_.progress && all)
      options.progress = [&, object](double fraction) {
        options_.progress((object + fraction) / static_cast<double>(scene.objects.size()));
      };
    scene_.objects[object] = build_kd(scene.objects[object], options);
    ++frame.objects;
  };
  if (all) {
    for (std::uint32_t object = 0; object < scene.objects.size(); ++object) rebuild(object);
  } else {
    for (const std::uint32_t object : changed) rebuild(object);
  }
  frame.objects_s = step();
  take_instances(scene_, scene);
  scene_.top = build_top(scene_.instances, scene_.objects, scene.transform, options_);
  frame.top_s = step();
  if (image_.words().empty() || frame.objects > 0 || !moves_) {
    frame.laid_out_anew = true;
  } else {
    frame.bytes = write_over();
    frame.laid_out_anew = frame.bytes == 0;
  }
  if (frame.laid_out_anew) {
    lay_out();
    frame.bytes = image_.bytes();
  }
  frame.write_s = step();
  return frame;
}

void TwoLevelImage::lay_out() {
  std::array<std::size_t, 3> at{};
  image_ = lay_out_two_levels(scene_, moves_, roots_, at);
  objects_in_ = {at[0], at[1], at[2]};
  const auto& h = image_.header();
  constexpr std::size_t kLine = kLineBytes;
  fixed_crc_[0] = crc_of(image_.words(), h.pair_offset * kLine + contract::kNodePairBytes,
                         h.pair_offset * kLine + objects_in_.pairs * contract::kNodePairBytes);
  fixed_crc_[1] =
      crc_of(image_.words(), h.leaf_offset * kLine, h.leaf_offset * kLine + objects_in_.leaves * contract::kLeafBytes);
  fixed_crc_[2] = crc_of(image_.words(), h.list_offset * kLine, h.list_offset * kLine + objects_in_.list * 4);
  fixed_crc_[3] = crc_of(image_.words(), h.triangle_offset * kLine, h.instance_offset * kLine);
}

/// Bytes written, in whole lines; 0 if there is no room.
std::size_t TwoLevelImage::write_over() {
  contract::HeaderRecord header = image_.header();
  contract::NodePairRecord root;
  const Tables top = top_of(scene_, objects_in_.pairs, objects_in_.leaves, objects_in_.list, root);
  const std::size_t pairs = objects_in_.pairs + top.pairs.size(), leaves = objects_in_.leaves + top.leaves.size(),
                    list = objects_in_.list + top.list.size();
  if (scene_.instances.size() != header.instance_count ||
      header.pair_offset + lines_of(pairs, contract::kNodePairBytes) > header.leaf_offset ||
      header.leaf_offset + lines_of(leaves, contract::kLeafBytes) > header.list_offset ||
      header.list_offset + lines_of(list, 4) > header.triangle_offset || pairs > kMaxPairs || leaves > kMaxLeaves ||
      list > kMaxList)
    return 0;

  std::vector<std::uint64_t>& words = image_.words_;
  auto* bytes = reinterpret_cast<std::uint8_t*>(words.data());
  std::size_t written = contract::kHeaderBytes / kLineBytes + 1;  // header and pair 0
  /// Writes records behind the first `kept` of a section, and zeros over what was there of the frame before.
  const auto write = [&](std::uint64_t line, std::size_t kept, std::size_t before, const auto& records) {
    constexpr std::size_t kSize = sizeof(std::uint64_t) * std::remove_cvref_t<decltype(records[0])>::kWords;
    const std::size_t begin = line * kLineBytes + kept * kSize, end = begin + records.size() * kSize,
                      old = line * kLineBytes + before * kSize;
    std::uint64_t* to = words.data() + begin / 8;
    for (const auto& record : records) {
      record.pack(to);
      to += record.kWords;
    }
    if (old > end) std::memset(bytes + end, 0, old - end);
    written += lines_between(begin, std::max(end, old));
  };
  root.pack(words.data() + header.pair_offset * MemoryImage::kLineWords);
  write(header.pair_offset, objects_in_.pairs, header.pair_count, top.pairs);
  write(header.leaf_offset, objects_in_.leaves, header.leaf_count, top.leaves);
  const std::size_t list_at = header.list_offset * kLineBytes, list_begin = list_at + 4 * objects_in_.list,
                    list_end = list_at + 4 * list, old_end = list_at + 4 * std::size_t{header.list_count};
  if (!top.list.empty()) std::memcpy(bytes + list_begin, top.list.data(), 4 * top.list.size());
  if (old_end > list_end) std::memset(bytes + list_end, 0, old_end - list_end);
  written += lines_between(list_begin, std::max(list_end, old_end));
  write(header.instance_offset, 0, header.instance_count, rooted(scene_, roots_));

  const contract::HeaderRecord& tree = scene_.top.header();
  header.pair_count = static_cast<std::uint32_t>(pairs);
  header.leaf_count = static_cast<std::uint32_t>(leaves);
  header.list_count = static_cast<std::uint32_t>(list);
  header.scale = tree.scale;
  header.center = tree.center;
  header.box = tree.box;
  header.max_depth = tree.max_depth;
  header.step_limit = two_level_step_limit(scene_);
  header.checksum = 0;
  header.pack(words.data());

  // The checksum over what frames change and, between, that of what they do not: header and pair 0, objects' pairs, the top level's, and so on.
  const std::size_t fixed[4][2] = {
      {header.pair_offset * kLineBytes + contract::kNodePairBytes,
       header.pair_offset * kLineBytes + objects_in_.pairs * contract::kNodePairBytes},
      {header.leaf_offset * kLineBytes, header.leaf_offset * kLineBytes + objects_in_.leaves * contract::kLeafBytes},
      {list_at, list_begin},
      {header.triangle_offset * kLineBytes, header.instance_offset * kLineBytes}};
  uLong crc = 0;
  std::size_t at = 0;
  for (std::size_t i = 0; i < std::size(fixed); ++i) {
    crc = crc32_z(crc, bytes + at, fixed[i][0] - at);
    crc = crc32_combine(crc, fixed_crc_[i], static_cast<z_off_t>(fixed[i][1] - fixed[i][0]));
    at = fixed[i][1];
  }
  header.checksum = static_cast<std::uint32_t>(crc32_z(crc, bytes + at, image_.bytes() - at));
  header.pack(words.data());
  image_.header_ = header;
  return written * kLineBytes;
}

}  // namespace retrace
