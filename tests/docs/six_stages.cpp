// six_stages SCENE WIDTHxHEIGHT X,Y: one primary ray through the six stages of the kernel, with a record of every call, as JSON.
//
// The walk climbs parent links, so that all six stages have something to do. Each step calls the stage function that is synthesized, on the
// records of the number contract, and beside it the golden stage in double precision. At the end the hit and the work of the ray must be
// those of the whole kernel; otherwise the exit code is 1. docs/one-ray.md is made of it (scripts/one_ray.py).
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
#include "golden/render/view.hpp"
#include "golden/tree/kd_builder.hpp"
#include "hls/stages/hit_finish.hpp"
#include "hls/stages/kd_backtrack.hpp"
#include "hls/stages/kd_descend.hpp"
#include "hls/stages/leaf_exit.hpp"
#include "hls/stages/ray_setup.hpp"
#include "hls/stages/tri_test.hpp"
#include "scenes/open_scene.hpp"
#include "testbench/csim/csim_engine.hpp"
#include "tests/stages/stage_test.hpp"

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

struct Node {
  std::int32_t split = 0;
  std::uint32_t axis = 0, child = 0;
};

Node node_of(const MemoryImage& image, std::uint32_t node) {
  const contract::NodePairRecord pair = image.pair(node >> 1);
  if ((node & 1) != 0) return {pair.right_split, pair.right_axis, pair.right_child};
  return {pair.left_split, pair.left_axis, pair.left_child};
}

/// One ray on its way; every call of a stage adds a record to calls().
class Walk {
 public:
  Walk(const GridScene& scene, const MemoryImage& image, const contract::RayRecord& ray)
      : scene_(scene), image_(image), golden_(golden::ray_setup(ray)) {
    contract::RaySetupInRecord in;
    in.origin = ray.origin;
    in.direction = ray.direction;
    in.t_max = ray.t_max;
    in.any = ray.any;
    in.box = scene.box;
    state_ = RETRACE_RUN_STAGE(RaySetupIn, ray_setup_in, RaySetupOut, ray_setup_out, ray_setup, in);
    record("ray_setup", in, state_, {{"reciprocal", list(golden_.reciprocal)}});
    best_.t = ray.t_max;
  }

  void run() {
    std::uint32_t node = 0;
    for (;;) {
      while (node_of(image_, node).axis != contract::kAxisLeaf) node = descend(node);
      const contract::LeafRecord leaf = image_.leaf(node_of(image_, node).child);
      const contract::LeafExitOutRecord exit = leave(leaf, node);
      for (std::uint32_t i = 0; i < leaf.count; ++i) test(image_.triangle(image_.reference(leaf, i)));
      if (exit.exits == 0 || best_.t <= static_cast<std::uint32_t>(exit.t_exit)) break;
      t_ = exit.t_exit;
      if (node == 0 || !climb(node, leaf.parent, exit)) break;
    }
    finish();
  }

  const Json& calls() const { return calls_; }
  const contract::HitRecord& hit() const { return hit_; }
  const RayWork& work() const { return work_; }

 private:
  static Json list(const glm::dvec3& x) { return Json::array({x.x, x.y, x.z}); }

  template <typename In, typename Out>
  void record(const char* stage, const In& in, const Out& out, const Json& golden) {
    calls_.push_back({{"stage", stage}, {"in", fields(in)}, {"out", fields(out)}, {"golden", golden}});
  }

  std::uint32_t descend(std::uint32_t node) {
    const Node here = node_of(image_, node);
    const std::size_t axis = here.axis;
    contract::KdDescendInRecord in;
    in.split = here.split;
    in.child = here.child;
    in.origin = state_.origin[axis];
    in.reciprocal = state_.reciprocal[axis];
    in.shift = state_.shift[axis];
    in.zero = state_.zero[axis];
    in.negative = state_.negative[axis];
    in.t = t_;
    const auto out = RETRACE_RUN_STAGE(KdDescendIn, kd_descend_in, KdDescendOut, kd_descend_out, kd_descend, in);
    const int place = static_cast<int>(axis);
    const double plane = golden::t_plane(golden_, place, position(here.split));
    const std::uint32_t child = golden::kd_descend(golden_, place, plane, 2 * here.child, t_ * unit(contract::kTFrac));
    record("kd_descend", in, out, {{"node", child}, {"t_plane", plane}});
    calls_.back()["node"] = node;
    calls_.back()["axis"] = axis;
    ++work_.down;
    return out.node;
  }

