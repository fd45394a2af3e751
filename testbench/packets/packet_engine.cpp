// See packet_engine.hpp.
#include "packet_engine.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <queue>
#include <vector>

#include "golden/engine/hit_codec.hpp"
#include "testbench/kit/machine_memory.hpp"
#include "testbench/kit/reference.hpp"
#include "testbench/kit/stage_inputs.hpp"

namespace retrace {
namespace {

constexpr std::int64_t kFar = (std::int64_t{1} << (contract::kTBits - 1)) - 1;

enum Unit { kTraversal, kList, kIntersection, kUnits };
enum Section { kNodes, kLeaves, kLists, kTriangles, kNothing };
// Clocks from the data to the next step of the packet, beside those that the unit is busy: as deep as the core's stages (docs/rtl-stages.md).
constexpr std::array<double, kUnits> kDepth{12, 8, 50};

/// One step of a packet: a read, then a unit that is busy for so many clocks.
struct Step {
  Section section;
  std::uint32_t index;
  Unit unit;
  std::uint32_t busy;
};

struct PacketRay {
  contract::RaySetupOutRecord ray;
  contract::HitFinishInRecord best;
  bool found = false, done = false;
};

/// Where one ray of the packet is in the tree: the interval of t in which it crosses the node; empty if it does not.
struct Interval {
  std::int64_t begin = 0, end = -1;
  bool active() const { return begin <= end; }
};

class Packets final : public PacketEngine {
 public:
  Packets(const MemoryImage& image, const PacketMachine& machine) : image_(image), machine_(machine) {}

  std::string name() const override { return "packets"; }
  const PacketTotals& totals() const override { return totals_; }

  void trace(std::span<const GridRay> rays, std::span<Hit> hits, std::span<RayWork> work,
             const TraceOptions& options) override {
    if (hits.size() != rays.size() || (!work.empty() && work.size() != rays.size()))
      throw Error("packets engine: sizes of rays, hits and work differ");
    std::fill(hits.begin(), hits.end(), Hit{});
    std::fill(work.begin(), work.end(), RayWork{});
    const std::vector<std::size_t> inside = rays_inside(rays);
    std::vector<std::vector<Step>> packets;
    for (std::size_t first = 0; first < inside.size(); first += machine_.rays) {
      const std::size_t count = std::min<std::size_t>(machine_.rays, inside.size() - first);
      packets.push_back(walk(rays, std::span(inside).subspan(first, count), hits, work));
      if (options.done) *options.done += count;
    }
    if (options.done) *options.done += rays.size() - inside.size();
    totals_.rays += inside.size();
    totals_.packets += packets.size();
    totals_.bytes += inside.size() * (8 * (kRayWords + kHitWords));
    run_clocks(packets, inside.size());
  }

