// The memory image: what the builder makes passes the check; what is changed afterwards does not, even with a right
// checksum, and the error names the record; files appear whole or not at all, and a broken one is refused with one
// line; statistics equal a naive walk.
#include "golden/tree/memory_image.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <bit>
#include <cmath>
#include <csignal>
#include <cstring>
#include <fstream>
#include <functional>
#include <limits>

#include "golden/tree/kd_builder.hpp"
#include "grid_scenes.hpp"
#include "testbench/kit/edit_record.hpp"

namespace retrace {
namespace {

using contract::HeaderRecord;
using contract::LeafRecord;
using contract::NodePairRecord;
using contract::TriangleRecord;
namespace fs = std::filesystem;

/// An image with everything in it: some depth, empty leaves, leaves with and without a list.
MemoryImage sample_image(int triangles = 60) {
  Random random(4711);
  std::vector<std::array<GridPoint, 3>> soup;
  for (int i = 0; i < triangles; ++i) {
    const GridPoint c = random_point(random, kGridMost);
    soup.push_back({random_point(random, kGridOne / 3, c), random_point(random, kGridOne / 3, c),
                    random_point(random, kGridOne / 3, c)});
  }
  for (int i = 0; i < 9; ++i) soup.push_back(soup[0]);
  BuildOptions options;
  options.intersection_cost = 10;
  return build_kd(grid_scene(soup), options);
}

std::vector<std::uint64_t> copy_words(const MemoryImage& image) { return {image.words().begin(), image.words().end()}; }

void seal(std::vector<std::uint64_t>& words) {
  HeaderRecord header = HeaderRecord::unpack(words.data());
  header.checksum = MemoryImage::checksum(words);
  header.pack(words.data());
}

/// What the image is refused for; empty if it is accepted.
std::string reason(std::vector<std::uint64_t> words) {
  try {
    MemoryImage image(std::move(words));
    return "";
  } catch (const Error& error) {
    return error.what();
  }
}

#define EXPECT_IN(part, text) \
  EXPECT_NE((text).find(part), std::string::npos) << "\"" << (text) << "\" lacks \"" << (part) << "\""

TEST(MemoryImageCheck, AcceptsWhatTheBuilderMakes) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE("RETRACE_SEED=" + std::to_string(seed));
  Random random(seed);
  for (const NamedGridScene& s : grid_scenes(random, 300)) {
    const MemoryImage image = build_kd(s.scene);
    EXPECT_EQ(reason(copy_words(image)), "") << s.name;
    const MemoryImage again(copy_words(image));
    EXPECT_EQ(again.header(), image.header());
    EXPECT_EQ(again.transform().scale, s.scene.transform.scale);
    EXPECT_EQ(again.transform().center, s.scene.transform.center);
    for (int face = 0; face < 6; ++face)
      EXPECT_EQ(static_cast<std::int32_t>(image.header().box[face]), s.scene.box[face]) << s.name;
  }
}

struct Corruption {
  const char* what;
  std::function<void(std::vector<std::uint64_t>&, const HeaderRecord&)> change;
  std::vector<std::string> parts;  ///< of the error
};

TEST(MemoryImageCheck, RefusesCorruptionAndNamesTheRecord) {
  const MemoryImage image = sample_image();
  const HeaderRecord h = image.header();
  // Records to corrupt: an interior left and right node, leaves short and long.
  std::size_t interior = 0, long_leaf = 0, short_leaf = 0, leaf_pair = 0;
  for (std::size_t i = 1; i < h.pair_count; ++i) {
    if (interior == 0 && image.pair(i).left_axis != 3u && image.pair(i).right_axis != 3u) interior = i;
    if (leaf_pair == 0 && image.pair(i).left_axis == 3u) leaf_pair = i;
  }
  for (std::size_t i = 0; i < h.leaf_count; ++i) {
    if (image.leaf(i).count > 5u) long_leaf = i;
    if (image.leaf(i).count > 0u && image.leaf(i).count < 5u) short_leaf = i;
  }
  ASSERT_NE(interior, 0u);
  ASSERT_NE(leaf_pair, 0u);
  ASSERT_NE(long_leaf, 0u);
  ASSERT_NE(short_leaf, 0u);

  const auto header = [&](std::function<void(HeaderRecord&)> change) {
    return [change](std::vector<std::uint64_t>& w, const HeaderRecord&) { edit_record<HeaderRecord>(w, 0, 0, change); };
  };
  const auto pair = [&](std::size_t i, std::function<void(NodePairRecord&)> change) {
    return [=](std::vector<std::uint64_t>& w, const HeaderRecord& r) {
      edit_record<NodePairRecord>(w, r.pair_offset, i, change);
    };
  };
  const auto leaf = [&](std::size_t i, std::function<void(LeafRecord&)> change) {
    return [=](std::vector<std::uint64_t>& w, const HeaderRecord& r) {
      edit_record<LeafRecord>(w, r.leaf_offset, i, change);
    };
  };
  const auto triangle = [&](std::size_t i, std::function<void(TriangleRecord&)> change) {
    return [=](std::vector<std::uint64_t>& w, const HeaderRecord& r) {
      edit_record<TriangleRecord>(w, r.triangle_offset, i, change);
    };
  };
  const auto word = [&](std::function<std::size_t(const HeaderRecord&)> at, std::uint64_t bits) {
    return [=](std::vector<std::uint64_t>& w, const HeaderRecord& r) { w[at(r)] ^= bits; };
  };
  const auto of = [](const char* record, std::size_t i) { return std::string(record) + " " + std::to_string(i); };
  const auto last_triangle = h.triangle_count - 1;
  const double nan = std::numeric_limits<double>::quiet_NaN();

  const std::vector<Corruption> table = {
      {"magic", header([](auto& r) { r.magic ^= 1; }), {"header", "magic"}},
      {"version", header([](auto& r) { r.version += 2; }), {"header", "version is 4"}},
      {"version of two levels", header([](auto& r) { ++r.version; }), {"header", "instance_offset is 0"}},
      {"lines", header([](auto& r) { ++r.lines; }), {"header", "lines"}},
      {"pair_offset", header([](auto& r) { ++r.pair_offset; }), {"header", "pair_offset"}},
      {"pair_offset huge", header([](auto& r) { r.pair_offset = ~0u; }), {"header", "pair_offset"}},
      {"pair_count", header([](auto& r) { --r.pair_count; }), {"node pair"}},
      {"pair_count 0", header([](auto& r) { r.pair_count = 0; }), {"header", "pair_count is 0"}},
      {"pair_count huge", header([](auto& r) { r.pair_count = ~0u; }), {"header", "pair_count"}},
      {"leaf_offset", header([](auto& r) { --r.leaf_offset; }), {"header", "leaf_offset"}},
      {"leaf_count 0", header([](auto& r) { r.leaf_count = 0; }), {"header", "leaf_count is 0"}},
      {"leaf_count huge", header([](auto& r) { r.leaf_count = ~0u; }), {"header", "leaf_count"}},
      {"list_offset", header([](auto& r) { r.list_offset = 0; }), {"header", "list_offset"}},
      {"list_count huge", header([](auto& r) { r.list_count = ~0u; }), {"header", "list_count"}},
      {"triangle_offset", header([](auto& r) { r.triangle_offset += 2; }), {"header", "triangle_offset"}},
      {"triangle_count", header([](auto& r) { ++r.triangle_count; }), {"header"}},
      {"triangle_count huge", header([](auto& r) { r.triangle_count = ~0u; }), {"header", "triangle_count"}},
      {"max_depth", header([](auto& r) { --r.max_depth; }), {"header", "max_depth"}},
      {"step_limit", header([](auto& r) { --r.step_limit; }), {"header", "step_limit"}},
      {"instance_offset", header([](auto& r) { r.instance_offset = 1; }), {"header", "instance_offset"}},
      {"instance_count", header([](auto& r) { r.instance_count = 1; }), {"header", "instance_count"}},
      {"reserved_2", header([](auto& r) { r.reserved_2[0] = 1; }), {"header", "reserved_2"}},
      {"box outside", header([](auto& r) { r.box[1] = (1u << 24) + 1; }), {"header", "box[0]", "box[1]"}},
      {"box empty", header([](auto& r) { r.box[4] = r.box[5]; }), {"header", "box[4]"}},
      {"box not sign extended", header([](auto& r) { r.box[2] &= 0x7ffffff; }), {"header", "box[2]"}},
      {"scale NaN", header([&](auto& r) { r.scale = std::bit_cast<std::uint64_t>(nan); }), {"header", "scale"}},
      {"scale 0", header([](auto& r) { r.scale = 0; }), {"header", "scale"}},
      {"center NaN", header([&](auto& r) { r.center[2] = std::bit_cast<std::uint64_t>(nan); }), {"header", "center"}},

      {"root's parent", pair(0, [](auto& r) { r.parent = 1; }), {"node pair 0", "parent is 1"}},
      {"root's copy: split", pair(0, [](auto& r) { ++r.right_split; }), {"node pair 0", "right_split"}},
      {"root's copy: axis", pair(0, [](auto& r) { r.right_axis ^= 1; }), {"node pair 0", "right_axis"}},
      {"root's copy: child", pair(0, [](auto& r) { ++r.right_child; }), {"node pair 0", "right_child"}},
      {"root a child of its own",
       pair(0, [](auto& r) { r.left_child = r.right_child = 0; }),
       {"node pair 0 (left)", "child is 0"}},
      {"split outside",
       pair(interior, [](auto& r) { r.left_split = 1 << 24; }),
       {of("node pair", interior) + " (left)", "split"}},
      {"split moved", pair(interior, [](auto& r) { ++r.left_split; }), {"leaf record", "bound["}},
      {"axis turned", pair(interior, [](auto& r) { r.right_axis = (r.right_axis + 1) % 3; }), {""}},
      {"interior made a leaf", pair(interior, [](auto& r) { r.left_axis = 3; }), {of("node pair", interior), "split"}},
      {"leaf made interior", pair(leaf_pair, [](auto& r) { r.left_axis = 0; }), {of("node pair", leaf_pair)}},
      {"child outside",
       pair(interior, [](auto& r) { r.right_child = (1u << 23) - 1; }),
       {of("node pair", interior) + " (right)", "child is 8388607"}},
      {"child twice",
       pair(interior, [](auto& r) { r.right_child = r.left_child; }),
       {of("node pair", interior) + " (right)", "child"}},
      {"a cycle",
       pair(interior, [&](auto& r) { r.left_child = static_cast<std::uint32_t>(interior); }),
       {of("node pair", interior) + " (left)", "child"}},
      {"parent", pair(interior, [](auto& r) { r.parent ^= 1; }), {of("node pair", interior), "parent"}},
      {"leaf index outside",
       pair(leaf_pair, [](auto& r) { r.left_child = (1u << 23) - 1; }),
       {of("node pair", leaf_pair), "child"}},
      {"leaf with a split",
       pair(leaf_pair, [](auto& r) { r.left_split = 7; }),
       {of("node pair", leaf_pair), "split is 7", "size code"}},
      {"leaf with another size",
       pair(leaf_pair, [](auto& r) { r.left_split = r.left_split == 0 ? 1 : r.left_split - 1; }),
       {of("node pair", leaf_pair), "size code"}},
      {"another's leaf", pair(leaf_pair, [&](auto& r) { r.left_child ^= 1; }), {"leaf record"}},

      {"bound", leaf(short_leaf, [](auto& r) { --r.bound[3]; }), {of("leaf record", short_leaf), "bound[3]"}},
      {"link", leaf(short_leaf, [](auto& r) { r.link[2] ^= 2; }), {of("leaf record", short_leaf), "link[2]"}},
      {"parent of a leaf", leaf(short_leaf, [](auto& r) { ++r.parent; }), {of("leaf record", short_leaf), "parent"}},
      {"kind", leaf(short_leaf, [](auto& r) { r.kind = 1; }), {of("leaf record", short_leaf), "kind is 1"}},
      {"kind unknown", leaf(short_leaf, [](auto& r) { r.kind = 3; }), {of("leaf record", short_leaf), "kind is 3"}},
      {"count up", leaf(long_leaf, [](auto& r) { ++r.count; }), {"count"}},
      {"count down", leaf(long_leaf, [](auto& r) { --r.count; }), {""}},
      {"count huge",
       leaf(long_leaf, [](auto& r) { r.count = (1u << 24) - 1; }),
       {of("leaf record", long_leaf), "count is 16777215"}},
      {"list_base", leaf(long_leaf, [](auto& r) { ++r.list_base; }), {of("leaf record", long_leaf), "list_base"}},
      {"list_base huge",
       leaf(long_leaf, [](auto& r) { r.list_base = (1u << 28) - 1; }),
       {of("leaf record", long_leaf), "list_base"}},
      {"list_base of a short leaf",
       leaf(short_leaf, [](auto& r) { r.list_base = 1; }),
       {of("leaf record", short_leaf), "list_base"}},
      {"reference outside",
       leaf(short_leaf, [](auto& r) { r.refs[0] = (1u << 24) - 1; }),
       {of("leaf record", short_leaf), "refs[0]"}},
      {"unused reference",
       leaf(short_leaf, [](auto& r) { r.refs[4] = 1; }),
       {of("leaf record", short_leaf), "refs[4]"}},
      {"reserved bits of a leaf",
       word([&](auto& r) { return r.leaf_offset * 8 + short_leaf * 8 + 7; }, std::uint64_t{1} << 63),
       {of("leaf record", short_leaf), "reserved"}},
      {"list entry outside",
       word([](auto& r) { return r.list_offset * 8; }, 0xffffffffull),
       {"reference list", "entry 0"}},

      {"exponents in the wrong order",
       triangle(3, [](auto& r) { r.exponent_v = r.exponent_u + 1; }),
       {"triangle record 3", "exponent_v"}},
      {"exponent too large",
       triangle(3, [](auto& r) { r.exponent_u = 63; }),
       {"triangle record 3", "exponent_u is 63"}},
      {"long row",
       triangle(0, [](auto& r) { r.u[0] = (1 << 26) - 1, r.u[1] = 1 << 25; }),
       {"triangle record 0", "row u"}},
      {"short row",
       triangle(0,
                [](auto& r) {
                  r.v = {1 << 24, 0, 0};
                }),
       {"triangle record 0", "row v"}},
      {"no row",
       triangle(1,
                [](auto& r) {
                  r.n = {0, 0, 0};
                }),
       {"triangle record 1", "row n"}},
      {"offset",
       triangle(last_triangle, [](auto& r) { r.offset_v = std::numeric_limits<std::int32_t>::min(); }),
       {of("triangle record", last_triangle), "offset_v"}},
      {"reserved bits of a triangle",
       word([&](auto& r) { return r.triangle_offset * 8 + last_triangle * 8 + 7; }, 1),
       {of("triangle record", last_triangle), "reserved"}},
  };
  for (const Corruption& c : table) {
    SCOPED_TRACE(c.what);
    std::vector<std::uint64_t> words = copy_words(image);
    c.change(words, h);
    EXPECT_NE(reason(words), "") << "without a right checksum";
    seal(words);
    const std::string why = reason(words);
    EXPECT_IN("memory image: ", why);
    for (const std::string& part : c.parts) EXPECT_IN(part, why);
    EXPECT_EQ(why.find('\n'), std::string::npos);
  }
}

TEST(MemoryImageCheck, EveryBitOfTheTreeCounts) {
  // With a right checksum, no single bit of the node pairs and leaf records can be changed, but for references that
  // stay in range.
  const MemoryImage image = sample_image(12);
  const HeaderRecord h = image.header();
  const std::vector<std::uint64_t> good = copy_words(image);
  const std::size_t first = h.pair_offset * MemoryImage::kLineWords, end = h.list_offset * MemoryImage::kLineWords;
  const std::size_t leaves = h.leaf_offset * MemoryImage::kLineWords;
  std::size_t refused = 0;
  for (std::size_t w = first; w < end; ++w) {
    for (int bit = 0; bit < 64; ++bit) {
      std::vector<std::uint64_t> words = good;
      words[w] ^= std::uint64_t{1} << bit;
      if (w >= leaves) {
        const std::size_t index = (w - leaves) / LeafRecord::kWords;
        LeafRecord before = image.leaf(index),
                   after = LeafRecord::unpack(words.data() + leaves + index * LeafRecord::kWords);
        bool in_range = before.refs != after.refs;
        for (std::uint32_t i = 0; i < 5; ++i)
          in_range = in_range && (i < before.count ? after.refs[i] < h.triangle_count : after.refs[i] == 0);
        if (in_range) continue;
      }
      seal(words);
      ASSERT_NE(reason(words), "") << "word " << w << " bit " << bit;
      ++refused;
    }
  }
  EXPECT_GT(refused, 10000u);
}

TEST(MemoryImageCheck, EveryBitOfTheImageIsUnderTheChecksum) {
  const std::vector<std::uint64_t> good = copy_words(sample_image(3));
  for (std::size_t w = 0; w < good.size(); ++w) {
    for (int bit = 0; bit < 64; ++bit) {
      std::vector<std::uint64_t> words = good;
      words[w] ^= std::uint64_t{1} << bit;
      ASSERT_NE(reason(words), "") << "word " << w << " bit " << bit;
    }
  }
}

TEST(MemoryImageCheck, RefusesWordsThatAreNoImage) {
  EXPECT_IN("header", reason({}));
  EXPECT_IN("header", reason(std::vector<std::uint64_t>(15)));
  EXPECT_IN("magic", reason(std::vector<std::uint64_t>(16)));
  std::vector<std::uint64_t> words = copy_words(sample_image());
  words.resize(words.size() - 8);
  EXPECT_IN("lines", reason(words));
  words.resize(words.size() + 16);
  EXPECT_IN("lines", reason(words));
  EXPECT_THROW(MemoryImage().check(), Error);
}

TEST(MemoryImageCheck, EndsOnAChainAsDeepAsTheImage) {
  // Split after split cuts one code off the box: what a walk that recurses, or that copies a cell for each level, would
  // not survive.
  constexpr std::uint32_t kDepth = 200000;
  std::vector<NodePairRecord> pairs(kDepth + 1);
  std::vector<LeafRecord> leaves(kDepth + 1);
  HeaderRecord header;
  const std::int32_t one = 1 << 24;
  const std::int32_t box[6] = {-one, one, -one, one, -one, one};
  for (int face = 0; face < 6; ++face) header.box[face] = static_cast<std::uint32_t>(box[face]);
  header.scale = std::bit_cast<std::uint64_t>(1.0);
  header.max_depth = kDepth;
  std::uint64_t depths = 0;
  for (std::uint32_t d = 0; d < kDepth;
       ++d) {  // node 2 d + 1 (2 d = 0 at the root) has a leaf at left and the chain at right
    NodePairRecord& at = pairs[d];
    const std::int32_t split = -one + 1 + static_cast<std::int32_t>(d);
    at.right_split = split, at.right_axis = 0, at.right_child = d + 1;
    if (d == 0) at.left_split = split, at.left_axis = 0, at.left_child = 1;
    const std::uint32_t node = d == 0 ? 0 : 2 * d + 1;
    pairs[d + 1].parent = node;
    pairs[d + 1].left_axis = 3;
    pairs[d + 1].left_child = d;
    LeafRecord& leaf = leaves[d];
    leaf.bound = {split - 1, split, -one, one, -one, one};
    leaf.link = {d == 0 ? 0 : 2 * d, 2 * (d + 1) + 1, 0, 0, 0, 0};
    leaf.parent = node;
    depths += d + 1;
    if (d + 1 == kDepth) {
      pairs[kDepth].right_axis = 3;
      pairs[kDepth].right_child = kDepth;
      leaves[kDepth].bound = {split, one, -one, one, -one, one};
      leaves[kDepth].link[0] = 2 * kDepth;
      leaves[kDepth].parent = node;
      depths += kDepth;
    }
  }
  header.step_limit = MemoryImage::step_limit(pairs.size(), leaves.size(), 0, depths);
  EXPECT_EQ(header.step_limit, 0xffffffffu) << "saturated";
  const MemoryImage image = MemoryImage::assemble(header, pairs, leaves, {}, {});
  ASSERT_NO_THROW(image.check());
  EXPECT_EQ(describe(image).max_depth, kDepth);
}

TEST(MemoryImageAssemble, RefusesWhatTheFormatCannotHold) {
  const NodePairRecord pair;
  const LeafRecord leaf;
  const auto why = [](auto&& call) -> std::string {
    try {
      call();
      return "";
    } catch (const Error& error) {
      return error.what();
    }
  };
  const std::vector<NodePairRecord> pairs((std::size_t{1} << contract::kPairIndexBits) + 1);
  EXPECT_IN("8388609 node pairs", why([&] { MemoryImage::assemble({}, pairs, {&leaf, 1}, {}, {}); }));
  LeafRecord large;
  large.count = 1u << contract::kTriangleIndexBits;
  EXPECT_IN("leaf record 0", why([&] { MemoryImage::assemble({}, {&pair, 1}, {&large, 1}, {}, {}); }));
  NodePairRecord far;
  far.left_split = 1 << 26;
  EXPECT_IN("node pair 0", why([&] { MemoryImage::assemble({}, {&far, 1}, {&leaf, 1}, {}, {}); }));
}

TEST(MemoryImageAssemble, SectionsStandOnLinesOneAfterTheOther) {
  const MemoryImage image = sample_image();
  const HeaderRecord& h = image.header();
  EXPECT_EQ(h.pair_offset, 2u);
  EXPECT_EQ(h.leaf_offset, h.pair_offset + (h.pair_count + 3) / 4);
  EXPECT_EQ(h.list_offset, h.leaf_offset + h.leaf_count);
  EXPECT_EQ(h.triangle_offset, h.list_offset + (h.list_count + 15) / 16);
  EXPECT_EQ(h.lines, h.triangle_offset + h.triangle_count);
  EXPECT_EQ(image.bytes(), h.lines * 64u);
  EXPECT_EQ(h.checksum, MemoryImage::checksum(image.words()));
  const std::string text =
      "123456789abc\xff\xff\xff\xff"
      "rest of two lines";  // bytes 12..15 count as 0
  std::vector<std::uint64_t> words(8);
  std::memcpy(words.data(), text.data(), text.size());
  std::uint32_t crc = 0xffffffffu;  // IEEE 802.3, bit by bit
  for (std::size_t i = 0; i < words.size() * 8; ++i) {
    std::uint8_t byte;
    std::memcpy(&byte, reinterpret_cast<const char*>(words.data()) + i, 1);
    crc ^= i >= 12 && i < 16 ? 0 : byte;
    for (int bit = 0; bit < 8; ++bit) crc = (crc >> 1) ^ (crc & 1 ? 0xedb88320u : 0);
  }
  EXPECT_EQ(MemoryImage::checksum(words), ~crc);
}

/// A folder of its own, removed at the end.
class MemoryImageFile : public testing::Test {
 protected:
  MemoryImageFile() {
    std::string name = (fs::temp_directory_path() / "memory_image_test.XXXXXX").string();
    folder_ = ::mkdtemp(name.data());
  }
  ~MemoryImageFile() override { fs::remove_all(folder_); }

