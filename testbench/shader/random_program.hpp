// Random programs for the shader unit by seed, and what their threads find: constants, memory, answers to rays. Most instructions are valid and most
// addresses lie in the memory, so that threads run; some are not, so that every status is reached.
#pragma once
#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <vector>

#include "golden/shader/assembler.hpp"
#include "golden/shader/float.hpp"
#include "golden/shader/machine.hpp"
#include "testbench/kit/float_vectors.hpp"
#include "testbench/kit/random.hpp"

namespace retrace::shader {

inline constexpr std::uint32_t kRandomProgramMemory = 256;
inline constexpr std::uint32_t kRandomProgramWords = 64;

/// A program and what its threads share.
struct RandomProgram {
  std::vector<Word> words;
  Setting setting;
};

namespace random_program {

inline std::uint32_t writable(Random& random) {
  constexpr std::array kOthers{kRegisterE0,  kRegisterE1,  kRegisterE2, kRegisterS,  kRegisterO,  kRegisterH,
                               kRegisterRc4, kRegisterRc7, kRegisterI0, kRegisterI3, kRegisterHit};
  const auto draw = static_cast<std::uint32_t>(random.below(16));
  if (random.chance(50)) return random.chance(2) ? kRegisterA : kRegisterAddr;
  if (random.chance(2)) return random.chance(3) ? draw : draw & 3;
  return static_cast<std::uint32_t>(kOthers.at(random.below(kOthers.size())));
}

inline Source source(Random& random) {
  Source made;
  made.swizzle = random.chance(2) ? 0xe4u : static_cast<std::uint32_t>(random.below(256));
  made.scale = random.chance(4) ? static_cast<std::uint32_t>(random.below(4)) : 0;
  made.negate = random.chance(4);
  switch (random.below(8)) {
    case 0: {  // an immediate
      const std::uint32_t bits = random.chance(2)
                                     ? float_vector(random)
                                     : std::bit_cast<std::uint32_t>(static_cast<float>(random.integer(-9, 99)));
      made = decode_source((bits >> (32 - (kABits - 1))) | 1u << (kABits - 1));
      break;
    }
    case 1:
      made.index = kRegisterConstants + static_cast<std::uint32_t>(random.below(kConstants));
      break;
    case 2:
      made.index = random.chance(2) ? kRegisterC : kRegisterP;
      break;
    case 3:
    case 4:
      made.index = kRegisterI0 + static_cast<std::uint32_t>(random.below(16));
      break;
    default:
      made.index = static_cast<std::uint32_t>(random.chance(3) ? random.below(16) : random.below(4));
      break;
  }
  return made;
}

/// Mostly one of a few constants: a picture that a texture operation finds, or a direction that is not 0.
inline Source constant(Random& random, std::uint64_t first, std::uint64_t count) {
  Source made = source(random);
  if (!random.chance(10)) {
    made = {};
    made.swizzle = 0xe4;
    made.index = kRegisterConstants + static_cast<std::uint32_t>(first + random.below(count));
  }
  return made;
}

inline std::uint32_t address(Random& random) {
  LoadPayload payload;
  payload.result = static_cast<std::uint32_t>(random.below(4));
  payload.address = static_cast<std::uint32_t>(random.below(random.chance(4) ? 8 : 4));
  payload.offset = static_cast<std::uint32_t>(random.chance(50) ? random.below(256) : random.below(8));
  return encode(payload);
}

inline void condition(Random& random, Instruction& in) {
  in.classes = static_cast<std::uint32_t>(random.chance(3) ? 15 : random.below(16));
  in.lanes = static_cast<std::uint32_t>(random.chance(2) ? 1 : random.below(16));
  in.all = random.chance(2);
}

/// How calls of a program are: now and then, or one after the other without a way back, by few registers or by many.
enum class Calls { kSome, kDeep, kWide };

inline Instruction instruction(Random& random, std::uint32_t place, std::uint32_t length, Calls calls) {
  const auto jump = [&] {  // mostly ahead
    const std::uint64_t to = random.chance(8) ? random.below(length + 2) : place + 1 + random.below(6);
    return static_cast<std::uint32_t>(std::min<std::uint64_t>(to, kProgramWords - 1));
  };
  const auto push = [&] {
    if (calls != Calls::kSome) return static_cast<std::uint32_t>(random.below(calls == Calls::kWide ? 16 : 2));
    return static_cast<std::uint32_t>(random.chance(8) ? random.below(16) : random.below(3));
  };
  Instruction in;
  for (Source* each : {&in.a, &in.b, &in.c}) *each = source(random);
  const std::uint64_t kind = random.below(100);
  if (kind < 8) {  // an address
    in.op = kOpMov;
    in.target = random.chance(3) ? kRegisterAddr : kRegisterA;
    in.mask = static_cast<std::uint32_t>(random.below(16));
    in.a = decode_source((std::bit_cast<std::uint32_t>(static_cast<float>(random.below(kRandomProgramMemory - 4))) >>
                          (32 - (kABits - 1))) |
                         1u << (kABits - 1));
  } else if (kind < 70) {
    in.op = kOpMov + static_cast<std::uint32_t>(random.below(kOpDp4));
    in.modifier = random.chance(2) ? 0 : static_cast<std::uint32_t>(random.below(4));
    in.component = static_cast<std::uint32_t>(random.below(4));
    in.target = writable(random);
    in.mask = static_cast<std::uint32_t>(random.chance(3) ? 15 : random.below(16));
  } else if (kind < 80) {
    in.op = kOpNop;
  } else if (kind < 86) {
    in.op = kOpStore;
    in.second = kSecondStore;
    in.payload = address(random);
  } else if (kind < 95) {
    in.op = kOpTexload + static_cast<std::uint32_t>(random.below(3));
    in.target = kRegisterI0 + static_cast<std::uint32_t>(random.below(4));
    in.a = constant(random, 0, 4);
  } else {
    in.op = kOpTrace;
    in.b = constant(random, 4, 28);
  }
  condition(random, in);
  if (in.op > kOpDp4 || random.chance(3)) return in;
  if (calls != Calls::kSome && random.chance(2)) {
    in.second = kSecondCall;
    in.payload = encode(CallPayload{place + 1, push()});
    in.classes = 15;
    in.lanes = 1;
    return in;
  }
  switch (random.below(16)) {
    case 0:
    case 1:
      in.second = kSecondLoad;
      in.payload = address(random);
      break;
    case 2:
      in.second = kSecondLoad4x;
      in.payload = address(random);
      break;
    case 3:
      in.second = kSecondJmp;
      in.payload = encode(JumpPayload{jump()});
      break;
    case 4:
      in.second = kSecondCall;
      in.payload = encode(CallPayload{jump(), push()});
      break;
    case 5:
      in.second = kSecondMaterial;
      in.payload = encode(MaterialPayload{push(), static_cast<std::uint32_t>(random.below(4))});
      break;
    case 6:
      in.second = kSecondTrace;
      in.payload = encode(TracePayload{static_cast<std::uint32_t>(random.below(random.chance(4) ? 16 : 8)),
                                       static_cast<std::uint32_t>(random.below(3))});
      break;
    case 7:
      in.second = kSecondReturn;
      break;
    case 8:
      in.second = random.chance(6) ? kSecondExit : kSecondNone;
      in.payload = encode(ExitPayload{static_cast<std::uint32_t>(random.below(256))});
      break;
    default: {
      in.second = kSecondMov + static_cast<std::uint32_t>(random.below(5));
      ArithmeticPayload payload;
      payload.target = writable(random);
      payload.mask = static_cast<std::uint32_t>(random.below(16));
      payload.saturate = random.chance(3);
      in.payload = encode(payload);
      break;
    }
  }
  return in;
}

}  // namespace random_program

/// Up to 64 words, one in 100 of them one that the machine may not know.
inline RandomProgram make_random_program(Random& random) {
  RandomProgram made;
  const auto length = static_cast<std::uint32_t>(1 + random.below(kRandomProgramWords));
  using random_program::Calls;
  const Calls calls = !random.chance(5) ? Calls::kSome : random.chance(2) ? Calls::kDeep : Calls::kWide;
  while (made.words.size() < length) {
    Word word =
        encode(random_program::instruction(random, static_cast<std::uint32_t>(made.words.size()), length, calls));
    if (random.chance(100)) {
      const std::uint64_t bit = random.below(kWordBits);
      word[bit / 64] ^= std::uint64_t{1} << bit % 64;
    } else if (!is_valid(decode(word))) {
      continue;
    }
    made.words.push_back(word);
  }
  Setting& setting = made.setting;
  setting.load(made.words);
  setting.step_limit = 100;
  setting.start = random.chance(50) ? static_cast<std::uint32_t>(random.below(length + 1)) : 0;
  setting.triangles = 20;
  setting.triangle_vectors = static_cast<std::uint32_t>(random.below(8));
  setting.object = static_cast<std::uint32_t>(random.below(kRandomProgramMemory));
  for (Vector& constant : setting.constants)
    for (float& component : constant) component = std::bit_cast<float>(float_vector(random));
  for (std::size_t i = 0; i < 4; ++i)  // textures
    setting.constants.at(i) = {static_cast<float>(random.below(200)), static_cast<float>(1 + random.below(20)),
                               static_cast<float>(1 + random.below(10)), static_cast<float>(random.below(20))};
  return made;
}

/// Numbers of every kind, and small ones that serve as addresses and places.
inline std::vector<Vector> make_random_memory(Random& random) {
  std::vector<Vector> memory(kRandomProgramMemory);
  for (Vector& vector : memory)
    for (float& component : vector)
      component = random.chance(3) ? std::bit_cast<float>(float_vector(random))
                                   : static_cast<float>(random.below(random.chance(2) ? 64 : 256));
  return memory;
}

inline Vector make_random_parameters(Random& random) {
  Vector parameters;
  for (float& component : parameters)
    component =
        random.chance(2) ? std::bit_cast<float>(float_vector(random)) : static_cast<float>(random.integer(-20, 100));
  return parameters;
}

/// What a ray hits: a function of its bits, so whoever sends the same ray gets the same answer.
inline RayAnswer answer_of(const RayRequest& ray) {
  std::uint64_t hash = ray.any ? 0x9e3779b97f4a7c15u : 0;
  const auto mix = [&](float x) { hash = std::rotl((hash ^ golden::float_bits(x)) * 0xbf58476d1ce4e5b9u, 29); };
  for (std::size_t i = 0; i < 3; ++i) mix(ray.origin[i]), mix(ray.direction[i]);
  mix(ray.t_min), mix(ray.t_max);
  Random random(hash);
  RayAnswer answer;
  answer.hit = !random.chance(3);
  if (!answer.hit) return answer;
  answer.t = std::bit_cast<float>(float_vector(random));
  answer.u = std::bit_cast<float>(float_vector(random));
  answer.v = std::bit_cast<float>(float_vector(random));
  answer.id = static_cast<std::uint32_t>(random.chance(8) ? random.below(1 << kIndexBits) : random.below(40));
  return answer;
}

/// Whether two vectors have the same bits.
inline bool same_bits(const Vector& a, const Vector& b) {
  return std::bit_cast<std::array<std::uint32_t, 4>>(a) == std::bit_cast<std::array<std::uint32_t, 4>>(b);
}

}  // namespace retrace::shader
