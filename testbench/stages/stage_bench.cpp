#include "stage_bench.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cinttypes>
#include <cstdio>
#include <stdexcept>

#include "boundary_vectors.hpp"
#include "scene_vectors.hpp"
#include "stage_functions.hpp"
#include "testbench/kit/stage_vectors.hpp"
#include "testbench/sim/clocked.hpp"
#include "testbench/sim/hold_off.hpp"
#include "Vrt_hit_finish.h"
#include "Vrt_instance_enter.h"
#include "Vrt_kd_backtrack.h"
#include "Vrt_kd_descend.h"
#include "Vrt_leaf_exit.h"
#include "Vrt_ray_setup.h"
#include "Vrt_tri_test.h"

namespace retrace::cosim {
namespace {

// ------------------------------------------------------------------------------------------- packed records on the
// model's ports Records are 64-bit words on the host; Verilator has 32-bit words beyond 64 bits and integers up to
// there.

template <int Words64, std::size_t Words32>
void put(VlWide<Words32>& port, const std::array<std::uint64_t, Words64>& words) {
  static_assert(Words32 == 2 * Words64);
  for (std::size_t i = 0; i < Words64; ++i) {
    port[2 * i] = static_cast<std::uint32_t>(words[i]);
    port[2 * i + 1] = static_cast<std::uint32_t>(words[i] >> 32);
  }
}

template <int Words64, std::size_t Words32>
std::array<std::uint64_t, Words64> get(const VlWide<Words32>& port) {
  static_assert(Words32 == 2 * Words64);
  std::array<std::uint64_t, Words64> words;
  for (std::size_t i = 0; i < Words64; ++i) words[i] = port[2 * i] | std::uint64_t{port[2 * i + 1]} << 32;
  return words;
}

template <int Words64>
std::array<std::uint64_t, 1> get(std::uint64_t port) {
  static_assert(Words64 == 1);
  return {port};
}

template <int Words64>
std::array<std::uint64_t, 1> get(std::uint32_t port) {
  static_assert(Words64 == 1);
  return {port};
}

// --------------------------------------------------------------------------------------------------------------------
// vectors

/// xoshiro256**: a generator that costs less than a clock of the smallest model.
class FastRandom {
 public:
  explicit FastRandom(std::uint64_t seed) {
    for (auto& word : state_) {
      seed += 0x9e3779b97f4a7c15ull;
      std::uint64_t z = seed;
      z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ull;
      z = (z ^ (z >> 27)) * 0x94d049bb133111ebull;
      word = z ^ (z >> 31);
    }
  }
  std::uint64_t bits() {
    const std::uint64_t result = rotate(state_[1] * 5, 7) * 9, t = state_[1] << 17;
    state_[2] ^= state_[0];
    state_[3] ^= state_[1];
    state_[1] ^= state_[2];
    state_[0] ^= state_[3];
    state_[2] ^= t;
    state_[3] = rotate(state_[3], 45);
    return result;
  }
  std::uint32_t below(std::uint32_t count) { return static_cast<std::uint32_t>(((bits() >> 32) * count) >> 32); }

 private:
  static std::uint64_t rotate(std::uint64_t x, int k) { return (x << k) | (x >> (64 - k)); }
  std::array<std::uint64_t, 4> state_;
};

template <typename Record>
int used_bits() {
  int bits = 0;
  Record record;
  record.visit([&](const char*, auto&, int width) { bits += width; });
  return bits;
}

/// Directed vectors of the testkit, and between them many that differ from one of those in a few bits: next to a
/// boundary there are more boundaries, and a changed bit costs nothing.
template <typename Record>
class Vectors {
 public:
  Vectors(std::uint64_t seed, Record (*directed)(Random&), const std::vector<Record>* recorded)
      : directed_(directed), recorded_(recorded), slow_(seed), fast_(seed), bits_(used_bits<Record>()) {
    for (auto& record : pool_) record = directed_(slow_);
  }

  void next(std::array<std::uint64_t, Record::kWords>& words) {
    if (recorded_ && next_recorded_ < recorded_->size()) {
      (*recorded_)[next_recorded_++].pack(words.data());
      return;
    }
    const std::uint32_t choice = fast_.below(16);
    Record& base = pool_[fast_.below(kPool)];
    if (choice == 0) base = directed_(slow_);
    base.pack(words.data());
    if (choice == 0) return;
    for (std::uint32_t flips = 1 + fast_.below(3); flips > 0; --flips) {
      const std::uint32_t bit = fast_.below(static_cast<std::uint32_t>(bits_));
      words[bit / 64] ^= std::uint64_t{1} << (bit % 64);
    }
  }

