// Walks as golden and the kernel show them: the same ray as in trace(), call by call, and the place at which two walks part.
#include "golden/engine/walk.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>

#include "golden/contract/contract_records.hpp"
#include "golden/render/view.hpp"
#include "golden/tree/traced_scene.hpp"
#include "scenes/open_scene.hpp"
#include "testbench/csim/csim_engine.hpp"
#include "testbench/kit/test_rays.hpp"

namespace retrace {
namespace {

std::size_t calls_of(const Walk& walk, Stage stage) {
  return static_cast<std::size_t>(
      std::count_if(walk.calls.begin(), walk.calls.end(), [&](const StageCall& call) { return call.stage == stage; }));
}

struct Fixture {
  TracedScene scene = prepare_scene(open_scene("knot:along=60,around=8"));
  std::unique_ptr<Engine> golden = make_golden_engine(scene.grid, scene.image), csim = make_csim_engine(scene.image);
  std::vector<GridRay> rays;

  explicit Fixture(std::size_t count) {
    Random random(test_seed());
    rays = make_test_rays(scene.grid, scene.image, count, random);
    std::erase_if(rays, [](const GridRay& ray) { return ray.outside; });
  }
};

TEST(Walk, is_that_of_the_traced_ray) {
  const Fixture f(400);
  for (Engine* engine : {f.golden.get(), f.csim.get()}) {
    for (const WayUp way : {WayUp::kParentLinks, WayUp::kFaceLinks}) {
      for (const int mailbox : {0, kCsimMailbox}) {
        TraceOptions options;
        options.way_up = way;
        options.mailbox = mailbox;
        std::vector<Hit> hits(f.rays.size());
        std::vector<RayWork> work(f.rays.size());
        engine->trace(f.rays, hits, work, options);
        for (std::size_t i = 0; i < f.rays.size(); ++i) {
          SCOPED_TRACE(engine->name() + ", ray " + std::to_string(i) + ", seed " + std::to_string(test_seed()));
          const Walk walk = engine->walk(f.rays[i], options);
          EXPECT_EQ(walk.hit.status, hits[i].status);
          EXPECT_EQ(walk.hit.id, hits[i].id);
          EXPECT_EQ(walk.hit.t, hits[i].t);
          ASSERT_GE(walk.calls.size(), 2u);
          EXPECT_EQ(walk.calls.front().stage, Stage::kRaySetup);
          EXPECT_EQ(walk.calls.back().stage, Stage::kHitFinish);
          EXPECT_EQ(walk.calls.back().find("status")->value, hits[i].status);
          EXPECT_EQ(calls_of(walk, Stage::kKdDescend), work[i].down);
          EXPECT_EQ(calls_of(walk, Stage::kLeafExit), work[i].leaf);
          EXPECT_EQ(calls_of(walk, Stage::kTriTest), work[i].tests);
          EXPECT_EQ(calls_of(walk, Stage::kKdBacktrack), work[i].up);
        }
      }
    }
  }
}

/// Rays of a camera through a scene of instances.
struct TwoLevelFixture {
  TracedScene scene = prepare_scene(open_scene("placed:count=30,cells=2,kind=3"), {}, TwoLevels::kOn);
  std::unique_ptr<Engine> golden = make_golden_engine(scene.grid, scene.image), csim = make_csim_engine(scene.image);
  std::vector<GridRay> rays;

