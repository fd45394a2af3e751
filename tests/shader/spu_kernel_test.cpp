// The shader unit's kernel against the machine on the host: every register, the place, the window and the return addresses after every instruction of
// random programs, the rays, the memory, how a thread ends; and the streaming top. RETRACE_PROGRAMS sets the number of programs.
#include <gtest/gtest.h>

#include <cinttypes>
#include <cstdio>
#include <map>
#include <stdexcept>

#include "hls/include/stream.hpp"
#include "hls/shader/spu.hpp"
#include "testbench/shader/random_program.hpp"

extern "C" void retrace_spu(const ap_uint<128>* program, const ap_uint<128>* constants, ap_uint<128>* memory,
                            hls::stream<ap_uint<128> >& launches, hls::stream<ap_uint<512> >& rays,
                            hls::stream<ap_uint<128> >& answers, hls::stream<ap_uint<256> >& results,
                            ap_uint<32> threads, ap_uint<32> length, ap_uint<32> start, ap_uint<32> step_limit,
                            ap_uint<32> memory_vectors, ap_uint<32> triangles, ap_uint<32> triangle_vectors,
                            ap_uint<32> object);

namespace retrace::shader {
namespace {

hls::vector_word_t to_word(const Vector& vector) {
  hls::vector_word_t word = 0;
  for (std::size_t c = 4; c-- > 0;) {
    word <<= 32;
    word |= hls::vector_word_t(golden::float_bits(vector[c]));
  }
  return word;
}
Vector from_word(const hls::vector_word_t& word) {
  Vector vector;
  for (int c = 0; c < 4; ++c) {
    const ap_uint<32> part = word.range(32 * c + 31, 32 * c);
    vector[static_cast<std::size_t>(c)] = std::bit_cast<float>(static_cast<std::uint32_t>(part.to_uint()));
  }
  return vector;
}
ap_uint<128> to_word(const Word& word) {
  ap_uint<128> bits = word[1];
  bits <<= 64;
  bits |= ap_uint<128>(word[0]);
  return bits;
}
float to_float(const hls::float_t& x) { return std::bit_cast<float>(static_cast<std::uint32_t>(x.to_uint())); }

/// The registers of a thread in the kernel's order.
Vector slot_of(const Thread& thread, std::size_t slot) {
  if (slot < kStackRegisters) return thread.stack[slot];
  if (slot == static_cast<std::size_t>(hls::kSpuP)) return thread.parameters;
  if (slot == static_cast<std::size_t>(hls::kSpuAddr)) return thread.addresses;
  return thread.fixed[slot - kStackRegisters + kRegisterI0];
}

std::string hex(const hls::vector_word_t& word) {
  char text[40];
  const hls::vector_word_t high = word >> 64;
  std::snprintf(text, sizeof text, "%016" PRIx64 "%016" PRIx64, static_cast<std::uint64_t>(high.to_uint64()),
                static_cast<std::uint64_t>(word.to_uint64()));
  return text;
}

std::string difference(const Thread& expected, const hls::spu_thread& got) {
  for (std::size_t slot = 0; slot < hls::kSpuSlots; ++slot) {
    const hls::vector_word_t word = to_word(slot_of(expected, slot));
    if (word != got.slots[slot])
      return "slot " + std::to_string(slot) + ": " + hex(got.slots[slot]) + " for " + hex(word);
  }
  if (expected.status != got.status.to_uint())
    return "status " + std::to_string(got.status.to_uint()) + " for " + std::to_string(expected.status);
  if (expected.place != got.place.to_uint()) return "place";
  if (expected.window != got.window.to_uint()) return "window";
  if (expected.depth != got.depth.to_uint()) return "depth";
  if (expected.steps != got.steps.to_uint()) return "steps";
  if (expected.code != got.code.to_uint()) return "code";
  if (expected.waits != (got.waits == 1)) return "whether it waits";
  for (std::size_t i = 0; i < expected.depth; ++i)
    if (expected.returns[i].place != got.return_place[i].to_uint() ||
        expected.returns[i].window != got.return_window[i].to_uint())
      return "return address " + std::to_string(i);
  return "";
}

hls::spu_setting kernel_setting(const Setting& setting) {
  hls::spu_setting made;
  made.length = setting.program.size();
  made.start = setting.start;
  made.step_limit = setting.step_limit;
  made.memory_vectors = kRandomProgramMemory;
  made.triangles = setting.triangles;
  made.triangle_vectors = setting.triangle_vectors;
  made.object = setting.object;
  return made;
}

RayRequest request_of(const hls::spu_ray& ray) {
  RayRequest request;
  for (std::size_t i = 0; i < 3; ++i) {
    request.origin[i] = to_float(ray.origin.part[i]);
    request.direction[i] = to_float(ray.direction.part[i]);
  }
  request.t_min = to_float(ray.t_min);
  request.t_max = to_float(ray.t_max);
  request.any = ray.any == 1;
  return request;
}

bool same_ray(const RayRequest& a, const RayRequest& b) {
  for (std::size_t i = 0; i < 3; ++i)
    if (golden::float_bits(a.origin[i]) != golden::float_bits(b.origin[i]) ||
        golden::float_bits(a.direction[i]) != golden::float_bits(b.direction[i]))
      return false;
  return golden::float_bits(a.t_min) == golden::float_bits(b.t_min) &&
         golden::float_bits(a.t_max) == golden::float_bits(b.t_max) && a.any == b.any;
}

std::uint64_t programs(std::uint64_t otherwise) {
  const char* text = std::getenv("RETRACE_PROGRAMS");
  return text ? std::strtoull(text, nullptr, 0) : otherwise;
}

TEST(SpuKernel, registers_after_every_instruction) {
  const std::uint64_t seed = test_seed(), count = programs(2000);
  std::map<std::uint32_t, std::uint64_t> ends, ops, seconds;
  std::uint64_t steps = 0, rays = 0;
  for (std::uint64_t i = 0; i < count; ++i) {
    Random random(seed + i);
    const RandomProgram program = make_random_program(random);
    std::vector<Vector> memory = make_random_memory(random);
    Thread thread;
    thread.place = program.setting.start;
    thread.parameters = make_random_parameters(random);

    const hls::spu_setting setting = kernel_setting(program.setting);
    std::vector<hls::instruction_word_t> words;
    for (const Word& word : program.words) words.push_back(to_word(word));
    std::vector<hls::vector_word_t> constants, kernel_memory;
    for (const Vector& vector : program.setting.constants) constants.push_back(to_word(vector));
    for (const Vector& vector : memory) kernel_memory.push_back(to_word(vector));
    hls::spu_thread kernel;
    hls::spu_launch(kernel, setting, to_word(thread.parameters));
    hls::spu_ray ray;

    while (thread.status == kStatusRunning) {
      const std::uint32_t place = thread.place;
      if (place < program.words.size())
        ++ops[program.setting.program[place].op], ++seconds[program.setting.program[place].second];
      step(thread, program.setting, memory);
      hls::spu_step(kernel, setting, words.data(), constants.data(), kernel_memory.data(), ray);
      const std::string parts = difference(thread, kernel);
      ASSERT_EQ(parts, "") << "program of seed " << seed + i << ", step " << thread.steps << ", "
                           << (place < program.words.size() ? disassemble(program.words[place]) : "no instruction");
      if (thread.waits) {
        const RayRequest request = request_of(ray);
        ASSERT_TRUE(same_ray(request, thread.ray))
            << "ray of the program of seed " << seed + i << ", step " << thread.steps;
        const RayAnswer answer = answer_of(request);
        wake(thread, program.setting, answer);
        hls::spu_answer kernel_answer;
        kernel_answer.hit = answer.hit;
        kernel_answer.t = golden::float_bits(answer.t);
        kernel_answer.u = golden::float_bits(answer.u);
        kernel_answer.v = golden::float_bits(answer.v);
        kernel_answer.id = answer.id;
        hls::spu_wake(kernel, setting, kernel_answer);
        ASSERT_EQ(difference(thread, kernel), "")
            << "answer, program of seed " << seed + i << ", step " << thread.steps;
        ++rays;
      }
    }
    for (std::size_t at = 0; at < memory.size(); ++at)
      ASSERT_TRUE(same_bits(memory[at], from_word(kernel_memory[at])))
          << "memory at " << at << ", program of seed " << seed + i;
    steps += thread.steps;
    ++ends[thread.status];
  }
  std::printf("%" PRIu64 " programs, %" PRIu64 " instructions, %" PRIu64 " rays, 0 differ; ends:", count, steps, rays);
  for (const auto& [status, number] : ends)
    std::printf(" %s %" PRIu64, std::string(kStatusTable[status].name).c_str(), number);
  std::printf("\n");
  // Every operation was executed, every end reached.
  if (count < 1000) return;
  EXPECT_EQ(ends.size(), kStatusTable.size() - 1);
  for (const OpEntry& op : kOpTable) EXPECT_GT(ops[op.code], 0u) << op.name;
  for (const SecondEntry& second : kSecondTable) EXPECT_GT(seconds[second.code], 0u) << second.name;
}

/// The other side of the kernel's streams: a read from `answers` finds the answer to the ray that was sent.
class Tracer : public ::hls::stream_waiter {
 public:
  Tracer(::hls::stream<ap_uint<512> >& rays, ::hls::stream<ap_uint<128> >& answers) : rays_(rays), answers_(answers) {
    current() = this;
  }
  Tracer(const Tracer&) = delete;
  Tracer& operator=(const Tracer&) = delete;
  ~Tracer() { current() = nullptr; }
  void wait(const ::hls::stream_base& stream, bool reading) override {
    if (!reading || &stream != &answers_) throw std::logic_error("the kernel waits for what nobody sends");
    const ap_uint<512> word = rays_.read();
    const auto number = [&](int i) {
      const ap_uint<32> part = word.range(32 * i + 31, 32 * i);
      return to_float(part);
    };
    RayRequest request;
    for (int i = 0; i < 3; ++i) {
      request.origin[static_cast<std::size_t>(i)] = number(i);
      request.direction[static_cast<std::size_t>(i)] = number(3 + i);
    }
    request.t_min = number(6);
    request.t_max = number(7);
    request.any = word[256] == 1;
    const RayAnswer answer = answer_of(request);
    ap_uint<128> reply = answer.hit;
    reply <<= 24;
    reply |= ap_uint<128>(answer.id);
    for (const float x : {answer.v, answer.u, answer.t}) {
      reply <<= 32;
      reply |= ap_uint<128>(golden::float_bits(x));
    }
    answers_.write(reply);
  }
  void moved(const ::hls::stream_base&, bool) override {}

