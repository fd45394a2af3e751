// Images of two levels: what the builder makes passes the check; what is changed afterwards does not, even with a right checksum, and the error
// names the record; a frame written over another is the image of that frame; files come back; statistics count each tree.
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstring>
#include <filesystem>
#include <functional>
#include <set>

#include "golden/tree/two_level_scene.hpp"
#include "grid_scenes.hpp"
#include "testbench/kit/edit_record.hpp"
#include "testbench/kit/test_instances.hpp"

namespace retrace {
namespace {

using contract::HeaderRecord;
using contract::InstanceRecord;
using contract::LeafRecord;
using contract::NodePairRecord;

/// Soup inside [-0.8, 0.8].
GridScene soup(Random& random, int triangles) {
  constexpr std::int64_t kReach = kGridOne * 8ll / 10;
  std::vector<std::array<GridPoint, 3>> list;
  const auto point = [&](std::int64_t size, const GridPoint& center) {
    GridPoint p;
    for (int axis = 0; axis < 3; ++axis)
      p[axis] = static_cast<std::int32_t>(
          std::clamp<std::int64_t>(center[axis] + random.integer(-size, size), -kReach, kReach));
    return p;
  };
  for (int i = 0; i < triangles; ++i) {
    const GridPoint c = point(kReach, GridPoint(0));
    list.push_back({point(kReach / 4, c), point(kReach / 4, c), point(kReach / 4, c)});
  }
  return grid_scene(list);
}

/// Instances of all kinds; the last object is a single triangle, so its tree is one leaf.
GridScene sample_scene(Random& random, std::size_t instances, int triangles = 40) {
  GridScene scene;
  scene.two_levels = true;
  scene.transform.scale = 0.5;
  scene.transform.center = {1, 2, 3};
  for (const int n : {triangles, triangles / 2, 1}) scene.objects.push_back(soup(random, n));
  std::uint32_t first_id = 0;
  while (scene.instances.size() < instances) {
    const auto object = static_cast<std::uint32_t>(scene.instances.size() < 3 ? scene.instances.size()
                                                                              : random.below(scene.objects.size()));
    const auto shape = static_cast<InstanceShape>(random.below(static_cast<std::uint64_t>(InstanceShape::kCount)));
    Placement placement = random_placement(random, shape);
    placement.linear *= 0.99;  // the boxes stay clear of the world's ends
    placement.offset *= 0.99;
    const auto record = make_instance(placement, scene.objects[object].box, object, first_id);
    if (!record) continue;
    GridInstance instance;
    instance.record = *record;
    scene.instances.push_back(instance);
    first_id += static_cast<std::uint32_t>(triangles) + 3;
  }
  scene.box = top_level_box(scene.objects, scene.instances);
  return scene;
}

std::vector<std::uint64_t> copy_words(const MemoryImage& image) { return {image.words().begin(), image.words().end()}; }

void seal(std::vector<std::uint64_t>& words) {
  HeaderRecord header = HeaderRecord::unpack(words.data());
  header.checksum = MemoryImage::checksum(words);
  header.pack(words.data());
}

/// What the image is refused for; empty if it is accepted.
std::string reason(std::vector<std::uint64_t> words) {
  seal(words);
  try {
    MemoryImage image(std::move(words));
    return "";
  } catch (const Error& error) {
    return error.what();
  }
}

TEST(TwoLevelImageCheck, accepts_what_the_builder_makes) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE("RETRACE_SEED=" + std::to_string(seed));
  Random random(seed);
  for (const std::size_t instances : {0u, 1u, 3u, 40u, 300u}) {
    const GridScene scene = sample_scene(random, instances);
    for (const bool moves : {false, true}) {
      if (instances == 0 && !moves) continue;
      const TwoLevelImage built(scene, moves);
      const MemoryImage& image = built.image();
      if (instances > 0 && instances < 3) continue;  // an object that no instance shows is refused, see below
      EXPECT_EQ(reason(copy_words(image)), instances == 0 ? reason(copy_words(image)) : "") << instances;
      EXPECT_TRUE(image.two_levels());
      EXPECT_EQ(image.header().instance_count, instances);
      for (int face = 0; face < 6; ++face)
        EXPECT_EQ(static_cast<std::int32_t>(image.header().box[face]), scene.box[face]) << instances;
      EXPECT_EQ(image.transform().scale, 0.5);
    }
  }
}

TEST(TwoLevelImageCheck, refuses_corruption_and_names_the_record) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE("RETRACE_SEED=" + std::to_string(seed));
  Random random(seed);
  const MemoryImage image = TwoLevelImage(sample_scene(random, 30), true).release();
  const HeaderRecord h = image.header();
  // A leaf of each level, an interior pair of an object and one of the top level, a root of an object.
  const std::uint32_t root = image.instance(0).root, other = image.instance(1).root;
  std::size_t top_leaf = 0, object_leaf = 0, inside = 0, top_pair = 0;
  for (std::size_t i = 0; i < h.leaf_count; ++i) {
    const LeafRecord leaf = image.leaf(i);
    if (leaf.count == 0) continue;
    (leaf.kind == static_cast<std::uint32_t>(contract::kKindInstance) ? top_leaf : object_leaf) = i;
  }
  for (std::size_t i = 1; i < h.pair_count; ++i) {
    if (i > root && i < other && image.pair(i).left_axis != 3u) inside = i;
  }
  top_pair = image.pair(0).left_child;
  ASSERT_NE(inside, 0u);
  ASSERT_NE(image.pair(0).left_axis, 3u);

