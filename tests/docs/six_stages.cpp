// six_stages SCENE WIDTHxHEIGHT X,Y: one primary ray through the six stages of the kernel, with a record of every call, as JSON.
//
// The walk climbs parent links, so that all six stages have something to do. It is the kernel's own (Engine::walk); beside each call stands what the
// golden stage makes of the same in double precision. The hit and the work of the walk must be those of the traced ray; otherwise the exit code
// is 1. docs/one-ray.md is made of it (scripts/one_ray.py).
#include <algorithm>
#include <array>
#include <cstdio>
#include <deque>
#include <iostream>
#include <nlohmann/json.hpp>
#include <string>

#include "golden/engine/stages/hit_finish.hpp"
#include "golden/engine/stages/kd_backtrack.hpp"
#include "golden/engine/stages/kd_descend.hpp"
#include "golden/engine/stages/leaf_exit.hpp"
#include "golden/engine/stages/ray_setup.hpp"
#include "golden/engine/stages/tri_test.hpp"
#include "golden/engine/walk.hpp"
#include "golden/render/view.hpp"
#include "golden/tree/traced_scene.hpp"
#include "scenes/open_scene.hpp"
#include "testbench/csim/csim_engine.hpp"
#include "testbench/kit/command_line.hpp"
#include "testbench/kit/stage_inputs.hpp"

namespace retrace {
namespace {

using Json = nlohmann::ordered_json;

/// The fields of a record; those that occur more than once (elements of an array) as a list.
template <typename Record>
Json fields(Record record) {
  Json result = Json::object();
  record.visit([&](const std::string& name, auto value, int) {
    const std::string stem = name.substr(0, name.find('['));
    if (stem == name && !result.contains(name)) {
      result[name] = value;
    } else {
      Json& list = result[stem];
      if (!list.is_array()) list = list.is_null() ? Json::array() : Json::array({list});
      list.push_back(value);
    }
  });
  return result;
}

constexpr double unit(int fraction_bits) { return 1.0 / static_cast<double>(1 << fraction_bits); }
double position(std::int32_t code) { return code * unit(contract::kPositionFrac); }

Json list(const glm::dvec3& x) { return Json::array({x.x, x.y, x.z}); }

/// The calls of a walk of the kernel as JSON: records of each, and beside them what golden makes of the same.
class Shown {
 public:
  Shown(const GridScene& scene, const MemoryImage& image, const contract::RayRecord& ray, const Walk& walk)
      : scene_(scene), image_(image), ray_(golden::ray_setup(ray)) {
    for (const StageCall& call : walk.calls) show(call);
  }

  const Json& calls() const { return calls_; }

 private:
  template <typename In, typename Out>
  std::pair<In, Out> record(const StageCall& call) {
    const std::pair<In, Out> records{In::unpack(call.input.data()), Out::unpack(call.output.data())};
    calls_.push_back(
        {{"stage", to_string(call.stage)}, {"in", fields(records.first)}, {"out", fields(records.second)}});
    return records;
  }
  Json& now() { return calls_.back(); }