 private:
  /// Traces one packet, which says what its steps are.
  std::vector<Step> walk(std::span<const GridRay> rays, std::span<const std::size_t> places, std::span<Hit> hits,
                         std::span<RayWork> work) {
    std::vector<Step> steps;
    std::vector<PacketRay> packet(places.size());
    std::vector<Interval> at(places.size());
    const auto& box = image_.header().box;
    for (std::size_t i = 0; i < places.size(); ++i) {
      const contract::RayRecord& record = rays[places[i]].record;
      contract::RaySetupInRecord in{
          .origin = record.origin, .direction = record.direction, .t_max = record.t_max, .any = record.any};
      for (std::size_t face = 0; face < 6; ++face) in.box[face] = static_cast<std::int32_t>(box[face]);
      PacketRay& r = packet[i];
      r.ray = reference::ray_setup(in);
      r.best.status = static_cast<std::uint32_t>(r.ray.valid ? contract::kStatusMiss : contract::kStatusBadRay);
      r.best.t = record.t_max;
      r.best.id = contract::kNoTriangle;
      r.done = !r.ray.valid;
      if (!r.done) at[i] = {0, kFar};
    }

    struct Waiting {
      std::uint32_t node;
      std::vector<Interval> at;
    };
    std::vector<Waiting> stack;
    std::uint32_t node = 0;
    std::uint64_t visits = 0;
    for (;;) {
      // A ray that is done, or has a hit in front of the node, has nothing to do in it.
      std::uint32_t active = 0;
      for (std::size_t i = 0; i < packet.size(); ++i) {
        if (packet[i].done || packet[i].best.t < at[i].begin) at[i] = {};
        active += at[i].active();
      }
      if (active != 0) {
        // What a checked image cannot do, and a walk must not do for ever.
        if (++visits > image_.header().step_limit) throw Error("packets engine: the image's step limit is used up");
        const WalkedNode walked = node_of(image_, node);
        ++totals_.nodes;
        totals_.ray_nodes += active;
        if (walked.axis != static_cast<std::uint32_t>(contract::kAxisLeaf)) {
          for (std::size_t i = 0; i < packet.size(); ++i)
            if (at[i].active() && !work.empty()) ++work[places[i]].down;
          steps.push_back({kNodes, node >> 1, kTraversal, clocks(active, machine_.traversal_lanes)});
          // The first active ray says which child comes first; others may go in the other order, which costs steps, not hits.
          std::size_t leader = 0;
          while (!at[leader].active()) ++leader;
          const bool right_first = packet[leader].ray.negative[walked.axis] != 0;
          std::vector<Interval> near(packet.size()), far(packet.size());
          for (std::size_t i = 0; i < packet.size(); ++i) {
            if (!at[i].active()) continue;
            const contract::RaySetupOutRecord& ray = packet[i].ray;
            Interval left = at[i], right = at[i];
            if (ray.zero[walked.axis]) {
              if (ray.origin[walked.axis] < walked.split) right = {};
              if (ray.origin[walked.axis] > walked.split) left = {};
            } else {
              const std::int64_t t = reference::t_plane(walked.split, ray.origin[walked.axis],
                                                        ray.reciprocal[walked.axis], ray.shift[walked.axis]);
              Interval& first = ray.negative[walked.axis] ? right : left;
              Interval& second = ray.negative[walked.axis] ? left : right;
              first.end = std::min(first.end, t);
              second.begin = std::max(second.begin, t);
            }
            near[i] = right_first ? right : left;
            far[i] = right_first ? left : right;
          }
          const std::uint32_t child = 2 * walked.child;
          const auto any = [](const std::vector<Interval>& all) { return std::ranges::any_of(all, &Interval::active); };
          if (any(near)) {
            if (any(far)) stack.push_back({child + !right_first, std::move(far)});
            node = child + right_first;
            at = std::move(near);
          } else {
            node = child + !right_first;
            at = std::move(far);
          }
          continue;
        }
        visit_leaf(walked, packet, at, active, places, work, steps);
      }
      if (stack.empty()) break;
      node = stack.back().node;
      at = std::move(stack.back().at);
      stack.pop_back();
    }
    for (std::size_t i = 0; i < places.size(); ++i) {
      PacketRay& r = packet[i];
      if (r.found) r.best.status = contract::kStatusHit;
      std::array<std::uint64_t, kHitWords> words;
      reference::hit_finish(r.best).pack(words.data());
      hits[places[i]] = unpack_hit(words);
    }
    return steps;
  }