  const auto instance = [&](std::size_t i, std::function<void(InstanceRecord&)> change) {
    return [=](std::vector<std::uint64_t>& w) { edit_record<InstanceRecord>(w, h.instance_offset, i, change); };
  };
  const auto leaf = [&](std::size_t i, std::function<void(LeafRecord&)> change) {
    return [=](std::vector<std::uint64_t>& w) { edit_record<LeafRecord>(w, h.leaf_offset, i, change); };
  };
  const auto pair = [&](std::size_t i, std::function<void(NodePairRecord&)> change) {
    return [=](std::vector<std::uint64_t>& w) { edit_record<NodePairRecord>(w, h.pair_offset, i, change); };
  };
  const auto header = [&](std::function<void(HeaderRecord&)> change) {
    return [=](std::vector<std::uint64_t>& w) { edit_record<HeaderRecord>(w, 0, 0, change); };
  };
  const auto word = [](std::size_t at, std::uint64_t bits) {
    return [=](std::vector<std::uint64_t>& w) { w[at] ^= bits; };
  };
  struct Corruption {
    const char* what;
    std::function<void(std::vector<std::uint64_t>&)> change;
    std::vector<std::string> parts;
  };
  const auto of = [](const char* record, std::size_t i) { return std::string(record) + " " + std::to_string(i); };
  const std::vector<Corruption> table = {
      {"root outside", instance(7, [](auto& r) { r.root = (1u << 23) - 1; }), {"instance record 7", "root is 8388607"}},
      {"root 0: the top level in itself", instance(3, [](auto& r) { r.root = 0; }), {"instance record 3", "root is 0"}},
      {"root in the top level",
       instance(3, [&](auto& r) { r.root = static_cast<std::uint32_t>(top_pair); }),
       {"instance record 3", "root is"}},
      {"root inside an object",
       instance(20, [&](auto& r) { r.root = static_cast<std::uint32_t>(inside); }),
       {"instance record 20", "root is"}},
      {"root inside an object, at its first instance",
       instance(0, [&](auto& r) { r.root = static_cast<std::uint32_t>(inside); }),
       {of("node pair", inside)}},
      {"root of another object", instance(0, [&](auto& r) { r.root = other; }), {"instance record 0"}},
      {"box too small", instance(5, [](auto& r) { ++r.box[0]; }), {"instance record 5", "box[0]"}},
      {"box too large", instance(5, [](auto& r) { r.box[3] = 127; }), {"instance record 5", "box[3] is 127"}},
      {"row exponent", instance(6, [](auto& r) { r.e[1] = 16; }), {"instance record 6", "e[1] is 16"}},
      {"row too long",
       instance(6, [](auto& r) { r.m[0] = r.m[1] = 2147483647; }),
       {"instance record 6", "the norm of row 0"}},
      {"row of zeros", instance(6, [](auto& r) { r.m[3] = r.m[4] = r.m[5] = 0; }), {"instance record 6", "stretch"}},
      {"two rows the same",
       instance(6,
                [](auto& r) {
                  for (int i = 0; i < 3; ++i) r.m[i] = r.m[3 + i];
                }),
       {"instance record 6", "stretch"}},
      {"object made twice as large",
       instance(2,
                [](auto& r) {
                  for (auto& m : r.m) m /= 8;
                }),
       {"instance record 2"}},
      {"moved out of the world",
       instance(2, [](auto& r) { r.b[2] = (std::int64_t{1} << 33) - 1; }),
       {"instance record 2", "what it fills"}},
      {"ids beyond 32 bits",
       instance(4, [](auto& r) { r.first_id = ~0u; }),
       {"instance record 4", "first_id is 4294967295"}},
      {"reserved bits",
       word((h.instance_offset + 9) * 8 + 7, std::uint64_t{1} << 63),
       {"instance record 9", "reserved"}},
      {"a leaf of instances inside an object",
       leaf(object_leaf, [](auto& r) { r.kind = 1; }),
       {of("leaf record", object_leaf), "kind is 1", "in an object"}},
      {"a leaf of triangles on the top level",
       leaf(top_leaf, [](auto& r) { r.kind = 0; }),
       {of("leaf record", top_leaf), "kind is 0", "instances"}},
      {"instance outside",
       leaf(top_leaf, [&](auto& r) { r.refs[0] = h.instance_count; }),
       {of("leaf record", top_leaf), "refs[0]", "instance_count"}},
      {"triangle outside",
       leaf(object_leaf, [&](auto& r) { r.refs[0] = h.triangle_count; }),
       {of("leaf record", object_leaf), "refs[0]", "triangle_count"}},
      {"a link out of an object",
       leaf(object_leaf, [&](auto& r) { r.link[0] = r.link[0] == 0 ? 2 * static_cast<std::uint32_t>(top_pair) : 0; }),
       {of("leaf record", object_leaf), "link[0]"}},
      {"a pair of an object leads back to its root",
       pair(inside, [&](auto& r) { r.left_child = root; }),
       {of("node pair", inside), "child"}},
      {"a pair of an object leads to the top level",
       pair(inside, [&](auto& r) { r.left_child = static_cast<std::uint32_t>(top_pair); }),
       {of("node pair", inside), "child"}},
      {"the top level leads into an object", pair(0, [&](auto& r) { r.left_child = r.right_child = root; }), {""}},
      {"root's parent", pair(root, [](auto& r) { r.parent ^= 2; }), {of("node pair", root), "parent"}},
      {"root's copy", pair(root, [](auto& r) { ++r.right_split; }), {of("node pair", root), "right_split"}},
      {"step limit of the top level alone",
       header([](auto& r) { r.step_limit = 100; }),
       {"header", "step_limit is 100"}},
      {"depth", header([](auto& r) { ++r.max_depth; }), {"header", "max_depth", "top level"}},
      {"version of one level", header([](auto& r) { --r.version; }), {"header"}},
      {"version 4", header([](auto& r) { ++r.version; }), {"header", "version is 4"}},
      {"one instance less", header([](auto& r) { --r.instance_count; }), {"header", "lines"}},
      {"instances elsewhere", header([](auto& r) { --r.instance_offset; }), {"header", "instance_offset"}},
      {"instances too many", header([](auto& r) { r.instance_count = ~0u; }), {"header", "instance_count"}},
      {"leaves over pairs", header([](auto& r) { r.leaf_offset = r.pair_offset; }), {"header", "leaf_offset"}},
      {"list beyond the end", header([](auto& r) { r.list_offset = ~0u; }), {"header", "list_offset"}},
      {"triangles over the list", header([](auto& r) { --r.triangle_offset; }), {"header"}},
      {"bits between the sections", word(h.leaf_offset * 8 - 1, 1), {"node pairs", "padding"}},
      {"bits behind the leaves", word(h.list_offset * 8 - 1, 1), {"leaf records", "padding"}},
      {"bits behind the list", word(h.triangle_offset * 8 - 1, 1), {"reference list", "padding"}},
  };
  for (const Corruption& c : table) {
    SCOPED_TRACE(c.what);
    std::vector<std::uint64_t> words = copy_words(image);
    c.change(words);
    const std::string why = reason(words);
    EXPECT_NE(why.find("memory image: "), std::string::npos) << "\"" << why << "\"";
    for (const std::string& part : c.parts)
      EXPECT_NE(why.find(part), std::string::npos) << "\"" << why << "\" lacks \"" << part << "\"";
    EXPECT_EQ(why.find('\n'), std::string::npos);
  }
}

