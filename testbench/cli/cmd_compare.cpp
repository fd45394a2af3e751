// retrace compare: the same quantised rays through two engines, classes of agreement, a picture of the difference.
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <array>
#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>
#include <memory>

#include "golden/compare.hpp"
#include "golden/image/renderer.hpp"
#include "golden/image/sampling.hpp"
#include "golden/image/tonemap.hpp"
#include "testbench/cli/commands.hpp"
#include "testbench/cli/engines.hpp"
#include "testbench/cli/progress.hpp"

namespace retrace::cli {
namespace {

struct CompareArguments {
  std::string scene, engines = "golden,csim", size = "640x480", camera, way_up = "face", output, stats, lights = "auto";
  std::vector<std::string> rays = {"primary", "shadow"};
  int spp = 1, light_samples = 1;
  std::uint32_t seed = 1;
  TraceOptions trace;
};

constexpr std::array<const char*, 4> kMeaning = {"", "differ within the edge band", "differ within the depth bound",
                                                 ""};

/// One kind of rays, counted.
struct Tally {
  std::string kind;
  AgreementCounts counts;
  double depth_difference = 0;  ///< largest |t_a - t_b| of rays that hit the same triangle, grid units
  double seconds_a = 0, seconds_b = 0;
  std::vector<std::string> examples;  ///< first violations
};

/// What the difference picture shows of a pixel.
struct Pixel {
  std::uint8_t a = 0, b = 0;  ///< encoded luminance of the hit through either engine, 0: miss
  Agreement agreement = Agreement::kSame;
};

glm::vec3 class_color(Agreement agreement) {
  switch (agreement) {
    case Agreement::kEdge:
      return {1.0f, 0.76f, 0.1f};
    case Agreement::kDepth:
      return {0.1f, 0.8f, 0.9f};
    case Agreement::kViolation:
      return {1.0f, 0.15f, 0.2f};
    default:
      return glm::vec3(0.3f);
  }
}

/// Traces a batch through both engines and classifies it.
class Duel {
 public:
  Duel(const LoadedScene& loaded, const std::string& name_a, const std::string& name_b, const TraceOptions& options)
      : loaded_(loaded),
        a_(make_engine(name_a, loaded.grid, loaded.image)),
        b_(make_engine(name_b, loaded.grid, loaded.image)),
        fixed_a_(find_engine(name_a).fixed_point),
        fixed_b_(find_engine(name_b).fixed_point),
        comparator_(loaded.grid),
        options_(options) {}

  Engine& a() { return *a_; }
  Engine& b() { return *b_; }
  bool same_kind() const { return fixed_a_ == fixed_b_; }
  const std::vector<Hit>& hits_a() const { return hits_a_; }
  const std::vector<Hit>& hits_b() const { return hits_b_; }
  const std::vector<Verdict>& verdicts() const { return verdicts_; }

  void run(std::span<const WorldRay> rays, bool any, Tally& tally) {
    grid_.resize(rays.size());
    quantise_all(rays, grid_, loaded_.grid.transform, loaded_.grid.box, any);
    tally.seconds_a += trace(*a_, hits_a_);
    tally.seconds_b += trace(*b_, hits_b_);
    verdicts_.assign(rays.size(), Verdict{});
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, rays.size(), 256), [&](const auto& range) {
      for (std::size_t i = range.begin(); i < range.end(); ++i) {
        verdicts_[i] = same_kind() ? Comparator::identical(hits_a_[i], hits_b_[i])
                                   : comparator_.compare(grid_[i], fixed_a_ ? hits_b_[i] : hits_a_[i],
                                                         fixed_a_ ? hits_a_[i] : hits_b_[i]);
      }
    });
    for (std::size_t i = 0; i < rays.size(); ++i) {
      const Hit &a = hits_a_[i], &b = hits_b_[i];
      tally.counts.add(verdicts_[i], a.hit(), b.hit());
      if (a.hit() && b.hit() && a.id == b.id)
        tally.depth_difference = std::max(tally.depth_difference, std::fabs(a.t - b.t));
      constexpr std::size_t kExamples = 5;
      if (verdicts_[i].agreement != Agreement::kViolation || tally.examples.size() >= kExamples) continue;
      char text[512];
      const auto& r = grid_[i].record;
      std::snprintf(
          text, sizeof text,
          "%s ray: %s; %s: status %u triangle %d t %.9f, %s: status %u triangle %d t %.9f; origin (%d %d %d) direction "
          "(%d %d %d) t_max %u",
          tally.kind.c_str(), verdicts_[i].reason, a_->name().c_str(), a.status, static_cast<int>(a.id), a.t,
          b_->name().c_str(), b.status, static_cast<int>(b.id), b.t, r.origin[0], r.origin[1], r.origin[2],
          r.direction[0], r.direction[1], r.direction[2], r.t_max);
      tally.examples.emplace_back(text);
    }
  }

