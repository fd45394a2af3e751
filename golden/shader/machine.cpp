#include "golden/shader/machine.hpp"

#include <bit>
#include <cmath>

#include "golden/shader/assembler.hpp"
#include "golden/shader/float.hpp"

namespace retrace::shader {
namespace {

using namespace retrace::golden;

constexpr std::uint32_t kNoIndex = 1u << kIndexBits;
constexpr std::array<int, 4> kScalePowers{0, 1, 2, -1};
constexpr Vector kBareConstants{0.0f, 1.0f, 0.5f, kGreatest};

/// What stands in memory or a constant, as the machine reads it: every pattern of bits is a number.
Vector read_vector(Vector x) {
  for (float& component : x) component = float_read(float_bits(component));
  return x;
}

class Execution {
 public:
  Execution(Thread& thread, const Setting& setting, std::span<Vector> memory)
      : t_(thread), setting_(setting), memory_(memory) {}

  void step() {
    if (t_.steps == setting_.step_limit) return end(kStatusStepLimit);
    ++t_.steps;
    if (t_.place >= setting_.program.size()) return end(kStatusBadPlace);
    const Instruction& in = setting_.program[t_.place];
    if (!setting_.valid[t_.place]) return end(kStatusBadOpcode);
    next_ = t_.place + 1;
    const OpEntry& op = kOpTable[in.op];
    switch (op.kind) {
      case OpKind::None:
      case OpKind::Arithmetic:
      case OpKind::Dot:
        pair(in, op);
        break;
      case OpKind::Store: {
        count(Counter::kMemory);
        Vector value;
        if (!fetch(in.a, value)) return;
        const std::uint32_t at = address(decode_load(in.payload));
        if (at >= memory_.size()) return end(kStatusBadAddress);
        memory_[at] = value;
        break;
      }
      case OpKind::Texture:
        texture(in);
        break;
      case OpKind::Trace: {
        Vector limits;
        if (!fetch(in.a, t_.ray.origin) || !fetch(in.b, t_.ray.direction) || !fetch(in.c, limits)) return;
        t_.ray_target = Thread::kRegisterNone;
        trace(limits[0], limits[1], limits[2] >= 1);
        break;
      }
    }
    if (t_.status == kStatusRunning) t_.place = next_;
  }

 private:
  void end(int status) { t_.status = static_cast<std::uint32_t>(status); }
  void count(Counter counter) { ++t_.counts[static_cast<std::size_t>(counter)]; }

  /// A place of the stack, or false and the end of the thread.
  bool in_stack(std::uint32_t code, std::uint32_t& place) {
    place = t_.window + code;
    if (place < kStackRegisters) return true;
    end(kStatusStackOverflow);
    return false;
  }
  bool read(std::uint32_t code, Vector& value) {
    if (code < kRegisters) {
      std::uint32_t place;
      if (!in_stack(code, place)) return false;
      value = t_.stack[place];
    } else if (code >= kRegisterConstants) {
      value = setting_.constants[code - kRegisterConstants];
    } else if (code == kRegisterP) {
      value = t_.parameters;
    } else if (code == kRegisterAddr) {
      value = t_.addresses;
    } else if (code == kRegisterC) {
      value = kBareConstants;
    } else {
      value = t_.fixed[code];
    }
    return true;
  }
  bool write(std::uint32_t code, std::uint32_t mask, const Vector& value) {
    Vector* target = nullptr;
    if (code < kRegisters) {
      std::uint32_t place;
      if (!in_stack(code, place)) return false;
      target = &t_.stack[place];
    } else {
      target = code == kRegisterAddr ? &t_.addresses : &t_.fixed[code];
    }
    for (std::size_t c = 0; c < 4; ++c)
      if (mask >> c & 1) (*target)[c] = value[c];
    return true;
  }
  bool fetch(const Source& source, Vector& value) {
    if (source.immediate) {
      const std::uint32_t upper = encode(source) & ((1u << (kABits - 1)) - 1);
      value.fill(float_read(upper << (kExponentBits + kFractionBits + 2 - kABits)));
      return true;
    }
    Vector whole;
    if (!read(source.index, whole)) return false;
    whole = read_vector(whole);
    for (std::size_t c = 0; c < 4; ++c) {
      const float x = float_scale(whole[source.swizzle >> 2 * c & 3], kScalePowers[source.scale]);
      value[c] = source.negate ? -x : x;
    }
    return true;
  }

