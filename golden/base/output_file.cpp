// See output_file.hpp.
#include "golden/base/output_file.hpp"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <climits>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <optional>
#include <system_error>
#include <utility>

namespace retrace {
namespace {

namespace fs = std::filesystem;

/// A descriptor that is closed at the end.
struct Descriptor {
  int value = -1;
  explicit Descriptor(int v) : value(v) {}
  ~Descriptor() { close(); }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  int close() { return value >= 0 && ::close(std::exchange(value, -1)) != 0 ? errno : 0; }
};

/// SIGPIPE of this thread is held back and thrown away.
class WithoutSigpipe {
 public:
  WithoutSigpipe() {
    ::sigemptyset(&pipe_);
    ::sigaddset(&pipe_, SIGPIPE);
    ::pthread_sigmask(SIG_BLOCK, &pipe_, &before_);
  }
  ~WithoutSigpipe() {
    const timespec at_once{};
    while (::sigtimedwait(&pipe_, nullptr, &at_once) > 0) {
    }
    ::pthread_sigmask(SIG_SETMASK, &before_, nullptr);
  }
  WithoutSigpipe(const WithoutSigpipe&) = delete;
  WithoutSigpipe& operator=(const WithoutSigpipe&) = delete;

 private:
  sigset_t pipe_, before_;
};

fs::path folder_of(const fs::path& path) { return path.has_parent_path() ? path.parent_path() : fs::path("."); }

/// A path with links followed, also one to what does not exist yet; or the descriptor of this program that it means.
struct Target {
  fs::path path;
  std::optional<int> descriptor;
};

Target follow(fs::path path) {
  constexpr int kMostLinks = 40;
  std::error_code ignored;
  const fs::path own = fs::canonical("/proc/self/fd", ignored);
  for (int i = 0; i < kMostLinks; ++i) {
    if (!fs::is_symlink(fs::symlink_status(path, ignored))) break;
    if (!own.empty() && fs::canonical(folder_of(path), ignored) == own) {
      const std::string name = path.filename().string();
      int number = -1;
      std::from_chars(name.data(), name.data() + name.size(), number);
      return {path, number};
    }
    const fs::path to = fs::read_symlink(path, ignored);
    if (to.empty()) break;
    path = to.is_absolute() ? to : folder_of(path) / to;
  }
  return {path, {}};
}

FileIdentity identity_of(const Target& target) {
  struct stat info {};
  if (target.descriptor) {
    if (::fstat(*target.descriptor, &info) == 0) return {info.st_dev, info.st_ino, {}};
    return {};
  }
  if (::stat(target.path.c_str(), &info) == 0) return {info.st_dev, info.st_ino, {}};
  if (::stat(folder_of(target.path).c_str(), &info) == 0)
    return {info.st_dev, info.st_ino, target.path.filename().string()};
  return {};
}

bool is_mount_point(const fs::path& path) {
  struct statx info {};
  return ::statx(AT_FDCWD, path.c_str(), AT_SYMLINK_NOFOLLOW, 0, &info) == 0 &&
         (info.stx_attributes & STATX_ATTR_MOUNT_ROOT) != 0;
}

/// Errors of making or renaming a file that say nothing about writing one that is there.
bool only_in_place(int error) {
  return error == EACCES || error == EPERM || error == EROFS || error == EBUSY || error == EXDEV;
}

int synchronise(int descriptor) {
  if (::fsync(descriptor) == 0 || errno == EINVAL || errno == ENOSYS || errno == ENOTSUP) return 0;
  return errno;
}

int put(int descriptor, std::string_view bytes) {
  if (::lseek(descriptor, 0, SEEK_SET) < 0) return errno;
  if (const int error = write_all(descriptor, bytes); error != 0) return error;
  return ::ftruncate(descriptor, static_cast<off_t>(bytes.size())) != 0 ? errno : 0;
}

int read_all(int descriptor, std::string& bytes) {
  std::array<char, 65536> buffer;
  for (;;) {
    const ssize_t n = ::read(descriptor, buffer.data(), buffer.size());
    if (n == 0) return 0;
    if (n > 0) {
      bytes.append(buffer.data(), static_cast<std::size_t>(n));
    } else if (errno != EINTR) {
      return errno;
    }
  }
}

}  // namespace

int write_all(int descriptor, std::string_view bytes) {
  constexpr std::size_t kMost = std::size_t{1} << 30;
  const WithoutSigpipe quiet;
  while (!bytes.empty()) {
    const ssize_t n = ::write(descriptor, bytes.data(), std::min(bytes.size(), kMost));
    if (n > 0) {
      bytes.remove_prefix(static_cast<std::size_t>(n));
    } else if (n == 0) {
      return ENOSPC;
    } else if (errno == EAGAIN) {
      pollfd ready{descriptor, POLLOUT, 0};
      ::poll(&ready, 1, -1);
    } else if (errno != EINTR) {
      return errno;
    }
  }
  return 0;
}

int read_memory_file(int descriptor, std::string& bytes) {
  rlimit limit{};
  if (::lseek(descriptor, 0, SEEK_SET) < 0) return errno;
  if (const int error = read_all(descriptor, bytes); error != 0) return error;
  return ::getrlimit(RLIMIT_FSIZE, &limit) == 0 && bytes.size() >= limit.rlim_cur ? EFBIG : 0;
}

bool is_written_through(const fs::path& path) {
  const Target target = follow(path);
  if (target.descriptor) return true;
  std::error_code ignored;
  const fs::file_status status = fs::status(target.path, ignored);
  return fs::exists(status) && !fs::is_regular_file(status) && !fs::is_directory(status);
}

FileIdentity identify(const fs::path& path) { return identity_of(follow(path)); }

void OutputFile::fail(int error) const {
  throw Error("cannot write " + path_.string() + ": " + std::generic_category().message(error));
}

OutputFile::OutputFile(fs::path path) : path_(std::move(path)) {
  std::error_code ignored;
  if (path_.filename().empty() || fs::is_directory(path_, ignored))
    throw Error("cannot write " + path_.string() + ": it is a folder");
  const Target target = follow(path_);
  target_ = target.path;
  identity_ = identity_of(target);
  if (target.descriptor) {
    const int flags = ::fcntl(*target.descriptor, F_GETFL);
    if (flags < 0) fail(errno);
    if ((flags & O_ACCMODE) == O_RDONLY) fail(EBADF);
    open_through(::fcntl(*target.descriptor, F_DUPFD_CLOEXEC, 0));
    return;
  }
  struct stat info {};
  const bool exists = ::stat(target_.c_str(), &info) == 0;
  if (!exists && errno != ENOENT) fail(errno);
  if (exists && ::faccessat(AT_FDCWD, target_.c_str(), W_OK, AT_EACCESS) != 0) fail(errno);
  if (exists && !S_ISREG(info.st_mode)) {
    // A FIFO is opened when there is something to write: opening waits for a reader, who may first want another of the outputs.
    if (S_ISFIFO(info.st_mode)) {
      kind_ = Kind::kThrough;
      return;
    }
    open_through(::open(target_.c_str(), O_WRONLY | O_CLOEXEC | O_NOCTTY));
    return;
  }
  if (exists && is_mount_point(target_)) {
    kind_ = Kind::kInPlace;
    return;
  }
  // Whether the folder takes a file: the temporary one is gone again at once, so that an end of the program in the middle of its work
  // leaves nothing, not even by SIGKILL.
  const TemporaryFile probe(folder_of(target_).string());
  if (probe.descriptor() >= 0) return;
  if (!exists || !only_in_place(errno)) fail(errno);
  kind_ = Kind::kInPlace;
}

OutputFile::~OutputFile() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

void OutputFile::open_through(int descriptor) {
  if (descriptor < 0) fail(errno);
  kind_ = Kind::kThrough;
  descriptor_ = descriptor;
  struct stat info {
  }, out{};
  if (::fstat(descriptor, &info) != 0) fail(errno);
  null_ = S_ISCHR(info.st_mode) && info.st_rdev == makedev(1, 3);
  // Text must not get between the bytes.
  if (!null_ && ::fstat(STDOUT_FILENO, &out) == 0 && out.st_dev == info.st_dev && out.st_ino == info.st_ino) {
    std::fflush(stdout);
    if (::dup2(STDERR_FILENO, STDOUT_FILENO) < 0) fail(errno);
  }
}

void OutputFile::write(std::string bytes) {
  bytes_ = std::move(bytes);
  contents_ = bytes_;
}

void OutputFile::refer(std::string_view bytes) { contents_ = bytes; }

/// Everything that can fail without touching what is there.
void OutputFile::prepare() {
  if (kind_ != Kind::kReplace) return;
  temporary_ = std::make_unique<TemporaryFile>(folder_of(target_).string());
  const int file = temporary_->descriptor();
  int error = file < 0 ? errno : 0;
  struct stat old {};
  if (error == 0 && ::stat(target_.c_str(), &old) == 0) {
    // Who may not give a file away keeps it.
    [[maybe_unused]] const bool given =
        ::fchown(file, old.st_uid, old.st_gid) == 0 || ::fchown(file, static_cast<uid_t>(-1), old.st_gid) == 0;
    if (::fchmod(file, old.st_mode & 0777) != 0) error = errno;
  }
  if (error == 0) error = write_all(file, contents_);
  if (error == 0) error = synchronise(file);
  // close() may be the first to report a full disk (network file systems).
  if (const int closed = temporary_->close(); error == 0) error = closed;
  if (error == 0) return;
  temporary_.reset();
  fail(error);
}

void OutputFile::publish() {
  if (kind_ == Kind::kThrough) return write_through();
  if (kind_ == Kind::kInPlace) return write_in_place();
  const int error = temporary_->rename_to(target_.string());
  temporary_.reset();
  if (error == 0) {
    const Descriptor folder(::open(folder_of(target_).c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
    if (folder.value >= 0) ::fsync(folder.value);
    return;
  }
  std::error_code ignored;
  if (!only_in_place(error) || !fs::is_regular_file(target_, ignored)) fail(error);
  write_in_place();
}

void OutputFile::write_in_place() const {
  const Descriptor file(::open(target_.c_str(), O_RDWR | O_CLOEXEC));
  if (file.value < 0) fail(errno);
  rlimit limit{};
  if (::getrlimit(RLIMIT_FSIZE, &limit) == 0 && contents_.size() > limit.rlim_cur) fail(EFBIG);
  const auto size = static_cast<off_t>(contents_.size());
  if (size > 0 && ::fallocate(file.value, FALLOC_FL_KEEP_SIZE, 0, size) != 0 && errno != EOPNOTSUPP && errno != ENOSYS)
    fail(errno);
  std::string old;
  if (const int error = read_all(file.value, old); error != 0) fail(error);
  const SignalShield shield;
  int error = put(file.value, contents_);
  if (error == 0) error = synchronise(file.value);
  if (error == 0) return;
  if (put(file.value, old) != 0 || synchronise(file.value) != 0)
    throw Error("cannot write " + path_.string() + ": " + std::generic_category().message(error) +
                ", and the old contents could not be put back");
  fail(error);
}

void OutputFile::write_through() {
  if (descriptor_ < 0) descriptor_ = ::open(target_.c_str(), O_WRONLY | O_CLOEXEC | O_NOCTTY);
  int error = descriptor_ < 0 ? errno : write_all(descriptor_, contents_);
  // Pipes and terminals have nothing to synchronise and say so.
  if (error == 0) error = synchronise(descriptor_);
  if (error == EROFS) error = 0;
  if (descriptor_ >= 0 && ::close(std::exchange(descriptor_, -1)) != 0 && error == 0) error = errno;
  if (error != 0) fail(error);
}

void OutputFile::commit() {
  prepare();
  publish();
}

void OutputFiles::reads(const fs::path& input) {
  std::error_code ignored;
  if (!fs::is_regular_file(input, ignored)) return;
  const FileIdentity identity = identify(input);
  for (const auto& file : files_) {
    if (file->identity() == identity)
      throw UsageError(file->path().string() + " is read (as " + input.string() + "): it cannot be written as well");
  }
  inputs_.push_back({input, identity});
}

void OutputFiles::check(const fs::path& path) const {
  const FileIdentity identity = identify(path);
  for (const Known& input : inputs_) {
    if (input.identity == identity)
      throw UsageError(path.string() + " is read (as " + input.path.string() + "): it cannot be written as well");
  }
  for (const auto& file : files_) {
    if (identity != FileIdentity{} && file->identity() == identity && !file->swallows())
      throw UsageError(path.string() + " is written twice (as " + file->path().string() + " too)");
  }
}

OutputFile& OutputFiles::add(const fs::path& path) {
  check(path);
  files_.push_back(std::make_unique<OutputFile>(path));
  return *files_.back();
}

void OutputFiles::commit() {
  for (const auto& file : files_) file->prepare();
  // What is written through or in place can still fail; a renaming hardly ever.
  for (const auto& file : files_)
    if (file->kind_ != OutputFile::Kind::kReplace) file->publish();
  const SignalShield shield;
  for (const auto& file : files_)
    if (file->kind_ == OutputFile::Kind::kReplace) file->publish();
}

void write_file(const fs::path& path, std::string bytes) {
  OutputFile file(path);
  file.write(std::move(bytes));
  file.commit();
}

}  // namespace retrace