 private:
  static constexpr std::uint32_t kPool = 256;
  Record (*directed_)(Random&);
  const std::vector<Record>* recorded_;
  std::size_t next_recorded_ = 0;
  Random slow_;
  FastRandom fast_;
  int bits_;
  std::array<Record, kPool> pool_;
};

// --------------------------------------------------------------------------------------------------------------- one
// stage's traits

// A flipped bit may leave the stage's stated input range; this brings it back. Only hit_finish has one that matters:
// d'z >= 0 of a hit.
template <typename Record>
void keep_in_range(Record&) {}
void keep_in_range(contract::HitFinishInRecord& in) {
  if (in.dz < 0) in.dz = ~in.dz;
}

template <typename Record>
std::string text_of(const char* title, Record record) {
  std::string text = std::string("  ") + title + "\n";
  record.visit([&](const char* name, auto value, int) {
    char line[96];
    std::snprintf(line, sizeof line, "    %-16s %" PRId64 "\n", name, static_cast<std::int64_t>(value));
    text += line;
  });
  return text;
}

HoldOff source_of(const StageRun& run) {
  return run.mode == StallMode::kRandom ? HoldOff::random(run.seed ^ 0x5eed, 60) : HoldOff::none();
}

// Blocked stretches are longer than any stage is deep.
HoldOff sink_of(const StageRun& run) {
  switch (run.mode) {
    case StallMode::kRandom:
      return HoldOff::random(run.seed ^ 0xd1a1, 60);
    case StallMode::kBackPressure:
      return HoldOff::bursts(run.seed ^ 0xd1a1, 120);
    default:
      return HoldOff::none();
  }
}

template <typename Model, typename In, typename Out>
StageResult run_model(const StageRun& run, In (*directed)(Random&), Out (*reference)(const In&),
                      std::vector<In> SceneVectors::*recorded) {
  constexpr std::size_t kRing = 256;  // more than any stage holds
  struct Expected {
    std::array<std::uint64_t, In::kWords> input;
    std::array<std::uint64_t, Out::kWords> output;
  };
  std::vector<Expected> ring(kRing);
  Vectors<In> vectors(run.seed, directed, run.scene ? &(run.scene->*recorded) : nullptr);
  HoldOff source = source_of(run), sink = sink_of(run);
  Clocked<Model> bench(run.seed);
  bench->in_valid_i = 0;
  bench->out_ready_i = 0;
  bench.reset();

  StageResult result;
  std::uint64_t sent = 0, received = 0, first_sent = 0, last_sent = 0, idle = 0;
  bool offering = false;
  const auto fail = [&](const std::string& what) {
    result.failure =
        run.stage + ": " + what + "\n  repeat with: " + command_of({run.stage, run.mode, run.seed, received + 1});
  };
  while (received < run.vectors) {
    if (!offering && sent < run.vectors && source.next()) {
      Expected& slot = ring[sent % kRing];
      vectors.next(slot.input);
      In input = In::unpack(slot.input.data());
      keep_in_range(input);
      input.pack(slot.input.data());
      reference(input).pack(slot.output.data());
      put<In::kWords>(bench->in_data_i, slot.input);
      bench->in_tag_i = static_cast<std::uint16_t>(sent);
      offering = true;
    }
    bench->in_valid_i = offering;
    bench->out_ready_i = sink.next();
    bench.settle();
    ++idle;
    if (bench->out_ready_i) {
      if (bench->out_valid_o) {
        if (received == 0) result.latency = bench.clock() - first_sent;
        const Expected& slot = ring[received % kRing];
        const auto output = get<Out::kWords>(bench->out_data_o);
        if (received >= sent || output != slot.output || bench->out_tag_o != static_cast<std::uint16_t>(received)) {
          if (received >= sent) {
            fail("an output without an input");
          } else {
            char head[96];
            int bits = 0;
            for (std::size_t i = 0; i < Out::kWords; ++i) bits += std::popcount(output[i] ^ slot.output[i]);
            std::snprintf(head, sizeof head, "vector %" PRIu64 " differs in %d bits (tag %u)\n", received, bits,
                          unsigned{bench->out_tag_o});
            fail(head + text_of("input", In::unpack(slot.input.data())) +
                 text_of("expected (hls)", Out::unpack(slot.output.data())) +
                 text_of("result (rtl)", Out::unpack(output.data())));
          }
          break;
        }
        ++received;
        idle = 0;
      } else if (received > 0 && sent < run.vectors && run.mode != StallMode::kRandom) {
        ++result.bubbles;
      }
    } else {
      idle = 0;
    }
    if (offering) {
      if (bench->in_ready_o) {
        if (sent == 0) first_sent = bench.clock();
        last_sent = bench.clock();
        ++sent;
        offering = false;
      } else if (!bench->out_ready_i) {
        result.refused = true;
      }
    }
    bench.rise();
    if (bench.failed()) {
      fail("an assertion of the RTL failed in clock " + std::to_string(bench.clock()));
      break;
    }
    if (idle > 1000) {
      fail("no output for 1000 clocks");
      break;
    }
  }
  result.vectors = received;
  result.clocks = bench.clock();
  if (sent > 1) result.interval = static_cast<double>(last_sent - first_sent) / static_cast<double>(sent - 1);
  return result;
}

/// Every kind of tri_test vector.
contract::TriTestInRecord mixed_tri_test_vector(Random& random) {
  switch (random.below(4)) {
    case 0:
      return tri_test_rounding_vector(random);
    case 1:
    case 2:
      return tri_test_boundary_vector(random);
    default:
      return tri_test_vector(random);
  }
}

}  // namespace

const std::vector<std::string>& stage_names() {
  static const std::vector<std::string> names{"ray_setup", "kd_descend", "leaf_exit",     "kd_backtrack",
                                              "tri_test",  "hit_finish", "instance_enter"};
  return names;
}

const std::vector<std::string>& stall_mode_names() {
  static const std::vector<std::string> names{"none", "random", "back-pressure"};
  return names;
}

StageResult run_stage(const StageRun& run) {
  if (run.stage == "ray_setup")
    return run_model<Vrt_ray_setup>(run, ray_setup_vector, hls_ray_setup, &SceneVectors::ray_setup);
  if (run.stage == "kd_descend")
    return run_model<Vrt_kd_descend>(run, kd_descend_vector, hls_kd_descend, &SceneVectors::kd_descend);
  if (run.stage == "leaf_exit")
    return run_model<Vrt_leaf_exit>(run, leaf_exit_vector, hls_leaf_exit, &SceneVectors::leaf_exit);
  if (run.stage == "kd_backtrack")
    return run_model<Vrt_kd_backtrack>(run, kd_backtrack_vector, hls_kd_backtrack, &SceneVectors::kd_backtrack);
  if (run.stage == "tri_test")
    return run_model<Vrt_tri_test>(run, mixed_tri_test_vector, hls_tri_test, &SceneVectors::tri_test);
  if (run.stage == "hit_finish")
    return run_model<Vrt_hit_finish>(run, hit_finish_vector, hls_hit_finish, &SceneVectors::hit_finish);
  if (run.stage == "instance_enter")
    return run_model<Vrt_instance_enter>(run, instance_enter_vector, hls_instance_enter, &SceneVectors::instance_enter);
  throw std::invalid_argument("unknown stage: " + run.stage);
}

std::uint64_t vectors_of(const SceneVectors& scene, const std::string& stage) {
  if (stage == "ray_setup") return scene.ray_setup.size();
  if (stage == "kd_descend") return scene.kd_descend.size();
  if (stage == "leaf_exit") return scene.leaf_exit.size();
  if (stage == "kd_backtrack") return scene.kd_backtrack.size();
  if (stage == "tri_test") return scene.tri_test.size();
  if (stage == "hit_finish") return scene.hit_finish.size();
  if (stage == "instance_enter") return scene.instance_enter.size();
  throw std::invalid_argument("unknown stage: " + stage);
}

std::string command_of(const StageRun& run) {
  return "rtl_stages --stage " + run.stage + " --mode " + stall_mode_names()[static_cast<std::size_t>(run.mode)] +
         " --seed " + std::to_string(run.seed) + " --vectors " + std::to_string(run.vectors) + " --batch " +
         std::to_string(run.vectors);
}

}  // namespace retrace::cosim