  contract::LeafExitOutRecord leave(const contract::LeafRecord& leaf, std::uint32_t node) {
    contract::LeafExitInRecord in;
    in.bound = leaf.bound;
    in.origin = state_.origin;
    in.reciprocal = state_.reciprocal;
    in.shift = state_.shift;
    in.zero = state_.zero;
    in.negative = state_.negative;
    in.t = t_;
    const auto out = RETRACE_RUN_STAGE(LeafExitIn, leaf_exit_in, LeafExitOut, leaf_exit_out, leaf_exit, in);
    std::array<double, 6> bound{};
    for (std::size_t face = 0; face < 6; ++face) bound[face] = position(leaf.bound[face]);
    const golden::LeafExit exit = golden::leaf_exit(golden_, bound);
    record("leaf_exit", in, out, {{"t_exit", exit.t_exit}, {"face", exit.face}});
    calls_.back()["node"] = node;
    calls_.back()["count"] = leaf.count;
    ++work_.leaf;
    return out;
  }

  void test(const contract::TriangleRecord& triangle) {
    contract::TriTestInRecord in;
    in.u = triangle.u;
    in.v = triangle.v;
    in.n = triangle.n;
    in.offset_u = triangle.offset_u;
    in.offset_v = triangle.offset_v;
    in.offset_n = triangle.offset_n;
    in.exponent_u = triangle.exponent_u;
    in.exponent_v = triangle.exponent_v;
    in.id = triangle.id;
    in.origin = state_.origin;
    in.direction = state_.direction;
    const auto out = RETRACE_RUN_STAGE(TriTestIn, tri_test_in, TriTestOut, tri_test_out, tri_test, in);
    const golden::Triangle& exact = triangles_.emplace_back(make(triangle.id));
    golden::Candidate candidate{};
    const bool hit = golden::tri_test(exact, golden_, golden_.t_max, candidate);
    Json beside{{"hit", hit}};
    if (hit) beside["t"] = candidate.t;
    record("tri_test", in, out, beside);
    ++work_.tests;
    if (out.hit != 0 && (out.t < best_.t || (out.t == best_.t && out.id < best_.id))) {
      best_.status = contract::kStatusHit;
      best_.t = out.t;
      best_.id = out.id;
      best_.edge_u = out.edge_u;
      best_.edge_v = out.edge_v;
      best_.dz = out.dz;
      best_.exponent_u = out.exponent_u;
      best_.exponent_v = out.exponent_v;
    }
    if (hit && golden::is_nearer(candidate, golden_best_, golden_)) golden_best_ = candidate;
  }

  /// Up from `node` to where the walk turns, and to the child there; false if the ray has left the scene.
  bool climb(std::uint32_t& node, std::uint32_t parent, const contract::LeafExitOutRecord& exit) {
    for (;;) {
      const Node above = node_of(image_, parent);
      contract::KdBacktrackInRecord in;
      in.face = exit.face;
      in.plane = exit.plane;
      in.node = node;
      in.parent = parent;
      in.parent_split = above.split;
      in.parent_axis = above.axis;
      in.parent_child = above.child;
      const auto out =
          RETRACE_RUN_STAGE(KdBacktrackIn, kd_backtrack_in, KdBacktrackOut, kd_backtrack_out, kd_backtrack, in);
      record("kd_backtrack", in, out,
             {{"matched", golden::kd_backtrack(static_cast<int>(exit.face), exit.plane, node,
                                               static_cast<int>(above.axis), above.split)}});
      ++work_.up;
      node = out.node;
      if (out.finished != 0 || out.bad != 0) return false;
      if (out.matched != 0) return true;
      parent = image_.pair(parent >> 1).parent;
    }
  }