  static std::string load_error(const fs::path& path) {
    try {
      MemoryImage::load(path);
      return "";
    } catch (const Error& error) {
      return error.what();
    }
  }
  static std::string save_error(const MemoryImage& image, const fs::path& path) {
    try {
      image.save(path);
      return "";
    } catch (const Error& error) {
      return error.what();
    }
  }
  static void write(const fs::path& path, const std::string& bytes) { std::ofstream(path, std::ios::binary) << bytes; }
  static std::string read(const fs::path& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }
  std::size_t files() const {
    return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder_), fs::directory_iterator()));
  }

  fs::path folder_;
};

TEST_F(MemoryImageFile, ComesBackAsItWas) {
  const MemoryImage image = sample_image();
  const fs::path path = folder_ / "a b.rtkd";
  image.save(path);
  const MemoryImage back = MemoryImage::load(path);
  EXPECT_TRUE(std::equal(image.words().begin(), image.words().end(), back.words().begin(), back.words().end()));
  EXPECT_EQ(back.header(), image.header());
  const MemoryImage other = sample_image(5);
  other.save(path);  // replaces
  EXPECT_EQ(MemoryImage::load(path).header(), other.header());
  fs::create_symlink(path, folder_ / "link");
  image.save(folder_ / "link");
  EXPECT_TRUE(fs::is_symlink(folder_ / "link"));
  EXPECT_EQ(MemoryImage::load(path).header(), image.header());
  EXPECT_EQ(files(), 2u) << "no temporary file is left";
}

