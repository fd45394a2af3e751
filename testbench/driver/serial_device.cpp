// See serial_device.hpp.
#include "testbench/driver/serial_device.hpp"

#include <algorithm>
#include <cstddef>

#include "golden/scene/geometry.hpp"

namespace retrace::cosim {
namespace {

constexpr std::size_t kLeastBudget = 32;   // payload of the shortest frames: one ray
constexpr std::size_t kFirstBudget = 256;  // before the line is known
constexpr std::size_t kOverhead = 24;      // flags, header, check sequence, some escapes; both ways
constexpr int kTriesOfDivisible = 2;
constexpr double kLeastTimeout = 0.05;  // seconds; USB and scheduling
constexpr double kMargin = 4;           // times what the line took for a byte, and memory for a word, so far
constexpr double kClocksPerWord = 20;   // of a fill or a sum, before one has been timed
constexpr double kLeastClockHz = 1e6;   // whatever the board says of itself

}  // namespace

SerialDevice::SerialDevice(std::unique_ptr<SerialLine> line, const LinkOptions& options)
    : BoardDevice(options),
      line_(std::move(line)),
      reader_(70000),
      budget_(kFirstBudget),
      most_budget_(kFirstBudget),
      byte_seconds_(10.0 / options.baud) {
  begin();
  word_seconds_ = kClocksPerWord / std::max<double>(identity_.clock_hz, kLeastClockHz);
  most_budget_ = most_load();
}

double SerialDevice::timeout(std::size_t bytes, std::size_t words) const {
  return slack_ * (kLeastTimeout +
                   kMargin * (byte_seconds_ * static_cast<double>(bytes) + word_seconds_ * static_cast<double>(words)));
}

void SerialDevice::failed(std::size_t bytes) { budget_ = std::max(kLeastBudget, std::min(budget_, bytes) * 2 / 3); }
void SerialDevice::succeeded(std::size_t bytes) {
  // Only a frame that used the budget says that there could be more.
  if (2 * bytes >= budget_) budget_ = std::min(most_budget_, budget_ + budget_ / 4 + 1);
}

bool SerialDevice::exchange(const link::Request& request, std::size_t answer_bytes, bool divisible, Answer& answer) {
  ++sequence_;
  std::vector<std::uint8_t> body{link::kRequest, static_cast<std::uint8_t>(sequence_),
                                 static_cast<std::uint8_t>(sequence_ >> 8), static_cast<std::uint8_t>(session_),
                                 static_cast<std::uint8_t>(session_ >> 8)};
  body.insert(body.end(), request.bytes().begin(), request.bytes().end());
  const std::vector<std::uint8_t> line = link::frame(body);
  const std::size_t load = std::max(request.bytes().size(), answer_bytes);
  const std::size_t expected = line.size() + answer_bytes + kOverhead, walked = request.walked();
  ++statistics_.frames;
  double heard = line_->now();
  bool ever = false;
  for (int tries = 1;; ++tries) {
    line_->write(line);
    statistics_.bytes_out += line.size();
    const double sent = line_->now(), until = sent + timeout(expected, walked);
    bool again = false;
    while (!again) {
      const double left = until - line_->now();
      if (left <= 0) break;
      const std::vector<std::uint8_t> bytes = line_->read(left);
      statistics_.bytes_in += bytes.size();
      if (!bytes.empty()) {
        heard = line_->now();
        ever = true;
      }
      for (const std::uint8_t byte : bytes) {
        const auto frame = reader_.take(byte);
        if (!frame) continue;
        if (!frame->good || frame->body.size() < link::kResponseHeader) {
          again = true;
          continue;
        }
        const std::vector<std::uint8_t>& b = frame->body;
        if ((b[0] & link::kRequestBit) != 0) continue;  // an echo of what was sent
        if (b[0] != link::kResponse)
          fail("the board speaks version " + std::to_string(b[0] & 0x0f) + " of the protocol, this program version " +
               std::to_string(link::kResponse & 0x0f));
        answer.status = static_cast<link::Status>(b[5]);
        if (answer.status == link::Status::kDamaged) {
          again = true;
          continue;
        }
        if (link::get(b, 1, 2) != sequence_ || link::get(b, 3, 2) != session_) continue;  // of a frame before
        answer.position = static_cast<std::uint16_t>(link::get(b, 6, 2));
        answer.data.assign(b.begin() + link::kResponseHeader, b.end());
        if (tries == 1) {
          // The board's own work says nothing about the line, so it is booked apart.
          const double elapsed = line_->now() - sent;
          const auto learn = [](double& known, double sample) { known = std::max(sample, 0.9 * known + 0.1 * sample); };
          if (walked == 0) {
            learn(byte_seconds_, elapsed / static_cast<double>(expected));
          } else {
            learn(word_seconds_,
                  std::max(0.0, elapsed - byte_seconds_ * static_cast<double>(expected)) / static_cast<double>(walked));
          }
          succeeded(load);
        }
        slack_ = std::max(1.0, slack_ / 2);
        return true;
      }
    }
    // Not answered: damaged on its way there or back, or not at all.
    ++statistics_.repeated;
    if (!again) {
      ++statistics_.timeouts;
      slack_ = std::min(16.0, 2 * slack_);
    }
    if (line_->now() - heard > std::max(options_.patience, 2 * timeout(expected, walked)))
      fail(ever || !unknown() ? "the board does not answer any more" : "nothing answers");
    if (tries >= options_.most_tries)
      fail("no whole answer in " + std::to_string(tries) +
           " tries; the line damages too much, or it is no Retrace board");
    failed(load);
    if (divisible && tries >= kTriesOfDivisible && load > kLeastBudget) return false;
  }
}

void SerialDevice::pass(double seconds) {
  // Nothing is outstanding, so what arrives meanwhile belongs to nothing.
  for (const double until = line_->now() + seconds; line_->now() < until;) line_->read(until - line_->now());
}

}  // namespace retrace::cosim