  void show(const StageCall& call) {
    using namespace contract;
    switch (call.stage) {
      case Stage::kRaySetup:
        record<RaySetupInRecord, RaySetupOutRecord>(call);
        now()["golden"] = {{"reciprocal", list(ray_.reciprocal)}};
        break;
      case Stage::kKdDescend: {
        const auto [in, out] = record<KdDescendInRecord, KdDescendOutRecord>(call);
        const std::uint32_t axis = node_of(image_, node_).axis;
        const double plane = golden::t_plane(ray_, static_cast<int>(axis), position(in.split));
        const std::uint32_t child =
            golden::kd_descend(ray_, static_cast<int>(axis), plane, 2 * in.child, in.t * unit(kTFrac));
        now()["golden"] = {{"node", child}, {"t_plane", plane}};
        now()["node"] = node_;
        now()["axis"] = axis;
        node_ = out.node;
        break;
      }
      case Stage::kLeafExit: {
        const auto [in, out] = record<LeafExitInRecord, LeafExitOutRecord>(call);
        std::array<double, 6> bound{};
        for (std::size_t face = 0; face < 6; ++face) bound[face] = position(in.bound[face]);
        const golden::LeafExit exit = golden::leaf_exit(ray_, bound);
        now()["golden"] = {{"t_exit", exit.t_exit}, {"face", exit.face}};
        now()["node"] = node_;
        now()["count"] = image_.leaf(node_of(image_, node_).child).count;
        break;
      }
      case Stage::kTriTest: {
        const auto [in, out] = record<TriTestInRecord, TriTestOutRecord>(call);
        std::array<int, 3> order{};
        const GridTriangle& triangle = *find_triangle(scene_.triangles, in.id);
        make_unit_triangle(triangle, &order);
        const golden::Triangle& exact = triangles_.emplace_back(golden::make_triangle(triangle, order));
        golden::Candidate candidate{};
        const bool hit = golden::tri_test(exact, ray_, ray_.t_max, candidate);
        now()["golden"] = {{"hit", hit}};
        if (hit) now()["golden"]["t"] = candidate.t;
        if (hit && golden::is_nearer(candidate, best_, ray_)) best_ = candidate;
        break;
      }
      case Stage::kKdBacktrack: {
        const auto [in, out] = record<KdBacktrackInRecord, KdBacktrackOutRecord>(call);
        now()["golden"] = {{"matched", golden::kd_backtrack(static_cast<int>(in.face), in.plane, in.node,
                                                            static_cast<int>(in.parent_axis), in.parent_split)}};
        node_ = out.node;
        break;
      }
      case Stage::kInstanceEnter:  // one level
        break;
      case Stage::kHitFinish: {
        record<HitFinishInRecord, HitRecord>(call);
        now()["golden"] = Json::object();
        if (best_.triangle == nullptr) break;
        const Hit hit = golden::hit_finish(best_);
        now()["golden"] = {{"t", hit.t}, {"id", hit.id}, {"u", hit.u}, {"v", hit.v}};
        break;
      }
    }
  }

  const GridScene& scene_;
  const MemoryImage& image_;
  golden::RayState ray_;
  golden::Candidate best_{};
  std::deque<golden::Triangle> triangles_;  ///< candidates point into it
  std::uint32_t node_ = 0;
  Json calls_ = Json::array();
};

int show(const std::string& name, int width, int height, int x, int y) {
  const TracedScene scene = prepare_scene(open_scene(name));
  const GridRay ray = quantise(default_view(scene.scene, scene.world).ray(x + 0.5, y + 0.5, width, height),
                               scene.grid.transform, scene.grid.box, false);
  if (ray.outside) throw Error("the ray of this pixel misses the scene");
  auto kernel = make_csim_engine(scene.image);
  const TraceOptions options{.way_up = WayUp::kParentLinks};
  const Walk walk = kernel->walk(ray, options);
  std::array<Hit, 1> hits;
  std::array<RayWork, 1> work;
  kernel->trace({&ray, 1}, hits, work, options);
  const auto calls_of = [&](Stage stage) {
    return std::count_if(walk.calls.begin(), walk.calls.end(), [&](const StageCall& c) { return c.stage == stage; });
  };
  const RayWork& a = work[0];
  if (walk.calls.empty() || !std::ranges::equal(walk.calls.back().output, kernel->raw_hits()) ||
      calls_of(Stage::kKdDescend) != a.down || calls_of(Stage::kKdBacktrack) != a.up ||
      calls_of(Stage::kLeafExit) != a.leaf || calls_of(Stage::kTriTest) != a.tests)
    throw Error("the stages, one by one, do not give what the kernel gives");

  const Json result{{"scene", name},
                    {"size", {width, height}},
                    {"pixel", {x, y}},
                    {"triangles", scene.grid.triangles.size()},
                    {"box", scene.grid.box},
                    {"work", {{"down", a.down}, {"up", a.up}, {"leaf", a.leaf}, {"tests", a.tests}}},
                    {"calls", Shown(scene.grid, scene.image, ray.record, walk).calls()}};
  std::cout << result.dump(1) << '\n';
  return std::cout.flush() ? 0 : 1;
}

}  // namespace
}  // namespace retrace

int main(int argc, char** argv) {
  using namespace retrace;
  std::string scene;
  ImageSize size;
  std::pair<int, int> pixel;
  CLI::App app("The values of one ray in each of the six stages, as JSON.", "six_stages");
  app.add_option("scene", scene, "A generated scene")->required();
  add_size(app, "size", size, 4096, "Of the picture")->required();
  add_pair(app, "pixel", pixel, ',', "Whose ray")->required();
  return run_program(app, argc, argv, [&] {
    if (pixel.first >= size.width || pixel.second >= size.height) throw Error("there is no such pixel");
    return show(scene, size.width, size.height, pixel.first, pixel.second);
  });
}
