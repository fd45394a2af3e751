// The shader unit's machine in SystemVerilog against the machine on the host: registers, place, window and steps before every instruction, rays, memory and
// how threads end, over random programs, one thread alone and all threads in rotation, with every stream free, held off at random, or slow. Each thread has a
// memory of its own, so that what it does does not depend on the others. RETRACE_PROGRAMS sets the number of programs.
#include <gtest/gtest.h>

#include <cinttypes>
#include <deque>
#include <map>
#include <optional>

#include "testbench/shader/random_program.hpp"
#include "testbench/sim/clocked.hpp"
#include "Vtb_spu.h"

namespace retrace::shader {
namespace {

constexpr std::size_t kThreads = 32;
constexpr std::size_t kSlots = 96;
constexpr std::size_t kSlotP = 80, kSlotAddr = 81;

template <typename Wide>
void put(Wide& port, const Vector& vector) {
  for (std::size_t c = 0; c < 4; ++c) port[c] = golden::float_bits(vector[c]);
}
template <typename Wide>
Vector get(const Wide& port, std::size_t components = 4) {
  Vector vector{};
  for (std::size_t c = 0; c < components; ++c) vector[c] = std::bit_cast<float>(static_cast<std::uint32_t>(port[c]));
  return vector;
}

Vector slot_of(const Thread& thread, std::size_t slot) {
  if (slot < kStackRegisters) return thread.stack[slot];
  if (slot == kSlotP) return thread.parameters;
  if (slot == kSlotAddr) return thread.addresses;
  return thread.fixed[slot - kStackRegisters + kRegisterI0];
}

/// How long streams wait: `hold` of 16 clocks they are held off; replies and answers take up to `latency` clocks.
struct Traffic {
  unsigned hold = 0, latency = 0;
};

/// A thread of the unit, what the host's machine says of it, and its memory.
struct Pair {
  bool there = false, begun = false;
  Thread expected;
  std::vector<Vector> memory, expected_memory;
  std::array<Vector, kSlots> slots{};
};

class Bench {
 public:
  Bench(const RandomProgram& program, std::uint64_t seed, cosim::Clocked<Vtb_spu>& model)
      : program_(program), random_(seed), seed_(seed), model_(model) {}