 private:
  double trace(Engine& engine, std::vector<Hit>& hits) {
    hits.assign(grid_.size(), Hit{});
    const double start = now();
    engine.trace(grid_, hits, {}, options_);
    return now() - start;
  }

  const LoadedScene& loaded_;
  std::unique_ptr<Engine> a_, b_;
  bool fixed_a_, fixed_b_;
  Comparator comparator_;
  TraceOptions options_;
  std::vector<GridRay> grid_;
  std::vector<Hit> hits_a_, hits_b_;
  std::vector<Verdict> verdicts_;
};

/// How bright a hit looks under a lamp at the eye; at least 1.
std::uint8_t shown(const Surfaces& surfaces, const Hit& hit, const glm::dvec3& direction) {
  if (!hit.hit() || surfaces.grid_index(hit.id) == kNone) return 0;
  const SurfacePoint point = surfaces.at(hit, direction);
  const auto facing = static_cast<float>(std::fabs(glm::dot(point.normal, direction)));
  const float bright = srgb_encode(luminance(glm::vec3(point.base)) * (0.15f + 0.85f * facing));
  return static_cast<std::uint8_t>(glm::clamp(bright * 255.0f, 1.0f, 255.0f));
}

Raster difference_picture(const std::vector<Pixel>& pixels, const Size& size, const std::string& name_a,
                          const std::string& name_b, const Tally& tally) {
  const int scale = std::clamp(size.width / 320, 1, 8), gap = 4 * scale, head = text_height(scale) + 2 * gap;
  const int foot = head;
  Raster image(3 * size.width + 2 * gap, size.height + head + foot, 3, 0.09f);
  const glm::vec3 ink(0.92f), ground(0.13f, 0.14f, 0.16f);
  for (int panel = 0; panel < 3; ++panel) {
    const int left = panel * (size.width + gap);
    const std::string title = panel == 0 ? name_a : panel == 1 ? name_b : "difference";
    draw_text(image, left + gap, gap, title, ink, scale);
    for (int y = 0; y < size.height; ++y) {
      for (int x = 0; x < size.width; ++x) {
        const Pixel& p =
            pixels[static_cast<std::size_t>(y) * static_cast<std::size_t>(size.width) + static_cast<std::size_t>(x)];
        const std::uint8_t value = panel == 1 ? p.b : p.a;
        glm::vec3 color = value == 0 ? ground : glm::vec3(static_cast<float>(value) / 255.0f);
        if (panel == 2) color *= value == 0 ? 0.6f : 0.45f;
        image.set_rgb(left + x, head + y, color);
      }
    }
    if (panel < 2) continue;
    // Disagreeing pixels are drawn last and large enough to be found; the worst on top.
    for (const Agreement agreement : {Agreement::kDepth, Agreement::kEdge, Agreement::kViolation}) {
      const int reach = agreement == Agreement::kViolation ? 2 * scale : scale;
      for (int y = 0; y < size.height; ++y) {
        for (int x = 0; x < size.width; ++x) {
          if (pixels[static_cast<std::size_t>(y) * static_cast<std::size_t>(size.width) + static_cast<std::size_t>(x)]
                  .agreement != agreement)
            continue;
          const int x0 = std::max(x - reach, 0), y0 = std::max(y - reach, 0);
          const int x1 = std::min(x + reach, size.width - 1), y1 = std::min(y + reach, size.height - 1);
          fill(image, left + x0, head + y0, x1 - x0 + 1, y1 - y0 + 1, class_color(agreement));
        }
      }
    }
  }
  int x = gap;
  const int y = head + size.height + gap;
  for (int i = 0; i < 4; ++i) {
    const auto agreement = static_cast<Agreement>(i);
    fill(image, x, y, 7 * scale, 7 * scale, class_color(agreement));
    const std::string text =
        std::string(to_string(agreement)) + " " + std::to_string(tally.counts.total[static_cast<std::size_t>(i)]);
    draw_text(image, x + 10 * scale, y, text, ink, scale);
    x += 10 * scale + text_width(text, scale) + 16 * scale;
  }
  return image;
}

