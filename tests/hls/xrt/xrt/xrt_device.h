// A stand-in for XRT, as much of its C++ interface as the host example uses: a device whose kernel is retrace_trace in C simulation. Host and device
// have copies of a buffer of their own, so that a forgotten sync() shows; a buffer in another argument's bank, or too short, is refused.
#pragma once
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

enum xclBOSyncDirection { XCL_BO_SYNC_BO_TO_DEVICE = 0, XCL_BO_SYNC_BO_FROM_DEVICE };

namespace xrt {

class uuid {};

class device {
 public:
  explicit device(unsigned index) {
    if (index != 0) throw std::runtime_error("No such device with index '" + std::to_string(index) + "'");
  }
  uuid load_xclbin(const std::string& file) {
    std::FILE* const opened = std::fopen(file.c_str(), "rb");
    if (opened == nullptr) throw std::runtime_error("Failed to open '" + file + "' for reading");
    std::fclose(opened);
    return {};
  }
};

class bo {
 public:
  bo(const device&, std::size_t bytes, int group)
      : state_(new state{group, std::vector<char>(bytes), std::vector<char>(bytes, 0x5a)}) {}
  void write(const void* source) { std::memcpy(state_->host.data(), source, state_->host.size()); }
  void read(void* target) const { std::memcpy(target, state_->host.data(), state_->host.size()); }
  void sync(xclBOSyncDirection direction) {
    if (direction == XCL_BO_SYNC_BO_TO_DEVICE) state_->device = state_->host;
    if (direction == XCL_BO_SYNC_BO_FROM_DEVICE) state_->host = state_->device;
  }
  int group() const { return state_->group; }
  std::vector<char>& device_memory() const { return state_->device; }

 private:
  struct state {
    int group;
    std::vector<char> host, device;
  };
  std::shared_ptr<state> state_;
};

}  // namespace xrt
