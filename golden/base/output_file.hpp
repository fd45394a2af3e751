// The one way in which files are written. Contents are made in memory; nothing is touched until all of a command's outputs are there.
//
// A regular file appears whole or not at all: a temporary file with a random name in the same folder is written, synchronised and renamed.
// It gets the mode and owner of the file that it replaces. Links are followed. What cannot be replaced is written through or in place:
//   - devices, FIFOs, and descriptors of the program (/dev/stdout, /dev/fd/3);
//   - regular files that cannot be renamed over: mount points (a single file mounted into a container), files in folders without write
//     permission. Space is reserved first, and the old contents are put back if the writing fails.
// A hard link is replaced, so that other names keep the old contents, as snapshots made with links expect.
#pragma once
#include <sys/types.h>

#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "golden/base/error.hpp"
#include "golden/base/interrupt.hpp"

namespace retrace {

/// Writes all bytes to a descriptor. 0, or the error number; a reader that has gone is EPIPE, not a signal.
int write_all(int descriptor, std::string_view bytes);

/// What other code has written to an anonymous file in memory (memfd_create). 0, or the error number: EFBIG if the limit on the size of
/// files may have cut it short.
int read_memory_file(int descriptor, std::string& bytes);

/// Whether `path` is a device, a FIFO or a descriptor of this program, which is written through.
bool is_written_through(const std::filesystem::path& path);

/// What a path means, links followed: the file, or its folder and name if there is none yet.
struct FileIdentity {
  dev_t device = 0;
  ino_t inode = 0;
  std::string name;  ///< empty if the file exists
  bool operator==(const FileIdentity&) const = default;
};
FileIdentity identify(const std::filesystem::path& path);

/// One output on its way.
class OutputFile {
 public:
  /// Checks that `path` can be written and changes nothing. Devices are opened. If the output is the program's standard output, text that
  /// is printed there later goes to standard error instead. Throws Error.
  explicit OutputFile(std::filesystem::path path);
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  const std::filesystem::path& path() const { return path_; }
  const FileIdentity& identity() const { return identity_; }
  /// Whether outputs that are this same file do each other no harm: the null device.
  bool swallows() const { return null_; }

  /// The contents.
  void write(std::string bytes);
  /// The same without a copy: `bytes` must stay until commit().
  void refer(std::string_view bytes);
  /// Puts the contents in their place. Throws Error that names the file and the reason; a regular file then is as it was.
  void commit();

 private:
  friend class OutputFiles;
  enum class Kind { kReplace, kInPlace, kThrough };

  [[noreturn]] void fail(int error) const;
  void open_through(int descriptor);
  void prepare();
  void publish();
  void write_in_place() const;
  void write_through();

  std::filesystem::path path_, target_;  ///< as given; with links followed
  FileIdentity identity_;
  Kind kind_ = Kind::kReplace;
  int descriptor_ = -1;  ///< of what is written through, unless it is opened late
  bool null_ = false;
  std::string bytes_;
  std::string_view contents_;
  std::unique_ptr<TemporaryFile> temporary_;
};

/// All files of one command. No two may be the same file, and none may be one that the command reads.
class OutputFiles {
 public:
  /// A file that is read; what does not exist is no file. Throws UsageError if it is an output.
  void reads(const std::filesystem::path& input);
  void reads(std::span<const std::filesystem::path> inputs) {
    for (const std::filesystem::path& input : inputs) reads(input);
  }
  /// Throws UsageError if the file is already an output or is read.
  void check(const std::filesystem::path& path) const;
  /// The same, and makes it an output. Throws Error if it cannot be written.
  OutputFile& add(const std::filesystem::path& path);
  const std::vector<std::unique_ptr<OutputFile>>& files() const { return files_; }
  /// All or none, as far as regular files go: they are renamed when every byte of every file is written.
  void commit();

 private:
  struct Known {
    std::filesystem::path path;
    FileIdentity identity;
  };
  std::vector<Known> inputs_;
  std::vector<std::unique_ptr<OutputFile>> files_;
};

/// Writes one file whole. Throws Error.
void write_file(const std::filesystem::path& path, std::string bytes);

}  // namespace retrace
