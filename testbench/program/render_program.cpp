// retrace render --engine spu --program NAME: a picture by a program of the shader unit.
#include <cstdio>

#include "golden/engine/registry.hpp"
#include "golden/gltf/gltf_loader.hpp"
#include "golden/render/shader_frame.hpp"
#include "testbench/program/cmd_render.hpp"
#include "testbench/program/progress.hpp"

namespace retrace::cli {
namespace {

constexpr std::array<const char*, static_cast<std::size_t>(shader::Counter::kCount)> kCounterNames{
    "arithmetic", "memory", "texture", "control", "trace"};

std::string status_name(std::uint32_t code) {
  for (const shader::StatusEntry& entry : shader::kStatusTable)
    if (entry.code == code) return std::string(entry.name);
  return std::to_string(code);
}

/// The listing with how often each instruction was executed in front of it.
void print_profile(const ShaderProgram& program, const ShaderFrame& frame) {
  std::uint64_t all = 0;
  for (const std::uint64_t count : frame.profile) all += count;
  std::printf("  place    executions  share  line  instruction\n");
  for (std::size_t i = 0; i < frame.profile.size(); ++i) {
    if (frame.profile[i] == 0) continue;
    std::printf("  %5zu  %12s  %4.1f %%  %4d  %s\n", i, with_commas(frame.profile[i]).c_str(),
                100.0 * static_cast<double>(frame.profile[i]) / static_cast<double>(all), program.code.lines[i],
                shader::disassemble(program.code.words[i]).c_str());
  }
}

}  // namespace

bool is_shader_engine(const std::string& engine) { return engine == "spu" || engine.starts_with("spu:"); }

void run_with_program(RenderArguments& a, const Common& common) {
  const std::string rays = a.engine == "spu" ? "golden" : a.engine.substr(4);
  if (a.program.empty()) throw UsageError("engine spu takes --program: " + shader_program_names() + ", or a file .asm");
  if (a.on_chip || a.animation || !a.aovs.empty())
    throw UsageError("engine spu makes a single picture: no --on-chip, --animation or --aov");
  check_options(rays, a.options.trace);
  if (common.two_levels == TwoLevels::kOn) check_instances(rays);
  const ShaderProgram program = find_shader_program(a.program);
  ShaderFrameOptions options;
  options.width = a.options.width;
  options.height = a.options.height;
  options.samples = a.chose_spp ? a.options.spp : 1;
  options.trace = a.options.trace;
  options.profile = a.profile;
  OutputFiles files;
  files.reads(gltf_files(a.scene));
  OutputFile& picture = files.add(a.output);
  OutputFile* const stats_file = a.stats.empty() ? nullptr : &files.add(a.stats);

  const LoadedScene loaded = load_scene(a.scene, common);
  const ViewCamera view = default_view(loaded.scene, loaded.world, a.camera);
  const Surfaces surfaces(loaded.scene, loaded.world, loaded.grid);
  const ShaderScene scene = make_shader_scene(program, surfaces, view, options.width, options.height);
  const std::unique_ptr<Engine> engine = make_engine(rays, loaded.grid, loaded.image);
  Progress progress("render " + loaded.name + " (" + program.name + ")", common.quiet);
  options.progress = [&](double fraction) { progress.update(fraction); };
  const ShaderFrame frame = run_shader_frame(scene, loaded.grid, *engine, options);
  progress.finish();
  write_raster(picture, is_linear_format(a.output) ? frame.color : shader_picture(frame.color));
  if (stats_file != nullptr) {
    nlohmann::ordered_json counts, ends;
    for (std::size_t i = 0; i < kCounterNames.size(); ++i) counts[kCounterNames[i]] = frame.counts[i];
    for (const auto& [status, threads] : frame.ends) ends[status_name(status)] = threads;
    stats_file->write(nlohmann::ordered_json{{"command", "render"},
                                             {"scene", scene_json(loaded)},
                                             {"engine", a.engine},
                                             {"program", program.name},
                                             {"words", program.code.words.size()},
                                             {"width", options.width},
                                             {"height", options.height},
                                             {"spp", options.samples},
                                             {"threads", frame.threads},
                                             {"instructions", frame.steps},
                                             {"rays", frame.rays},
                                             {"any_hit_rays", frame.any_rays},
                                             {"operations", counts},
                                             {"ends", ends},
                                             {"memory_vectors", scene.memory.size()},
                                             {"seconds", {{"run", frame.run_s}, {"trace", frame.trace_s}}}}
                          .dump(2) +
                      "\n");
  }
  files.commit();
  std::printf("%s, %s triangles, %dx%d, %d samples a pixel, program %s of %zu words, rays by %s, camera %s\n",
              loaded.name.c_str(), with_commas(loaded.world.vertices.size()).c_str(), options.width, options.height,
              options.samples, program.name.c_str(), program.code.words.size(), engine->name().c_str(),
              view.name.c_str());
  const auto threads = static_cast<double>(frame.threads);
  std::printf("  a thread: %.1f instructions, %.2f rays (%.2f any hit)", static_cast<double>(frame.steps) / threads,
              static_cast<double>(frame.rays) / threads, static_cast<double>(frame.any_rays) / threads);
  for (std::size_t i = 0; i < kCounterNames.size(); ++i)
    std::printf("%s %s %.1f", i == 0 ? ";" : ",", kCounterNames[i], static_cast<double>(frame.counts[i]) / threads);
  std::printf("\n");
  for (const auto& [status, count] : frame.ends)
    if (status != static_cast<std::uint32_t>(shader::kStatusDone))
      std::printf("  %s threads ended with %s\n", with_commas(count).c_str(), status_name(status).c_str());
  std::printf("  %s vectors of memory; run in %.2f s, traced in %.2f s\n", with_commas(scene.memory.size()).c_str(),
              frame.run_s, frame.trace_s);
  if (a.profile) print_profile(program, frame);
  for (const auto& file : files.files()) std::printf("  wrote %s\n", file->path().c_str());
}

}  // namespace retrace::cli