void print_tally(const Tally& tally, const std::string& name_a, const std::string& name_b, bool same_kind) {
  const AgreementCounts& c = tally.counts;
  const double n = c.rays() > 0 ? static_cast<double>(c.rays()) : 1.0;
  std::printf("%s rays: %s (both hit %s, both miss %s, only %s hits %s, only %s hits %s)\n", tally.kind.c_str(),
              with_commas(c.rays()).c_str(), with_commas(c.both_hit).c_str(), with_commas(c.both_miss).c_str(),
              name_a.c_str(), with_commas(c.only_a).c_str(), name_b.c_str(), with_commas(c.only_b).c_str());
  for (std::size_t i = 0; i < 4; ++i) {
    if (same_kind && (i == 1 || i == 2)) continue;
    const char* meaning = i == 0   ? (same_kind ? "bit for bit" : "same triangle within the depth bound, or both miss")
                          : i == 3 ? (c.total[3] == 0 ? "" : "anything else")
                                   : kMeaning[i];
    std::printf("  %-10s %14s  %9.5f %%  grazing %s  %s\n", to_string(static_cast<Agreement>(i)),
                with_commas(c.total[i]).c_str(), 100.0 * static_cast<double>(c.total[i]) / n,
                with_commas(c.grazing[i]).c_str(), meaning);
  }
  if (!same_kind) {
    std::printf(
        "  exact hits lost: %s; hits outside their triangle: %s, the farthest by %.3f x 2^-20 (%s by more than "
        "2^-20)\n",
        with_commas(c.lost).c_str(), with_commas(c.false_hits).c_str(), c.farthest * 0x1p20,
        with_commas(c.beyond_band).c_str());
  }
  std::printf("  largest |t - t'| on the same triangle: %.3g of the scene box = %.2f x 2^-24\n", tally.depth_difference,
              tally.depth_difference * 0x1p24);
  std::printf("  %s %s rays/s, %s %s rays/s\n", name_a.c_str(),
              with_unit(tally.seconds_a > 0 ? n / tally.seconds_a : 0).c_str(), name_b.c_str(),
              with_unit(tally.seconds_b > 0 ? n / tally.seconds_b : 0).c_str());
}

nlohmann::ordered_json tally_json(const Tally& tally) {
  const AgreementCounts& c = tally.counts;
  nlohmann::ordered_json json = {{"rays", c.rays()},
                                 {"both_hit", c.both_hit},
                                 {"both_miss", c.both_miss},
                                 {"only_a", c.only_a},
                                 {"only_b", c.only_b}};
  for (std::size_t i = 0; i < 4; ++i) json[to_string(static_cast<Agreement>(i))] = c.total[i];
  for (std::size_t i = 0; i < 4; ++i) json["grazing"][to_string(static_cast<Agreement>(i))] = c.grazing[i];
  json["lost"] = c.lost;
  json["false_hits"] = c.false_hits;
  json["false_hits_beyond_band"] = c.beyond_band;
  json["farthest_false_hit"] = c.farthest;
  json["largest_t_difference"] = tally.depth_difference;
  json["seconds_a"] = tally.seconds_a;
  json["seconds_b"] = tally.seconds_b;
  json["examples"] = tally.examples;
  return json;
}

