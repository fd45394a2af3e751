// Pictures by programs: what a program is given, where its rays go, that faults stay with their thread, and that nothing depends on the number of threads.
#include "golden/render/shader_frame.hpp"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <fstream>

#include "golden/tree/traced_scene.hpp"
#include "scenes/generators.hpp"

namespace retrace {
namespace {

constexpr int kWidth = 40, kHeight = 30;

struct Stage : TracedScene {
  ViewCamera camera;
  Surfaces surfaces;
  std::unique_ptr<Engine> engine;

  explicit Stage(Scene s)
      : TracedScene(prepare_scene(std::move(s))),
        camera(default_view(scene, world)),
        surfaces(scene, world, grid),
        engine(make_golden_engine(grid, image)) {}
  ShaderFrame draw(const ShaderProgram& program, std::uint64_t step_limit = 1 << 16) {
    ShaderScene made = make_shader_scene(program, surfaces, camera, kWidth, kHeight);
    made.setting.step_limit = step_limit;
    ShaderFrameOptions options;
    options.width = kWidth;
    options.height = kHeight;
    return run_shader_frame(made, grid, *engine, options);
  }
};

ShaderProgram program_of(const std::string& text) {
  ShaderProgram program;
  program.name = "test";
  program.text = text;
  program.code = shader::assemble(text, "test");
  const auto at = [&](const char* label) {
    const auto found = program.code.labels.find(label);
    return found == program.code.labels.end() ? 0 : found->second;
  };
  program.start = at("main");
  program.surface = at("surface");
  program.sky = at("sky");
  return program;
}

const std::string kCamera =
    "main: dp2h R0.x,C4,P\n dp2h R0.y,C5,P\n dp2h R0.z,C6,P\n dp2h R1.x,C1,P\n dp2h R1.y,C2,P\n dp2h R1.z,C3,P\n"
    "dp3_rsq R1.w,R1,R1\n mul R1.xyz,R1,S.w\n trace R0,R1,C.xwxx\n";

TEST(ShaderFrame, primary_rays_find_what_the_view_sees) {
  Stage stage(make_scene("knot"));
  const ShaderFrame frame =
      stage.draw(program_of(kCamera + "mov R2,HIT.w + jmp miss, w <0\n mov O.x,HIT.x\n exit\nmiss: exit"));
  int hits = 0, apart = 0;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const WorldRay ray = stage.camera.ray(x + 0.5, y + 0.5, kWidth, kHeight);
      std::array<GridRay, 1> rays{quantise(ray, stage.grid.transform, stage.grid.box, false)};
      std::array<Hit, 1> found{};
      stage.engine->trace(rays, found, {}, {});
      const double t =
          found[0].hit() ? (rays[0].t_base + rays[0].t_scale * found[0].t) * stage.grid.transform.scale : 0;
      hits += found[0].hit();
      // Directions of 24 bits: at an outline, another surface may be hit.
      if (std::abs(t - static_cast<double>(frame.color.at(x, y)[0])) > 1e-4) ++apart;
    }
  }
  EXPECT_GT(hits, kWidth * kHeight / 10);
  EXPECT_LE(apart, hits / 50);
  EXPECT_EQ(frame.rays, frame.threads);
  EXPECT_EQ(frame.ends.at(shader::kStatusDone), frame.threads);
}