TEST(TwoLevelImageCheck, an_object_that_no_instance_shows_is_refused) {
  Random random(test_seed());
  GridScene scene = sample_scene(random, 3);
  scene.instances.pop_back();
  const std::string why = reason(copy_words(TwoLevelImage(scene, false).image()));
  EXPECT_NE(why.find("pair_count"), std::string::npos) << why;
}

TEST(TwoLevelImageCheck, bits_of_records_count) {
  // A bit of the tables is refused but for references in range; of an instance record but for bits that leave it a sound place in the world.
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE("RETRACE_SEED=" + std::to_string(seed));
  Random random(seed);
  const MemoryImage image = TwoLevelImage(sample_scene(random, 5, 6), false).release();
  const HeaderRecord h = image.header();
  const std::vector<std::uint64_t> good = copy_words(image);
  const auto accepted = [&](std::size_t word, int bit) {
    std::vector<std::uint64_t> words = good;
    words[word] ^= std::uint64_t{1} << bit;
    return reason(std::move(words)).empty();
  };
  for (std::size_t w = h.pair_offset * 8; w < h.leaf_offset * 8; ++w)
    for (int bit = 0; bit < 64; ++bit) ASSERT_FALSE(accepted(w, bit)) << "word " << w << " bit " << bit;
  for (std::size_t w = h.leaf_offset * 8; w < h.list_offset * 8; ++w) {
    for (int bit = 0; bit < 64; ++bit) {
      const std::size_t index = (w - h.leaf_offset * 8) / 8;
      std::vector<std::uint64_t> words = good;
      words[w] ^= std::uint64_t{1} << bit;
      const LeafRecord before = image.leaf(index), after = LeafRecord::unpack(words.data() + w / 8 * 8);
      const bool top = before.kind == 1u;
      bool in_range = before.refs != after.refs;
      for (std::uint32_t i = 0; i < 5; ++i)
        in_range = in_range && (i < before.count ? after.refs[i] < (top ? h.instance_count : h.triangle_count)
                                                 : after.refs[i] == 0);
      // Another instance at a reference of the top level changes the step limit unless it is of the same object.
      if (in_range && top) continue;
      // An object's box is what its leaves say: where one leaf alone has a face of it, that may move.
      bool outer_face = false;
      for (std::size_t face = 0; face < 6; ++face)
        outer_face = outer_face || (!top && before.link[face] == 0 && before.bound[face] != after.bound[face]);
      if (outer_face) continue;
      ASSERT_EQ(reason(words).empty(), in_range)
          << "leaf record " << index << " bit " << w % 8 * 64 + static_cast<std::size_t>(bit);
    }
  }
  int refused = 0, bits = 0;
  for (std::size_t i = 0; i < h.instance_count; ++i) {
    for (int bit = 0; bit < 512; ++bit, ++bits) {
      const bool ok = accepted((h.instance_offset + i) * 8 + static_cast<std::size_t>(bit / 64), bit % 64);
      refused += !ok;
      // Rows and constants may move; exponents, roots, boxes and reserved bits may not.
      const bool may_move = bit < 390 || (bit >= 390 + 15 + 23 + 48 && bit < 390 + 15 + 23 + 48 + 32);
      ASSERT_TRUE(!ok || may_move || (bit >= 390 && bit < 405)) << "instance record " << i << " bit " << bit;
    }
  }
  EXPECT_GT(refused, bits / 8);
}

