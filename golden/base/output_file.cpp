// Whole files or none, see output_file.hpp.
#include "golden/image/output_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <cstring>
#include <utility>

#include "golden/scene/scene.hpp"

namespace retrace {
namespace {

// Names of the pending temporary files, in memory that a signal handler may read. A slot is claimed before its name is written and is
// visible to the handler only when `ready`.
struct Slot {
  std::atomic<bool> claimed{false}, ready{false};
  char name[4096];
};
std::array<Slot, 64> slots;
std::atomic<unsigned> counter{0};

int claim(const std::string& name) {
  if (name.size() >= sizeof(Slot::name)) return -1;
  for (std::size_t i = 0; i < slots.size(); ++i) {
    bool expected = false;
    if (!slots[i].claimed.compare_exchange_strong(expected, true)) continue;
    std::memcpy(slots[i].name, name.c_str(), name.size() + 1);
    slots[i].ready.store(true);
    return static_cast<int>(i);
  }
  return -1;
}

void release(int slot) {
  if (slot < 0) return;
  slots[static_cast<std::size_t>(slot)].ready.store(false);
  slots[static_cast<std::size_t>(slot)].claimed.store(false);
}

}  // namespace

OutputFile::OutputFile(std::filesystem::path path) : path_(std::move(path)) {
  std::error_code ignored;
  if (path_.filename().empty() || std::filesystem::is_directory(path_, ignored)) {
    throw Error("cannot write " + path_.string() + ": it is a folder");
  }
  std::filesystem::path name =
      "." + path_.stem().string() + ".tmp" + std::to_string(::getpid()) + "-" + std::to_string(counter.fetch_add(1));
  name += path_.extension();
  temporary_ = path_.parent_path() / name;
  slot_ = claim(temporary_.string());
  const int file = ::open(temporary_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
  if (file < 0) {
    const std::string why = std::strerror(errno);
    release(slot_);
    throw Error("cannot write " + path_.string() + ": " + why);
  }
  ::close(file);
}

OutputFile::OutputFile(OutputFile&& other) noexcept
    : path_(std::move(other.path_)), temporary_(std::move(other.temporary_)), slot_(std::exchange(other.slot_, -1)) {
  other.temporary_.clear();
}

OutputFile::~OutputFile() {
  if (!temporary_.empty()) ::unlink(temporary_.c_str());
  release(slot_);
}

void OutputFile::write(std::string_view bytes) {
  const int file = ::open(temporary_.c_str(), O_WRONLY | O_TRUNC | O_CLOEXEC);
  int error = file < 0 ? errno : 0;
  while (error == 0 && !bytes.empty()) {
    const ssize_t n = ::write(file, bytes.data(), bytes.size());
    if (n > 0) {
      bytes.remove_prefix(static_cast<std::size_t>(n));
    } else if (errno != EINTR) {
      error = errno;
    }
  }
  if (file >= 0 && ::close(file) != 0 && error == 0) error = errno;
  if (error != 0) throw Error("cannot write " + path_.string() + ": " + std::strerror(error));
}

void OutputFile::commit() {
  if (std::rename(temporary_.c_str(), path_.c_str()) != 0) {
    throw Error("cannot write " + path_.string() + ": " + std::strerror(errno));
  }
  temporary_.clear();
  release(std::exchange(slot_, -1));
}

void remove_pending_outputs() noexcept {
  for (const Slot& slot : slots) {
    if (slot.ready.load()) ::unlink(slot.name);
  }
}

void write_file(const std::filesystem::path& path, std::string_view bytes) {
  OutputFile file(path);
  file.write(bytes);
  file.commit();
}

}  // namespace retrace
