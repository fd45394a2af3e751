// See child.hpp.
#include "testbench/program/child.hpp"

#include <fcntl.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <system_error>
#include <utility>

#include "golden/base/interrupt.hpp"
#include "golden/base/output_file.hpp"

namespace retrace::cli {
namespace {

constexpr std::array<std::pair<const char*, const char*>, 11> kContainers = {{{".mp4", "mp4"},
                                                                              {".m4v", "mp4"},
                                                                              {".mov", "mov"},
                                                                              {".mkv", "matroska"},
                                                                              {".webm", "webm"},
                                                                              {".avi", "avi"},
                                                                              {".gif", "gif"},
                                                                              {".mpg", "mpeg"},
                                                                              {".ts", "mpegts"},
                                                                              {".ogv", "ogv"},
                                                                              {".flv", "flv"}}};

int anonymous_file(const char* name) { return ::memfd_create(name, MFD_CLOEXEC); }

std::string error_text(int error) { return std::generic_category().message(error); }

}  // namespace

std::string video_container(const std::filesystem::path& name) {
  std::string extension = name.extension().string(), known;
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  for (const auto& [of, container] : kContainers) {
    if (extension == of) return container;
    known += (known.empty() ? "" : ", ") + std::string(of);
  }
  throw UsageError("a video is one of " + known + ", not " + name.string());
}

VideoEncoder::VideoEncoder(std::string ffmpeg, const std::filesystem::path& name, int width, int height, double fps)
    : program_(std::move(ffmpeg)) {
  const std::string container = video_container(name);
  video_ = anonymous_file("video");
  messages_ = anonymous_file("messages");
  if (video_ < 0 || messages_ < 0) fail(error_text(errno));
  char rate[32];
  std::snprintf(rate, sizeof rate, "%.9g", fps);
  // 4:2:0 is what every player shows; it needs even sides.
  start({program_,
         "-nostdin",
         "-v",
         "error",
         "-y",
         "-f",
         "rawvideo",
         "-pixel_format",
         "rgb24",
         "-video_size",
         std::to_string(width) + "x" + std::to_string(height),
         "-framerate",
         rate,
         "-i",
         "pipe:0",
         "-vf",
         "pad=ceil(iw/2)*2:ceil(ih/2)*2",
         "-pix_fmt",
         "yuv420p",
         "-f",
         container,
         "file:/proc/self/fd/3"});
}

VideoEncoder::~VideoEncoder() {
  if (child_ > 0) {
    ::kill(-child_, SIGKILL);
    wait();
  }
  for (const int file : {pictures_, video_, messages_}) {
    if (file >= 0) ::close(file);
  }
}

void VideoEncoder::start(const std::vector<std::string>& command) {
  std::array<int, 2> channel;
  if (::pipe2(channel.data(), O_CLOEXEC) != 0) fail(error_text(errno));
  pictures_ = channel[1];
  std::vector<char*> argv;
  for (const std::string& argument : command) argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);
  const pid_t parent = ::getpid();
  const int nowhere = ::open("/dev/null", O_WRONLY | O_CLOEXEC);
  const SignalShield shield;
  child_ = ::fork();
  if (child_ == 0) {
    // Only what is safe between fork and exec in a program with threads. The handlers are this program's: they must not run here.
    for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGPIPE, SIGXFSZ}) ::signal(signal, SIG_DFL);
    ::setpgid(0, 0);
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);  // also when this program is killed
    if (::getppid() != parent) ::_exit(127);
    // Numbers above those that are filled, so that no one is overwritten before it is copied.
    const int from = ::fcntl(channel[0], F_DUPFD_CLOEXEC, 10), video = ::fcntl(video_, F_DUPFD_CLOEXEC, 10),
              messages = ::fcntl(messages_, F_DUPFD_CLOEXEC, 10), null = ::fcntl(nowhere, F_DUPFD_CLOEXEC, 10);
    if (::dup2(from, 0) < 0 || ::dup2(null, 1) < 0 || ::dup2(messages, 2) < 0 || ::dup2(video, 3) < 0) ::_exit(127);
    ::execv(argv[0], argv.data());
    ::_exit(127);
  }
  const int error = child_ < 0 ? errno : 0;
  ::close(channel[0]);
  if (nowhere >= 0) ::close(nowhere);
  if (error != 0) fail(error_text(error));
  ::setpgid(child_, child_);
  set_child(child_);
}

int VideoEncoder::wait() {
  int status = 0;
  siginfo_t ended;
  // It stays a zombie, whose number is not given away, until the signal handler does not know it any more.
  while (::waitid(P_PID, static_cast<id_t>(child_), &ended, WEXITED | WNOWAIT) < 0 && errno == EINTR) {
  }
  set_child(0);
  while (::waitpid(child_, &status, 0) < 0 && errno == EINTR) {
  }
  child_ = 0;
  return status;
}

void VideoEncoder::fail(const std::string& why) {
  std::string said;
  if (messages_ >= 0) read_memory_file(messages_, said);
  said = said.substr(0, said.find('\n'));
  throw Error(program_ + " failed: " + (said.empty() ? why : said));
}

void VideoEncoder::add(const Raster& picture) {
  std::string bytes;
  bytes.reserve(picture.data.size());
  for (const float value : picture.data)
    bytes += static_cast<char>(std::lround(255.0f * std::clamp(value, 0.0f, 1.0f)));
  const int error = write_all(pictures_, bytes);
  if (error == 0) return;
  // It has ended or closed its input: its exit code and words say more.
  ::close(std::exchange(pictures_, -1));
  const int status = wait();
  fail("it took no more pictures (status " + std::to_string(WIFEXITED(status) ? WEXITSTATUS(status) : status) +
       "): " + error_text(error));
}

std::string VideoEncoder::finish() {
  ::close(std::exchange(pictures_, -1));
  const int status = wait();
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0) fail("it said nothing");
  std::string bytes;
  if (const int error = read_memory_file(video_, bytes); error != 0) fail(error_text(error));
  if (bytes.empty()) fail("it made no video");
  return bytes;
}

}  // namespace retrace::cli