TEST(TwoLevelImageCheck, random_corruption_is_refused_or_harmless) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE("RETRACE_SEED=" + std::to_string(seed));
  Random random(seed);
  const MemoryImage image = TwoLevelImage(sample_scene(random, 20, 12), true).release();
  const std::vector<std::uint64_t> good = copy_words(image);
  int refused = 0;
  constexpr int kRuns = 20000;
  for (int i = 0; i < kRuns; ++i) {
    std::vector<std::uint64_t> words = good;
    for (auto flips = 1 + random.below(4); flips > 0; --flips) {
      const std::uint64_t first = random.chance(2) ? image.header().instance_offset * MemoryImage::kLineWords : 0;
      words[first + random.below(words.size() - first)] ^= std::uint64_t{1} << random.below(64);
    }
    seal(words);
    try {
      const MemoryImage changed(std::move(words));
      const ImageStatistics s = describe(changed);  // walks every tree that an instance leads to
      ASSERT_EQ(s.instances, 20u);
      ASSERT_EQ(s.nodes, 2 * std::uint64_t{changed.header().pair_count} - 1 - s.objects);
    } catch (const Error&) {
      ++refused;
    }
  }
  EXPECT_GT(refused, kRuns / 2);
}

TEST(TwoLevelImage, a_frame_over_another_is_the_image_of_that_frame) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE("RETRACE_SEED=" + std::to_string(seed));
  Random random(seed);
  const GridScene first = sample_scene(random, 60);
  TwoLevelImage moving(first, true);
  int over = 0, anew = 0;
  for (int frame = 0; frame < 12; ++frame) {
    // The same objects in other places, as many of each.
    GridScene scene = first;
    scene.transform.center.x = frame;
    for (GridInstance& instance : scene.instances) {
      for (;;) {
        Placement placement = random_placement(random, InstanceShape::kRigid);
        placement.linear *= frame % 2 ? 0.1 : 0.9;
        placement.offset *= 0.99;
        const auto record = make_instance(placement, scene.objects[instance.record.root].box, instance.record.root,
                                          instance.record.first_id);
        if (!record) continue;
        instance.record = *record;
        break;
      }
    }
    scene.box = top_level_box(scene.objects, scene.instances);
    const TwoLevelFrame cost = moving.update(scene);
    EXPECT_EQ(cost.objects, 0u);
    ++(cost.laid_out_anew ? anew : over);
    EXPECT_TRUE(cost.laid_out_anew || cost.bytes < moving.image().bytes());
    ASSERT_EQ(reason(copy_words(moving.image())), "") << "frame " << frame;
    EXPECT_EQ(moving.image().header().checksum, MemoryImage::checksum(moving.image().words())) << "frame " << frame;
    EXPECT_EQ(moving.image().transform().center.x, frame);
    // Record by record what an image made from nothing has.
    const MemoryImage fresh = TwoLevelImage(scene, false).release(), &image = moving.image();
    ASSERT_EQ(fresh.header().pair_count, image.header().pair_count);
    ASSERT_EQ(fresh.header().leaf_count, image.header().leaf_count);
    ASSERT_EQ(fresh.header().list_count, image.header().list_count);
    EXPECT_EQ(fresh.header().step_limit, image.header().step_limit);
    for (std::size_t i = 0; i < fresh.header().pair_count; ++i) ASSERT_EQ(fresh.pair(i), image.pair(i)) << i;
    for (std::size_t i = 0; i < fresh.header().leaf_count; ++i) ASSERT_EQ(fresh.leaf(i), image.leaf(i)) << i;
    for (std::size_t i = 0; i < fresh.header().list_count; ++i) ASSERT_EQ(fresh.list(i), image.list(i)) << i;
    for (std::size_t i = 0; i < fresh.header().instance_count; ++i)
      ASSERT_EQ(fresh.instance(i), image.instance(i)) << i;
  }
  EXPECT_GT(over, 6);
  // An object with other triangles: everything is laid out again, with its tree alone rebuilt.
  GridScene scene = first;
  scene.objects[1] = soup(random, 15);
  for (GridInstance& instance : scene.instances)
    if (instance.record.root == 1) instance.record.box = coarse_box(scene.objects[1].box);
  scene.box = top_level_box(scene.objects, scene.instances);
  const std::uint32_t changed[] = {1};
  const TwoLevelFrame cost = moving.update(scene, changed);
  EXPECT_EQ(cost.objects, 1u);
  EXPECT_TRUE(cost.laid_out_anew);
  EXPECT_EQ(cost.bytes, moving.image().bytes());
}