  void finish() {
    hit_ = RETRACE_RUN_STAGE(HitFinishIn, hit_finish_in, Hit, hit, hit_finish, best_);
    Json beside = Json::object();
    if (golden_best_.triangle != nullptr) {
      const Hit golden = golden::hit_finish(golden_best_);
      beside = {{"t", golden.t}, {"id", golden.id}, {"u", golden.u}, {"v", golden.v}};
    }
    record("hit_finish", best_, hit_, beside);
  }

  golden::Triangle make(std::uint32_t id) const {
    for (const GridTriangle& triangle : scene_.triangles) {
      if (triangle.id != id) continue;
      std::array<int, 3> order{};
      make_unit_triangle(triangle, &order);
      return golden::make_triangle(triangle, order);
    }
    throw Error("no triangle " + std::to_string(id));
  }

  const GridScene& scene_;
  const MemoryImage& image_;
  golden::RayState golden_;
  contract::RaySetupOutRecord state_;
  std::int32_t t_ = 0;
  contract::HitFinishInRecord best_{.status = contract::kStatusMiss, .id = contract::kNoTriangle};
  golden::Candidate golden_best_{};
  std::deque<golden::Triangle> triangles_;  ///< candidates point into it
  contract::HitRecord hit_;
  RayWork work_;
  Json calls_ = Json::array();
};

int show(const std::string& name, int width, int height, int x, int y) {
  const Scene scene = open_scene(name);
  const WorldTriangles world = flatten(scene);
  const GridScene grid = snap(world);
  const MemoryImage image = build_kd(grid);
  const GridRay ray =
      quantise(default_view(scene, world).ray(x + 0.5, y + 0.5, width, height), grid.transform, grid.box, false);
  if (ray.outside) throw Error("the ray of this pixel misses the scene");
  Walk walk(grid, image, ray.record);
  walk.run();

  auto kernel = make_csim_engine(image);
  std::array<Hit, 1> hits;
  std::array<RayWork, 1> work;
  kernel->trace({&ray, 1}, hits, work, {.way_up = WayUp::kParentLinks});
  std::uint64_t raw[2]{};
  walk.hit().pack(raw);
  const RayWork &a = walk.work(), &b = work[0];
  if (raw[0] != kernel->raw_hits()[0] || raw[1] != kernel->raw_hits()[1] || a.down != b.down || a.up != b.up ||
      a.leaf != b.leaf || a.tests != b.tests)
    throw Error("the stages, one by one, do not give what the kernel gives");

  const Json result{
      {"scene", name},        {"size", {width, height}},
      {"pixel", {x, y}},      {"triangles", grid.triangles.size()},
      {"box", grid.box},      {"work", {{"down", a.down}, {"up", a.up}, {"leaf", a.leaf}, {"tests", a.tests}}},
      {"calls", walk.calls()}};
  std::cout << result.dump(1) << '\n';
  return std::cout.flush() ? 0 : 1;
}

}  // namespace
}  // namespace retrace

int main(int argc, char** argv) {
  int width = 0, height = 0, x = 0, y = 0;
  char rest = 0;
  if (argc != 4 || std::sscanf(argv[2], "%dx%d%c", &width, &height, &rest) != 2 ||
      std::sscanf(argv[3], "%d,%d%c", &x, &y, &rest) != 2 || width < 1 || height < 1 || x < 0 || y < 0 || x >= width ||
      y >= height) {
    std::fprintf(stderr, "usage: six_stages SCENE WIDTHxHEIGHT X,Y\n");
    return 2;
  }
  try {
    return retrace::show(argv[1], width, height, x, y);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "six_stages: error: %s\n", error.what());
    return 1;
  }
}