TEST(ShaderFrame, normals_and_materials_come_from_memory) {
  Stage stage(make_scene("box"));
  const ShaderFrame frame = stage.draw(program_of(kCamera + "call HIT.w push 0\n exit\nsurface: load I0,TRI,3\n dp3 "
                                                            "O.x,-I0,R1\n load4x TRI,0\n mov A.x,I0.w\n load I0,A.x,1\n"
                                                            "dp3 O.y,I0,C.xyxx\n return\nsky: mov O,C.y + return"));
  int faces = 0;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const WorldRay ray = stage.camera.ray(x + 0.5, y + 0.5, kWidth, kHeight);
      std::array<GridRay, 1> rays{quantise(ray, stage.grid.transform, stage.grid.box, false)};
      std::array<Hit, 1> found{};
      stage.engine->trace(rays, found, {}, {});
      if (!found[0].hit()) continue;
      const SurfacePoint point = stage.surfaces.at(found[0], ray.direction);
      const float* shown = frame.color.at(x, y);
      const double facing = -glm::dot(stage.surfaces.front(found[0].id), ray.direction);
      // A colour below 0 is shown as 0.
      EXPECT_NEAR(static_cast<double>(shown[0]), std::max(0.0, facing), 1e-3);
      EXPECT_NEAR(shown[1], point.base.g, 1e-4f);
      ++faces;
    }
  }
  EXPECT_GT(faces, 50);
}

// Phong's shading and its shadows by the renderer's own surfaces, offsets and rays, in doubles.
struct Agreement {
  int lit = 0, dark = 0;
  int otherwise = 0;                  ///< pixels of another surface, or in shadow for one and not for the other
  double psnr = 0, psnr_of_rest = 0;  ///< of all pixels; without those
};
Agreement phong_agreement(Stage& stage) {
  Agreement result;
  const ShaderProgram program = find_shader_program("phong");
  const ShaderScene made = make_shader_scene(program, stage.surfaces, stage.camera, kWidth, kHeight);
  const auto& c = made.setting.constants;
  const ShaderFrame frame = stage.draw(program);
  const glm::dvec3 light = glm::dvec3(c[7][0], c[7][1], c[7][2]) / stage.grid.transform.scale;
  const auto trace = [&](const WorldRay& ray, bool any) {
    std::array<GridRay, 1> rays{quantise(ray, stage.grid.transform, stage.grid.box, any)};
    std::array<Hit, 1> found{};
    if (!rays[0].outside) stage.engine->trace(rays, found, {}, {});
    return found[0];
  };
  double squares = 0, rest = 0;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const WorldRay ray = stage.camera.ray(x + 0.5, y + 0.5, kWidth, kHeight);
      const glm::dvec3 along = glm::normalize(ray.direction);
      const Hit hit = trace(ray, false);
      glm::dvec3 colour;
      if (hit.hit()) {
        const SurfacePoint point = stage.surfaces.at(hit, along);
        const glm::dvec3 to_light = light - point.position, towards = glm::normalize(to_light);
        const double facing = glm::dot(point.normal, towards);
        bool shadow = facing <= 0;
        if (!shadow) shadow = trace(stage.surfaces.leave(point, towards, glm::length(to_light)), true).hit();
        shadow ? ++result.dark : ++result.lit;
        const glm::dvec3 direct = shadow ? glm::dvec3(0) : glm::dvec3(c[8][0], c[8][1], c[8][2]) * facing;
        const double s = std::clamp(glm::dot(glm::reflect(along, point.normal), towards), 0.0, 1.0);
        const double highlight = 0.25 * s / (c[8][3] * (1 - s) + s);
        colour = (direct + static_cast<double>(c[7][3])) * glm::dvec3(point.base) + glm::dvec3(point.emissive) +
                 direct * highlight;
      } else {
        const double up = 0.5 * along.y + 0.5;
        for (int k = 0; k < 3; ++k) {
          const auto i = static_cast<std::size_t>(k);
          colour[k] = c[9][i] + up * (c[10][i] - c[9][i]);
        }
      }
      const float* shown = frame.color.at(x, y);
      double pixel = 0;
      for (int k = 0; k < 3; ++k) {
        const double apart = std::min(1.0, colour[k]) - std::min(1.0, static_cast<double>(shown[k]));
        pixel += apart * apart;
      }
      constexpr double kOtherwise = 0.02;
      squares += pixel;
      if (pixel > kOtherwise * kOtherwise)
        ++result.otherwise;
      else
        rest += pixel;
    }
  }
  const auto psnr = [](double sum) { return -10 * std::log10(sum / (3 * kWidth * kHeight)); };
  result.psnr = psnr(squares);
  result.psnr_of_rest = psnr(rest);
  return result;
}