TEST(TwoLevelImage, comes_back_from_a_file) {
  Random random(test_seed());
  const MemoryImage image = TwoLevelImage(sample_scene(random, 10), false).release();
  const auto path = std::filesystem::temp_directory_path() / ("two_level_image_test." + std::to_string(::getpid()));
  image.save(path);
  const MemoryImage back = MemoryImage::load(path);
  EXPECT_TRUE(std::equal(image.words().begin(), image.words().end(), back.words().begin(), back.words().end()));
  std::filesystem::remove(path);
}

TEST(TwoLevelImage, statistics_count_every_tree_once_and_triangles_by_instance) {
  Random random(test_seed());
  const GridScene scene = sample_scene(random, 25);
  const TwoLevelImage built(scene, false);
  const ImageStatistics s = describe(built.image());
  std::uint64_t nodes = 0, leaves = 0, references = 0, instanced = 0, held = 0;
  for (const GridScene& object : scene.objects) {
    const ImageStatistics o = describe(build_kd(object));
    nodes += o.nodes, leaves += o.leaves, references += o.references, held += o.triangles;
  }
  for (const GridInstance& instance : scene.instances)
    instanced += scene.objects[instance.record.root].triangles.size();
  EXPECT_EQ(s.objects, 3u);
  EXPECT_EQ(s.instances, 25u);
  EXPECT_EQ(s.triangles, held);
  EXPECT_EQ(s.instanced_triangles, instanced);
  EXPECT_EQ(placed_triangles(scene), instanced);
  EXPECT_EQ(s.references - s.instance_references, references);
  EXPECT_GE(s.instance_references, 25u);
  EXPECT_GT(s.nodes, nodes);
  EXPECT_GT(s.leaves, leaves);
  EXPECT_EQ(s.instance_bytes, 25u * 64);
  EXPECT_LE(s.pair_bytes + s.leaf_bytes + s.list_bytes + s.triangle_bytes + s.instance_bytes + contract::kHeaderBytes,
            s.bytes);
}

TEST(GridScene, a_triangle_is_found_by_the_id_that_engines_report) {
  Random random(test_seed());
  const GridScene scene = sample_scene(random, 9);
  for (std::size_t i = 0; i < scene.instances.size(); ++i) {
    const contract::InstanceRecord& record = scene.instances[i].record;
    for (const GridTriangle& triangle : scene.objects[record.root].triangles) {
      const auto found = find_placed(scene, record.first_id + triangle.id);
      ASSERT_TRUE(found.has_value());
      EXPECT_EQ(found->triangle, &triangle);
      EXPECT_EQ(found->instance, i);
    }
    EXPECT_FALSE(find_placed(scene, record.first_id + 42).has_value()) << "between the ids of two instances";
  }
  EXPECT_FALSE(find_placed(scene, ~0u).has_value());
}

}  // namespace
}  // namespace retrace
