// dram_bench: what rt_dram_port and a DRAM controller give, by size of the reads and reads in flight; addresses at random. See --help.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <deque>
#include <string>
#include <vector>

#include "golden/base/error.hpp"
#include "testbench/kit/command_line.hpp"
#include "testbench/kit/random.hpp"
#include "testbench/sim/dram/dram_model.hpp"

namespace {

using namespace retrace;
using namespace retrace::cosim;

struct Result {
  double bytes_per_clock, mean_latency, written_per_clock;
};

/// Reads of `size` bytes at multiples of 16 with at most `in_flight` open at a time, each under an id of its own; one write of 64 bytes beside
/// every `write_every` reads (0: none).
Result measure(const std::string& memory, std::uint32_t size, std::size_t in_flight, std::uint64_t clocks,
               unsigned write_every, std::uint64_t seed) {
  constexpr std::uint32_t kBeat = 8, kSize = 3, kIncrement = 1, kLine = 64, kPage = 4096, kGrain = 16;
  constexpr int kReset = 8, kWarm = 500;
  const auto model = make_dram_model(memory, seed);
  Random random(seed);
  AxiSlaveSignals out;
  AxiMasterSignals m;
  for (int i = 0; i < kReset; ++i) model->clock(false, {}, out);
  m.r_ready = m.b_ready = true;
  m.ar_size = m.aw_size = kSize;
  m.ar_burst = m.aw_burst = kIncrement;
  std::vector<std::uint64_t> asked(in_flight);
  std::deque<std::uint32_t> free_ids;
  for (std::uint32_t id = 0; id < in_flight; ++id) free_ids.push_back(id);
  std::uint64_t beats = 0, reads = 0, waited = 0, written = 0;
  unsigned until_write = write_every;
  std::uint32_t write_beats = 0;
  const auto address = [&](std::uint32_t bytes) {
    const std::uint64_t page = model->base() + kPage * random.below(model->bytes() / kPage);
    return page + kGrain * random.below((kPage - bytes) / kGrain + 1);
  };
  for (std::uint64_t clock = 0; clock < clocks + kWarm; ++clock) {
    if (!m.ar_valid && !free_ids.empty()) {
      m.ar_valid = true;
      m.ar_id = free_ids.front();
      free_ids.pop_front();
      m.ar_addr = address(size);
      m.ar_len = size / kBeat - 1;
      asked[m.ar_id] = clock;
    }
    if (write_every != 0 && !m.aw_valid && write_beats == 0 && until_write == 0) {
      until_write = write_every;
      m.aw_valid = true;
      m.aw_addr = address(kLine) / kLine * kLine;
      m.aw_len = kLine / kBeat - 1;
      write_beats = kLine / kBeat;
    }
    m.w_valid = write_beats > 0;
    m.w_strb = 0xff;
    m.w_last = write_beats == 1;
    const AxiSlaveSignals driven = out;
    model->clock(true, m, out);
    if (m.ar_valid && driven.ar_ready) {
      m.ar_valid = false;
      if (until_write > 0) --until_write;
    }
    if (m.aw_valid && driven.aw_ready) m.aw_valid = false;
    if (m.w_valid && driven.w_ready) {
      --write_beats;
      if (clock >= kWarm) written += kBeat;
    }
    if (!driven.r_valid) continue;
    if (driven.r_resp != 0) throw Error("a read was answered with an error");
    if (clock >= kWarm) ++beats;
    if (!driven.r_last) continue;
    if (clock >= kWarm) {
      ++reads;
      waited += clock - asked[driven.r_id];
    }
    free_ids.push_back(driven.r_id);
  }
  if (model->failed()) throw Error("an assertion of the RTL has failed");
  const auto all = static_cast<double>(clocks);
  return {static_cast<double>(kBeat * beats) / all, static_cast<double>(waited) / static_cast<double>(reads),
          static_cast<double>(written) / all};
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "Bytes a clock and clocks of latency of a board's DRAM behind rt_dram_port, by bytes a read and reads in flight. "
      "Addresses are random multiples of 16.",
      "dram_bench");
  std::vector<std::string> memories = dram_names();
  std::uint64_t clocks = 20000, seed = test_seed();
  unsigned write_every = 0;
  app.add_option("memory", memories, "Memories (all)")->check(CLI::IsMember(dram_names()));
  app.add_option("--clocks", clocks, "Of each measurement")->check(CLI::Range(1000, 100000000))->capture_default_str();
  app.add_option("--write-every", write_every, "Reads for each write of 64 bytes; 0: none")->capture_default_str();
  app.add_option("--seed", seed, "Of the addresses")->capture_default_str();
  return run_program(app, argc, argv, [&] {
    std::printf(
        "| memory | bytes a read | in flight | bytes a clock | mean latency, clocks | written a clock |\n"
        "| --- | ---: | ---: | ---: | ---: | ---: |\n");
    for (const std::string& memory : memories)
      for (const std::uint32_t size : {16u, 48u, 64u})
        for (const std::size_t in_flight : {1u, 8u, 16u}) {
          const Result r = measure(memory, size, in_flight, clocks, write_every, seed);
          std::printf("| %s | %u | %zu | %.2f | %.1f | %.2f |\n", memory.c_str(), size, in_flight, r.bytes_per_clock,
                      r.mean_latency, r.written_per_clock);
          std::fflush(stdout);
        }
    return 0;
  });
}
