// See stage_watch.hpp; the functions that rt_stage_probe.sv imports.
#include "testbench/sim/core/stage_watch.hpp"

#include <svdpi.h>

#include "golden/base/error.hpp"

namespace retrace::cosim {
namespace {

thread_local StageWatch* watch_of_thread = nullptr;

std::vector<std::uint64_t> words(const std::uint32_t* data, std::size_t count) {
  std::vector<std::uint64_t> result(count);
  for (std::size_t i = 0; i < count; ++i) result[i] = data[2 * i] | static_cast<std::uint64_t>(data[2 * i + 1]) << 32;
  return result;
}

}  // namespace

StageWatch::StageWatch() {
  if (watch_of_thread != nullptr) throw Error("rtl core: its stages are being watched already");
  watch_of_thread = this;
}
StageWatch::~StageWatch() { watch_of_thread = nullptr; }

void StageWatch::takes(int stage, const std::uint32_t* data) {
  const auto s = static_cast<Stage>(stage);
  waiting_[static_cast<std::size_t>(stage)].push_back(seen_.size());
  seen_.push_back({s, words(data, words_of(s).input), {}});
}

void StageWatch::gives(int stage, const std::uint32_t* data) {
  auto& waiting = waiting_[static_cast<std::size_t>(stage)];
  if (waiting.empty())
    throw Error(std::string("rtl core: ") + to_string(static_cast<Stage>(stage)) + " gave what it was not asked for");
  Seen& call = seen_[waiting.front()];
  waiting.pop_front();
  call.output = words(data, words_of(call.stage).output);
}

std::vector<StageCall> StageWatch::calls() const {
  std::vector<StageCall> result;
  for (const Seen& call : seen_) {
    if (call.output.empty()) throw Error(std::string("rtl core: ") + to_string(call.stage) + " has not answered");
    result.push_back(read_stage_call(call.stage, call.input, call.output));
  }
  return result;
}

}  // namespace retrace::cosim

extern "C" {
svBit retrace_watches_stages() { return retrace::cosim::watch_of_thread != nullptr ? 1 : 0; }
void retrace_stage_takes(int stage, const svBitVecVal* data) {
  if (retrace::cosim::watch_of_thread != nullptr) retrace::cosim::watch_of_thread->takes(stage, data);
}
void retrace_stage_gives(int stage, const svBitVecVal* data) {
  if (retrace::cosim::watch_of_thread != nullptr) retrace::cosim::watch_of_thread->gives(stage, data);
}
}
