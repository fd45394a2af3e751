// .npy files, see npy.hpp. The header is a Python dictionary literal; a small parser takes exactly the three keys it must have.
#include "testbench/program/npy.hpp"

#include <algorithm>
#include <bit>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <limits>

#include "golden/scene/scene.hpp"

namespace retrace::cli {
namespace {

static_assert(std::endian::native == std::endian::little, "files are little endian and are copied as they are");

constexpr std::string_view kMagic = "\x93NUMPY";
constexpr std::size_t kLargestHeader = 65536;  ///< a plain header is below 200 bytes

/// The header's literal: {'descr': '<f8', 'fortran_order': False, 'shape': (3, 8), }
class HeaderParser {
 public:
  HeaderParser(std::string_view text, const std::string& name) : text_(text), name_(name) {}

  NpyHeader parse() {
    NpyHeader header;
    bool descr = false, order = false, shape = false;
    expect('{');
    while (!accept('}')) {
      const std::string key = string();
      expect(':');
      if (key == "descr" && !descr) {
        skip();
        if (at_ < text_.size() && text_[at_] == '[') fail("holds a structured array, not plain float64");
        header.descr = string();
        descr = true;
      } else if (key == "fortran_order" && !order) {
        header.fortran_order = boolean();
        order = true;
      } else if (key == "shape" && !shape) {
        header.shape = tuple();
        shape = true;
      } else {
        fail("has an unexpected key in its header");
      }
      if (!accept(',')) {
        expect('}');
        break;
      }
    }
    skip();
    if (at_ != text_.size()) fail("has something after the dictionary in its header");
    if (!descr || !order || !shape) fail("lacks descr, fortran_order or shape in its header");
    return header;
  }

 private:
  [[noreturn]] void fail(const std::string& what) const { throw Error(name_ + " " + what); }

  void skip() {
    while (at_ < text_.size() && (text_[at_] == ' ' || text_[at_] == '\n' || text_[at_] == '\t')) ++at_;
  }
  bool accept(char c) {
    skip();
    if (at_ >= text_.size() || text_[at_] != c) return false;
    ++at_;
    return true;
  }
  void expect(char c) {
    if (!accept(c)) fail("has a damaged header: '" + std::string(1, c) + "' expected at byte " + std::to_string(at_));
  }
  std::string string() {
    skip();
    if (at_ < text_.size() && text_[at_] == 'u') ++at_;  // Python 2
    const char quote = at_ < text_.size() ? text_[at_] : '\0';
    if (quote != '\'' && quote != '"') fail("has a damaged header: a string expected at byte " + std::to_string(at_));
    const std::size_t end = text_.find(quote, ++at_);
    if (end == std::string_view::npos || end - at_ > 64) fail("has a damaged header: a string does not end");
    const std::string value(text_.substr(at_, end - at_));
    at_ = end + 1;
    return value;
  }
  bool boolean() {
    skip();
    for (const std::string_view word : {std::string_view("True"), std::string_view("False")}) {
      if (text_.substr(at_, word.size()) == word) {
        at_ += word.size();
        return word == "True";
      }
    }
    fail("has a damaged header: True or False expected at byte " + std::to_string(at_));
  }
  std::vector<std::uint64_t> tuple() {
    std::vector<std::uint64_t> values;
    expect('(');
    while (!accept(')')) {
      skip();
      std::uint64_t value = 0;
      const std::size_t start = at_;
      while (at_ < text_.size() && text_[at_] >= '0' && text_[at_] <= '9') {
        if (value > (std::numeric_limits<std::uint64_t>::max() - 9) / 10) fail("has an impossible shape");
        value = value * 10 + static_cast<std::uint64_t>(text_[at_++] - '0');
      }
      const bool number = at_ > start;
      if (number && at_ < text_.size() && text_[at_] == 'L') ++at_;  // a long integer of Python 2
      if (!number || values.size() == 32) fail("has a damaged shape in its header");
      values.push_back(value);
      if (!accept(',')) {
        expect(')');
        break;
      }
    }
    return values;
  }

