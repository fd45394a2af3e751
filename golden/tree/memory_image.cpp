// Laying out, loading and saving the memory image (docs/memory-image.md). Checks: memory_image_check.cpp.
#include "memory_image.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zlib.h>

#include <algorithm>
#include <bit>
#include <cerrno>
#include <cstring>
#include <limits>
#include <system_error>
#include <utility>

#include "golden/base/output_file.hpp"
#include "memory_image_layout.hpp"

namespace retrace {
namespace {

using namespace image;

static_assert(std::endian::native == std::endian::little, "words are stored and checksummed as they lie in memory");

std::string errno_text() { return std::error_code(errno, std::generic_category()).message(); }

/// A file descriptor that closes itself.
struct File {
  int descriptor = -1;
  explicit File(int d) : descriptor(d) {}
  File(const File&) = delete;
  File& operator=(const File&) = delete;
  ~File() {
    if (descriptor >= 0) ::close(descriptor);
  }
};

}  // namespace

MemoryImage::MemoryImage(std::vector<std::uint64_t> words) : words_(std::move(words)) {
  if (words_.size() < HeaderRecord::kWords)
    fail("header: " + std::to_string(bytes()) + " bytes are too few, expected at least " +
         std::to_string(contract::kHeaderBytes));
  header_ = HeaderRecord::unpack(words_.data());
  check();
}

std::uint32_t MemoryImage::checksum(std::span<const std::uint64_t> words) {
  constexpr std::size_t kAt = 12, kSize = 4;  // of the checksum word itself, which counts as 0
  const auto* bytes = reinterpret_cast<const Bytef*>(words.data());
  const Bytef zero[kSize] = {};
  if (words.size_bytes() < kAt + kSize) return 0;
  uLong crc = crc32_z(0, bytes, kAt);
  crc = crc32_z(crc, zero, kSize);
  return static_cast<std::uint32_t>(crc32_z(crc, bytes + kAt + kSize, words.size_bytes() - kAt - kSize));
}

std::uint32_t MemoryImage::step_limit(std::uint64_t pairs, std::uint64_t leaves, std::uint64_t references,
                                      std::uint64_t leaf_depths) {
  // A walk is a depth-first one: it goes down through a node once, into a leaf once, tests a reference once, and from a
  // leaf climbs at most to the root.
  const std::uint64_t steps = 2 * pairs - 1 + leaves + references + leaf_depths;
  return static_cast<std::uint32_t>(std::min<std::uint64_t>(steps, std::numeric_limits<std::uint32_t>::max()));
}

MemoryImage MemoryImage::assemble(HeaderRecord header, std::span<const NodePairRecord> pairs,
                                  std::span<const LeafRecord> leaves, std::span<const std::uint32_t> list,
                                  std::span<const TriangleRecord> triangles, std::span<const InstanceRecord> instances,
                                  const SectionRoom& room) {
  const auto expect_room = [](std::uint64_t count, std::uint64_t most, const char* what) {
    if (count > most)
      fail(std::to_string(count) + " " + what + " are more than the format holds, " + std::to_string(most));
  };
  expect_room(pairs.size(), kMaxPairs, "node pairs");
  expect_room(leaves.size(), kMaxLeaves, "leaf records");
  expect_room(list.size(), kMaxList, "list entries");
  expect_room(triangles.size(), kMaxTriangles, "triangles");
  const bool two_levels = header.version == static_cast<std::uint32_t>(contract::kImageVersionTwoLevels);
  expect_room(instances.size(), two_levels ? kMaxInstances : 0, "instances");
  const Layout at = layout_of(pairs.size(), leaves.size(), list.size(), triangles.size(), instances.size(),
                              two_levels ? room : SectionRoom{});
  expect_room(at.end, kMaxLines, "lines");

  MemoryImage image;
  image.words_.resize(at.end * kLineWords);
  header.magic = static_cast<std::uint32_t>(contract::kImageMagic);
  header.version = static_cast<std::uint32_t>(two_levels ? contract::kImageVersionTwoLevels : contract::kImageVersion);
  header.lines = static_cast<std::uint32_t>(at.end);
  header.checksum = 0;
  header.pair_offset = static_cast<std::uint32_t>(at.pairs);
  header.pair_count = static_cast<std::uint32_t>(pairs.size());
  header.leaf_offset = static_cast<std::uint32_t>(at.leaves);
  header.leaf_count = static_cast<std::uint32_t>(leaves.size());
  header.list_offset = static_cast<std::uint32_t>(at.list);
  header.list_count = static_cast<std::uint32_t>(list.size());
  header.triangle_offset = static_cast<std::uint32_t>(at.triangles);
  header.triangle_count = static_cast<std::uint32_t>(triangles.size());
  header.instance_offset = two_levels ? static_cast<std::uint32_t>(at.instances) : 0;
  header.instance_count = static_cast<std::uint32_t>(instances.size());

  const auto pack_all = [&](auto records, std::uint64_t line, auto name) {
    std::uint64_t* to = image.words_.data() + line * kLineWords;
    for (std::size_t i = 0; i < records.size(); ++i) {
      if (!records[i].fits()) fail(name(i) + ": a field does not fit its bits");
      records[i].pack(to);
      to += records[i].kWords;
    }
  };
  pack_all(pairs, at.pairs, [](std::size_t i) { return "node pair " + std::to_string(i); });
  pack_all(leaves, at.leaves, leaf_name);
  pack_all(triangles, at.triangles, triangle_name);
  pack_all(instances, at.instances, instance_name);
  if (!list.empty()) std::memcpy(image.words_.data() + at.list * kLineWords, list.data(), list.size_bytes());
  header.pack(image.words_.data());
  header.checksum = checksum(image.words_);
  header.pack(image.words_.data());
  image.header_ = header;
  return image;
}

MemoryImage MemoryImage::load(const std::filesystem::path& path) {
  const auto fail_file = [&](const std::string& what) { throw Error(path.string() + ": " + what); };
  // O_NONBLOCK: opening a pipe that nobody writes must not hang.
  File file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  if (file.descriptor < 0) fail_file("cannot open: " + errno_text());
  struct stat status;
  if (::fstat(file.descriptor, &status) != 0) fail_file("cannot read: " + errno_text());
  if (!S_ISREG(status.st_mode)) fail_file("not a regular file");
  const auto size = static_cast<std::uint64_t>(status.st_size);

  const auto read_exactly = [&](std::uint64_t* to, std::uint64_t count) {
    auto* bytes = reinterpret_cast<char*>(to);
    for (std::uint64_t done = 0; done < count;) {
      const ssize_t got = ::read(file.descriptor, bytes + done, std::min<std::uint64_t>(count - done, 1u << 30));
      if (got < 0 && errno == EINTR) continue;
      if (got < 0) fail_file("cannot read: " + errno_text());
      if (got == 0) fail_file("file ends after " + std::to_string(done) + " bytes");
      done += static_cast<std::uint64_t>(got);
    }
  };
  if (size < contract::kHeaderBytes)
    fail_file("file has " + std::to_string(size) + " bytes, a memory image at least " +
              std::to_string(contract::kHeaderBytes));
  std::vector<std::uint64_t> words(HeaderRecord::kWords);
  read_exactly(words.data(), contract::kHeaderBytes);
  const HeaderRecord header = HeaderRecord::unpack(words.data());
  if (header.magic != static_cast<std::uint32_t>(contract::kImageMagic)) fail_file("not a memory image (magic)");
  if (header.version != static_cast<std::uint32_t>(contract::kImageVersion) &&
      header.version != static_cast<std::uint32_t>(contract::kImageVersionTwoLevels))
    fail_file("memory image of version " + std::to_string(header.version) + ", expected " +
              std::to_string(contract::kImageVersion) + ", or " + std::to_string(contract::kImageVersionTwoLevels) +
              " (two levels)");
  if (size != header.lines * kLineBytes)
    fail_file("file has " + std::to_string(size) + " bytes, its header says " +
              std::to_string(header.lines * kLineBytes));
  try {
    check_header(header, size / 8);  // bounds the size before anything that large is allocated
    words.resize(size / 8);
    read_exactly(words.data() + HeaderRecord::kWords, size - contract::kHeaderBytes);
    return MemoryImage(std::move(words));
  } catch (const Error& error) {
    throw Error(path.string() + ": " + error.what());
  }
}

void MemoryImage::save(const std::filesystem::path& path) const {
  OutputFile file(path);
  file.refer(file_bytes());
  file.commit();
}

GridTransform MemoryImage::transform() const {
  GridTransform transform;
  transform.scale = std::bit_cast<double>(header_.scale);
  for (int i = 0; i < 3; ++i) transform.center[i] = std::bit_cast<double>(header_.center[i]);
  return transform;
}

}  // namespace retrace