  /// Runs `count` threads, at most `at_once` of them side by side; "" or what differs.
  std::string run(std::size_t count, std::size_t at_once, const Traffic& traffic) {
    load();
    std::size_t launched = 0, ended = 0;
    std::deque<Vector> parameters;
    for (std::size_t i = 0; i < count; ++i) {
      Vector each = make_random_parameters(random_);
      each[3] = static_cast<float>(i);
      parameters.push_back(each);
    }
    const auto all = parameters;
    std::vector<std::vector<Vector>> memories;
    for (std::size_t i = 0; i < count; ++i) memories.push_back(make_random_memory(random_));
    std::map<std::size_t, Thread> done;
    const auto offered = [&](bool was) { return was || random_.below(16) >= traffic.hold; };  // what is offered stays
    bool launch = false;
    std::optional<Reply> reply;
    std::optional<Answer> answer;
    std::uint64_t idle = 0;
    while (ended < count) {
      // Inputs.
      launch = launched < count && launched - ended < at_once && offered(launch);
      model_->launch_valid_i = launch;
      if (launch) put(model_->launch_parameters_i, all[launched]);
      if (!reply && offered(false)) reply = take(replies_);
      model_->reply_valid_i = reply.has_value();
      if (reply) {
        model_->reply_thread_i = reply->thread;
        model_->reply_tag_i = reply->tag;
        put(model_->reply_data_i, reply->data);
      }
      if (!answer && offered(false)) answer = take(answers_);
      model_->answer_valid_i = answer.has_value();
      if (answer) {
        const RayAnswer& a = answer->answer;
        model_->answer_thread_i = answer->thread;
        model_->answer_hit_i = a.hit;
        model_->answer_t_i = golden::float_bits(a.t);
        model_->answer_u_i = golden::float_bits(a.u);
        model_->answer_v_i = golden::float_bits(a.v);
        model_->answer_id_i = a.id;
      }
      model_->request_ready_i = random_.below(16) >= traffic.hold;
      model_->ray_ready_i = random_.below(16) >= traffic.hold;
      model_->result_ready_i = random_.below(16) >= traffic.hold;
      model_.settle();

      // Outputs.
      ++idle;
      if (launch && model_->launch_ready_o) {
        waiting_.push_back({all[launched], memories[launched]});
        ++launched;
        launch = false;
      }
      if (reply && model_->reply_ready_o) reply.reset();
      if (answer && model_->answer_ready_o) answer.reset();
      if (model_->request_valid_o && model_->request_ready_i) {
        Pair& pair = pairs_[model_->request_thread_o];
        const std::size_t at = model_->request_address_o;
        if (at >= pair.memory.size()) return say("a request outside of the memory");
        if (model_->request_write_o)
          pair.memory[at] = get(model_->request_data_o);
        else
          replies_.push_back({model_.clock() + random_.below(traffic.latency + 1), model_->request_thread_o,
                              model_->request_tag_o, pair.memory[at]});
      }
      if (model_->ray_valid_o && model_->ray_ready_i) {
        RayRequest ray;
        const Vector origin = get(model_->ray_origin_o, 3), direction = get(model_->ray_direction_o, 3);
        ray.origin = origin;
        ray.direction = direction;
        ray.t_min = std::bit_cast<float>(model_->ray_t_min_o);
        ray.t_max = std::bit_cast<float>(model_->ray_t_max_o);
        ray.any = model_->ray_any_o;
        answers_.push_back({model_.clock() + random_.below(traffic.latency + 1), model_->ray_thread_o, answer_of(ray)});
        ++rays;
      }
      if (model_->begins_o) {
        idle = 0;
        const std::string wrong = begin(model_->thread_o);
        if (!wrong.empty()) return say(wrong);
      }
      if (model_->writes_o) {
        Vector& slot = pairs_[model_->write_thread_o].slots[model_->slot_o];
        const Vector data = get(model_->data_o);
        for (std::size_t c = 0; c < 4; ++c)
          if (model_->mask_o >> c & 1) slot[c] = data[c];
      }
      if (model_->result_valid_o && model_->result_ready_i) {
        const auto work = static_cast<std::size_t>(get(model_->result_parameters_o)[3]);
        const auto found = ended_.find(work);
        if (found == ended_.end()) return say("a result of a thread that has not ended");
        const Thread& thread = found->second;
        if (model_->result_status_o != thread.status)
          return say("status " + std::to_string(model_->result_status_o) + " for " + std::to_string(thread.status));
        if (model_->result_code_o != thread.code) return say("code");
        if (model_->result_steps_o != thread.steps) return say("steps");
        if (!same_bits(get(model_->result_colour_o), thread.fixed[kRegisterO])) return say("colour");
        ++ends[thread.status];
        ended_.erase(found);
        ++ended;
      }
      model_.rise();
      if (idle > 20000) return say("nothing begins for 20,000 clocks");
      if (model_.failed()) return say("an assertion of the RTL");
    }
    if (!replies_.empty() || !answers_.empty()) return say("replies left over");
    return "";
  }

  std::map<std::uint32_t, std::uint64_t> ends;
  std::uint64_t instructions = 0, rays = 0;

 private:
  struct Reply {
    std::uint64_t at;
    std::uint32_t thread, tag;
    Vector data;
  };
  struct Answer {
    std::uint64_t at;
    std::uint32_t thread;
    RayAnswer answer;
  };
  struct Launched {
    Vector parameters;
    std::vector<Vector> memory;
  };

  /// The first of a thread that has waited long enough: threads overtake each other.
  template <typename Item>
  std::optional<Item> take(std::deque<Item>& items) const {
    std::uint64_t passed = 0;  // threads with an earlier one
    for (auto item = items.begin(); item != items.end(); ++item) {
      const std::uint64_t thread = std::uint64_t{1} << item->thread;
      if (item->at <= model_.clock() && (passed & thread) == 0) {
        const Item taken = *item;
        items.erase(item);
        return taken;
      }
      passed |= thread;
    }
    return std::nullopt;
  }

  std::string say(const std::string& what) const {
    return what + ", clock " + std::to_string(model_.clock()) + ", program of seed " + std::to_string(seed_);
  }

  void load() {
    model_->launch_valid_i = model_->reply_valid_i = model_->answer_valid_i = 0;
    model_->length_i = static_cast<std::uint16_t>(program_.words.size());
    model_->start_i = static_cast<std::uint16_t>(program_.setting.start);
    model_->step_limit_i = static_cast<std::uint32_t>(program_.setting.step_limit);
    model_->memory_vectors_i = kRandomProgramMemory;
    model_->triangles_i = program_.setting.triangles;
    model_->triangle_vectors_i = static_cast<std::uint8_t>(program_.setting.triangle_vectors);
    model_->object_i = program_.setting.object;
    model_->write_valid_i = 1;
    model_->write_constant_i = 0;
    for (std::size_t i = 0; i < program_.words.size(); ++i) {
      model_->write_address_i = static_cast<std::uint16_t>(i);
      for (std::size_t half = 0; half < 4; ++half)
        model_->write_data_i[half] = static_cast<std::uint32_t>(program_.words[i][half / 2] >> 32 * (half % 2));
      model_.step();
    }
    model_->write_constant_i = 1;
    for (std::size_t i = 0; i < kConstants; ++i) {
      model_->write_address_i = static_cast<std::uint16_t>(i);
      put(model_->write_data_i, program_.setting.constants[i]);
      model_.step();
    }
    model_->write_valid_i = 0;
    pairs_.assign(64, {});
  }