void run_compare(const CompareArguments& a, Program& program) {
  const Size size = parse_size(a.size);
  const std::size_t comma = a.engines.find(',');
  if (comma == std::string::npos || a.engines.find(',', comma + 1) != std::string::npos) {
    throw UsageError("--engines takes two engines, as in golden,csim, not '" + a.engines + "'");
  }
  const std::string name_a = a.engines.substr(0, comma), name_b = a.engines.substr(comma + 1);
  TraceOptions trace = a.trace;
  trace.way_up = parse_way_up(a.way_up);
  trace.threads = program.common.threads;
  check_options(name_a, trace);
  check_options(name_b, trace);
  bool shadow = false, primary = false;
  for (const std::string& kind : a.rays) (kind == "shadow" ? shadow : primary) = true;
  std::unique_ptr<OutputFile> picture, stats;
  if (!a.output.empty()) {
    if (is_linear_format(a.output))
      throw UsageError("the difference picture is for looking at: name a .png file, not " + a.output);
    picture = std::make_unique<OutputFile>(a.output);
  }
  if (!a.stats.empty()) stats = std::make_unique<OutputFile>(a.stats);

  const LoadedScene loaded = load_scene(a.scene, program.common);
  const ViewCamera camera = default_view(loaded.scene, loaded.world, a.camera);
  const Surfaces surfaces(loaded.scene, loaded.world, loaded.grid);
  Duel duel(loaded, name_a, name_b, trace);
  const LightChoice choice = a.lights == "scene" ? LightChoice::kScene
                             : a.lights == "rig" ? LightChoice::kRig
                                                 : LightChoice::kAuto;
  const Lighting lighting(surfaces, camera, choice, is_indoors(surfaces, camera, loaded.grid.box, duel.a(), trace));

  Tally tallies[2];
  tallies[0].kind = "primary";
  tallies[1].kind = "shadow";
  std::vector<Pixel> pixels(picture ? static_cast<std::size_t>(size.width) * static_cast<std::size_t>(size.height) : 0);
  Progress progress("compare " + loaded.name + " (" + a.engines + ")", program.common.quiet);
  const auto total =
      static_cast<std::size_t>(size.width) * static_cast<std::size_t>(size.height) * static_cast<std::size_t>(a.spp);
  constexpr std::size_t kWave = std::size_t{1} << 16;
  std::vector<WorldRay> rays, shadow_rays;
  std::vector<LightSample> samples;
  for (std::size_t begin = 0; begin < total; begin += kWave) {
    const std::size_t n = std::min(kWave, total - begin);
    const auto pixel_of = [&](std::size_t i) {
      return static_cast<std::uint32_t>((begin + i) / static_cast<std::size_t>(a.spp));
    };
    const auto sample_of = [&](std::size_t i) {
      return static_cast<std::uint32_t>((begin + i) % static_cast<std::size_t>(a.spp));
    };
    rays.resize(n);
    for (std::size_t i = 0; i < n; ++i) {
      const std::uint32_t pixel = pixel_of(i), width = static_cast<std::uint32_t>(size.width);
      const glm::dvec2 where =
          a.spp == 1 ? glm::dvec2(0.5) : sample_2d(sample_of(i), hash_combine(hash_combine(a.seed, pixel), 0x5058u));
      rays[i] = camera.ray(pixel % width + where.x, pixel / width + where.y, size.width, size.height);
    }
    // Shadow rays start where engine A's primary rays end, so primary rays are traced in any case.
    Tally unasked;
    duel.run(rays, false, primary ? tallies[0] : unasked);
    if (picture && primary) {
      for (std::size_t i = 0; i < n; ++i) {
        Pixel& pixel = pixels[pixel_of(i)];
        if (sample_of(i) == 0) {
          pixel.a = shown(surfaces, duel.hits_a()[i], rays[i].direction);
          pixel.b = shown(surfaces, duel.hits_b()[i], rays[i].direction);
        }
        pixel.agreement = std::max(pixel.agreement, duel.verdicts()[i].agreement);
      }
    }
    if (shadow) {
      shadow_rays.clear();
      for (std::size_t i = 0; i < n; ++i) {
        const Hit& hit = duel.hits_a()[i];
        if (!hit.hit() || surfaces.grid_index(hit.id) == kNone) continue;
        const SurfacePoint point = surfaces.at(hit, rays[i].direction);
        lighting.sample(point, a.light_samples, sample_of(i), hash_combine(hash_combine(a.seed, pixel_of(i)), 0x5348u),
                        samples);
        for (const LightSample& s : samples) shadow_rays.push_back(surfaces.leave(point, s.direction, s.distance));
      }
      if (!shadow_rays.empty()) duel.run(shadow_rays, true, tallies[1]);
    }
    progress.update(static_cast<double>(begin + n) / static_cast<double>(total));
  }
  progress.finish();

  std::uint64_t violations = 0;
  std::printf("%s, %s triangles, %dx%d, %s against %s, way up: %s\n", loaded.name.c_str(),
              with_commas(loaded.world.vertices.size()).c_str(), size.width, size.height, name_a.c_str(),
              name_b.c_str(), a.way_up.c_str());
  for (int i = 0; i < 2; ++i) {
    if (!(i == 0 ? primary : shadow)) continue;
    print_tally(tallies[i], name_a, name_b, duel.same_kind());
    violations += tallies[i].counts.violations();
    for (const std::string& example : tallies[i].examples) std::printf("  violation: %s\n", example.c_str());
  }
  if (picture) write_raster(*picture, difference_picture(pixels, size, name_a, name_b, tallies[0]));
  if (stats) {
    nlohmann::ordered_json json = {{"command", "compare"},
                                   {"scene", scene_json(loaded)},
                                   {"engines", {name_a, name_b}},
                                   {"way_up", a.way_up},
                                   {"mailbox", trace.mailbox},
                                   {"camera", camera.name},
                                   {"width", size.width},
                                   {"height", size.height},
                                   {"spp", a.spp},
                                   {"violations", violations},
                                   {"rays", nlohmann::ordered_json::object()}};
    if (primary) json["rays"]["primary"] = tally_json(tallies[0]);
    if (shadow) json["rays"]["shadow"] = tally_json(tallies[1]);
    stats->write(json.dump(2) + "\n");
  }
  for (OutputFile* file : {picture.get(), stats.get()}) {
    if (file == nullptr) continue;
    file->commit();
    std::printf("wrote %s\n", file->path().c_str());
  }
  std::printf("%s\n", violations == 0 ? "0 violations" : (with_commas(violations) + " violations").c_str());
  if (violations > 0) program.exit_code = 1;
}

}  // namespace