  static Vector compute(std::uint32_t op, const std::array<Vector, 3>& s) {
    Vector r{};
    std::array<float, 4> a = s[0], b = s[1];
    switch (op) {
      case kOpDp2h:
        b[2] = 1;
        a[3] = b[3] = 0;
        break;
      case kOpDp3:
        a[3] = b[3] = 0;
        break;
      case kOpDp3h:
        b[3] = 1;
        break;
      default:
        break;
    }
    for (std::size_t c = 0; c < 4; ++c) {
      switch (op) {
        case kOpMov:
          r[c] = s[0][c];
          break;
        case kOpFrac:
          r[c] = float_frac(s[0][c]);
          break;
        case kOpAdd:
          r[c] = float_add(s[0][c], s[1][c]);
          break;
        case kOpMul:
          r[c] = float_mul(s[0][c], s[1][c]);
          break;
        case kOpMad:
          r[c] = float_mad(s[0][c], s[1][c], s[2][c]);
          break;
        default:
          r[c] = float_dot(a.data(), b.data());
          break;
      }
    }
    return r;
  }
  static Vector saturated(Vector x) {
    for (float& component : x) component = float_saturate(component);
    return x;
  }

  void pair(const Instruction& in, const OpEntry& op) {
    const SecondEntry& second = kSecondTable[in.second];
    const std::array<Source, 3> sources{in.a, in.b, in.c};
    std::array<Vector, 3> values{};
    const bool arithmetic = second.layout == Layout::Arithmetic;
    const std::uint32_t others = arithmetic ? kOpTable[second.op].sources : 0;
    for (std::uint32_t i = 0; i < op.sources + others; ++i)
      if (!fetch(sources[i], values[i])) return;
    // Everything is read; now writes.
    Vector first{}, other{};
    if (arithmetic) {
      std::array<Vector, 3> rest{};
      for (std::uint32_t i = 0; i < others; ++i) rest[i] = values[op.sources + i];
      other = compute(second.op, rest);
    }
    const bool load = second.layout == Layout::Load;
    const std::uint32_t at = load ? address(decode_load(in.payload)) : 0;
    if (op.kind != OpKind::None) {
      count(Counter::kArithmetic);
      first = compute(in.op, values);
      t_.result = first;
      if (!write(in.target, in.mask, in.modifier == kModifierSat ? saturated(first) : first)) return;
      if (in.modifier == kModifierRcp || in.modifier == kModifierRsq) {
        const float x = first[in.component];
        Vector special;
        special.fill(in.modifier == kModifierRcp ? float_rcp(x) : float_rsq(x));
        write(kRegisterS, in.mask, special);
      }
    }
    if (arithmetic) {
      count(Counter::kArithmetic);
      const auto payload = decode_arithmetic(in.payload);
      write(payload.target, payload.mask, payload.saturate ? saturated(other) : other);
      return;
    }
    if (in.second == kSecondNone || !fulfilled(in)) return;
    if (load) {
      count(Counter::kMemory);
      const std::uint32_t vectors = in.second == kSecondLoad4x ? 4 : 1;
      if (at >= memory_.size() || memory_.size() - at < vectors) return end(kStatusBadAddress);
      const std::uint32_t target = kRegisterI0 + (vectors == 4 ? 0 : decode_load(in.payload).result);
      for (std::uint32_t i = 0; i < vectors; ++i) t_.fixed[target + i] = memory_[at + i];
      return;
    }
    control(in);
  }

  bool fulfilled(const Instruction& in) const {
    bool every = true, some = false;
    for (std::size_t c = 0; c < 4; ++c) {
      if (!(in.lanes >> c & 1)) continue;
      const bool is = (in.classes & float_class(t_.result[c])) != 0;
      every = every && is;
      some = some || is;
    }
    return in.all ? every : some;
  }

  void control(const Instruction& in) {
    if (in.second != kSecondTrace) count(Counter::kControl);
    switch (in.second) {
      case kSecondJmp:
        next_ = decode_jump(in.payload).place;
        break;
      case kSecondCall: {
        const auto payload = decode_call(in.payload);
        call(payload.place, payload.push);
        break;
      }
      case kSecondMaterial: {
        const auto payload = decode_material(in.payload);
        const std::uint32_t triangle = float_index(t_.addresses[0]);
        if (triangle >= memory_.size()) return end(kStatusBadAddress);
        const std::uint32_t material = float_index(read_vector(memory_[triangle])[3]);
        if (material >= memory_.size()) return end(kStatusBadAddress);
        const std::uint32_t place = float_index(read_vector(memory_[material])[payload.entry]);
        if (place >= kProgramWords) return end(kStatusBadPlace);
        call(place, payload.push);
        break;
      }
      case kSecondTrace: {
        const auto payload = decode_trace(in.payload);
        t_.ray.origin = t_.fixed[kRegisterE0];
        for (std::size_t c = 0; c < 3; ++c) t_.ray.direction[c] = float_rcp(t_.fixed[kRegisterE1][c]);
        t_.ray.direction[3] = 0;
        const Vector& limits = t_.fixed[kRegisterE2];
        if (!in_stack(payload.push + 4, t_.ray_target)) return;
        trace(limits[1], limits[2], payload.entry == 1);
        break;
      }
      case kSecondReturn:
        if (t_.depth == 0) return end(kStatusDone);
        --t_.depth;
        next_ = t_.returns[t_.depth].place;
        t_.window = t_.returns[t_.depth].window;
        break;
      default:
        t_.code = decode_exit(in.payload).code;
        return end(kStatusDone);
    }
  }