  /// An instruction of a thread of the unit begins, or its result is read: the host's machine does the one before.
  std::string begin(std::size_t number) {
    Pair& pair = pairs_[number];
    if (!pair.there) {  // launched just now; which launch it was, its parameters say
      const auto work = static_cast<std::size_t>(pair.slots[kSlotP][3]);
      std::erase_if(waiting_, [&](const Launched& each) {
        if (static_cast<std::size_t>(each.parameters[3]) != work) return false;
        pair.expected = {};
        pair.expected.parameters = each.parameters;
        pair.expected.place = program_.setting.start;
        pair.memory = pair.expected_memory = each.memory;
        pair.there = true;
        return true;
      });
      if (!pair.there) return "a thread that was not launched";
    } else {
      Thread& thread = pair.expected;
      step(thread, program_.setting, pair.expected_memory);
      if (thread.waits) wake(thread, program_.setting, answer_of(thread.ray));
      ++instructions;
    }
    const Thread& thread = pair.expected;
    const std::string where = " of thread " + std::to_string(number) + " after step " + std::to_string(thread.steps);
    for (std::size_t slot = 0; slot <= kSlotAddr; ++slot)
      if (!same_bits(pair.slots[slot], slot_of(thread, slot))) return "slot " + std::to_string(slot) + where;
    if (thread.status != kStatusRunning) {
      for (std::size_t at = 0; at < pair.memory.size(); ++at)
        if (!same_bits(pair.memory[at], pair.expected_memory[at])) return "memory at " + std::to_string(at) + where;
      if (model_->steps_o != thread.steps) return "steps" + where;
      ended_[static_cast<std::size_t>(thread.parameters[3])] = thread;
      pair.there = false;
      return "";
    }
    if (model_->place_o != thread.place)
      return "place " + std::to_string(model_->place_o) + " for " + std::to_string(thread.place) + where;
    if (model_->window_o != thread.window) return "window" + where;
    if (model_->depth_o != thread.depth) return "depth" + where;
    if (model_->steps_o != thread.steps) return "steps" + where;
    return "";
  }

  const RandomProgram& program_;
  Random random_;
  std::uint64_t seed_;
  cosim::Clocked<Vtb_spu>& model_;
  std::vector<Pair> pairs_;
  std::deque<Launched> waiting_;
  std::deque<Reply> replies_;
  std::deque<Answer> answers_;
  std::map<std::size_t, Thread> ended_;
};

class RtlSpu : public ::testing::TestWithParam<Traffic> {};

TEST_P(RtlSpu, registers_before_every_instruction) {
  const char* text = std::getenv("RETRACE_PROGRAMS");
  const std::uint64_t count = text ? std::strtoull(text, nullptr, 0) : 60;
  const std::uint64_t seed = test_seed();
  cosim::Clocked<Vtb_spu> model(seed);
  model.reset();
  std::map<std::uint32_t, std::uint64_t> ends;
  std::uint64_t instructions = 0, rays = 0;
  for (std::uint64_t i = 0; i < count; ++i) {
    Random random(seed + i);
    const RandomProgram program = make_random_program(random);
    Bench bench(program, seed + i, model);
    const bool alone = i % 4 == 0;
    ASSERT_EQ(bench.run(alone ? 2 : 40, alone ? 1 : kThreads + 8, GetParam()), "");
    for (const auto& [status, number] : bench.ends) ends[status] += number;
    instructions += bench.instructions;
    rays += bench.rays;
  }
  std::printf("%" PRIu64 " programs, %" PRIu64 " instructions, %" PRIu64 " rays, %" PRIu64 " clocks, 0 differ; ends:",
              count, instructions, rays, model.clock());
  for (const auto& [status, number] : ends)
    std::printf(" %s %" PRIu64, std::string(kStatusTable[status].name).c_str(), number);
  std::printf("\n");
}

INSTANTIATE_TEST_SUITE_P(Traffic, RtlSpu,
                         ::testing::Values(Traffic{}, Traffic{.hold = 4, .latency = 60},
                                           Traffic{.hold = 14, .latency = 3}),
                         [](const auto& each) { return "hold" + std::to_string(each.param.hold); });

}  // namespace
}  // namespace retrace::shader