  void visit_leaf(const WalkedNode& walked, std::vector<PacketRay>& packet, const std::vector<Interval>& at,
                  std::uint32_t active, std::span<const std::size_t> places, std::span<RayWork> work,
                  std::vector<Step>& steps) {
    const contract::LeafRecord leaf = image_.leaf(walked.child);
    ++totals_.leaves;
    totals_.ray_leaves += active;
    steps.push_back({kLeaves, walked.child, kTraversal, clocks(active, machine_.traversal_lanes)});
    for (std::size_t i = 0; i < packet.size(); ++i)
      if (at[i].active() && !work.empty()) ++work[places[i]].leaf;
    for (std::uint32_t n = 0; n < leaf.count; ++n) {
      const std::uint32_t index = image_.reference(leaf, n);
      const bool listed = n >= static_cast<std::uint32_t>(contract::kLeafInline);
      steps.push_back(
          {listed ? kLists : kNothing, listed ? (leaf.list_base + n - contract::kLeafInline) / 16 : 0, kList, 1});
      const contract::TriangleRecord triangle = image_.triangle(index);
      std::uint32_t tested = 0;
      for (std::size_t i = 0; i < packet.size(); ++i) {
        PacketRay& r = packet[i];
        if (!at[i].active() || r.done) continue;
        ++tested;
        if (!work.empty()) ++work[places[i]].tests;
        const contract::TriTestOutRecord hit = reference::tri_test(tri_test_in(triangle, r.ray));
        if (!hit.hit || !(hit.t < r.best.t || (hit.t == r.best.t && hit.id < r.best.id))) continue;
        r.found = true;
        r.best.t = hit.t;
        r.best.id = hit.id;
        r.best.edge_u = hit.edge_u;
        r.best.edge_v = hit.edge_v;
        r.best.dz = hit.dz;
        r.best.exponent_u = hit.exponent_u;
        r.best.exponent_v = hit.exponent_v;
        r.done = r.ray.any != 0;
      }
      if (tested == 0) break;  // any hits found: nobody is left in the leaf
      ++totals_.triangles;
      totals_.tests += tested;
      steps.push_back({kTriangles, index, kIntersection, clocks(tested, machine_.intersection_lanes)});
    }
  }

  static std::uint32_t clocks(std::uint32_t rays, int lanes) {
    return (rays + lanes - 1) / static_cast<std::uint32_t>(lanes);
  }

  /// Lets the packets' steps compete for the units, the caches and the bus, in the order in which they come.
  void run_clocks(const std::vector<std::vector<Step>>& packets, std::size_t rays) {
    std::array<MachineCache, 4> caches{MachineCache(machine_.node_lines), MachineCache(machine_.leaf_lines),
                                       MachineCache(machine_.list_lines), MachineCache(machine_.triangle_lines)};
    constexpr std::array<int, 4> kBytes{16, 64, 64, 64};
    std::array<double, kUnits> free{}, busy{};
    double bus_free = 0, bus_busy = 0, end = 0;
    struct Event {
      double at;
      std::size_t context;
      bool fetched;
      bool operator>(const Event& other) const { return at > other.at || (at == other.at && context > other.context); }
    };
    struct Context {
      std::size_t packet, step;
    };
    std::vector<Context> contexts;
    std::priority_queue<Event, std::vector<Event>, std::greater<>> events;
    std::size_t next = 0;
    const auto start_packet = [&](std::size_t context, double at) {
      while (next < packets.size() && packets[next].empty()) ++next;
      if (next == packets.size()) return;
      contexts[context] = {next++, 0};
      events.push({at, context, false});
    };
    contexts.resize(machine_.packets);
    for (std::size_t context = 0; context < contexts.size(); ++context) start_packet(context, 0);
    const auto transfer = [&](double at, double bytes) {
      const double begin = std::max(at, bus_free), length = bytes / MachineMemory::kBytesPerClock;
      bus_free = begin + length;
      bus_busy += length;
      return bus_free;
    };
    while (!events.empty()) {
      const Event event = events.top();
      events.pop();
      Context& context = contexts[event.context];
      const std::vector<Step>& steps = packets[context.packet];
      const Step& step = steps[context.step];
      if (!event.fetched) {
        double data = event.at;
        if (step.section != kNothing && !caches[step.section].look_up(step.index)) {
          totals_.bytes += kBytes[step.section];
          data = transfer(event.at, kBytes[step.section]) + MachineMemory::kLatency;
        }
        events.push({data, event.context, true});
        continue;
      }
      const double begin = std::max(event.at, free[step.unit]);
      free[step.unit] = begin + step.busy;
      busy[step.unit] += step.busy;
      const double done = free[step.unit] + kDepth[step.unit];
      end = std::max(end, done);
      if (++context.step < steps.size()) {
        events.push({done, event.context, false});
      } else {
        start_packet(event.context, done);
      }
    }
    // Rays come in and hits go out over the same bus.
    bus_busy += static_cast<double>(rays) * 8 * (kRayWords + kHitWords) / MachineMemory::kBytesPerClock;
    totals_.clocks += std::max(end, bus_busy);
    totals_.traversal += busy[kTraversal];
    totals_.list += busy[kList];
    totals_.intersection += busy[kIntersection];
    totals_.bus += bus_busy;
    totals_.node_hits = caches[kNodes].hit_rate();
    totals_.leaf_hits = caches[kLeaves].hit_rate();
    totals_.list_hits = caches[kLists].hit_rate();
    totals_.triangle_hits = caches[kTriangles].hit_rate();
  }