  void call(std::uint32_t place, std::uint32_t push) {
    if (t_.depth == kCallDepth || t_.window + push >= kStackRegisters) return end(kStatusStackOverflow);
    t_.returns[t_.depth] = {next_, t_.window};
    ++t_.depth;
    t_.window += push;
    next_ = place;
  }

  void trace(float t_min, float t_max, bool any) {
    count(Counter::kTrace);
    t_.ray.t_min = t_min;
    t_.ray.t_max = t_max;
    t_.ray.any = any;
    if (t_.ray.direction[0] == 0 && t_.ray.direction[1] == 0 && t_.ray.direction[2] == 0) return end(kStatusBadRay);
    t_.waits = true;
  }

  /// Of a load or store; beyond every memory where the register holds none.
  std::uint32_t address(const LoadPayload& payload) const {
    const AddressEntry& entry = kAddressTable[payload.address];
    const Vector& from = entry.register_ == kRegisterA ? t_.fixed[kRegisterA] : t_.addresses;
    const std::uint32_t index = float_index(from[static_cast<std::size_t>(entry.lane)]);
    return index == kNoIndex ? kNoIndex : index + payload.offset;
  }

  /// floor(x) modulo the size; what no index can say counts as 0.
  static std::uint32_t wrapped(float x, std::uint32_t size) {
    const double whole = std::floor(static_cast<double>(x));
    if (std::abs(whole) >= kNoIndex) return 0;
    const auto rest = static_cast<std::int64_t>(whole) % size;
    return static_cast<std::uint32_t>(rest < 0 ? rest + size : rest);
  }

  void texture(const Instruction& in) {
    count(Counter::kTexture);
    Vector picture, place, value{};
    if (!fetch(in.a, picture) || !fetch(in.b, place)) return;
    if (in.op == kOpTexstore && !fetch(in.c, value)) return;
    const std::uint32_t begin = float_index(picture[0]), width = float_index(picture[1]),
                        height = float_index(picture[2]);
    if (begin == kNoIndex || width == kNoIndex || height == kNoIndex || width == 0 || height == 0)
      return end(kStatusBadAddress);
    const std::uint32_t x = wrapped(place[0], width), y = wrapped(place[1], height);
    const auto texel = [&](std::uint32_t dx, std::uint32_t dy) {
      const std::uint64_t column = (x + dx) % width, row = (y + dy) % height;
      return begin + row * width + column;
    };
    const std::uint32_t texels = in.op == kOpTexload4x ? 4 : 1;
    for (std::uint32_t i = 0; i < texels; ++i)
      if (texel(i & 1, i >> 1) >= memory_.size()) return end(kStatusBadAddress);
    if (in.op == kOpTexstore) {
      memory_[texel(0, 0)] = value;
    } else if (in.op == kOpTexload) {
      t_.fixed[in.target] = memory_[texel(0, 0)];
    } else {
      for (std::uint32_t i = 0; i < 4; ++i) t_.fixed[kRegisterI0 + i] = memory_[texel(i & 1, i >> 1)];
    }
  }

  Thread& t_;
  const Setting& setting_;
  std::span<Vector> memory_;
  std::uint32_t next_ = 0;
};

}  // namespace

void Setting::load(std::span<const Word> words) {
  program.clear();
  valid.clear();
  for (const Word& word : words) {
    program.push_back(decode(word));
    valid.push_back(is_valid(program.back()));
  }
}

void step(Thread& thread, const Setting& setting, std::span<Vector> memory) {
  Execution(thread, setting, memory).step();
}

void wake(Thread& thread, const Setting& setting, const RayAnswer& answer) {
  thread.waits = false;
  Vector& hit = thread.fixed[kRegisterHit];
  if (answer.hit) {
    hit = read_vector({answer.t, answer.u, answer.v, static_cast<float>(answer.id)});
  } else {
    hit = {golden::kGreatest, 0.0f, 0.0f, -1.0f};
  }
  const std::int64_t triangle = static_cast<std::int64_t>(setting.triangles) +
                                (answer.hit ? static_cast<std::int64_t>(answer.id) : -1) * setting.triangle_vectors;
  const bool there = triangle >= 0 && triangle < std::int64_t{1} << kIndexBits;
  thread.addresses[0] = there ? static_cast<float>(triangle) : -1.0f;  // below 0: no address
  thread.addresses[1] = static_cast<float>(setting.object);
  Vector& h = thread.fixed[kRegisterH];
  h[0] = thread.addresses[1];
  h[1] = thread.addresses[0];
  h[3] = hit[3];
  if (thread.ray_target != Thread::kRegisterNone) thread.stack[thread.ray_target] = {hit[1], hit[2], hit[0], hit[3]};
}

}  // namespace retrace::shader
