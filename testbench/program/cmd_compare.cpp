// retrace compare: the same quantised rays through two or more engines, classes of agreement, a picture of the difference.
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>
#include <memory>

#include "golden/compare/compare.hpp"
#include "golden/engine/registry.hpp"
#include "golden/gltf/gltf_loader.hpp"
#include "golden/render/renderer.hpp"
#include "golden/render/sampling.hpp"
#include "golden/render/tonemap.hpp"
#include "testbench/program/commands.hpp"
#include "testbench/program/progress.hpp"

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

constexpr std::array<const char*, 2> kKinds = {"primary", "shadow"};

/// Two engines that are held against each other, as places in the list of engines.
struct Pair {
  std::size_t a = 0, b = 0;
  bool identical = false;  ///< both fixed-point, or both golden: must agree bit for bit
};

/// One kind of rays through one pair, counted.
struct Tally {
  AgreementCounts counts;
  double depth_difference = 0;        ///< largest |t_a - t_b| of rays that hit the same triangle, grid units
  std::vector<std::string> examples;  ///< first violations
};

/// Rays and time of one engine and one kind of rays.
struct Speed {
  std::uint64_t rays = 0;
  double seconds = 0;
  double rays_s() const { return seconds > 0 ? static_cast<double>(rays) / seconds : 0; }
};

/// What the difference picture shows.
struct Picture {
  std::vector<std::vector<std::uint8_t>> shades;  ///< one an engine: encoded luminance of the hit, 0: miss
  std::vector<Agreement> agreement;               ///< the worst of all pairs
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

/// Traces batches through all engines and classifies every pair (places_held_against).
class Contest {
 public:
  Contest(const LoadedScene& loaded, const std::vector<std::string>& names, const TraceOptions& options)
      : loaded_(loaded), names_(names), hits_(names.size()), comparator_(loaded.grid), options_(options) {
    const std::vector<std::size_t> against = places_held_against(names);
    for (std::size_t i = 0; i < names.size(); ++i) {
      engines_.push_back(make_engine(names[i], loaded.grid, loaded.image));
      if (i == 0) continue;
      const bool fixed = find_engine(names[against[i]]).fixed_point;
      pairs_.push_back({against[i], i, fixed == find_engine(names[i]).fixed_point});
      golden_first_.push_back(!fixed);
    }
    verdicts_.resize(pairs_.size());
    for (auto& kind : tallies_) kind.resize(pairs_.size());
    for (auto& kind : speeds_) kind.resize(names.size());
  }

  Engine& first() { return *engines_[0]; }
  const std::vector<std::string>& names() const { return names_; }
  const std::vector<Pair>& pairs() const { return pairs_; }
  const std::vector<Hit>& hits(std::size_t engine) const { return hits_[engine]; }
  const Tally& tally(int kind, std::size_t pair) const { return tallies_[static_cast<std::size_t>(kind)][pair]; }
  const Speed& speed(int kind, std::size_t engine) const { return speeds_[static_cast<std::size_t>(kind)][engine]; }
  Agreement worst(std::size_t ray) const {
    Agreement worst = Agreement::kSame;
    for (const auto& verdicts : verdicts_) worst = std::max(worst, verdicts[ray].agreement);
    return worst;
  }

  /// Traces rays of one kind (a place in kKinds); `counted` says whether they enter the tallies.
  void run(std::span<const WorldRay> rays, int kind, bool counted) {
    grid_.resize(rays.size());
    quantise_all(rays, grid_, loaded_.grid.transform, loaded_.grid.box, kind == 1);
    auto& speeds = speeds_[static_cast<std::size_t>(kind)];
    for (std::size_t i = 0; i < engines_.size(); ++i) {
      hits_[i].assign(grid_.size(), Hit{});
      if (!counted && i > 0) continue;  // only where they end is asked for
      const double start = now();
      engines_[i]->trace(grid_, hits_[i], {}, options_);
      speeds[i].seconds += now() - start;
      speeds[i].rays += rays.size();
    }
    for (std::size_t p = 0; p < pairs_.size(); ++p) {
      verdicts_[p].assign(rays.size(), Verdict{});
      if (counted) judge(p, kind);
    }
  }

