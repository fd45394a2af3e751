// The 13 instructions of the literature (unit_triangle.asm) as an intersection program, against the exact test, on scenes: the same decision for every ray
// and triangle outside of a band, which is the first-order bound of the program's own rounding; rays through edges of closed meshes leak, counted.
// RETRACE_RAYS sets the number of rays a scene.
#include <gtest/gtest.h>

#include <cinttypes>
#include <cmath>
#include <fstream>
#include <iterator>

#include "golden/engine/stages/tri_test.hpp"
#include "golden/shader/assembler.hpp"
#include "golden/shader/float.hpp"
#include "golden/shader/machine.hpp"
#include "golden/tree/kd_builder.hpp"
#include "golden/tree/traced_scene.hpp"
#include "scenes/generators.hpp"
#include "testbench/kit/closed_meshes.hpp"

namespace retrace {
namespace {

constexpr double kUnit = 1.0 / (1 << contract::kPositionFrac);
constexpr double kRound = 0x1p-24;

/// Rows and offsets of the transformation that makes a triangle the unit triangle.
using Rows = std::array<std::array<double, 4>, 3>;
Rows rows_of(const golden::Triangle& triangle) {
  const double square = glm::dot(triangle.n, triangle.n);
  const std::array<glm::dvec3, 3> axes{glm::cross(triangle.e2, triangle.n) / square,
                                       glm::cross(triangle.n, triangle.e1) / square, triangle.n / square};
  Rows rows{};
  for (std::size_t r = 0; r < 3; ++r) rows[r] = {axes[r].x, axes[r].y, axes[r].z, -glm::dot(axes[r], triangle.vertex)};
  return rows;
}

class Program {
 public:
  explicit Program(const GridScene& scene) {
    std::ifstream file(RETRACE_SOURCE_DIR "/golden/shader/programs/unit_triangle.asm");
    const std::string text{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
    const shader::Assembled code = shader::assemble(text, "unit_triangle.asm");
    EXPECT_EQ(code.words.size(), 13u);
    setting_.load(code.words);
    for (const GridTriangle& triangle : scene.triangles) {
      std::array<int, 3> order{};
      make_unit_triangle(triangle, &order);
      triangles.push_back(golden::make_triangle(triangle, order));
      rows.push_back(rows_of(triangles.back()));
      for (const auto& row : rows.back()) {
        shader::Vector vector{};
        for (std::size_t c = 0; c < 4; ++c) vector[c] = golden::float_round(row[c]);
        memory_.push_back(vector);
      }
      memory_.push_back({1, 0, 0, 0});
    }
  }

  /// Whether the program says that the ray hits triangle `index`.
  bool hits(std::size_t index, const golden::RayState& ray) {
    thread_.status = shader::kStatusRunning;
    thread_.place = 0;
    thread_.steps = 0;
    for (std::size_t c = 0; c < 3; ++c) {
      thread_.stack[2][c] = golden::float_round(ray.origin[static_cast<int>(c)]);
      thread_.stack[3][c] = golden::float_round(ray.direction[static_cast<int>(c)]);
    }
    thread_.stack[4] = {0, 0, golden::float_round(ray.t_max), 0};
    thread_.fixed[shader::kRegisterA][1] = static_cast<float>(4 * index);
    thread_.fixed[shader::kRegisterE2] = {};
    shader::run(thread_, setting_, memory_);
    EXPECT_EQ(thread_.status, static_cast<std::uint32_t>(shader::kStatusDone));
    return thread_.fixed[shader::kRegisterE2][0] == 1;
  }

  /// Whether the program's numbers cannot decide: a weight, or t, is as near to its limit as they may be wrong.
  bool in_band(std::size_t index, const golden::RayState& ray) const {
    std::array<double, 3> o{}, d{}, error_o{}, error_d{};
    for (std::size_t r = 0; r < 3; ++r) {
      // Three products, their sums, and the operands are rounded.
      constexpr double kRoundings = 6;
      o[r] = rows[index][r][3];
      error_o[r] = std::abs(o[r]);
      for (std::size_t c = 0; c < 3; ++c) {
        const double from = rows[index][r][c] * ray.origin[static_cast<int>(c)],
                     along = rows[index][r][c] * ray.direction[static_cast<int>(c)];
        o[r] += from;
        error_o[r] += std::abs(from);
        d[r] += along;
        error_d[r] += std::abs(along);
      }
      error_o[r] *= kRoundings * kRound;
      error_d[r] *= kRoundings * kRound;
    }
    if (std::abs(d[2]) <= error_d[2]) return true;
    const double t = -o[2] / d[2];
    const double error_t =
        (error_o[2] + std::abs(t) * error_d[2]) / (std::abs(d[2]) - error_d[2]) + 4 * kRound * std::abs(t);
    std::array<double, 2> weight{}, error{};
    for (std::size_t r = 0; r < 2; ++r) {
      weight[r] = o[r] + t * d[r];
      error[r] = error_o[r] + (std::abs(t) + error_t) * error_d[r] + std::abs(d[r]) * error_t +
                 4 * kRound * (std::abs(o[r]) + std::abs(t * d[r]));
    }
    const double both = error[0] + error[1] + 2 * kRound;
    return std::abs(t) <= error_t || std::abs(ray.t_max - t) <= error_t + kRound * ray.t_max ||
           std::abs(weight[0]) <= error[0] || std::abs(weight[1]) <= error[1] || std::abs(weight[0] - 1) <= error[0] ||
           std::abs(weight[1] - 1) <= error[1] || std::abs(1 - weight[0] - weight[1]) <= both;
  }

  std::vector<golden::Triangle> triangles;
  std::vector<Rows> rows;

 private:
  shader::Setting setting_;
  std::vector<shader::Vector> memory_;
  shader::Thread thread_;
};

std::uint64_t rays_of_a_scene() {
  const char* text = std::getenv("RETRACE_RAYS");
  return text ? std::strtoull(text, nullptr, 0) : 100;
}

/// From a point in the box, at a point near a triangle or on one of its edges.
golden::RayState ray_at(const GridScene& scene, const golden::Triangle& triangle, bool at_edge, Random& random) {
  glm::dvec3 origin;
  for (int axis = 0; axis < 3; ++axis) {
    const auto face = 2 * static_cast<std::size_t>(axis);
    origin[axis] = static_cast<double>(random.integer(scene.box[face], scene.box[face + 1])) * kUnit;
  }
  const double u = at_edge ? random.real(0.0, 1.0) : random.real(-0.5, 1.0);
  const double v = !at_edge ? random.real(-0.5, 1.0) : random.chance(2) ? 0.0 : 1.0 - u;
  const glm::dvec3 target = triangle.vertex + u * triangle.e1 + v * triangle.e2;
  const glm::dvec3 unit = glm::normalize(target - origin);
  contract::RayRecord record;
  for (int axis = 0; axis < 3; ++axis) {
    record.origin[axis] = static_cast<std::int32_t>(std::lround(origin[axis] / kUnit));
    record.direction[axis] = static_cast<std::int32_t>(std::lround(unit[axis] * (1 << contract::kDirectionFrac)));
  }
  record.t_max = std::numeric_limits<std::uint32_t>::max() >> (32 - contract::kTLimitBits);
  return golden::ray_setup(record);
}

TEST(UnitTriangle, decides_as_the_exact_test_outside_of_its_band) {
  const std::uint64_t seed = test_seed();
  Random random(seed);
  struct Case {
    const char* name;
    double most_in_band;  // share of rays not aimed at edges; many needles are thinner than numbers of 24 bits resolve
  };
  for (const auto& [name, most_in_band] :
       {Case{"box", 0.001}, Case{"knot", 0.01}, Case{"room", 0.03}, Case{"slivers", 0.03}, Case{"needles", 0.5}}) {
    const TracedScene scene = snap_scene(make_scene(name));
    Program program(scene.grid);
    std::uint64_t pairs = 0, hits = 0, apart = 0, aimed_pairs = 0, banded = 0;
    const auto compare = [&](std::size_t index, const golden::RayState& ray) {
      golden::Candidate candidate;
      const bool exact = golden::tri_test(program.triangles[index], ray, ray.t_max, candidate);
      ++pairs;
      hits += exact;
      if (exact == program.hits(index, ray)) return true;
      ++apart;
      return program.in_band(index, ray);
    };
    // A few rays at many triangles, and many at the triangle that they are aimed at, one in four of them at an edge of it.
    constexpr std::size_t kMost = 500, kAimed = 100;
    const std::size_t stride = program.triangles.size() / kMost + 1;
    for (std::uint64_t i = 0; i < rays_of_a_scene() * kAimed; ++i) {
      const std::size_t aimed = random.below(program.triangles.size());
      const bool at_edge = random.chance(4);
      const golden::RayState ray = ray_at(scene.grid, program.triangles[aimed], at_edge, random);
      ASSERT_TRUE(compare(aimed, ray)) << name << ", triangle " << program.triangles[aimed].id << ", ray " << i
                                       << ", seed " << seed;
      if (!at_edge) {
        ++aimed_pairs;
        banded += program.in_band(aimed, ray);
      }
      if (i % kAimed != 0) continue;
      for (std::size_t k = stride; k < program.triangles.size(); k += stride) {
        const std::size_t index = (k + aimed) % program.triangles.size();
        ASSERT_TRUE(compare(index, ray)) << name << ", triangle " << program.triangles[index].id << ", ray " << i
                                         << ", seed " << seed;
      }
    }
    std::printf("%s: %" PRIu64 " pairs of a ray and a triangle, %" PRIu64 " hits, %" PRIu64
                " differ, all in the band, which holds %.3f %% of rays not aimed at edges\n",
                name, pairs, hits, apart, 100.0 * static_cast<double>(banded) / static_cast<double>(aimed_pairs));
    EXPECT_LT(static_cast<double>(banded), most_in_band * static_cast<double>(aimed_pairs)) << name;
    EXPECT_GT(hits, rays_of_a_scene() / 10) << name;
  }
}

// A ray through an edge to the last bit hits one of the two triangles exactly; the program decides each by rounded numbers, and may find neither.
TEST(UnitTriangle, leaks_at_edges_are_counted) {
  const std::uint64_t seed = test_seed();
  Random random(seed);
  std::uint64_t rays = 0, leaks = 0, random_rays = 0, random_leaks = 0;
  const auto finds_none = [](Program& program, const golden::RayState& ray) {
    bool exact = false;
    for (const golden::Triangle& triangle : program.triangles) {
      golden::Candidate candidate;
      exact = exact || golden::tri_test(triangle, ray, ray.t_max, candidate);
    }
    EXPECT_TRUE(exact) << "the mesh is closed, and its rays come from inside";
    for (std::size_t i = 0; i < program.triangles.size(); ++i)
      if (program.hits(i, ray)) return false;
    return true;
  };
  for (const char* kind : {"sphere", "random"}) {
    const GridScene scene = make_closed_mesh(kind, 4, random);
    Program program(scene);
    const std::uint64_t count = 4 * rays_of_a_scene();
    const GridPoint origin = inside_closed_mesh(scene, random);
    for (const GridRay& ray : make_exact_edge_rays(scene, origin, count, random)) {
      ++rays;
      leaks += finds_none(program, golden::ray_setup(ray.record));
    }
    for (std::uint64_t i = 0; i < count; ++i) {
      golden::RayState ray = ray_at(scene, program.triangles[random.below(program.triangles.size())], false, random);
      for (int axis = 0; axis < 3; ++axis) ray.origin[axis] = origin[axis] * kUnit;
      ++random_rays;
      random_leaks += finds_none(program, ray);
    }
  }
  std::printf("rays through edges: %" PRIu64 ", %" PRIu64 " leak (%.1f %%); other rays: %" PRIu64 ", %" PRIu64
              " leak\n",
              rays, leaks, 100.0 * static_cast<double>(leaks) / static_cast<double>(rays), random_rays, random_leaks);
  EXPECT_GT(leaks, 0u) << "seed " << seed;
  EXPECT_LT(leaks, rays / 2) << "seed " << seed;
  EXPECT_LE(random_leaks, random_rays / 100) << "seed " << seed;
}

}  // namespace
}  // namespace retrace