  std::string_view text_;
  const std::string& name_;
  std::size_t at_ = 0;
};

std::string shape_text(const std::vector<std::uint64_t>& shape) {
  std::string text = "(";
  for (const std::uint64_t n : shape) text += (text.size() > 1 ? ", " : "") + std::to_string(n);
  return text + (shape.size() == 1 ? ",)" : ")");
}

}  // namespace

NpyHeader parse_npy_header(std::string_view bytes, const std::string& name) {
  const auto byte = [&](std::size_t i) { return static_cast<std::size_t>(static_cast<unsigned char>(bytes[i])); };
  if (bytes.size() < 10 || bytes.substr(0, kMagic.size()) != kMagic) throw Error(name + " is not a .npy file");
  const std::size_t major = byte(6), minor = byte(7);
  if (major < 1 || major > 3 || minor != 0) {
    throw Error(name + " has .npy version " + std::to_string(major) + "." + std::to_string(minor) +
                "; known are 1.0 to 3.0");
  }
  const std::size_t start = major == 1 ? 10 : 12;
  if (bytes.size() < start) throw Error(name + " ends in its header");
  std::size_t length = byte(8) | byte(9) << 8;
  if (major > 1) length |= byte(10) << 16 | byte(11) << 24;
  if (length > kLargestHeader) throw Error(name + " claims a header of " + std::to_string(length) + " bytes");
  if (length > bytes.size() - start) throw Error(name + " ends in its header");
  NpyHeader header = HeaderParser(bytes.substr(start, length), name).parse();
  header.data_offset = start + length;
  return header;
}

std::vector<NpyRay> parse_rays(std::string_view bytes, const std::string& name) {
  const NpyHeader header = parse_npy_header(bytes, name);
  // Other names that NumPy has for the same type.
  constexpr std::array<std::string_view, 6> kDouble = {"<f8", "=f8", "f8", "<d", "d", "float64"};
  if (std::find(kDouble.begin(), kDouble.end(), header.descr) == kDouble.end())
    throw Error(name + " holds '" + header.descr + "', not little-endian float64 ('<f8')");
  if (header.shape.size() != 2 || header.shape[1] != 8) {
    throw Error(name + " has shape " + shape_text(header.shape) + ", not (N, 8): origin, t_min, direction, t_max");
  }
  // With one row or none both orders are the same, and NumPy then writes either.
  if (header.fortran_order && header.shape[0] > 1)
    throw Error(name + " is in Fortran order; save it with numpy.ascontiguousarray");
  const std::size_t available = bytes.size() - header.data_offset;
  if (header.shape[0] > available / sizeof(NpyRay)) {
    throw Error(name + " is too short: " + std::to_string(available) + " bytes for " + std::to_string(header.shape[0]) +
                " rays");
  }
  if (header.shape[0] * sizeof(NpyRay) != available) throw Error(name + " is longer than its shape says");
  std::vector<NpyRay> rays(header.shape[0]);
  if (!rays.empty()) std::memcpy(rays.data(), bytes.data() + header.data_offset, available);
  return rays;
}

std::vector<NpyRay> read_rays(const std::filesystem::path& path) {
  std::error_code status;
  if (std::filesystem::is_directory(path, status)) throw Error("cannot read " + path.string() + ": it is a folder");
  std::ifstream file(path, std::ios::binary);
  if (!file) throw Error("cannot read " + path.string() + ": " + std::strerror(errno));
  std::string bytes;
  const std::uintmax_t size = std::filesystem::file_size(path, status);
  if (!status) {
    bytes.resize(size);
    file.read(bytes.data(), static_cast<std::streamsize>(size));
    bytes.resize(static_cast<std::size_t>(file.gcount()));
  } else {
    bytes.assign(std::istreambuf_iterator<char>(file), {});  // a pipe has no size
  }
  if (file.bad()) throw Error("cannot read " + path.string());
  return parse_rays(bytes, path.string());
}

std::string format_hits(std::span<const SceneHit> hits) {
  std::string header =
      "{'descr': [('t', '<f8'), ('mesh', '<i4'), ('primitive', '<i4'), ('triangle', '<i4'), ('node', '<i4'), ('u', "
      "'<f8'), "
      "('v', '<f8')], 'fortran_order': False, 'shape': (" +
      std::to_string(hits.size()) + ",), }";
  // The data start on a multiple of 64, as NumPy writes them.
  const std::size_t unpadded = 10 + header.size() + 1;
  header.append((64 - unpadded % 64) % 64, ' ');
  header += '\n';
  std::string bytes(kMagic);
  bytes += '\x01';
  bytes += '\0';
  bytes += static_cast<char>(header.size() & 0xff);
  bytes += static_cast<char>(header.size() >> 8);
  bytes += header;
  bytes.append(reinterpret_cast<const char*>(hits.data()), hits.size_bytes());
  return bytes;
}

}  // namespace retrace::cli
