// The machine of the shader unit: every operation against host arithmetic, the order of reads and writes, conditions, calls and their window, memory and
// textures, rays, every way to end, and words that nobody wrote.
#include "golden/shader/machine.hpp"

#include <gtest/gtest.h>

#include <bit>
#include <cinttypes>
#include <cmath>
#include <fstream>
#include <iterator>

#include "golden/shader/assembler.hpp"
#include "golden/shader/float.hpp"
#include "testbench/kit/float_vectors.hpp"

namespace retrace::shader {
namespace {

using golden::kGreatest;

struct Machine {
  explicit Machine(const std::string& text) {
    program = assemble(text, "test");
    setting.load(program.words);
    memory.resize(256);
  }
  Thread& run() {
    shader::run(thread, setting, memory);
    return thread;
  }
  Vector& r(std::size_t i) { return thread.stack[i]; }
  Vector& fixed(int code) { return thread.fixed[static_cast<std::size_t>(code)]; }

  Assembled program;
  Setting setting;
  std::vector<Vector> memory;
  Thread thread;
};

std::string status_of(const Thread& thread) {
  for (const StatusEntry& entry : kStatusTable)
    if (entry.code == thread.status) return std::string(entry.name);
  return "?";
}

TEST(Machine, arithmetic) {
  const std::uint64_t seed = test_seed();
  Random random(seed);
  Machine machine(
      "mov R4,R0\nfrac R5,R0\nadd R6,R0,R1\nmul R7,R0,R1\nmad R8,R0,R1,R2\ndp2h R9,R0,R1\ndp3 R10,R0,R1\ndp3h "
      "R11,R0,R1\n"
      "dp4 R12,R0,R1\nmov_sat R13,R0\nmov_rcpy R14,R0\nmov_rsq.x I0,R1\nmov R15,-0.5*R0.wzyx\nexit 7");
  for (int i = 0; i < 2000; ++i) {
    machine.thread = {};
    for (std::size_t v = 0; v < 3; ++v)
      for (float& component : machine.r(v)) component = golden::float_read(float_vector(random));
    const Vector a = machine.r(0), b = machine.r(1), c = machine.r(2);
    machine.run();
    ASSERT_EQ(status_of(machine.thread), "done");
    ASSERT_EQ(machine.thread.code, 7u);
    const auto rounded = [](double x) { return golden::float_round(x); };
    const auto product = [&](std::size_t k) { return static_cast<double>(rounded(static_cast<double>(a[k]) * b[k])); };
    const float low = rounded(product(0) + product(1));
    for (std::size_t k = 0; k < 4; ++k) {
      ASSERT_EQ(machine.r(4)[k], a[k]);
      ASSERT_EQ(machine.r(5)[k], golden::float_frac(a[k])) << a[k] << ", seed " << seed;
      ASSERT_EQ(machine.r(6)[k], rounded(static_cast<double>(a[k]) + b[k])) << "seed " << seed;
      ASSERT_EQ(machine.r(7)[k], static_cast<float>(product(k))) << "seed " << seed;
      ASSERT_EQ(machine.r(8)[k], rounded(product(k) + c[k])) << "seed " << seed;
      ASSERT_EQ(machine.r(9)[k], rounded(static_cast<double>(low) + a[2])) << "seed " << seed;
      ASSERT_EQ(machine.r(10)[k], rounded(low + product(2))) << "seed " << seed;
      ASSERT_EQ(machine.r(11)[k], rounded(static_cast<double>(low) + rounded(product(2) + a[3]))) << "seed " << seed;
      ASSERT_EQ(machine.r(12)[k], rounded(static_cast<double>(low) + rounded(product(2) + product(3))))
          << "seed " << seed;
      ASSERT_EQ(machine.r(13)[k], a[k] >= 1 ? 1 : a[k] > 0 ? a[k] : 0);
      ASSERT_EQ(machine.r(15)[k], rounded(-0.5 * a[3 - k]));
      // The root is the later one.
      ASSERT_EQ(machine.fixed(kRegisterS)[k], golden::float_rsq(b[0])) << b[0] << ", seed " << seed;
    }
  }
}

TEST(Machine, reads_come_before_writes) {
  Machine swap("mov R0,R1 + mov R1,R0\nmov_rcp.x R2.x,2.0 + mov R3,S\nmov R4.zx,R5.xyzw\nexit 0");
  swap.r(0) = {1, 2, 3, 4};
  swap.r(1) = {5, 6, 7, 8};
  swap.r(5) = {9, 10, 11, 12};
  swap.run();
  EXPECT_EQ(swap.r(0), (Vector{5, 6, 7, 8}));
  EXPECT_EQ(swap.r(1), (Vector{1, 2, 3, 4}));
  EXPECT_EQ(swap.r(3), (Vector{}));
  EXPECT_EQ(swap.fixed(kRegisterS), (Vector{0.5f, 0, 0, 0}));
  EXPECT_EQ(swap.r(4), (Vector{9, 0, 11, 0}));
  Machine load("mov R0,I0 + load I0,A.x,2\nload4x A.y,1\nexit 0");
  for (std::size_t i = 0; i < load.memory.size(); ++i) load.memory[i].fill(static_cast<float>(i));
  load.fixed(kRegisterA) = {3, 10, 0, 0};
  load.run();
  EXPECT_EQ(load.r(0)[0], 0);
  EXPECT_EQ(load.fixed(kRegisterI0)[0], 11);
  EXPECT_EQ(load.fixed(kRegisterI3)[0], 14);
}

TEST(Machine, conditions) {
  struct Case {
    const char* condition;
    Vector value;
    bool taken;
  };
  constexpr float kMinus = -0.0f;
  const Case kCases[]{{"x <0", {-1, 0, 0, 0}, true},
                      {"x <0", {kMinus, 0, 0, 0}, false},
                      {"x =0", {kMinus, 0, 0, 0}, true},
                      {"x >=0", {kMinus, 0, 0, 0}, true},
                      {"x >=1", {1, 0, 0, 0}, true},
                      {"x >=1", {1 - 0x1p-24f, 0, 0, 0}, false},
                      {"x <1", {1 - 0x1p-24f, 0, 0, 0}, true},
                      {"x >0", {0x1p-126f, 0, 0, 0}, true},
                      {"or xy (<0 or >=1)", {0.5, 2, 9, 9}, true},
                      {"or xy (<0 or >=1)", {0.5, 0.25, 9, -9}, false},
                      {"and xy (<0 or >=1)", {-1, 2, 0, 0}, true},
                      {"and xy (<0 or >=1)", {-1, 0.5, 0, 0}, false},
                      {"and xy (<0 or >=1)", {0.5, 2, 0, 0}, false},
                      {"or xyzw (>=0 or <1)", {-1, 0, 1, 2}, true},
                      {"and xyzw (>=0 and <1)", {0, 0.25, 0.5, 0.75}, true},
                      {"w !=0", {1, 1, 1, 0}, false}};
  for (const Case& each : kCases) {
    Machine machine("mov_sat R1.x,R0 + jmp there, " + std::string(each.condition) + "\nexit 1\nthere: exit 2");
    machine.r(0) = each.value;
    machine.run();
    EXPECT_EQ(machine.thread.code, each.taken ? 2u : 1u) << each.condition;
  }
  // Alone, a condition looks at the result before.
  Machine alone("add R0.x,R1,R2\njmp there, w <0\nexit 1\nthere: exit 2");
  alone.r(1) = {0, 0, 0, -1};
  EXPECT_EQ(alone.run().code, 2u);
}

TEST(Machine, calls_move_the_window) {
  Machine machine(
      "mov R2.x,5.0\ncall f push 2\nmov R1.x,R2.x\nexit 0\nf: add R0.x,R0.x,1.0\n call g push 3\n return\ng: mov "
      "R0.y,9.0 + return");
  EXPECT_EQ(status_of(machine.run()), "done");
  EXPECT_EQ(machine.r(1)[0], 6);
  EXPECT_EQ(machine.r(5)[1], 9);
  EXPECT_EQ(machine.thread.window, 0u);
  EXPECT_EQ(machine.thread.depth, 0u);
}

TEST(Machine, textures_repeat) {
  Machine machine("texload4x R0,R1\nmov R4,I0\nmov R5,I3\ntexload I2,R0,R2\ntexstore R0,R1,R3\nexit 0");
  for (std::size_t i = 0; i < 12; ++i) machine.memory[100 + i].fill(static_cast<float>(i));
  machine.r(0) = {100, 4, 3, 0};
  machine.r(1) = {-0.5f, 2.9f, 0, 0};  // column -1 is 3, row 2; the next ones are 0 and 0
  machine.r(2) = {1e20f, -4.0f, 0, 0};
  machine.r(3) = {7, 7, 7, 7};
  EXPECT_EQ(status_of(machine.run()), "done");
  EXPECT_EQ(machine.r(4)[0], 11);
  EXPECT_EQ(machine.r(5)[0], 0);
  EXPECT_EQ(machine.fixed(kRegisterI2)[0], 8);
  EXPECT_EQ(machine.memory[111][0], 7);
}

TEST(Machine, rays) {
  Machine machine(
      "trace R0,R1,C.xwxx\ncall HIT.w push 1 rty 2\nexit 0\nexit 9\nshade: mov R0.x,HIT.w\nmov R0.y,HIT.x + exit 4");
  machine.setting.triangles = 20;
  machine.setting.triangle_vectors = 3;
  machine.memory[26] = {0, 0, 0, 50};  // triangle 2: its material stands at 50
  machine.memory[50] = {3, 3, 4, 3};
  machine.memory[17] = {0, 0, 0, 51};  // nothing hit
  machine.memory[51] = {3, 3, 3, 3};
  machine.r(1) = {0, 0, 1, 0};
  Machine miss = machine;
  machine.run();
  ASSERT_TRUE(machine.thread.waits);
  EXPECT_EQ(machine.thread.ray.t_max, kGreatest);
  EXPECT_FALSE(machine.thread.ray.any);
  wake(machine.thread, machine.setting, {.hit = true, .t = 2.5f, .u = 0.25f, .v = 0.5f, .id = 2});
  EXPECT_EQ(status_of(machine.run()), "done");
  EXPECT_EQ(machine.thread.code, 4u);
  EXPECT_EQ(machine.r(1)[0], 2);
  EXPECT_EQ(machine.r(1)[1], 2.5f);
  miss.run();
  wake(miss.thread, miss.setting, {});
  EXPECT_EQ(miss.run().code, 9u);
  EXPECT_EQ(miss.fixed(kRegisterHit), (Vector{kGreatest, 0, 0, -1}));
  // The published form: reciprocal direction in E1, the hit in R(4 + push).
  Machine published("mov E0,R0 + mov E1,R1\nmov E2,C.xxww + trace push 2 rty 1\nexit 0");
  published.r(1) = {0.5f, kGreatest, -4, 0};
  published.run();
  ASSERT_TRUE(published.thread.waits);
  EXPECT_TRUE(published.thread.ray.any);
  EXPECT_EQ(published.thread.ray.direction, (Vector{2, 0, -0.25f, 0}));
  wake(published.thread, published.setting, {.hit = true, .t = 1, .u = 0.25f, .v = 0.5f, .id = 6});
  EXPECT_EQ(status_of(published.run()), "done");
  EXPECT_EQ(published.r(6), (Vector{0.25f, 0.5f, 1, 6}));
}

TEST(Machine, every_fault_is_a_status) {
  struct Case {
    const char* text;
    const char* status;
  };
  constexpr Case kCases[]{
      {"loop: jmp loop", "step_limit"},
      {"f: call f push 0", "stack_overflow"},
      {"call f push 15\nf: call f push 15", "stack_overflow"},
      {"call f push 15\nf: call g push 15\ng: call h push 15\nh: call i push 10\ni: mov R15,R0", "stack_overflow"},
      {"mov R0,R1", "bad_place"},
      {".word 0x1f", "bad_opcode"},
      {".word 0x7f8000f00000000000000000000", "bad_opcode"},
      {"mov A.x,300.0\nload I0,A.x,0", "bad_address"},
      {"mov A.x,-1.0\nload I0,A.x,255", "bad_address"},
      {"mov A.x,253.0\nload4x A.x,0", "bad_address"},
      {"mov A.x,C.w\nstore A.x,0,R0", "bad_address"},
      {"texload I0,R0,R1", "bad_address"},
      {"mov R0,250.0\ntexload4x R0,R1.xyxy", "bad_address"},
      {"mov ADDR.x,C.w\ncall HIT.w push 0", "bad_address"},
      {"call HIT.w push 0\nload I0,A.x,0", "step_limit"},
      {"trace R0,R1,C", "bad_ray"},
      {"return", "done"},
      {"exit 3", "done"}};
  for (const Case& each : kCases) {
    Machine machine(each.text);
    machine.setting.step_limit = 1000;
    if (std::string(each.text).starts_with("call HIT")) machine.setting.step_limit = 5;
    EXPECT_EQ(status_of(machine.run()), each.status) << each.text;
    EXPECT_LE(machine.thread.steps, machine.setting.step_limit);
  }
}

// Bits that are no number elsewhere are numbers here, wherever they come from.
TEST(Machine, every_pattern_of_bits_is_a_number) {
  const auto bits = [](std::uint32_t x) { return std::bit_cast<float>(x); };
  const Vector strange{bits(0x7fc00001), bits(0xff800000), bits(0x00000001), bits(0x807fffff)};
  const Vector read{kGreatest, -kGreatest, 0.0f, -0.0f};
  Machine machine("load I0,A.x,1\nmov R0,I0\nmov R1,C0\nmov R2,P\nmul R3,I0,0.0\nadd R4,I0,-I0\ncall HIT.w push 0");
  machine.memory[1] = machine.setting.constants[0] = machine.thread.parameters = strange;
  machine.memory[0] = strange;  // as a material, its place is the greatest number
  machine.run();
  for (const std::size_t i : {0, 1, 2})
    for (std::size_t c = 0; c < 4; ++c)
      EXPECT_EQ(golden::float_bits(machine.r(i)[c]), golden::float_bits(read[c])) << i;
  for (const std::size_t i : {3, 4}) EXPECT_EQ(machine.r(i), (Vector{})) << i;
  EXPECT_EQ(status_of(machine.thread), "bad_place");
}

// Words that nobody wrote: the machine ends, with a status, and touches nothing outside.
TEST(Machine, random_words_end) {
  const std::uint64_t seed = test_seed();
  Random random(seed);
  std::uint64_t steps = 0;
  for (int i = 0; i < 3000; ++i) {
    Machine machine("");
    std::vector<Word> words(1 + random.below(64));
    for (Word& word : words) {
      do {
        word = {random.bits(), random.bits() >> (128 - kWordBits)};
        Instruction in = decode(word);
        in.op %= 16;
        in.target &= 31;
        for (Source* source : {&in.a, &in.b, &in.c}) source->index &= random.chance(4) ? 127 : 31;
        if (in.op <= 9 && random.chance(2)) in.second %= 8;
        word = encode(in);
      } while (!is_valid(decode(word)) && !random.chance(200));
    }
    machine.setting.load(words);
    machine.setting.step_limit = 300;
    for (Vector& vector : machine.thread.stack)
      for (float& component : vector) component = golden::float_read(float_vector(random));
    Thread& thread = machine.thread;
    while (thread.status == kStatusRunning) {
      machine.run();
      if (thread.waits)
        wake(thread, machine.setting,
             {.hit = random.chance(2), .t = 1, .u = 0, .v = 0, .id = static_cast<std::uint32_t>(random.below(40))});
    }
    steps += thread.steps;
    for (const Vector& vector : thread.stack)
      for (const float component : vector)
        ASSERT_TRUE(std::isfinite(component) && std::fpclassify(component) != FP_SUBNORMAL) << "seed " << seed;
  }
  EXPECT_GT(steps, 6000u);
}

// The published intersection program finds what the formula says.
TEST(Machine, the_unit_triangle_program) {
  const std::uint64_t seed = test_seed();
  Random random(seed);
  std::ifstream file(RETRACE_SOURCE_DIR "/golden/shader/programs/unit_triangle.asm");
  Machine machine({std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()});
  int found = 0;
  for (int i = 0; i < 5000; ++i) {
    machine.thread = {};
    std::array<std::array<double, 4>, 3> m{};
    for (std::size_t row = 0; row < 3; ++row)
      for (std::size_t column = 0; column < 4; ++column)
        m[row][column] = machine.memory[40 + row][column] = static_cast<float>(random.real(-1, 1));
    machine.memory[43] = {17, 0, 0, 0};
    machine.fixed(kRegisterA)[1] = 40;
    std::array<double, 3> o{}, d{};
    for (std::size_t k = 0; k < 3; ++k) {
      o[k] = machine.r(2)[k] = static_cast<float>(random.real(-1, 1));
      d[k] = machine.r(3)[k] = static_cast<float>(random.real(-1, 1));
    }
    const double best = machine.r(4)[2] = static_cast<float>(random.real(0, 4));
    machine.run();
    ASSERT_EQ(status_of(machine.thread), "done");
    const auto at = [&](std::size_t row) { return m[row][0] * o[0] + m[row][1] * o[1] + m[row][2] * o[2] + m[row][3]; };
    const auto along = [&](std::size_t row) { return m[row][0] * d[0] + m[row][1] * d[1] + m[row][2] * d[2]; };
    const double t = -at(2) / along(2), u = at(0) + t * along(0), v = at(1) + t * along(1);
    constexpr double kBand = 1e-4;  // what 24 bits cannot decide
    const double scale = std::max({1.0, std::abs(t), 1 / std::abs(along(2))});
    const double margin = std::min({t, u, v, 1 - u - v, best - t});
    if (std::abs(margin) < kBand * scale) continue;
    const bool hit = machine.fixed(kRegisterE2)[0] == 17;
    ASSERT_EQ(hit, margin > 0) << "ray " << i << ", seed " << seed;
    if (!hit) continue;
    ++found;
    EXPECT_NEAR(machine.r(4)[2], t, 1e-4 * scale);
    EXPECT_NEAR(machine.r(4)[0], u, 1e-4 * scale);
    EXPECT_NEAR(machine.r(4)[1], v, 1e-4 * scale);
    EXPECT_EQ(machine.fixed(kRegisterE2)[2], machine.r(4)[2]);
  }
  EXPECT_GT(found, 100);
}

}  // namespace
}  // namespace retrace::shader
