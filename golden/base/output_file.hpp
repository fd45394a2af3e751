// Files that appear whole or not at all: everything is written to a temporary file in the same folder and renamed at the end.
#pragma once
#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace retrace {

/// One output on its way. The destructor removes the temporary file unless commit() was called.
class OutputFile {
 public:
  /// Creates the temporary file. It keeps the extension of `path`, because writers choose the format by it. Throws Error if the folder
  /// does not exist or cannot be written, or if `path` is a folder.
  explicit OutputFile(std::filesystem::path path);
  ~OutputFile();
  OutputFile(OutputFile&& other) noexcept;
  OutputFile& operator=(OutputFile&&) = delete;

  const std::filesystem::path& path() const { return path_; }
  const std::filesystem::path& temporary() const { return temporary_; }
  /// Replaces the contents of the temporary file. Throws Error.
  void write(std::string_view bytes);
  /// Puts the file in its place. Throws Error.
  void commit();

 private:
  std::filesystem::path path_, temporary_;
  int slot_ = -1;  ///< in the table that remove_pending_outputs() reads
};

/// Removes the temporary files of all outputs that are not committed. Safe to call from a signal handler.
void remove_pending_outputs() noexcept;

/// Writes one file whole. Throws Error.
void write_file(const std::filesystem::path& path, std::string_view bytes);

}  // namespace retrace
