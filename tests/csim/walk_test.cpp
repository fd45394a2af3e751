// Walks as golden and the kernel show them: the same ray as in trace(), call by call, and the place at which two walks part.
#include "golden/engine/walk.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>

#include "golden/contract/contract_records.hpp"
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