void add_compare(CLI::App& app, Program& program) {
  CLI::App* command =
      app.add_subcommand("compare", "Trace the same rays through two engines and classify every difference");
  auto a = std::make_shared<CompareArguments>();
  command->add_option("scene", a->scene, kSceneHelp)->required()->type_name("SCENE");
  command->add_option("-e,--engines", a->engines, "Two engines, see below")->capture_default_str()->type_name("A,B");
  command->add_option("-s,--size", a->size, "Size in pixels")->capture_default_str()->type_name("WxH");
  command->add_option("-c,--camera", a->camera, "Camera by name or number")->type_name("CAMERA");
  command->add_option("--rays", a->rays, "primary, shadow or both")
      ->delimiter(',')
      ->check(CLI::IsMember({"primary", "shadow"}))
      ->type_name("KIND,...");
  command->add_option("--spp", a->spp, "Primary rays a pixel")
      ->capture_default_str()
      ->check(CLI::Range(1, 65536))
      ->type_name("N");
  command->add_option("--light-samples", a->light_samples, "Shadow rays to emissive surfaces a primary ray")
      ->capture_default_str()
      ->check(CLI::Range(1, 1024))
      ->type_name("N");
  command
      ->add_option("--lights", a->lights,
                   "The scene's lights, a rig that follows the camera, or the rig only where there are none")
      ->capture_default_str()
      ->check(CLI::IsMember({"auto", "scene", "rig"}));
  command->add_option("--way-up", a->way_up, "How a walk goes up the tree: stack (golden only), parent or face links")
      ->capture_default_str()
      ->check(CLI::IsMember({"stack", "parent", "face"}));
  command->add_flag("--mailbox{8}", a->trace.mailbox, "Remember the last triangles tested (8 unless =N)");
  command->add_option("--seed", a->seed, "Of the sample points")->capture_default_str();
  command->add_option("-o,--output", a->output, "Picture: A, B, and where their primary rays differ")
      ->type_name("FILE");
  command->add_option("--stats", a->stats, "The table as JSON")->type_name("FILE");
  add_engine_options(*command);
  add_common(*command, program);
  command->footer(
      "Engines:\n" + engine_help() +
      "Classes, golden against a fixed-point engine (docs/program.md):\n"
      "  same       the same triangle, t within the proven bound, or both miss\n"
      "  edge       the ray passes close to an edge of the triangle in question (2^-20 of the scene box; 2^-19.4 for "
      "its longest edge)\n"
      "  depth      two triangles closer together than the proven depth bounds\n"
      "  violation  anything else; the exit code is 1\n"
      "Two fixed-point engines must agree bit for bit.\n"
      "Examples:\n"
      "  retrace compare room.glb --engines golden,csim --size 640x480\n"
      "  retrace compare room.glb --engines golden,csim --rays shadow -o difference.png --stats compare.json\n"
      "  retrace compare room.glb --engines golden,csim --way-up parent --mailbox\n");
  command->callback([a, &program] { run_compare(*a, program); });
}

}  // namespace retrace::cli