 private:
  void judge(std::size_t p, int kind) {
    const Pair& pair = pairs_[p];
    const std::vector<Hit>&hits_a = hits_[pair.a], &hits_b = hits_[pair.b];
    std::vector<Verdict>& verdicts = verdicts_[p];
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, grid_.size(), 256), [&](const auto& range) {
      for (std::size_t i = range.begin(); i < range.end(); ++i) {
        verdicts[i] = pair.identical ? Comparator::identical(hits_a[i], hits_b[i])
                                     : comparator_.compare(grid_[i], golden_first_[p] ? hits_a[i] : hits_b[i],
                                                           golden_first_[p] ? hits_b[i] : hits_a[i]);
      }
    });
    Tally& tally = tallies_[static_cast<std::size_t>(kind)][p];
    for (std::size_t i = 0; i < grid_.size(); ++i) {
      const Hit &a = hits_a[i], &b = hits_b[i];
      tally.counts.add(verdicts[i], a.hit(), b.hit());
      if (a.hit() && b.hit() && a.id == b.id)
        tally.depth_difference = std::max(tally.depth_difference, std::fabs(a.t - b.t));
      constexpr std::size_t kExamples = 5;
      if (verdicts[i].agreement != Agreement::kViolation || tally.examples.size() >= kExamples) continue;
      char text[512];
      const auto& r = grid_[i].record;
      std::snprintf(
          text, sizeof text,
          "%s ray: %s; %s: status %u triangle %d t %.9f, %s: status %u triangle %d t %.9f; origin (%d %d %d) direction "
          "(%d %d %d) t_max %u",
          kKinds[static_cast<std::size_t>(kind)], verdicts[i].reason, names_[pair.a].c_str(), a.status,
          static_cast<int>(a.id), a.t, names_[pair.b].c_str(), b.status, static_cast<int>(b.id), b.t, r.origin[0],
          r.origin[1], r.origin[2], r.direction[0], r.direction[1], r.direction[2], r.t_max);
      tally.examples.emplace_back(text);
    }
  }

  const LoadedScene& loaded_;
  std::vector<std::string> names_;
  std::vector<std::unique_ptr<Engine>> engines_;
  std::vector<Pair> pairs_;
  std::vector<bool> golden_first_;  ///< of a pair that is not identical
  std::vector<GridRay> grid_;
  std::vector<std::vector<Hit>> hits_;          ///< one an engine
  std::vector<std::vector<Verdict>> verdicts_;  ///< one a pair
  std::array<std::vector<Tally>, 2> tallies_;
  std::array<std::vector<Speed>, 2> speeds_;
  Comparator comparator_;
  TraceOptions options_;
};

/// How bright a hit looks under a lamp at the eye; at least 1.
std::uint8_t shown(const Surfaces& surfaces, const Hit& hit, const glm::dvec3& direction) {
  if (!hit.hit() || !surfaces.exists(hit.id)) return 0;
  const SurfacePoint point = surfaces.at(hit, direction);
  const auto facing = static_cast<float>(std::fabs(glm::dot(point.normal, direction)));
  const float bright = srgb_encode(luminance(glm::vec3(point.base)) * (0.15f + 0.85f * facing));
  return static_cast<std::uint8_t>(glm::clamp(bright * 255.0f, 1.0f, 255.0f));
}

/// How the difference picture is laid out.
struct Panels {
  Panels(const Size& size, std::size_t engines)
      : count(static_cast<int>(engines) + 1),
        scale(std::clamp(size.width / 320, 1, 8)),
        gap(4 * scale),
        head(text_height(scale) + 2 * gap),
        width(count * size.width + (count - 1) * gap),
        height(size.height + 2 * head) {}
  int count, scale, gap, head, width, height;
};