TEST_F(MemoryImageFile, BrokenFilesAreRefusedByName) {
  const fs::path path = folder_ / "broken.rtkd";
  const MemoryImage image = sample_image(4);
  image.save(path);
  const std::string good = read(path);
  std::vector<std::size_t> lengths{
      0, 1, 63, 64, 127, 128, 129, good.size() - 64, good.size() - 1, good.size() + 1, good.size() + 64};
  for (const std::size_t length : lengths) {
    std::string bytes = good;
    bytes.resize(length);
    write(path, bytes);
    EXPECT_IN("broken.rtkd: ", load_error(path)) << length << " bytes";
    EXPECT_IN(std::to_string(length), load_error(path));
  }
  std::string flipped = good;
  flipped[good.size() / 2] ^= 1;
  write(path, flipped);
  EXPECT_IN("broken.rtkd: memory image: header: checksum", load_error(path));
  write(path, std::string(4096, 'x'));
  EXPECT_IN("broken.rtkd: not a memory image", load_error(path));
  flipped = good;
  flipped[4] = 9;
  write(path, flipped);
  EXPECT_IN("version 9", load_error(path));
  EXPECT_IN("missing.rtkd: cannot open", load_error(folder_ / "missing.rtkd"));
  EXPECT_IN("not a regular file", load_error(folder_));
  ASSERT_EQ(::mkfifo((folder_ / "pipe").c_str(), 0600), 0);
  EXPECT_IN("pipe: not a regular file", load_error(folder_ / "pipe"));
  EXPECT_IN("not a regular file", load_error("/dev/zero"));
}

