// The shader unit as a kernel: threads one after the other, each from its launch to its end.
//   program    setting.length instruction words; constants: 32 vectors; memory: memory_vectors vectors
//   launches   parameters P of a thread
//   rays       origin, direction, t min, t max from the lowest bit, 32 bits each, above them whether any hit will do; answers: t, u, v, number of the
//              triangle (24 bits), above them whether something is hit: one for each ray, in their order
//   results    colour O, above it status (8 bits), code (8 bits) and the number of instructions (32 bits): one for each launch, in their order
#include "spu.hpp"

#include "../include/stream.hpp"

namespace retrace::hls {

static const int kMostSteps = 0x7fffffff;

inline ap_uint<512> spu_ray_word(const spu_ray& ray) {
  RT_INLINE
  const ap_uint<512> t_max = ray.t_max;
  const ap_uint<512> t_min = ray.t_min;
  ap_uint<512> word = ray.any;
  word <<= kFloatBits;
  word |= t_max;
  word <<= kFloatBits;
  word |= t_min;
DIRECTION:
  for (int i = 2; i >= 0; --i) {
    RT_UNROLL
    const ap_uint<512> part = ray.direction.part[i];
    word <<= kFloatBits;
    word |= part;
  }
ORIGIN:
  for (int i = 2; i >= 0; --i) {
    RT_UNROLL
    const ap_uint<512> part = ray.origin.part[i];
    word <<= kFloatBits;
    word |= part;
  }
  return word;
}

}  // namespace retrace::hls

extern "C" void retrace_spu(const ap_uint<128>* program, const ap_uint<128>* constants, ap_uint<128>* memory,
                            hls::stream<ap_uint<128> >& launches, hls::stream<ap_uint<512> >& rays,
                            hls::stream<ap_uint<128> >& answers, hls::stream<ap_uint<256> >& results,
                            ap_uint<32> threads, ap_uint<32> length, ap_uint<32> start, ap_uint<32> step_limit,
                            ap_uint<32> memory_vectors, ap_uint<32> triangles, ap_uint<32> triangle_vectors,
                            ap_uint<32> object) {
  using namespace retrace::hls;
  // clang-format off
#pragma HLS interface mode=axis port=launches
#pragma HLS interface mode=axis port=rays
#pragma HLS interface mode=axis port=answers
#pragma HLS interface mode=axis port=results
  RT_MEMORY(program, gmem_program, 1024)
  RT_MEMORY(constants, gmem_program, 32)
  RT_MEMORY(memory, gmem_memory, 4096)
  RT_CONTROL(threads)
  RT_CONTROL(length)
  RT_CONTROL(start)
  RT_CONTROL(step_limit)
  RT_CONTROL(memory_vectors)
  RT_CONTROL(triangles)
  RT_CONTROL(triangle_vectors)
  RT_CONTROL(object)
  RT_CONTROL(return)
  // clang-format on
  spu_setting setting;
  setting.length = length;
  setting.start = start;
  setting.step_limit = step_limit;
  setting.memory_vectors = memory_vectors;
  setting.triangles = triangles;
  setting.triangle_vectors = triangle_vectors;
  setting.object = object;
  instruction_word_t words[retrace::shader::kProgramWords];
PROGRAM:
  for (int i = 0; i < retrace::shader::kProgramWords; ++i) {
    RT_PIPELINE(1)
    if (i < setting.length) words[i] = program[i];
  }
  vector_word_t numbers[retrace::shader::kConstants];
CONSTANTS:
  for (int i = 0; i < retrace::shader::kConstants; ++i) {
    RT_PIPELINE(1)
    numbers[i] = constants[i];
  }
  spu_thread thread;
  ap_uint<32> left = threads;
THREADS:
  for (int turn = 0; turn < kMostSteps; ++turn) {
    if (left == 0) break;
    left -= 1;
    const vector_word_t parameters = launches.read();
    spu_launch(thread, setting, parameters);
  STEPS:
    for (int step = 0; step < kMostSteps; ++step) {
      spu_ray ray;
      spu_step(thread, setting, words, numbers, memory, ray);
      if (thread.waits == 1) {
        const ap_uint<512> word = spu_ray_word(ray);
        rays.write(word);
        const ap_uint<128> answer_word = answers.read();
        spu_answer answer;
        answer.t = answer_word.range(31, 0);
        answer.u = answer_word.range(63, 32);
        answer.v = answer_word.range(95, 64);
        answer.id = answer_word.range(119, 96);
        answer.hit = answer_word[120];
        spu_wake(thread, setting, answer);
      }
      if (thread.status != retrace::shader::kStatusRunning) break;
    }
    const ap_uint<256> code = thread.code;
    const ap_uint<256> status = thread.status;
    const ap_uint<256> colour = thread.slots[kSpuFixed + retrace::shader::kRegisterO - retrace::shader::kRegisterI0];
    ap_uint<256> result = thread.steps;
    result <<= 8;
    result |= code;
    result <<= 8;
    result |= status;
    result <<= kVectorBits;
    result |= colour;
    results.write(result);
  }
}
