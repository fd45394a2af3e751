// C-simulation testbench of the stage tops: vectors through the streaming tops, results compared with plain integers.
// Returns 0 on success.
#include <hls_stream.h>

#include <cinttypes>
#include <cstdio>
#include <string>

#include "testbench/csim/stage_tops.hpp"
#include "testbench/kit/command_line.hpp"
#include "testbench/kit/reference.hpp"
#include "testbench/kit/stage_vectors.hpp"

namespace {

using retrace::Random;

/// Copies 64-bit words of a host record to and from a stream word.
template <typename Word, typename Record>
Word to_word(const Record& record) {
  std::uint64_t words[Record::kWords];
  record.pack(words);
  Word bits = 0;
  for (int i = Record::kWords - 1; i >= 0; --i) {
    bits <<= 64;
    bits |= Word(ap_uint<64>(words[i]));
  }
  return bits;
}

template <typename Record, typename Word>
Record from_word(const Word& bits) {
  std::uint64_t words[Record::kWords];
  for (int i = 0; i < Record::kWords; ++i) {
    const Word shifted = bits >> (64 * i);
    words[i] = ap_uint<64>(shifted).to_uint64();
  }
  return Record::unpack(words);
}

template <typename Record>
void print(const char* title, Record record) {
  std::printf("  %s\n", title);
  record.visit(
      [](const char* name, auto value, int) { std::printf("    %-12s %" PRId64 "\n", name, std::int64_t(value)); });
}

template <typename InWord, typename OutWord, typename Vector, typename Reference>
bool run(const char* stage, const std::string& only, std::uint64_t vectors, std::uint64_t seed,
         void (*top)(hls::stream<InWord>&, hls::stream<OutWord>&), Vector vector, Reference reference) {
  if (!only.empty() && only != stage) return true;
  Random random(seed);
  hls::stream<InWord> in("in");
  hls::stream<OutWord> out("out");
  std::uint64_t wrong = 0;
  for (std::uint64_t i = 0; i < vectors; ++i) {
    const auto input = vector(random);
    const auto expected = reference(input);
    in.write(to_word<InWord>(input));
    top(in, out);
    const auto result = from_word<std::remove_const_t<decltype(expected)>>(out.read());
    if (result == expected) continue;
    if (++wrong > 1) continue;
    std::printf("%s: vector %" PRIu64 " of seed %" PRIu64 " differs\n", stage, i, seed);
    print("input", input);
    print("expected", expected);
    print("result", result);
  }
  std::printf("%-12s %" PRIu64 " vectors, seed %" PRIu64 ", %" PRIu64 " differ\n", stage, vectors, seed, wrong);
  return wrong == 0;
}

}  // namespace

int main(int argc, char** argv) {
  std::uint64_t vectors = 20000, seed = retrace::test_seed();
  std::string stage;
  CLI::App app("The streaming tops of the stages against plain integers.", "tb_stages");
  app.add_option("vectors", vectors, "Vectors a stage")->capture_default_str();
  app.add_option("seed", seed, "Default: RETRACE_SEED")->capture_default_str();
  app.add_option("stage", stage, "One stage; default: all")
      ->check(CLI::IsMember(
          {"ray_setup", "kd_descend", "leaf_exit", "kd_backtrack", "tri_test", "hit_finish", "instance_enter"}));
  return retrace::run_program(app, argc, argv, [&] {
    bool good = true;
#define RUN(name) good &= run(#name, stage, vectors, seed, name##_top, retrace::name##_vector, retrace::reference::name)
    RUN(ray_setup);
    RUN(kd_descend);
    RUN(leaf_exit);
    RUN(kd_backtrack);
    RUN(tri_test);
    RUN(hit_finish);
    RUN(instance_enter);
#undef RUN
    return good ? 0 : 1;
  });
}
