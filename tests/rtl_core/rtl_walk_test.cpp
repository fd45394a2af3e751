// A walk as the stages of the verilated core take it: the kernel's, bit for bit, in every record; and the engine goes on as before.
#include <gtest/gtest.h>

#include <algorithm>

#include "golden/engine/walk.hpp"
#include "testbench/sim/core/core_model.hpp"
#include "testbench/sim/core/rtl_engine.hpp"
#include "testbench/sim/core/stage_watch.hpp"
#include "tests/rtl_core/frames.hpp"

namespace retrace::rtl_core_test {
namespace {

TEST(RtlWalk, is_the_kernels_in_every_bit) {
  const Prepared& p = prepared("knot:along=60,around=8");
  auto csim = make_csim_engine(p.image);
  RtlOptions rtl_options;
  rtl_options.configuration = "small";
  auto rtl = make_rtl_engine(p.image, rtl_options);
  std::vector<GridRay> rays;
  for (std::size_t i = 0; i < p.awkward.size(); i += 23) rays.push_back(p.awkward[i]);
  for (std::size_t i = 0; i < p.primary.size(); i += 61) rays.push_back(p.primary[i]);
  rays = only_inside(rays);
  std::vector<Hit> before(rays.size()), after(rays.size());
  for (const WayUp way : {WayUp::kParentLinks, WayUp::kFaceLinks}) {
    for (const int mailbox : {0, kCsimMailbox}) {
      TraceOptions options;
      options.way_up = way;
      options.mailbox = mailbox;
      rtl->trace(rays, before, {}, options);
      for (std::size_t i = 0; i < rays.size(); ++i) {
        const Walk expected = csim->walk(rays[i], options), walk = rtl->walk(rays[i], options);
        const Parting parting = first_parting_in_bits(expected, walk);
        EXPECT_FALSE(parting.parts) << "ray " << i << ", way up " << static_cast<int>(way) << ", mailbox " << mailbox
                                    << ", seed " << test_seed() << ", step " << parting.step << ": " << parting.why;
        EXPECT_EQ(walk.hit.status, before[i].status);
        EXPECT_EQ(walk.hit.id, before[i].id);
        EXPECT_EQ(walk.hit.t, before[i].t);
      }
      rtl->trace(rays, after, {}, options);
      for (std::size_t i = 0; i < rays.size(); ++i) EXPECT_EQ(before[i].t, after[i].t);
    }
  }
}

TEST(RtlWalk, through_instances_is_the_kernels_in_every_bit) {
  const auto& built = cosim::core_configurations();
  if (std::find(built.begin(), built.end(), "saarcor") == built.end())
    GTEST_SKIP() << "RETRACE_RTL_CONFIGS leaves out saarcor";
  const TracedScene scene = prepare_scene(open_scene("field:count=60"), {}, TwoLevels::kAuto);
  ASSERT_TRUE(scene.image.two_levels());
  auto csim = make_csim_engine(scene.image);
  RtlOptions rtl_options;
  rtl_options.configuration = "saarcor";
  auto rtl = make_rtl_engine(scene.image, rtl_options);
  const ViewCamera view = default_view(scene.scene, scene.world);
  std::size_t entries = 0, tests = 0;
  for (const bool any : {false, true}) {
    for (int i = 0; i < 60; ++i) {
      const GridRay ray = quantise(view.ray(i % 10 * 3.2 + 0.5, i / 10 * 4.1 + 0.5, kWidth, kHeight),
                                   scene.grid.transform, scene.grid.box, any);
      if (ray.outside) continue;
      TraceOptions options;
      options.way_up = i % 2 != 0 ? WayUp::kParentLinks : WayUp::kFaceLinks;
      options.mailbox = i % 3 != 0 ? kCsimMailbox : 0;
      const Walk expected = csim->walk(ray, options), walk = rtl->walk(ray, options);
      const Parting parting = first_parting_in_bits(expected, walk);
      EXPECT_FALSE(parting.parts) << "ray " << i << ", any " << any << ", step " << parting.step << ": " << parting.why;
      for (std::size_t c = 0; c < std::min(walk.calls.size(), expected.calls.size()); ++c) {
        EXPECT_EQ(walk.calls[c].level, expected.calls[c].level);
        EXPECT_EQ(walk.calls[c].value("instance"), expected.calls[c].value("instance"));
        entries += walk.calls[c].value("enters") != 0;
        tests += walk.calls[c].stage == Stage::kTriTest;
      }
    }
  }
  EXPECT_GT(entries, 40u);
  EXPECT_GT(tests, 40u);
}

TEST(RtlWalk, one_watch_at_a_time) {
  const cosim::StageWatch watch;
  EXPECT_THROW(cosim::StageWatch(), Error);
  EXPECT_TRUE(watch.calls().empty());
}

TEST(RtlWalk, an_answer_that_is_missing_or_not_asked_for_is_an_error) {
  const std::array<std::uint32_t, 32> data{};
  cosim::StageWatch watch;
  EXPECT_THROW(watch.gives(1, data.data()), Error);
  watch.takes(1, data.data());
  EXPECT_THROW(watch.calls(), Error);
  watch.gives(1, data.data());
  EXPECT_EQ(watch.calls().size(), 1u);
}

}  // namespace
}  // namespace retrace::rtl_core_test