  explicit TwoLevelFixture(int side) {
    const ViewCamera camera = default_view(scene.scene, scene.world);
    for (int i = 0; i < side * side; ++i)
      rays.push_back(quantise(camera.ray(i % side + 0.5, static_cast<int>(i / side) + 0.5, side, side),
                              scene.grid.transform, scene.grid.box, i % 4 == 3));
    std::erase_if(rays, [](const GridRay& ray) { return ray.outside; });
  }
};

TEST(Walk, through_instances_is_that_of_the_traced_ray) {
  const TwoLevelFixture f(24);
  std::size_t entered = 0, rejected = 0;
  for (Engine* engine : {f.golden.get(), f.csim.get()}) {
    for (const WayUp way : {WayUp::kParentLinks, WayUp::kFaceLinks}) {
      TraceOptions options;
      options.way_up = way;
      std::vector<Hit> hits(f.rays.size());
      std::vector<RayWork> work(f.rays.size());
      engine->trace(f.rays, hits, work, options);
      for (std::size_t i = 0; i < f.rays.size(); ++i) {
        SCOPED_TRACE(engine->name() + ", ray " + std::to_string(i));
        const Walk walk = engine->walk(f.rays[i], options);
        ASSERT_EQ(walk.hit.status, hits[i].status);
        ASSERT_EQ(walk.hit.id, hits[i].id);
        ASSERT_EQ(walk.hit.t, hits[i].t);
        std::size_t into = 0, out_of = 0;
        int level = 0;
        for (const StageCall& call : walk.calls) {
          if (call.stage == Stage::kInstanceEnter) {
            ASSERT_EQ(call.level, 0);
            ASSERT_LT(call.value("instance"), 30.0);
            into += call.value("enters") != 0;
            rejected += call.value("enters") == 0;
          }
          out_of += level == 1 && call.level == 0;
          level = call.level;
        }
        // A ray that asks for any hit may end in an object, and one may have nothing to do there.
        ASSERT_EQ(into, out_of);
        entered += into;
        const std::size_t again = f.rays[i].record.any && hits[i].hit() ? into - 1 : into;
        ASSERT_EQ(calls_of(walk, Stage::kLeafExit), work[i].leaf + again);
        ASSERT_EQ(calls_of(walk, Stage::kKdDescend), work[i].down);
        ASSERT_EQ(calls_of(walk, Stage::kTriTest), work[i].tests);
        ASSERT_EQ(calls_of(walk, Stage::kKdBacktrack), work[i].up);
      }
    }
  }
  EXPECT_GT(entered, 500u);
  EXPECT_GT(rejected, 100u);
}

TEST(Walk, of_golden_and_the_kernel_through_instances_choose_alike_but_at_edges) {
  const TwoLevelFixture f(32);
  std::size_t alike = 0;
  for (const GridRay& ray : f.rays) {
    const Walk golden = f.golden->walk(ray, {}), csim = f.csim->walk(ray, {});
    const Parting parting = first_parting_in_choices(golden, csim);
    if (parting.parts) {
      EXPECT_FALSE(parting.why.empty());
      continue;
    }
    ++alike;
    ASSERT_EQ(golden.hit.id, csim.hit.id);
  }
  std::printf("%zu of %zu rays: the same steps\n", alike, f.rays.size());
  EXPECT_GT(100 * alike, 97 * f.rays.size());
  // A bit of an entry that differs is found in its step.
  for (const GridRay& ray : f.rays) {
    const Walk walk = f.csim->walk(ray, {});
    const auto entry = std::find_if(walk.calls.begin(), walk.calls.end(),
                                    [](const StageCall& call) { return call.stage == Stage::kInstanceEnter; });
    if (entry == walk.calls.end()) continue;
    Walk other = walk;
    const auto step = static_cast<std::size_t>(entry - walk.calls.begin());
    other.calls[step].input[0] ^= 1;
    const Parting parting = first_parting_in_bits(walk, other);
    ASSERT_TRUE(parting.parts);
    EXPECT_EQ(parting.step, step);
    EXPECT_EQ(parting.why.rfind("instance_enter: input ", 0), 0u) << parting.why;
    return;
  }
  FAIL() << "no ray met an instance";
}

TEST(Walk, golden_and_the_kernel_choose_alike_but_for_rays_at_edges) {
  const Fixture f(2000);
  std::size_t alike = 0;
  for (std::size_t i = 0; i < f.rays.size(); ++i) {
    const Walk golden = f.golden->walk(f.rays[i], {}), csim = f.csim->walk(f.rays[i], {});
    const Parting parting = first_parting_in_choices(golden, csim);
    if (parting.parts) {
      EXPECT_FALSE(parting.why.empty());
      continue;
    }
    ++alike;
    EXPECT_EQ(parting.step, golden.calls.size());
    EXPECT_EQ(golden.hit.id, csim.hit.id) << "ray " << i << ", seed " << test_seed();
    EXPECT_NEAR(golden.hit.t, csim.hit.t, 1e-3);
  }
  EXPECT_GT(alike, f.rays.size() / 2);
}

TEST(Walk, a_changed_bit_is_found_and_named) {
  const Fixture f(40);
  Random random(test_seed());
  for (const GridRay& ray : f.rays) {
    const Walk walk = f.csim->walk(ray, {});
    EXPECT_FALSE(first_parting_in_bits(walk, walk).parts);
    for (std::size_t step = 0; step < walk.calls.size(); ++step) {
      Walk changed = walk;
      StageCall& call = changed.calls[step];
      call.output[0] ^= 1;  // every record has a field there
      const Parting parting = first_parting_in_bits(walk, changed);
      ASSERT_TRUE(parting.parts);
      EXPECT_EQ(parting.step, step);
      EXPECT_EQ(parting.why.rfind(std::string(to_string(call.stage)) + ": output ", 0), 0u) << parting.why;
    }
    Walk shorter = walk;
    shorter.calls.pop_back();
    EXPECT_EQ(first_parting_in_bits(walk, shorter).step, shorter.calls.size());
    Walk swapped = walk;
    std::swap(swapped.calls.front(), swapped.calls.back());
    EXPECT_EQ(first_parting_in_choices(walk, swapped).why, "ray_setup against hit_finish");
  }
}

TEST(Walk, refuses_what_it_cannot_show) {
  const Fixture f(10);
  TraceOptions stack;
  stack.way_up = WayUp::kStack;
  EXPECT_THROW(f.golden->walk(f.rays[0], stack), Error);
  EXPECT_THROW(f.csim->walk(f.rays[0], stack), Error);
  TraceOptions mailbox;
  mailbox.mailbox = 3;
  EXPECT_THROW(f.csim->walk(f.rays[0], mailbox), Error);
  mailbox.mailbox = 65;
  EXPECT_THROW(f.golden->walk(f.rays[0], mailbox), Error);
  const std::array<std::uint64_t, 1> word{};
  EXPECT_THROW(read_stage_call(Stage::kTriTest, word, word), Error);
}

}  // namespace
}  // namespace retrace