TEST_F(MemoryImageFile, AHeaderThatPromisesMuchAllocatesLittle) {
  // A sparse file as long as its header says, with counts that do not add up: refused before it is read.
  HeaderRecord header = sample_image(4).header();
  header.lines = 1u << 24;
  const fs::path path = folder_ / "sparse.rtkd";
  std::uint64_t words[HeaderRecord::kWords];
  header.pack(words);
  write(path, std::string(reinterpret_cast<const char*>(words), sizeof words));
  fs::resize_file(path, std::uintmax_t{header.lines} * 64);
  rusage before, after;
  ::getrusage(RUSAGE_SELF, &before);
  EXPECT_IN("header: lines", load_error(path));
  ::getrusage(RUSAGE_SELF, &after);
  EXPECT_LT(after.ru_maxrss - before.ru_maxrss, 100000) << "KiB";
}

TEST_F(MemoryImageFile, WholeOrNothing) {
  const MemoryImage image = sample_image();
  EXPECT_IN("cannot write", save_error(image, folder_ / "no such folder" / "x.rtkd"));
  write(folder_ / "file", "kept");
  EXPECT_IN("cannot write", save_error(image, folder_ / "file" / "x.rtkd"));
  EXPECT_IN("it is a folder", save_error(image, folder_));
  EXPECT_IN("/dev/full: No space left", save_error(image, "/dev/full"));
  EXPECT_IN("cannot write", save_error(image, "/proc/x.rtkd"));

  // A limit on the size of files stops the writing half way, for root too.
  rlimit old;
  ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &old), 0);
  const rlimit half{image.bytes() / 2, old.rlim_max};
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &half), 0);
  const std::string why = save_error(image, folder_ / "file");
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &old), 0);
  std::signal(SIGXFSZ, handler);
  EXPECT_IN("cannot write " + (folder_ / "file").string() + ": File too large", why);
  EXPECT_EQ(read(folder_ / "file"), "kept");
  EXPECT_EQ(files(), 1u) << "no temporary file is left";
}

