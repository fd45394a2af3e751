// See serial_line.hpp.
#include "testbench/driver/serial_line.hpp"

#include <fcntl.h>
#include <linux/serial.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>

#include "golden/base/clock.hpp"
#include "golden/scene/geometry.hpp"

namespace retrace::cosim {
namespace {

constexpr double kPatience = 10;  // seconds in which a line has to take something

speed_t speed_of(unsigned baud) {
  constexpr struct {
    unsigned baud;
    speed_t code;
  } kSpeeds[] = {{9600, B9600},       {19200, B19200},     {38400, B38400},     {57600, B57600},
                 {115200, B115200},   {230400, B230400},   {460800, B460800},   {921600, B921600},
                 {1000000, B1000000}, {1500000, B1500000}, {2000000, B2000000}, {2500000, B2500000},
                 {3000000, B3000000}, {4000000, B4000000}};
  std::string known;
  for (const auto& speed : kSpeeds) {
    if (speed.baud == baud) return speed.code;
    known += (known.empty() ? "" : ", ") + std::to_string(speed.baud);
  }
  throw Error("serial line: there is no rate of " + std::to_string(baud) + " baud; there are: " + known);
}

class Terminal final : public SerialLine {
 public:
  Terminal(const std::string& path, unsigned baud) : path_(path) {
    const speed_t speed = speed_of(baud);
    check_serial_line(path);
    file_ = ::open(path.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
    if (file_ < 0) throw Error("serial line: cannot open " + path + ": " + std::strerror(errno));
    try {
      set_up(speed);
    } catch (...) {
      ::close(file_);
      throw;
    }
  }
  ~Terminal() override {
    ::ioctl(file_, TIOCNXCL);
    ::close(file_);
  }
  Terminal(const Terminal&) = delete;
  Terminal& operator=(const Terminal&) = delete;

  void write(std::span<const std::uint8_t> bytes) override {
    double waiting = now();
    while (!bytes.empty()) {
      const ssize_t done = ::write(file_, bytes.data(), bytes.size());
      if (done > 0) {
        bytes = bytes.subspan(static_cast<std::size_t>(done));
        waiting = now();
        continue;
      }
      if (done < 0 && errno != EAGAIN && errno != EINTR) gone();
      if (now() - waiting > kPatience) throw Error("serial line: " + path_ + " takes no data");
      wait_for(POLLOUT, 0.1);
    }
  }

  std::vector<std::uint8_t> read(double seconds) override {
    std::vector<std::uint8_t> bytes(4096);
    const double until = now() + seconds;
    for (;;) {
      const ssize_t done = ::read(file_, bytes.data(), bytes.size());
      if (done > 0) {
        bytes.resize(static_cast<std::size_t>(done));
        return bytes;
      }
      // A terminal that was hung up reads as the end of a file.
      if (done == 0) errno = 0;
      if (done == 0 || (errno != EAGAIN && errno != EINTR)) gone();
      const double left = until - now();
      if (left <= 0) return {};
      wait_for(POLLIN, left);
    }
  }

  double now() const override { return retrace::now(); }
  const std::string& name() const override { return path_; }

 private:
  void set_up(speed_t speed) {
    const auto fail = [&](const char* what) {
      throw Error("serial line: " + path_ + ": " + what + ": " + std::strerror(errno));
    };
    if (::ioctl(file_, TIOCEXCL) != 0) fail("cannot be had alone");
    termios settings{};
    if (::tcgetattr(file_, &settings) != 0) fail("has no terminal settings");
    ::cfmakeraw(&settings);
    settings.c_cflag |= CLOCAL | CREAD;
    settings.c_cflag &= ~static_cast<tcflag_t>(CSTOPB | CRTSCTS);
    settings.c_cc[VMIN] = 1;  // so that nothing to read and a line that was hung up are told apart
    settings.c_cc[VTIME] = 0;
    if (::cfsetispeed(&settings, speed) != 0 || ::cfsetospeed(&settings, speed) != 0) fail("does not know the rate");
    if (::tcsetattr(file_, TCSANOW, &settings) != 0) fail("does not take the settings");
    // USB adapters wait up to 16 ms for more bytes before they pass on what they have, unless told otherwise.
    serial_struct serial{};
    if (::ioctl(file_, TIOCGSERIAL, &serial) == 0) {
      serial.flags |= ASYNC_LOW_LATENCY;
      ::ioctl(file_, TIOCSSERIAL, &serial);
    }
    ::tcflush(file_, TCIOFLUSH);
  }

  void wait_for(short what, double seconds) {
    pollfd ask{file_, what, 0};
    const int milliseconds = std::clamp(static_cast<int>(std::ceil(seconds * 1000)), 1, 1000);
    const int found = ::poll(&ask, 1, milliseconds);
    if (found > 0 && (ask.revents & (POLLERR | POLLNVAL | POLLHUP)) != 0) {
      errno = 0;
      gone();
    }
  }

  [[noreturn]] void gone() const {
    throw Error("serial line: " + path_ + " is gone" + (errno != 0 ? std::string(": ") + std::strerror(errno) : ""));
  }

  std::string path_;
  int file_ = -1;
};

}  // namespace

void check_serial_line(const std::string& path) {
  struct stat info {};
  if (::stat(path.c_str(), &info) != 0) throw Error("serial line: " + path + ": " + std::strerror(errno));
  if (!S_ISCHR(info.st_mode)) throw Error("serial line: " + path + " is no device");
  if (::access(path.c_str(), R_OK | W_OK) != 0) throw Error("serial line: " + path + ": " + std::strerror(errno));
}

std::unique_ptr<SerialLine> open_serial_line(const std::string& path, unsigned baud) {
  return std::make_unique<Terminal>(path, baud);
}

}  // namespace retrace::cosim
