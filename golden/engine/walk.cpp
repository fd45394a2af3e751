// See walk.hpp.
#include "walk.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "golden/contract/contract_records.hpp"

namespace retrace {
namespace {

constexpr double kPositionUnit = 1.0 / (1 << contract::kPositionFrac), kTUnit = 1.0 / (1 << contract::kTLimitFrac);

using Words = std::span<const std::uint64_t>;

/// Reads a record and writes it again, so that bits beyond its fields are 0.
template <typename Record>
Record read(Words words, std::vector<std::uint64_t>& kept) {
  const Record record = Record::unpack(words.data());
  kept.resize(Record::kWords);
  record.pack(kept.data());
  return record;
}

StageValue choice(const char* name, double value) { return {name, value, true}; }
StageValue measure(const char* name, double value) { return {name, value, false}; }

std::string shown(const StageValue& value) {
  char text[64];
  std::snprintf(text, sizeof text, value.choice ? "%.0f" : "%.9f", value.value);
  return text;
}

/// Compares call by call; `differ` says why two calls of the same stage differ, or nothing.
template <typename Differ>
Parting first_parting(const Walk& a, const Walk& b, Differ differ) {
  const std::size_t both = std::min(a.calls.size(), b.calls.size());
  for (std::size_t i = 0; i < both; ++i) {
    if (a.calls[i].stage != b.calls[i].stage)
      return {i, true, std::string(to_string(a.calls[i].stage)) + " against " + to_string(b.calls[i].stage)};
    const std::string why = differ(a.calls[i], b.calls[i]);
    if (!why.empty()) return {i, true, std::string(to_string(a.calls[i].stage)) + ": " + why};
  }
  if (a.calls.size() != b.calls.size()) {
    return {both, true, std::to_string(a.calls.size()) + " steps against " + std::to_string(b.calls.size())};
  }
  return {both, false, {}};
}

template <typename Record>
std::string first_field(Words a, Words b, const char* side) {
  Record first = Record::unpack(a.data()), second = Record::unpack(b.data());
  std::vector<std::pair<std::string, std::int64_t>> fields;
  first.visit(
      [&](const std::string& name, auto& value, int) { fields.emplace_back(name, static_cast<std::int64_t>(value)); });
  std::size_t next = 0;
  std::string why;
  second.visit([&](const std::string& name, auto& value, int) {
    const std::int64_t expected = fields[next++].second, seen = static_cast<std::int64_t>(value);
    if (why.empty() && seen != expected)
      why = std::string(side) + " " + name + " = " + std::to_string(expected) + " against " + std::to_string(seen);
  });
  return why;
}

template <typename In, typename Out>
std::string first_bits(const StageCall& a, const StageCall& b) {
  std::string why = first_field<In>(a.input, b.input, "input");
  return why.empty() ? first_field<Out>(a.output, b.output, "output") : why;
}

std::string first_bits_of(const StageCall& a, const StageCall& b) {
  using namespace contract;
  switch (a.stage) {
    case Stage::kRaySetup:
      return first_bits<RaySetupInRecord, RaySetupOutRecord>(a, b);
    case Stage::kKdDescend:
      return first_bits<KdDescendInRecord, KdDescendOutRecord>(a, b);
    case Stage::kLeafExit:
      return first_bits<LeafExitInRecord, LeafExitOutRecord>(a, b);
    case Stage::kTriTest:
      return first_bits<TriTestInRecord, TriTestOutRecord>(a, b);
    case Stage::kKdBacktrack:
      return first_bits<KdBacktrackInRecord, KdBacktrackOutRecord>(a, b);
    case Stage::kHitFinish:
      if (const auto in = HitFinishInRecord::unpack(a.input.data());
          in.status != kStatusHit && in.status == HitFinishInRecord::unpack(b.input.data()).status)
        return first_field<HitRecord>(a.output, b.output, "output");
      return first_bits<HitFinishInRecord, HitRecord>(a, b);
    case Stage::kInstanceEnter:
      return first_bits<InstanceEnterInRecord, InstanceEnterOutRecord>(a, b);
  }
  return {};
}

}  // namespace

Walk Engine::walk(const GridRay&, const TraceOptions&) { throw Error("engine " + name() + " does not show its walk"); }

const char* to_string(Stage stage) {
  constexpr std::array<const char*, kStages> kNames = {"ray_setup",    "kd_descend", "leaf_exit",     "tri_test",
                                                       "kd_backtrack", "hit_finish", "instance_enter"};
  return kNames[static_cast<std::size_t>(stage)];
}

const StageValue* StageCall::find(std::string_view name) const {
  const auto found = std::find_if(values.begin(), values.end(), [&](const StageValue& v) { return name == v.name; });
  return found == values.end() ? nullptr : &*found;
}

double StageCall::value(std::string_view name) const {
  const StageValue* found = find(name);
  return found != nullptr ? found->value : 0.0;
}

StageWords words_of(Stage stage) {
  using namespace contract;
  switch (stage) {
    case Stage::kRaySetup:
      return {RaySetupInRecord::kWords, RaySetupOutRecord::kWords};
    case Stage::kKdDescend:
      return {KdDescendInRecord::kWords, KdDescendOutRecord::kWords};
    case Stage::kLeafExit:
      return {LeafExitInRecord::kWords, LeafExitOutRecord::kWords};
    case Stage::kTriTest:
      return {TriTestInRecord::kWords, TriTestOutRecord::kWords};
    case Stage::kKdBacktrack:
      return {KdBacktrackInRecord::kWords, KdBacktrackOutRecord::kWords};
    case Stage::kHitFinish:
      return {HitFinishInRecord::kWords, HitRecord::kWords};
    case Stage::kInstanceEnter:
      return {InstanceEnterInRecord::kWords, InstanceEnterOutRecord::kWords};
  }
  return {0, 0};
}

StageCall read_stage_call(Stage stage, Words input, Words output) {
  using namespace contract;
  const StageWords words = words_of(stage);
  if (input.size() < words.input || output.size() < words.output)
    throw Error(std::string("records of ") + to_string(stage) + " are too short");
  StageCall call;
  call.stage = stage;
  switch (stage) {
    case Stage::kRaySetup: {
      const auto in = read<RaySetupInRecord>(input, call.input);
      const auto out = read<RaySetupOutRecord>(output, call.output);
      constexpr std::array<const char*, 3> kOrigin = {"origin_x", "origin_y", "origin_z"},
                                           kDirection = {"direction_x", "direction_y", "direction_z"};
      for (std::size_t i = 0; i < 3; ++i) call.values.push_back(measure(kOrigin[i], in.origin[i] * kPositionUnit));
      for (std::size_t i = 0; i < 3; ++i)
        call.values.push_back(measure(kDirection[i], in.direction[i] * (1.0 / (1 << kDirectionFrac))));
      call.values.push_back(choice("valid", out.valid));
      break;
    }
    case Stage::kKdDescend: {
      const auto in = read<KdDescendInRecord>(input, call.input);
      const auto out = read<KdDescendOutRecord>(output, call.output);
      call.values = {measure("split", in.split * kPositionUnit), measure("t", in.t * kTUnit), choice("node", out.node)};
      break;
    }
    case Stage::kLeafExit: {
      const auto in = read<LeafExitInRecord>(input, call.input);
      const auto out = read<LeafExitOutRecord>(output, call.output);
      constexpr std::array<const char*, 6> kBound = {"low_x", "high_x", "low_y", "high_y", "low_z", "high_z"};
      for (std::size_t i = 0; i < 6; ++i) call.values.push_back(measure(kBound[i], in.bound[i] * kPositionUnit));
      call.values.push_back(measure("t", in.t * kTUnit));
      call.values.push_back(measure("t_exit", out.t_exit * kTUnit));
      call.values.push_back(choice("face", out.face));
      break;
    }
    case Stage::kTriTest: {
      read<TriTestInRecord>(input, call.input);
      const auto out = read<TriTestOutRecord>(output, call.output);
      call.values = {choice("triangle", out.id), choice("hit", out.hit)};
      if (out.hit != 0) call.values.push_back(measure("t", out.t * kTUnit));
      break;
    }
    case Stage::kKdBacktrack: {
      const auto in = read<KdBacktrackInRecord>(input, call.input);
      const auto out = read<KdBacktrackOutRecord>(output, call.output);
      call.values = {choice("from", in.node), choice("parent", in.parent), choice("matched", out.matched)};
      if (out.matched != 0) call.values.push_back(choice("node", out.node));
      break;
    }
    case Stage::kHitFinish: {
      read<HitFinishInRecord>(input, call.input);
      const auto out = read<HitRecord>(output, call.output);
      call.values = {choice("status", out.status)};
      if (out.status != kStatusHit) break;
      call.values.push_back(choice("triangle", out.id));
      call.values.push_back(measure("t", out.t * kTUnit));
      call.values.push_back(measure("u", out.u * (1.0 / (1 << kBarycentricFrac))));
      call.values.push_back(measure("v", out.v * (1.0 / (1 << kBarycentricFrac))));
      break;
    }
    case Stage::kInstanceEnter: {
      read<InstanceEnterInRecord>(input, call.input);
      const auto out = read<InstanceEnterOutRecord>(output, call.output);
      call.values = {choice("enters", out.enters)};
      if (out.enters == 0) break;
      call.values.push_back(choice("scale", out.scale));
      call.values.push_back(measure("start", out.start * (1.0 / (1 << kEntryStartFrac))));
      constexpr std::array<const char*, 3> kOrigin = {"origin_x", "origin_y", "origin_z"};
      for (std::size_t i = 0; i < 3; ++i) call.values.push_back(measure(kOrigin[i], out.origin[i] * kPositionUnit));
      break;
    }
  }
  return call;
}

void find_levels(std::vector<StageCall>& calls) {
  constexpr std::array<const char*, 8> kPlace = {"low_x", "high_x", "low_y", "high_y",
                                                 "low_z", "high_z", "t",     "t_exit"};
  const StageCall* leaf = nullptr;  // the last one of the top level
  int level = 0;
  for (StageCall& call : calls) {
    if (call.stage == Stage::kLeafExit) {
      if (level == 1 && leaf != nullptr &&
          std::ranges::all_of(kPlace, [&](const char* name) { return call.value(name) == leaf->value(name); }))
        level = 0;
      if (level == 0) leaf = &call;
    }
    if (call.stage == Stage::kHitFinish) level = 0;
    call.level = level;
    if (call.stage == Stage::kInstanceEnter && call.value("enters") != 0) level = 1;
  }
}

std::vector<contract::InstanceRecord> instances_of(std::span<const std::uint64_t> image) {
  const auto header = contract::HeaderRecord::unpack(image.data());
  std::vector<contract::InstanceRecord> instances;
  if (header.version != static_cast<std::uint32_t>(contract::kImageVersionTwoLevels)) return instances;
  std::size_t at = std::size_t{header.instance_offset} * MemoryImage::kLineWords;
  for (std::uint32_t i = 0; i < header.instance_count; ++i, at += contract::InstanceRecord::kWords) {
    if (at + contract::InstanceRecord::kWords > image.size()) break;
    instances.push_back(contract::InstanceRecord::unpack(image.data() + at));
  }
  return instances;
}

void name_instance(StageCall& call, const contract::InstanceEnterInRecord& in,
                   std::span<const contract::InstanceRecord> instances) {
  const auto found = std::ranges::find_if(instances, [&](const contract::InstanceRecord& record) {
    return record.m == in.m && record.b == in.b && record.e == in.e && record.box == in.box;
  });
  call.values.insert(call.values.begin(), choice("instance", static_cast<double>(found - instances.begin())));
}

bool agree_in_bits(const StageCall& a, const StageCall& b) { return a.stage == b.stage && first_bits_of(a, b).empty(); }

Parting first_parting_in_bits(const Walk& a, const Walk& b) { return first_parting(a, b, first_bits_of); }

Parting first_parting_in_choices(const Walk& a, const Walk& b) {
  return first_parting(a, b, [](const StageCall& x, const StageCall& y) -> std::string {
    for (const StageValue& value : x.values) {
      if (!value.choice) continue;
      const StageValue* other = y.find(value.name);
      if (other != nullptr && other->value == value.value) continue;
      return std::string(value.name) + " " + shown(value) + " against " + (other != nullptr ? shown(*other) : "none");
    }
    return {};
  });
}

}  // namespace retrace
