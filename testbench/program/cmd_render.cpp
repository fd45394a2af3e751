// retrace render: a scene through one engine to pictures.
#include "testbench/program/cmd_render.hpp"

#include <charconv>
#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>

#include "golden/base/options.hpp"
#include "golden/engine/registry.hpp"
#include "golden/gltf/gltf_loader.hpp"
#include "golden/render/shader_frame.hpp"
#include "testbench/program/commands.hpp"
#include "testbench/program/progress.hpp"

namespace retrace::cli {
namespace {

std::filesystem::path with_suffix(const std::filesystem::path& path, const std::string& suffix) {
  std::filesystem::path result = path;
  result.replace_extension();
  result += suffix;
  return result;
}

void print_work(const char* kind, const WorkTotals& work) {
  if (work.rays == 0) return;
  const double n = static_cast<double>(work.rays);
  std::printf("  %-9s %12s rays   per ray: down %.2f, up %.2f, leaf %.2f, tests %.2f", kind,
              with_commas(work.rays).c_str(), static_cast<double>(work.down) / n, static_cast<double>(work.up) / n,
              static_cast<double>(work.leaf) / n, static_cast<double>(work.tests) / n);
  if (work.skipped > 0) std::printf(", skipped %.2f", static_cast<double>(work.skipped) / n);
  std::printf("\n");
}

}  // namespace

nlohmann::ordered_json work_json(const WorkTotals& work) {
  return {{"rays", work.rays}, {"down", work.down},   {"up", work.up},
          {"leaf", work.leaf}, {"tests", work.tests}, {"skipped", work.skipped}};
}

double parse_exposure(const std::string& text, double automatic) {
  if (text == "auto") return automatic;
  double stops = 0;
  const auto [end, status] = std::from_chars(text.data(), text.data() + text.size(), stops);
  if (status != std::errc() || end != text.data() + text.size() || !(std::fabs(stops) <= 64)) {
    throw UsageError("--exposure takes 'auto' or a number of stops from -64 to 64, not '" + text + "'");
  }
  return std::exp2(stops);
}

void note_cut_rays(std::uint64_t rays, const Common& common) {
  if (rays > 0)
    note(common, with_commas(rays) +
                     " rays have passed more transparent surfaces than are followed; the last one "
                     "counts as opaque");
}

std::vector<std::filesystem::path> aov_paths(const RenderArguments& a, const std::filesystem::path& output) {
  std::vector<std::filesystem::path> paths;
  for (const std::string& name : a.aovs) {
    paths.push_back(with_suffix(output, "." + name + ".exr"));
    paths.push_back(with_suffix(output, "." + name + ".png"));
  }
  return paths;
}

void write_aovs(const RenderArguments& a, const RenderResult& result, const std::vector<OutputFile*>& outputs) {
  const ColorMap map = a.color_map == "viridis" ? ColorMap::kViridis : ColorMap::kInferno;
  for (std::size_t i = 0; i < a.aovs.size(); ++i) {
    const std::string& name = a.aovs[i];
    std::vector<std::string> channels;
    if (name == "depth") channels = {"Z"};
    if (name == "normal") channels = {"N.X", "N.Y", "N.Z"};
    if (name == "id") {
      write_ids(*outputs[2 * i], result.depth.width, result.depth.height, result.id, "id");
    } else {
      write_raster(*outputs[2 * i], aov_data(result, name), channels);
    }
    write_raster(*outputs[2 * i + 1], aov_picture(result, name, map));
  }
}

namespace {

void run_render(RenderArguments& a, const Common& common) {
  // Everything that the arguments alone can get wrong is found before the scene is built.
  const std::filesystem::path output = a.output;
  const bool linear = is_linear_format(output);
  const Size size = parse_size(a.size);
  check_raster(output, size.width, size.height, linear ? 4 : 3);
  if (is_written_through(output) && (a.animation || !a.aovs.empty()))
    throw UsageError(a.output + " is one stream: --aov and --animation write several files");
  RenderOptions& options = a.options;
  options.width = size.width;
  options.height = size.height;
  options.trace.way_up = parse_way_up(a.way_up);
  options.trace.threads = common.threads;
  options.lights = parse_lights(a.lights);
  parse_exposure(a.exposure, 1.0);
  if (is_shader_engine(a.engine)) return run_with_program(a, common);
  if (!a.program.empty() || a.profile) throw UsageError("--program and --profile are for engine spu");
  check_options(a.engine, options.trace);
  if (common.two_levels == TwoLevels::kOn) check_instances(a.engine);
  check_aovs(a.aovs, a.engine);
  if (a.on_chip && a.animation) throw UsageError("--on-chip makes a single picture: no --animation");
  if (a.on_chip) return run_on_chip(a, common);
  if (a.animation) return run_animation(a, common);
  OutputFiles files;
  files.reads(gltf_files(a.scene));
  OutputFile& picture = files.add(output);
  std::vector<OutputFile*> aovs;
  for (const std::filesystem::path& path : aov_paths(a, output)) aovs.push_back(&files.add(path));
  OutputFile* const stats_file = a.stats.empty() ? nullptr : &files.add(a.stats);

  const LoadedScene loaded = load_scene(a.scene, common);
  const ViewCamera camera = default_view(loaded.scene, loaded.world, a.camera);
  const Surfaces surfaces(loaded.scene, loaded.world, loaded.grid);
  const std::unique_ptr<Engine> engine = make_engine(a.engine, loaded.grid, loaded.image);
  Progress progress("render " + loaded.name + " (" + engine->name() + ")", common.quiet);
  options.progress = [&](double fraction) { progress.update(fraction); };
  const RenderResult result = render(surfaces, camera, loaded.grid.box, *engine, options);
  progress.finish();
  note_cut_rays(result.cut_rays, common);

  const double write_start = now();
  const double exposure = parse_exposure(a.exposure, result.exposure);
  write_raster(picture, linear ? result.color : develop(result, exposure));
  write_aovs(a, result, aovs);
  const std::uint64_t rays = result.camera.rays + result.shadow.rays + result.occlusion.rays;
  const double rays_s = result.trace_s > 0 ? static_cast<double>(rays) / result.trace_s : 0.0;
  if (stats_file != nullptr) {
    nlohmann::ordered_json names = nlohmann::ordered_json::array();
    for (const auto& file : files.files())
      if (file.get() != stats_file) names.push_back(file->path().string());
    const nlohmann::ordered_json stats = {{"command", "render"},
                                          {"scene", scene_json(loaded)},
                                          {"engine", engine->name()},
                                          {"way_up", a.way_up},
                                          {"mailbox", options.trace.mailbox},
                                          {"camera", camera.name},
                                          {"width", options.width},
                                          {"height", options.height},
                                          {"spp", options.spp},
                                          {"lights", result.lights},
                                          {"exposure", exposure},
                                          {"rays",
                                           {{"camera", work_json(result.camera)},
                                            {"shadow", work_json(result.shadow)},
                                            {"occlusion", work_json(result.occlusion)}}},
                                          {"seconds",
                                           {{"quantise", result.quantise_s},
                                            {"trace", result.trace_s},
                                            {"shade", result.shade_s},
                                            {"write", now() - write_start},
                                            {"total", result.total_s}}},
                                          {"rays_s", rays_s},
                                          {"files", names}};
    stats_file->write(stats.dump(2) + "\n");
  }
  files.commit();

  std::printf("%s, %s triangles, %dx%d, %d samples a pixel, engine %s, camera %s, light: %s\n", loaded.name.c_str(),
              with_commas(loaded.world.vertices.size()).c_str(), options.width, options.height, options.spp,
              engine->name().c_str(), camera.name.c_str(), result.lights.c_str());
  const EngineKind& kind = find_engine(a.engine);
  if (kind.counts_work) {
    print_work("camera", result.camera);
    print_work("shadow", result.shadow);
    print_work("occlusion", result.occlusion);
  }
  if (kind.summary) std::printf("  %s\n", kind.summary(*engine).c_str());
  print_levels(loaded);
  std::printf("  built in %.2f s, traced in %.2f s (%s rays/s), shaded in %.2f s\n", loaded.build_s, result.trace_s,
              with_unit(rays_s).c_str(), result.shade_s + result.quantise_s);
  for (const auto& file : files.files()) std::printf("  wrote %s\n", file->path().c_str());
}

}  // namespace

void add_render(CLI::App& app, Program& program) {
  CLI::App* command =
      app.add_subcommand("render", "Render a glTF scene through an engine to a picture, with AOVs on request");
  auto a = std::make_shared<RenderArguments>();
  command->add_option("scene", a->scene, kSceneHelp)->required()->type_name("SCENE");
  command
      ->add_option("-o,--output", a->output,
                   "Picture: .png (tone mapped), .exr (linear radiance and coverage), .hdr (linear radiance), ...")
      ->required()
      ->type_name("FILE");
  command->add_option("-e,--engine", a->engine, "Engine, see below")->capture_default_str()->type_name("ENGINE");
  command->add_option("-s,--size", a->size, "Size in pixels")->capture_default_str()->type_name("WxH");
  command
      ->add_option("-c,--camera", a->camera,
                   "Camera by name or number; default: the first, or a view of the whole scene")
      ->type_name("CAMERA");
  const CLI::Option* const spp = command->add_option("--spp", a->options.spp, "Samples a pixel")
                                     ->capture_default_str()
                                     ->check(CLI::Range(1, 65536))
                                     ->type_name("N");
  command->add_flag(
      "--on-chip", a->on_chip,
      "The engine makes rays and pixels by itself, lit from the camera or, with --shadows, from above it: "
      "engine golden, csim or rtl, --spp 1 (default), 2 or 4");
  command
      ->add_option("--program", a->program,
                   "Of engine spu: " + shader_program_names() + ", or a file .asm (docs/shader.md)")
      ->type_name("NAME");
  command->add_flag("--profile", a->profile, "Print how often each instruction of the program was executed");
  const CLI::Option* const shadows =
      command->add_flag("--shadows,!--no-shadows", a->options.shadows,
                        "Shadow rays (on unless --no-shadows; with --on-chip off unless --shadows)");
  command->add_option("--ao", a->options.ao, "Ambient occlusion rays a sample; 0: none")
      ->capture_default_str()
      ->check(CLI::Range(0, 4096))
      ->type_name("N");
  command
      ->add_option("--ao-distance", a->options.ao_distance,
                   "Reach of ambient occlusion in scene units; default: a sixth of the scene")
      ->check(PositiveReal())
      ->type_name("LENGTH");
  command->add_option("--light-samples", a->options.light_samples, "Shadow rays to emissive surfaces a sample")
      ->capture_default_str()
      ->check(CLI::Range(1, 1024))
      ->type_name("N");
  command
      ->add_option("--lights", a->lights,
                   "The scene's lights, a rig that follows the camera, or the rig only where there are none")
      ->capture_default_str()
      ->check(CLI::IsMember({"auto", "scene", "rig"}));
  command->add_option("--exposure", a->exposure, "Stops, or auto")->capture_default_str()->type_name("EV");
  command->add_option("--aov", a->aovs, "Further images, comma-separated, see below")
      ->delimiter(',')
      ->type_name("NAME,...");
  command->add_option("--color-map", a->color_map, "Of the heat maps")
      ->capture_default_str()
      ->check(CLI::IsMember({"inferno", "viridis"}));
  const CLI::Option* const way_up =
      command
          ->add_option("--way-up", a->way_up, "How a walk goes up the tree: stack (golden only), parent or face links")
          ->capture_default_str()
          ->check(CLI::IsMember({"stack", "parent", "face"}));
  const CLI::Option* const mailbox = add_mailbox(*command, a->options.trace.mailbox);
  command->add_option("--seed", a->options.seed, "Of the sample points")->capture_default_str();
  command->add_option("--stats", a->stats, "Counters and times as JSON")->type_name("FILE");
  CLI::Option* animation = command->add_flag("--animation", a->animation,
                                             "A numbered sequence of an animated glTF file, and a video if ffmpeg is "
                                             "installed; FILE-0000.png, or a run of # in FILE is the number");
  const char* group = "Animation";
  animation->group(group);
  const auto moving = [&](CLI::Option* option) { option->needs(animation)->group(group); };
  moving(command->add_option("--fps", a->fps, "Frames a second")
             ->capture_default_str()
             ->check(RealRange(0.001, 1000.0))
             ->type_name("N"));
  moving(command->add_option("--frames", a->frames, "Number of frames; default: to the end of the animation")
             ->check(CLI::Range(1, 100000))
             ->type_name("N"));
  moving(command->add_option("--start", a->start, "Time of the first frame")
             ->capture_default_str()
             ->check(RealRange(0.0, 1e6))
             ->type_name("SECONDS"));
  moving(command->add_option("--clip", a->clip, "Number of the animation in the file")
             ->capture_default_str()
             ->type_name("N"));
  moving(
      command
          ->add_option(
              "--structure", a->structure,
              "two-level: a tree an object, only instance records and the top level follow motion; one-tree: rebuilt "
              "over all triangles every frame, which any engine can walk")
          ->capture_default_str()
          ->check(CLI::IsMember({"two-level", "one-tree"})));
  moving(command
             ->add_option("--full-rebuild", a->full_rebuild,
                          "When to build the frame from nothing beside the two-level structure: to time it at the "
                          "first frame, or at every one, where its picture must be the same, or never")
             ->capture_default_str()
             ->check(CLI::IsMember({"first", "every", "never"})));
  CLI::Option* video = command->add_option("--video", a->video, "Where the video goes; default FILE.mp4");
  moving(video->type_name("FILE"));
  moving(command->add_flag("--no-video", a->no_video, "Only the sequence")->excludes(video));
  add_engine_options(*command);
  add_two_level(*command, program);
  add_common(*command, program);
  std::string footer = "Engines:\n" + engine_help() +
                       "  spu        the shader unit's interpreter with --program; spu:ENGINE: rays by another engine\n"
                       "AOVs (each written as FILE.NAME.exr with the data and FILE.NAME.png to look at):\n";
  for (const Aov& aov : known_aovs()) {
    footer += "  " + std::string(aov.name) + std::string(10 - std::string(aov.name).size(), ' ') + aov.help + "\n";
  }
  footer +=
      "Examples:\n"
      "  retrace make-scene room -o room.glb\n"
      "  retrace render room.glb -o room.png --size 1280x720 --spp 16 --ao 4\n"
      "  retrace render room.glb -o room.png --engine csim --aov depth,steps,tests\n"
      "  retrace render room.glb -o room.exr --camera 0 --stats room.json\n"
      "  retrace render knot -o glass.png --engine spu --program refraction\n"
      "  retrace make-scene creatures -o creatures.glb\n"
      "  retrace render carousel --two-level auto --engine csim -o carousel.png\n"
      "  retrace render creatures.glb -o creatures.png --animation --fps 25\n"
      "  retrace render carousel.glb -o carousel.png --animation --frames 4 --engine csim --full-rebuild every\n";
  command->footer(footer);
  command->callback([a, way_up, mailbox, spp, shadows, &program] {
    a->chose_shadows = shadows->count() > 0;
    a->chose_spp = spp->count() > 0;
    a->chose_walk = way_up->count() > 0 || mailbox->count() > 0;
    run_render(*a, program.common);
  });
}

}  // namespace retrace::cli