 private:
  ::hls::stream<ap_uint<512> >& rays_;
  ::hls::stream<ap_uint<128> >& answers_;
};

TEST(SpuKernel, the_streaming_top_runs_threads_to_their_ends) {
  const std::uint64_t seed = test_seed();
  for (std::uint64_t i = 0; i < 100; ++i) {
    Random random(seed + i);
    const RandomProgram program = make_random_program(random);
    std::vector<Vector> memory = make_random_memory(random);
    std::vector<ap_uint<128> > words, constants, kernel_memory;
    for (const Word& word : program.words) words.push_back(to_word(word));
    for (const Vector& vector : program.setting.constants) constants.push_back(to_word(vector));
    for (const Vector& vector : memory) kernel_memory.push_back(to_word(vector));
    ::hls::stream<ap_uint<128> > launches("launches"), answers("answers");
    ::hls::stream<ap_uint<512> > rays("rays");
    ::hls::stream<ap_uint<256> > results("results");
    constexpr std::size_t kThreads = 3;
    std::vector<Vector> parameters;
    for (std::size_t t = 0; t < kThreads; ++t) {
      parameters.push_back(make_random_parameters(random));
      launches.write(to_word(parameters.back()));
    }
    {
      const Tracer tracer(rays, answers);
      retrace_spu(words.data(), constants.data(), kernel_memory.data(), launches, rays, answers, results, kThreads,
                  words.size(), program.setting.start, program.setting.step_limit, kRandomProgramMemory,
                  program.setting.triangles, program.setting.triangle_vectors, program.setting.object);
    }
    for (const Vector& each : parameters) {
      Thread thread;
      thread.place = program.setting.start;
      thread.parameters = each;
      while (thread.status == kStatusRunning) {
        run(thread, program.setting, memory);
        if (thread.waits) wake(thread, program.setting, answer_of(thread.ray));
      }
      const ap_uint<256> result = results.read();
      const hls::vector_word_t colour = result.range(127, 0);
      EXPECT_TRUE(same_bits(from_word(colour), thread.fixed[kRegisterO])) << "program of seed " << seed + i;
      const ap_uint<32> steps = result.range(175, 144);
      EXPECT_EQ(result.range(135, 128).to_uint(), thread.status) << "program of seed " << seed + i;
      EXPECT_EQ(result.range(143, 136).to_uint(), thread.code) << "program of seed " << seed + i;
      EXPECT_EQ(steps.to_uint(), thread.steps) << "program of seed " << seed + i;
    }
    for (std::size_t at = 0; at < memory.size(); ++at)
      ASSERT_TRUE(same_bits(memory[at], from_word(kernel_memory[at])))
          << "memory at " << at << ", program of seed " << seed + i;
  }
}

}  // namespace
}  // namespace retrace::shader