Raster difference_picture(const Picture& picture, const Size& size, const std::vector<std::string>& names) {
  const Panels layout(size, names.size());
  const int scale = layout.scale, gap = layout.gap, head = layout.head, panels = layout.count, engines = panels - 1;
  Raster image(layout.width, layout.height, 3, 0.09f);
  const auto place = [&](int x, int y) {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(size.width) + static_cast<std::size_t>(x);
  };
  const glm::vec3 ink(0.92f), ground(0.13f, 0.14f, 0.16f);
  for (int panel = 0; panel < panels; ++panel) {
    const int left = panel * (size.width + gap);
    const bool difference = panel == engines;
    const std::string title = difference ? "difference" : names[static_cast<std::size_t>(panel)];
    draw_text(image, left + gap, gap, title, ink, scale);
    for (int y = 0; y < size.height; ++y) {
      for (int x = 0; x < size.width; ++x) {
        const std::uint8_t value = picture.shades[difference ? 0 : static_cast<std::size_t>(panel)][place(x, y)];
        glm::vec3 color = value == 0 ? ground : glm::vec3(static_cast<float>(value) / 255.0f);
        if (difference) color *= value == 0 ? 0.6f : 0.45f;
        image.set_rgb(left + x, head + y, color);
      }
    }
    if (!difference) continue;
    // Disagreeing pixels are drawn last and large enough to be found; the worst on top.
    for (const Agreement agreement : {Agreement::kDepth, Agreement::kEdge, Agreement::kViolation}) {
      const int reach = agreement == Agreement::kViolation ? 2 * scale : scale;
      for (int y = 0; y < size.height; ++y) {
        for (int x = 0; x < size.width; ++x) {
          if (picture.agreement[place(x, y)] != agreement) continue;
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
    const auto count = std::count(picture.agreement.begin(), picture.agreement.end(), agreement);
    const std::string text = std::string(to_string(agreement)) + " " + std::to_string(count);
    draw_text(image, x + 10 * scale, y, text, ink, scale);
    x += 10 * scale + text_width(text, scale) + 16 * scale;
  }
  return image;
}

void print_tally(const char* kind, const Tally& tally, const std::string& name_a, const std::string& name_b,
                 bool same_kind) {
  const AgreementCounts& c = tally.counts;
  const double n = c.rays() > 0 ? static_cast<double>(c.rays()) : 1.0;
  std::printf("%s rays, %s against %s: %s (both hit %s, both miss %s, only %s hits %s, only %s hits %s)\n", kind,
              name_a.c_str(), name_b.c_str(), with_commas(c.rays()).c_str(), with_commas(c.both_hit).c_str(),
              with_commas(c.both_miss).c_str(), name_a.c_str(), with_commas(c.only_a).c_str(), name_b.c_str(),
              with_commas(c.only_b).c_str());
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
  json["examples"] = tally.examples;
  return json;
}

void run_compare(const CompareArguments& a, Program& program) {
  const Size size = parse_size(a.size);
  const std::vector<std::string> names = parse_engines(a.engines);
  if (names.size() < 2)
    throw UsageError("--engines takes two or more engines, as in golden,csim, not '" + a.engines + "'");
  TraceOptions trace = a.trace;
  trace.way_up = parse_way_up(a.way_up);
  trace.threads = program.common.threads;
  for (const std::string& name : names) {
    check_options(name, trace);
    if (program.common.two_levels == TwoLevels::kOn) check_instances(name);
  }
  bool shadow = false, primary = false;
  for (const std::string& kind : a.rays) (kind == "shadow" ? shadow : primary) = true;
  OutputFiles files;
  files.reads(gltf_files(a.scene));
  OutputFile *picture = nullptr, *stats = nullptr;
  if (!a.output.empty()) {
    if (is_linear_format(a.output))
      throw UsageError("the difference picture is for looking at: name a .png file, not " + a.output);
    const Panels drawn(size, names.size());
    check_raster(a.output, drawn.width, drawn.height, 3);
    picture = &files.add(a.output);
  }
  if (!a.stats.empty()) stats = &files.add(a.stats);

  const LoadedScene loaded = load_scene(a.scene, program.common);
  const ViewCamera camera = default_view(loaded.scene, loaded.world, a.camera);
  const Surfaces surfaces(loaded.scene, loaded.world, loaded.grid);
  Contest contest(loaded, names, trace);
  const Lighting lighting(surfaces, camera, parse_lights(a.lights),
                          is_indoors(surfaces, camera, loaded.grid.box, contest.first(), trace));

  Picture seen;
  if (picture) {
    const std::size_t count = static_cast<std::size_t>(size.width) * static_cast<std::size_t>(size.height);
    seen.shades.assign(names.size(), std::vector<std::uint8_t>(count));
    seen.agreement.assign(count, Agreement::kSame);
  }
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
    // Shadow rays start where the first engine's primary rays end, so it traces those in any case.
    contest.run(rays, 0, primary);
    if (picture && primary) {
      for (std::size_t i = 0; i < n; ++i) {
        const std::size_t pixel = pixel_of(i);
        for (std::size_t e = 0; e < names.size() && sample_of(i) == 0; ++e) {
          seen.shades[e][pixel] = shown(surfaces, contest.hits(e)[i], rays[i].direction);
        }
        seen.agreement[pixel] = std::max(seen.agreement[pixel], contest.worst(i));
      }
    }
    if (shadow) {
      shadow_rays.clear();
      for (std::size_t i = 0; i < n; ++i) {
        const Hit& hit = contest.hits(0)[i];
        if (!hit.hit() || !surfaces.exists(hit.id)) continue;
        const SurfacePoint point = surfaces.at(hit, rays[i].direction);
        lighting.sample(point, a.light_samples, sample_of(i), hash_combine(hash_combine(a.seed, pixel_of(i)), 0x5348u),
                        samples);
        for (const LightSample& s : samples) shadow_rays.push_back(surfaces.leave(point, s.direction, s.distance));
      }
      if (!shadow_rays.empty()) contest.run(shadow_rays, 1, true);
    }
    progress.update(static_cast<double>(begin + n) / static_cast<double>(total));
  }
  progress.finish();

  std::uint64_t violations = 0;
  std::printf("%s, %s triangles, %dx%d, engines %s, way up: %s\n", loaded.name.c_str(),
              with_commas(loaded.world.vertices.size()).c_str(), size.width, size.height, a.engines.c_str(),
              a.way_up.c_str());
  print_levels(loaded);
  const bool asked[2] = {primary, shadow};
  for (int kind = 0; kind < 2; ++kind) {
    if (!asked[kind]) continue;
    for (std::size_t p = 0; p < contest.pairs().size(); ++p) {
      const Pair& pair = contest.pairs()[p];
      const Tally& tally = contest.tally(kind, p);
      print_tally(kKinds[static_cast<std::size_t>(kind)], tally, names[pair.a], names[pair.b], pair.identical);
      violations += tally.counts.violations();
      for (const std::string& example : tally.examples) std::printf("  violation: %s\n", example.c_str());
    }
    std::printf("  rays/s:");
    for (std::size_t e = 0; e < names.size(); ++e)
      std::printf(" %s %s%s", names[e].c_str(), with_unit(contest.speed(kind, e).rays_s()).c_str(),
                  e + 1 < names.size() ? "," : "\n");
  }
  if (picture) write_raster(*picture, difference_picture(seen, size, names));
  if (stats) {
    nlohmann::ordered_json json = {{"command", "compare"},
                                   {"scene", scene_json(loaded)},
                                   {"engines", names},
                                   {"way_up", a.way_up},
                                   {"mailbox", trace.mailbox},
                                   {"camera", camera.name},
                                   {"width", size.width},
                                   {"height", size.height},
                                   {"spp", a.spp},
                                   {"violations", violations},
                                   {"pairs", nlohmann::ordered_json::array()},
                                   {"rays_s", nlohmann::ordered_json::object()}};
    for (std::size_t p = 0; p < contest.pairs().size(); ++p) {
      const Pair& pair = contest.pairs()[p];
      nlohmann::ordered_json entry = {{"engines", {names[pair.a], names[pair.b]}}, {"bit_for_bit", pair.identical}};
      for (int kind = 0; kind < 2; ++kind) {
        if (asked[kind]) entry[kKinds[static_cast<std::size_t>(kind)]] = tally_json(contest.tally(kind, p));
      }
      json["pairs"].push_back(entry);
    }
    for (int kind = 0; kind < 2; ++kind) {
      if (!asked[kind]) continue;
      for (std::size_t e = 0; e < names.size(); ++e)
        json["rays_s"][kKinds[static_cast<std::size_t>(kind)]][names[e]] = contest.speed(kind, e).rays_s();
    }
    stats->write(json.dump(2) + "\n");
  }
  files.commit();
  for (const auto& file : files.files()) std::printf("wrote %s\n", file->path().c_str());
  std::printf("%s\n", violations == 0 ? "0 violations" : (with_commas(violations) + " violations").c_str());
  if (violations > 0) program.exit_code = 1;
}

}  // namespace

void add_compare(CLI::App& app, Program& program) {
  CLI::App* command =
      app.add_subcommand("compare", "Trace the same rays through two or more engines and classify every difference");
  auto a = std::make_shared<CompareArguments>();
  command->add_option("scene", a->scene, kSceneHelp)->required()->type_name("SCENE");
  command->add_option("-e,--engines", a->engines, "Two engines or more, see below")
      ->capture_default_str()
      ->type_name("A,B,...");
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
  add_mailbox(*command, a->trace.mailbox);
  command->add_option("--seed", a->seed, "Of the sample points")->capture_default_str();
  command->add_option("-o,--output", a->output, "Picture: what each engine sees, and where their primary rays differ")
      ->type_name("FILE");
  command->add_option("--stats", a->stats, "The table as JSON")->type_name("FILE");
  add_engine_options(*command);
  add_two_level(*command, program);
  add_common(*command, program);
  command->footer(
      "Engines:\n" + engine_help() +
      "Classes, golden against a fixed-point engine (docs/program.md):\n"
      "  same       the same triangle, t within the proven bound, or both miss\n"
      "  edge       the ray passes close to an edge of the triangle in question (2^-20 of the scene box; 2^-19.4 for "
      "its longest edge)\n"
      "  depth      two triangles closer together than the proven depth bounds\n"
      "  violation  anything else; the exit code is 1\n"
      "Each engine is held against the first one, a fixed-point engine against the first that makes the same choices "
      "among equal hits (csim, rtl, board): these must agree bit for bit. Others (stream, packets) are held against "
      "golden.\n"
      "Examples:\n"
      "  retrace compare room.glb --engines golden,csim --size 640x480\n"
      "  retrace compare room.glb --engines golden,csim --rays shadow -o difference.png --stats compare.json\n"
      "  retrace compare room.glb --engines golden,csim,rtl --size 320x240 -o difference.png\n"
      "  retrace compare room.glb --engines golden,csim --way-up parent --mailbox\n");
  command->callback([a, &program] { run_compare(*a, program); });
}

}  // namespace retrace::cli
