// See udp_device.hpp.
#include "testbench/driver/udp_device.hpp"

#include <algorithm>
#include <utility>

#include "golden/base/error.hpp"

namespace retrace::cosim {
namespace {

constexpr double kFirstRoundTrip = 0.02, kLeastTimeout = 0.005;  // seconds
constexpr double kMargin = 4, kMostSlack = 16;
constexpr double kClocksPerWord = 20, kLeastClockHz = 1e6;  // of a sum or a fill
constexpr std::size_t kBatchWords = 65536;                  // of a read: what is asked for at once

/// How far `later` is behind `earlier`, modulo 2^16; negative where it is before.
int distance(std::uint16_t earlier, std::uint16_t later) {
  return static_cast<std::int16_t>(static_cast<std::uint16_t>(later - earlier));
}

}  // namespace

UdpDevice::UdpDevice(std::unique_ptr<DatagramLine> line, const LinkOptions& options, const WindowOptions& window)
    : BoardDevice(options), line_(std::move(line)), window_(window), round_trip_(kFirstRoundTrip) {
  begin();
}

std::size_t UdpDevice::budget() const {
  return identity_.most_frame == 0 ? window_.payload : std::min(window_.payload, most_load());
}

void UdpDevice::send(Flight& flight) {
  line_->send(flight.frame);
  statistics_.bytes_out += flight.frame.size();
}

bool UdpDevice::carry_out(std::vector<Job>& jobs) {
  std::deque<std::size_t> waiting;
  for (std::size_t i = 0; i < jobs.size(); ++i) waiting.push_back(i);
  std::deque<Flight> flights;  // in the order of their sequence
  double heard = line_->now(), waits_since = heard, back_since = heard - 1;
  int tries = 0;
  bool ever = false;
  std::size_t walked = 0;
  for (const Job& job : jobs) walked = std::max(walked, job.request.walked());
  const double work =
      kClocksPerWord * static_cast<double>(walked) / std::max<double>(identity_.clock_hz, kLeastClockHz);
  const auto timeout = [&] { return slack_ * (std::max(kLeastTimeout, kMargin * round_trip_) + kMargin * work); };

  /// Frames up to this one are carried out. Whose answer is lost is asked again, in a frame of its own.
  const auto carried_out_to = [&](std::uint16_t sequence) {
    while (!flights.empty() && distance(flights.front().sequence, sequence) >= 0) {
      const Flight& flight = flights.front();
      if (jobs[flight.job].answer_bytes != jobs[flight.job].answer.data.size()) waiting.push_front(flight.job);
      flights.pop_front();
      waits_since = line_->now();
      tries = 0;
      slack_ = std::max(1.0, slack_ / 2);
    }
  };
  const auto again = [&] {
    for (Flight& flight : flights) {
      flight.repeated = true;
      ++statistics_.repeated;
      send(flight);
    }
    back_since = waits_since = line_->now();
  };

  while (!waiting.empty() || !flights.empty()) {
    while (!waiting.empty() && flights.size() < window_.frames) {
      Flight flight{++sequence_, waiting.front(), {}, line_->now()};
      waiting.pop_front();
      std::vector<std::uint8_t>& f = flight.frame;
      f = {link::kOrderedRequest, static_cast<std::uint8_t>(sequence_), static_cast<std::uint8_t>(sequence_ >> 8),
           static_cast<std::uint8_t>(session_), static_cast<std::uint8_t>(session_ >> 8)};
      const auto& operations = jobs[flight.job].request.bytes();
      f.insert(f.end(), operations.begin(), operations.end());
      const std::uint32_t check = link::crc(f);
      for (int i = 0; i < 4; ++i) f.push_back(static_cast<std::uint8_t>(check >> (8 * i)));
      ++statistics_.frames;
      if (flights.empty()) waits_since = line_->now();
      send(flight);
      flights.push_back(std::move(flight));
    }
    const double left = waits_since + timeout() - line_->now();
    const auto datagram = left > 0 ? line_->receive(left) : std::nullopt;
    if (!datagram) {
      if (line_->now() < waits_since + timeout()) continue;
      ++statistics_.timeouts;
      slack_ = std::min(kMostSlack, 2 * slack_);
      if (line_->now() - heard > std::max(options_.patience, 2 * timeout()))
        fail(ever || !unknown() ? "the board does not answer any more" : "nothing answers");
      if (++tries >= options_.most_tries)
        fail("no whole answer in " + std::to_string(tries) +
             " tries; the link loses too much, or there is no Retrace board");
      again();
      continue;
    }
    const std::vector<std::uint8_t>& b = *datagram;
    statistics_.bytes_in += b.size();
    heard = line_->now();
    ever = true;
    if (b.size() < link::kResponseHeader + link::kCrcBytes ||
        link::crc(std::span(b).first(b.size() - link::kCrcBytes)) != link::get(b, b.size() - link::kCrcBytes, 4))
      continue;  // damaged: as if it were lost
    if ((b[0] & link::kRequestBit) != 0) continue;
    if (b[0] != link::kOrderedResponse)
      fail("the board speaks version " + std::to_string(b[0] & 0x0f) + " of the protocol, this program version " +
           std::to_string(link::kOrderedResponse & 0x0f));
    const auto status = static_cast<link::Status>(b[5]);
    if (status == link::Status::kDamaged) continue;  // of which frame is not known
    if (link::get(b, 3, 2) != session_) continue;
    const auto sequence = static_cast<std::uint16_t>(link::get(b, 1, 2)),
               position = static_cast<std::uint16_t>(link::get(b, 6, 2));
    const auto found =
        std::find_if(flights.begin(), flights.end(), [&](const Flight& f) { return f.sequence == sequence; });
    if (found == flights.end()) continue;  // answered before
    if (status == link::Status::kOrder) {
      // Up to `position` all is carried out, whatever has been heard of it.
      if (distance(position, sequence_) < 0) continue;
      carried_out_to(position);
      if (!flights.empty() && flights.front().sequence == static_cast<std::uint16_t>(position + 1) &&
          line_->now() - back_since > round_trip_)
        again();
      continue;
    }
    if (!found->repeated)
      round_trip_ = 0.875 * round_trip_ + 0.125 * std::max(0.0, line_->now() - found->first_sent - work);
    Answer& answer = jobs[found->job].answer;
    answer.status = status;
    answer.position = position;
    answer.data.assign(b.begin() + link::kResponseHeader, b.end() - link::kCrcBytes);
    if (status != link::Status::kOk) {
      sequence_ =
          static_cast<std::uint16_t>(sequence - 1);  // a frame that fails does not count, nor do those behind it
      return false;
    }
    if (answer.data.size() != jobs[found->job].answer_bytes)
      fail("an answer of " + std::to_string(answer.data.size()) + " bytes instead of " +
           std::to_string(jobs[found->job].answer_bytes));
    carried_out_to(sequence);
  }
  return true;
}

bool UdpDevice::exchange(const link::Request& request, std::size_t answer_bytes, bool, Answer& answer) {
  std::vector<Job> jobs(1);
  jobs[0].request = request;
  jobs[0].answer_bytes = answer_bytes;
  carry_out(jobs);
  answer = std::move(jobs[0].answer);
  return true;
}

void UdpDevice::carry_out_or_fail(std::vector<Job>& jobs) {
  if (carry_out(jobs)) return;
  for (const Job& job : jobs)
    if (job.answer.status != link::Status::kOk) refused(job.answer);
}

void UdpDevice::send_words(std::uint64_t address, std::span<const std::uint64_t> words) {
  for (std::size_t at = 0; at < words.size();) {
    std::vector<Job> jobs;
    for (const std::size_t end = std::min(words.size(), at + kBatchWords); at < end;) {
      jobs.emplace_back();
      at += next_write(address, words, at, budget(), jobs.back().request);
    }
    carry_out_or_fail(jobs);
  }
}

void UdpDevice::fetch_words(std::uint64_t address, std::span<std::uint64_t> words) {
  for (std::size_t begin = 0; begin < words.size(); begin += kBatchWords) {
    const std::size_t end = std::min(words.size(), begin + kBatchWords), step = budget() / 8;
    std::vector<Job> jobs;
    for (std::size_t at = begin; at < end; at += step) {
      const std::size_t n = std::min(step, end - at);
      jobs.emplace_back();
      jobs.back().request.mem_read(address + 8 * at, static_cast<std::uint16_t>(n));
      jobs.back().answer_bytes = 8 * n;
    }
    carry_out_or_fail(jobs);
    std::size_t at = begin;
    for (const Job& job : jobs)
      for (std::size_t i = 0; i < job.answer.data.size(); i += 8) words[at++] = link::get(job.answer.data, i, 8);
  }
}

void UdpDevice::pass(double seconds) {
  // Nothing is outstanding, so what arrives meanwhile belongs to nothing.
  for (const double until = line_->now() + seconds; line_->now() < until;) line_->receive(until - line_->now());
}

}  // namespace retrace::cosim