  const MemoryImage& image_;
  PacketMachine machine_;
  PacketTotals totals_;
};

PacketMachine machine_of(const std::string& argument) {
  PacketMachine machine;
  if (argument.empty()) return machine;
  const auto [end, status] = std::from_chars(argument.data(), argument.data() + argument.size(), machine.rays);
  if (status != std::errc() || end != argument.data() + argument.size() || machine.rays < 1 || machine.rays > 1024)
    throw UsageError("engine packets takes the rays of a packet, 1 to 1024, not '" + argument + "'");
  return machine;
}

CoreReport report_of(const Engine& engine) {
  const PacketTotals& t = dynamic_cast<const PacketEngine&>(engine).totals();
  CoreReport report;
  report.configuration = "model";
  report.rays = t.rays;
  report.clocks = static_cast<std::uint64_t>(std::llround(t.clocks));
  report.steps = t.ray_nodes;
  report.bytes = t.bytes;
  report.hit_rates = {
      {"node", t.node_hits}, {"leaf", t.leaf_hits}, {"list", t.list_hits}, {"triangle", t.triangle_hits}};
  const auto unit = [&](const char* name, double busy) -> CoreReport::Unit {
    return {name, t.clocks > 0 ? busy / t.clocks : 0, t.clocks > 0 ? 1 - busy / t.clocks : 1, 0};
  };
  report.units = {unit("traversal", t.traversal), unit("list", t.list), unit("intersection", t.intersection),
                  unit("bus", t.bus)};
  return report;
}

}  // namespace

std::unique_ptr<PacketEngine> make_packet_engine(const MemoryImage& image, const PacketMachine& machine) {
  return std::make_unique<Packets>(image, machine);
}

EngineKind packet_engine_kind() {
  EngineKind kind;
  kind.name = "packets";
  kind.same_hits = "packets";
  kind.help = "static SaarCOR (2002), packets of rays with a stack, as a cycle model; argument: rays a packet";
  kind.takes_argument = true;
  kind.stack = true;
  kind.check = [](const std::string& argument) { machine_of(argument); };
  kind.make = [](const GridScene&, const MemoryImage& image, const std::string& argument) -> std::unique_ptr<Engine> {
    return make_packet_engine(image, machine_of(argument));
  };
  kind.report = report_of;
  kind.summary = [](const Engine& engine) {
    const PacketTotals& t = dynamic_cast<const PacketEngine&>(engine).totals();
    const auto rays = static_cast<double>(std::max<std::uint64_t>(t.rays, 1));
    char text[300];
    std::snprintf(text, sizeof text,
                  "packets: %.1f clocks and %.1f bytes a ray (model), %.1f nodes and %.1f tests a ray, %.1f nodes and "
                  "%.1f triangles a packet",
                  t.clocks / rays, static_cast<double>(t.bytes) / rays, static_cast<double>(t.ray_nodes) / rays,
                  static_cast<double>(t.tests) / rays,
                  static_cast<double>(t.nodes) / static_cast<double>(std::max<std::uint64_t>(t.packets, 1)),
                  static_cast<double>(t.triangles) / static_cast<double>(std::max<std::uint64_t>(t.packets, 1)));
    return std::string(text);
  };
  return kind;
}

}  // namespace retrace
