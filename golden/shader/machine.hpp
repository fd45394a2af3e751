// The shader unit on the host: executes programs instruction by instruction, in the numbers of float.hpp. What a thread does depends on its registers,
// the constants and the memory alone; rays go to whoever holds the machine, between two instructions.
// Counterparts: hls/shader/, rtl/shader/; docs/shader-isa.md.
#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "golden/shader/isa.hpp"

namespace retrace::shader {

using Vector = std::array<float, 4>;

/// What all threads of a program share.
struct Setting {
  std::vector<Instruction> program;
  std::vector<std::uint8_t> valid;  ///< whether the machine knows the instruction
  std::array<Vector, kConstants> constants{};
  std::uint32_t start = 0;             ///< where threads begin
  std::uint32_t triangles = 0;         ///< address of the vectors of triangle 0; those of "nothing hit" stand before it
  std::uint32_t triangle_vectors = 1;  ///< from one triangle to the next
  std::uint32_t object = 0;            ///< OBJ after a trace, an index
  std::uint64_t step_limit = 1 << 16;  ///< instructions of a thread

  void load(std::span<const Word> words);
};

/// A ray that a thread waits for.
struct RayRequest {
  Vector origin{}, direction{};
  float t_min = 0, t_max = 0;
  bool any = false;
};
struct RayAnswer {
  bool hit = false;
  float t = 0, u = 0, v = 0;
  std::uint32_t id = 0;  ///< an index
};

enum class Counter { kArithmetic, kMemory, kTexture, kControl, kTrace, kCount };

struct Thread {
  std::array<Vector, kStackRegisters> stack{};
  std::array<Vector, 32> fixed{};  ///< registers by their code, from I0 to HIT
  Vector parameters{}, addresses{};
  Vector result{};  ///< of the last first operation: what conditions look at
  struct Return {
    std::uint32_t place = 0, window = 0;
    bool operator==(const Return&) const = default;
  };
  std::array<Return, kCallDepth> returns{};
  std::uint32_t place = 0, window = 0, depth = 0;
  std::uint64_t steps = 0;
  std::uint32_t status = kStatusRunning, code = 0;
  bool waits = false;  ///< for the answer to `ray`
  RayRequest ray{};
  std::uint32_t ray_target = kRegisterNone;  ///< register of the stack that (u, v, t, id) goes to
  std::array<std::uint32_t, static_cast<std::size_t>(Counter::kCount)> counts{};

  static constexpr std::uint32_t kRegisterNone = ~0u;
  bool running() const { return status == kStatusRunning && !waits; }
  bool operator==(const Thread&) const = default;
};

/// One instruction of a thread that runs.
void step(Thread& thread, const Setting& setting, std::span<Vector> memory);

/// Until it waits for a ray or has ended.
inline void run(Thread& thread, const Setting& setting, std::span<Vector> memory) {
  while (thread.running()) step(thread, setting, memory);
}

/// The answer to the ray it waits for.
void wake(Thread& thread, const Setting& setting, const RayAnswer& answer);

}  // namespace retrace::shader
