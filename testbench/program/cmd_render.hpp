// What `retrace render` and `retrace render --animation` share.
#pragma once
#include <memory>
#include <string>
#include <vector>

#include "golden/base/output_file.hpp"
#include "golden/render/renderer.hpp"
#include "testbench/program/workspace.hpp"

namespace retrace::cli {

struct RenderArguments {
  std::string scene, output, engine = "golden", size = "640x480", camera, way_up = "face", exposure = "auto",
                             lights = "auto", stats, color_map = "inferno", program;
  std::vector<std::string> aovs;
  bool chose_walk = false;  ///< --way-up or --mailbox was given
  bool chose_spp = false;
  bool on_chip = false;
  bool chose_shadows = false;
  bool profile = false;
  RenderOptions options;

  bool animation = false;
  double fps = 24.0, start = 0.0;
  int frames = 0;  ///< 0: to the end of the animation
  std::uint32_t clip = 0;
  std::string structure = "two-level", full_rebuild = "first", video;
  bool no_video = false;
};

nlohmann::ordered_json work_json(const WorkTotals& work);
/// The factor that --exposure means; `automatic` for auto. Throws UsageError.
double parse_exposure(const std::string& text, double automatic);
/// A note about RenderResult::cut_rays, if there are any.
void note_cut_rays(std::uint64_t rays, const Common& common);
/// Where the AOVs of a picture that goes to `output` go: each as data and as something to look at, in this order.
std::vector<std::filesystem::path> aov_paths(const RenderArguments& a, const std::filesystem::path& output);
/// Writes the AOVs to the outputs of these paths.
void write_aovs(const RenderArguments& a, const RenderResult& result, const std::vector<OutputFile*>& outputs);

/// A numbered sequence of an animated file, and a video. Arguments are checked as far as they are those of a single
/// picture.
void run_animation(RenderArguments& a, const Common& common);

/// The engine makes the picture itself. Arguments are checked as far as they are those of any picture.
void run_on_chip(const RenderArguments& a, const Common& common);

/// Whether `engine` is the shader unit, alone or with the engine of its rays: spu, spu:csim.
bool is_shader_engine(const std::string& engine);
/// A program of the shader unit makes the picture.
void run_with_program(RenderArguments& a, const Common& common);

}  // namespace retrace::cli