/// Numbers of describe() the slow way: recursion and areas in floating point from the records of the leaves and splits.
struct NaiveWalk {
  const MemoryImage& image;
  ImageStatistics s;
  double cost = 0;

  explicit NaiveWalk(const MemoryImage& i) : image(i) {
    std::array<double, 6> box;
    for (int face = 0; face < 6; ++face) box[face] = static_cast<std::int32_t>(image.header().box[face]);
    s.leaf_size_histogram.resize(17);
    s.depth_histogram.resize(image.header().max_depth + 1);
    visit(0, box, 0);
    cost /= area(box);
  }
  static double area(const std::array<double, 6>& b) {
    const double x = b[1] - b[0], y = b[3] - b[2], z = b[5] - b[4];
    return 2 * (x * y + y * z + z * x);
  }
  void visit(std::uint32_t node, std::array<double, 6> box, std::uint32_t depth) {
    const NodePairRecord p = image.pair(node / 2);
    const bool right = node % 2 == 1;
    const std::uint32_t axis = right ? p.right_axis : p.left_axis, child = right ? p.right_child : p.left_child;
    ++s.nodes;
    s.max_depth = std::max(s.max_depth, depth);
    if (axis == 3) {
      const LeafRecord leaf = image.leaf(child);
      ++s.leaves;
      s.empty_leaves += leaf.count == 0;
      s.references += leaf.count;
      s.max_leaf = std::max(s.max_leaf, leaf.count);
      ++s.depth_histogram[depth];
      ++s.leaf_size_histogram[leaf.count >= 16 ? 16 : leaf.count];
      cost += BuildOptions().intersection_cost * leaf.count * area(box);
      return;
    }
    ++s.interior;
    cost += BuildOptions().traversal_cost * area(box);
    for (std::uint32_t side = 0; side < 2; ++side) {
      std::array<double, 6> cell = box;
      cell[2 * axis + (side == 0 ? 1 : 0)] = right ? p.right_split : p.left_split;
      visit(2 * child + side, cell, depth + 1);
    }
  }
};

