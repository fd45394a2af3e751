// A program that makes a video of pictures, as a child that ends with this one.
#pragma once
#include <sys/types.h>

#include <string>
#include <vector>

#include "golden/render/raster.hpp"

namespace retrace::cli {

/// ffmpeg, fed with pictures through a pipe. What it makes is in memory until finish(), so neither pictures nor a video of another run can
/// get in, and nothing is left where this program is ended: its group of processes is killed with it.
class VideoEncoder {
 public:
  /// Throws UsageError if the container cannot be told from the extension of `name`.
  VideoEncoder(std::string ffmpeg, const std::filesystem::path& name, int width, int height, double fps);
  /// Ends the child if finish() was not called.
  ~VideoEncoder();
  VideoEncoder(const VideoEncoder&) = delete;
  VideoEncoder& operator=(const VideoEncoder&) = delete;

  /// Three channels, sRGB-encoded. Throws Error with what ffmpeg said if it takes no more.
  void add(const Raster& picture);
  /// The file. Throws Error with what ffmpeg said if it failed.
  std::string finish();

 private:
  void start(const std::vector<std::string>& command);
  [[noreturn]] void fail(const std::string& why);
  int wait();

  std::string program_;
  pid_t child_ = 0;
  int pictures_ = -1, video_ = -1, messages_ = -1;
};

/// What ffmpeg calls the container of files with this extension (".mp4"); throws UsageError that lists the known ones.
std::string video_container(const std::filesystem::path& name);

}  // namespace retrace::cli
