// .npy files: what NumPy writes is read, what is damaged is one error, whatever the damage.
#include "testbench/program/npy.hpp"

#include <gtest/gtest.h>

#include <cstring>
#include <limits>

#include "golden/scene/scene.hpp"
#include "testbench/kit/random.hpp"

namespace retrace::cli {
namespace {

std::string file(int major, const std::string& header, const std::string& data) {
  std::string bytes = "\x93NUMPY";
  bytes += static_cast<char>(major);
  bytes += '\0';
  for (int i = 0; i < (major == 1 ? 2 : 4); ++i) bytes += static_cast<char>(header.size() >> (8 * i) & 0xff);
  return bytes + header + data;
}

std::string plain_header(const std::string& shape, const std::string& descr = "<f8",
                         const std::string& order = "False") {
  return "{'descr': '" + descr + "', 'fortran_order': " + order + ", 'shape': " + shape + ", }                \n";
}

std::string doubles(std::size_t count) {
  std::string data;
  for (std::size_t i = 0; i < count; ++i) {
    const double value = static_cast<double>(i) + 0.5;
    data.append(reinterpret_cast<const char*>(&value), sizeof value);
  }
  return data;
}

TEST(Npy, ReadsAllVersions) {
  for (const int major : {1, 2, 3}) {
    const auto rays = parse_rays(file(major, plain_header("(3, 8)"), doubles(24)), "a");
    ASSERT_EQ(rays.size(), 3u);
    EXPECT_EQ(rays[0][0], 0.5);
    EXPECT_EQ(rays[2][7], 23.5);
  }
}

TEST(Npy, ReadsWhatIsUnusualButRight) {
  EXPECT_EQ(parse_rays(file(1, plain_header("(0, 8)"), ""), "a").size(), 0u);
  EXPECT_EQ(parse_rays(file(1, plain_header("(1, 8)", "<f8", "True"), doubles(8)), "a").size(),
            1u);  // one row: no order
  EXPECT_EQ(parse_rays(file(1, "{\"shape\":(1,8),\"descr\":\"<f8\",\"fortran_order\":False}", doubles(8)), "a").size(),
            1u);
  EXPECT_EQ(parse_rays(file(1, "{'shape': (1, 8,), 'fortran_order': False, 'descr': '<f8'}\n", doubles(8)), "a").size(),
            1u);
}

TEST(Npy, ReadsWhatPython2AndOtherWritersMake) {
  const std::string python2 = "{'descr': '<f8', 'fortran_order': False, 'shape': (3L, 8L), }        \n";
  const auto rays = parse_rays(file(1, python2, doubles(24)), "a");
  ASSERT_EQ(rays.size(), 3u);
  EXPECT_EQ(rays[2][7], 23.5);
  EXPECT_EQ(
      parse_rays(file(1, "{u'descr': u'<f8', u'fortran_order': False, u'shape': (1L, 8L)}", doubles(8)), "a").size(),
      1u);
  for (const char* descr : {"=f8", "f8", "<d", "d", "float64"})
    EXPECT_EQ(parse_rays(file(1, plain_header("(1, 8)", descr), doubles(8)), "a").size(), 1u) << descr;
}

struct Bad {
  const char* what;
  std::string bytes;
  const char* message;  ///< part of it
};

TEST(Npy, HostileFilesAreOneErrorEach) {
  const std::string data = doubles(8);
  std::string long_header = file(2, plain_header("(1, 8)"), data);
  long_header[8] = long_header[9] = long_header[10] = long_header[11] = static_cast<char>(0xff);
  const std::vector<Bad> cases = {
      {"empty", "", "not a .npy"},
      {"text", "origin,direction\n1,2,3\n", "not a .npy"},
      {"magic only", "\x93NUMPY", "not a .npy"},
      {"version 9", file(9, plain_header("(1, 8)"), data), "version 9.0"},
      {"header of 4 GiB", long_header, "claims a header"},
      {"ends in the header", file(1, plain_header("(1, 8)"), "").substr(0, 30), "ends in its header"},
      {"ends in the length", file(2, "", "").substr(0, 11), "ends in its header"},
      {"empty header", file(1, "", data), "damaged header"},
      {"no dictionary", file(1, "[1, 2]", data), "damaged header"},
      {"unknown key", file(1, "{'descr': '<f8', 'shape': (1, 8), 'fortran_order': False, 'x': 1}", data),
       "unexpected key"},
      {"twice the same key", file(1, "{'descr': '<f8', 'descr': '<f8', 'shape': (1, 8), 'fortran_order': False}", data),
       "unexpected key"},
      {"missing key", file(1, "{'descr': '<f8', 'shape': (1, 8)}", data), "lacks"},
      {"trailing text", file(1, "{'descr': '<f8', 'shape': (1, 8), 'fortran_order': False} + 1", data),
       "after the dictionary"},
      {"open string", file(1, "{'descr': '<f8", data), "does not end"},
      {"no bool", file(1, "{'descr': '<f8', 'fortran_order': None, 'shape': (1, 8)}", data), "True or False"},
      {"float32", file(1, plain_header("(1, 8)", "<f4"), data), "'<f4'"},
      {"big endian", file(1, plain_header("(1, 8)", ">f8"), data), "'>f8'"},
      {"objects", file(1, plain_header("(1, 8)", "|O"), data), "'|O'"},
      {"structured", file(1, "{'descr': [('t', '<f8')], 'fortran_order': False, 'shape': (1,)}", data), "structured"},
      {"fortran", file(1, plain_header("(2, 8)", "<f8", "True"), doubles(16)), "Fortran order"},
      {"vector", file(1, plain_header("(8,)"), data), "shape (8,)"},
      {"scalar", file(1, plain_header("()"), data), "shape ()"},
      {"six columns", file(1, plain_header("(1, 6)"), data), "shape (1, 6)"},
      {"three axes", file(1, plain_header("(1, 8, 1)"), data), "shape (1, 8, 1)"},
      {"negative", file(1, plain_header("(-1, 8)"), data), "damaged shape"},
      {"letter in the shape", file(1, plain_header("(L, 8)"), data), "damaged shape"},
      {"two letters in the shape", file(1, plain_header("(1LL, 8)"), data), "damaged header"},
      {"too short", file(1, plain_header("(2, 8)"), data), "too short"},
      {"too long", file(1, plain_header("(1, 8)"), doubles(9)), "longer"},
      {"product overflows", file(1, plain_header("(2305843009213693953, 8)"), data), "too short"},
      {"count overflows", file(1, plain_header("(99999999999999999999999, 8)"), data), "impossible shape"},
  };
  for (const Bad& bad : cases) {
    try {
      parse_rays(bad.bytes, "rays.npy");
      ADD_FAILURE() << bad.what << ": accepted";
    } catch (const Error& error) {
      const std::string message = error.what();
      EXPECT_NE(message.find(bad.message), std::string::npos) << bad.what << ": " << message;
      EXPECT_EQ(message.find("rays.npy"), 0u) << bad.what << ": " << message;
      EXPECT_EQ(message.find('\n'), std::string::npos) << bad.what;
    }
  }
}

TEST(Npy, DamagedBytesNeverDoHarm) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE("RETRACE_SEED=" + std::to_string(seed));
  Random random(seed);
  const std::string good = file(1, plain_header("(4, 8)"), doubles(32));
  int accepted = 0, refused = 0;
  for (int i = 0; i < 20000; ++i) {
    std::string bytes = good;
    for (std::uint64_t k = random.below(4) + 1; k > 0; --k)
      bytes[random.below(100)] = static_cast<char>(random.below(256));
    if (random.chance(4)) bytes.resize(random.below(bytes.size()));
    try {
      EXPECT_LE(parse_rays(bytes, "x").size(), 4u);
      ++accepted;
    } catch (const Error&) {
      ++refused;
    }
  }
  EXPECT_GT(accepted, 100);
  EXPECT_GT(refused, 1000);
}

TEST(Npy, HitsAreAStructuredArray) {
  const std::vector<SceneHit> hits = {{1.5, 2, 3, 4, 5, 0.25, 0.5},
                                      {std::numeric_limits<double>::infinity(), -1, -1, -1, -1, 0, 0}};
  const std::string bytes = format_hits(hits);
  ASSERT_EQ(bytes.substr(0, 8), std::string("\x93NUMPY\x01\0", 8));
  const std::size_t length =
      static_cast<unsigned char>(bytes[8]) | static_cast<std::size_t>(static_cast<unsigned char>(bytes[9])) << 8;
  EXPECT_EQ((10 + length) % 64, 0u);
  EXPECT_EQ(bytes[10 + length - 1], '\n');
  const std::string header = bytes.substr(10, length);
  EXPECT_EQ(header.find(
                "{'descr': [('t', '<f8'), ('mesh', '<i4'), ('primitive', '<i4'), ('triangle', '<i4'), ('node', '<i4'), "
                "('u', '<f8'), ('v', '<f8')], 'fortran_order': False, 'shape': (2,), }"),
            0u);
  ASSERT_EQ(bytes.size(), 10 + length + 80);
  double value = 0;
  std::int32_t node = 0;
  std::memcpy(&value, bytes.data() + 10 + length + 32, 8);
  std::memcpy(&node, bytes.data() + 10 + length + 20, 4);
  EXPECT_EQ(value, 0.5);
  EXPECT_EQ(node, 5);
  EXPECT_EQ(format_hits({}).find("\x93NUMPY"), 0u);
}

}  // namespace
}  // namespace retrace::cli