TEST(ShaderFrame, phong_with_shadows_is_the_renderers) {
  for (const char* name : {"box", "room", "knot"}) {
    SceneParameters parameters;
    if (std::string(name) == "room") parameters["detail"] = 0.02;
    Stage stage(make_scene(name, parameters));
    const Agreement found = phong_agreement(stage);
    std::printf(
        "%s: phong with shadows, PSNR %.1f dB against the renderer's surfaces in doubles, %.1f dB without %d pixels "
        "that "
        "see or shade another surface; %d pixels lit, %d in shadow\n",
        name, found.psnr, found.psnr_of_rest, found.otherwise, found.lit, found.dark);
    EXPECT_GT(found.psnr_of_rest, 60) << name;
    EXPECT_LE(found.otherwise, kWidth * kHeight / 100) << name;  // the box has edges that rays meet exactly
    EXPECT_GT(found.lit, 0) << name;
    EXPECT_GT(found.dark, 0) << name;
  }
}

TEST(ShaderFrame, every_picture_of_the_library) {
  Stage stage(make_scene("knot"));
  std::string names = shader_program_names() + ", ";
  int pictures = 0;
  for (std::size_t at = 0; at < names.size();) {
    const std::size_t end = names.find(", ", at);
    const std::string name = names.substr(at, end - at);
    at = end + 2;
    const ShaderFrame frame = stage.draw(find_shader_program(name));
    EXPECT_EQ(frame.ends.size(), 1u) << name;
    EXPECT_EQ(frame.ends.count(shader::kStatusDone), 1u) << name;
    double sum = 0, squares = 0;
    for (const float value : frame.color.data)
      sum += static_cast<double>(value), squares += static_cast<double>(value) * value;
    const auto count = static_cast<double>(frame.color.data.size());
    const double mean = sum / count;
    EXPECT_GT(mean, 0.05) << name;
    EXPECT_LT(mean, 1.0) << name;
    EXPECT_GT(squares / count - mean * mean, 1e-3) << name << " is all of one colour";
    const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
    EXPECT_EQ(stage.draw(find_shader_program(name)).color.data, frame.color.data) << name;
    ++pictures;
  }
  EXPECT_EQ(pictures, 8);
}

TEST(ShaderFrame, a_fault_is_one_threads) {
  Stage stage(make_scene("box"));
  // Columns from 20 on never end.
  const ShaderFrame frame = stage.draw(
      program_of("mov R0,P.x\n add R0,R0,-20.0\n mov R1,R0 + jmp loop, x >=0\n mov O,C.y + exit 0\nloop: jmp loop"),
      500);
  EXPECT_EQ(frame.ends.at(shader::kStatusStepLimit), static_cast<std::uint64_t>(kWidth / 2 * kHeight));
  EXPECT_EQ(frame.ends.at(shader::kStatusDone), static_cast<std::uint64_t>(kWidth / 2 * kHeight));
  EXPECT_EQ(frame.color.at(19, 3)[0], 1.0f);
  EXPECT_EQ(frame.color.at(20, 3)[0], 0.0f);
}

TEST(ShaderFrame, stores_happen_in_the_order_of_the_pixels) {
  Stage stage(make_scene("box"));
  const ShaderFrame frame =
      stage.draw(program_of("load I0,A.x,0\n add R0,I0,C.y\n store A.x,0,R0\n mov O,R0 + exit 0"));
  for (int i = 0; i < kWidth * kHeight; ++i)
    ASSERT_EQ(frame.color.data[3 * static_cast<std::size_t>(i)], static_cast<float>(i + 2));
}

TEST(ShaderFrame, programs_that_are_not_there) {
  EXPECT_THROW(find_shader_program("none"), UsageError);
  EXPECT_THROW(find_shader_program("./none.asm"), Error);
  EXPECT_THROW(find_shader_program("."), Error);
}

}  // namespace
}  // namespace retrace