TEST(MemoryImageDescribe, EqualsANaiveWalk) {
  Random random(test_seed());
  for (const NamedGridScene& s : grid_scenes(random, 200)) {
    SCOPED_TRACE(s.name);
    const MemoryImage image = build_kd(s.scene);
    const NaiveWalk naive(image);
    const ImageStatistics d = describe(image);
    EXPECT_EQ(d.nodes, naive.s.nodes);
    EXPECT_EQ(d.interior, naive.s.interior);
    EXPECT_EQ(d.leaves, naive.s.leaves);
    EXPECT_EQ(d.empty_leaves, naive.s.empty_leaves);
    EXPECT_EQ(d.references, naive.s.references);
    EXPECT_EQ(d.max_leaf, naive.s.max_leaf);
    EXPECT_EQ(d.max_depth, naive.s.max_depth);
    EXPECT_EQ(d.depth_histogram, naive.s.depth_histogram);
    EXPECT_EQ(d.leaf_size_histogram, naive.s.leaf_size_histogram);
    EXPECT_EQ(d.triangles, s.scene.triangles.size());
    EXPECT_NEAR(d.sah_cost, naive.cost, 1e-9 * (1 + naive.cost));
    EXPECT_EQ(d.nodes, 2 * std::uint64_t{image.header().pair_count} - 1);
    if (d.triangles > 0) {
      EXPECT_DOUBLE_EQ(d.references_per_triangle, static_cast<double>(d.references) / static_cast<double>(d.triangles));
    }
    EXPECT_DOUBLE_EQ(d.references_per_leaf, static_cast<double>(d.references) / static_cast<double>(d.leaves));
    EXPECT_EQ(d.bytes, image.bytes());
    EXPECT_LE(d.pair_bytes + d.leaf_bytes + d.list_bytes + d.triangle_bytes + contract::kHeaderBytes, d.bytes);
    EXPECT_GT(d.pair_bytes + d.leaf_bytes + d.list_bytes + d.triangle_bytes + contract::kHeaderBytes + 128, d.bytes);
  }
}

}  // namespace
}  // namespace retrace
