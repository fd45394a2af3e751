// Pictures by programs of the shader unit: a scene and a view as constants and memory, threads for all samples, their rays through an engine.
// What a program finds there: docs/shader.md.
#pragma once
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "golden/render/raster.hpp"
#include "golden/render/surface.hpp"
#include "golden/render/view.hpp"
#include "golden/shader/assembler.hpp"
#include "golden/shader/machine.hpp"

namespace retrace {

/// A program, where its threads begin, and the shader of surfaces and of nothing.
struct ShaderProgram {
  std::string name;
  std::string text;  ///< the source
  shader::Assembled code;
  std::uint32_t start = 0, surface = 0, sky = 0;
};
/// A picture of the library by its name, or a file: its threads begin at `main`, or, without that label, at its first instruction; hits are shaded
/// by `surface`, misses by `sky`. Throws Error or AssemblyError.
ShaderProgram find_shader_program(const std::string& name);
/// "environment, phong, ...": the pictures of the library.
std::string shader_program_names();

/// What the threads of a program see.
struct ShaderScene {
  shader::Setting setting;
  std::vector<shader::Vector> memory;
};
/// Throws Error if the scene needs more vectors than an address can say.
ShaderScene make_shader_scene(const ShaderProgram& program, const Surfaces& surfaces, const ViewCamera& view, int width,
                              int height);

struct ShaderFrameOptions {
  int width = 640, height = 480, samples = 1;
  TraceOptions trace;
  bool profile = false;
  std::function<void(double)> progress;
};
struct ShaderFrame {
  Raster color;  ///< linear
  std::uint64_t threads = 0, steps = 0, rays = 0, any_rays = 0;
  std::array<std::uint64_t, static_cast<std::size_t>(shader::Counter::kCount)> counts{};
  std::map<std::uint32_t, std::uint64_t> ends;  ///< threads by status
  std::vector<std::uint64_t> profile;           ///< executions by place
  double trace_s = 0, run_s = 0;
};
/// Threads of all samples of all pixels. A program that writes to memory runs thread after thread, in the order of the pixels.
ShaderFrame run_shader_frame(const ShaderScene& scene, const GridScene& grid, Engine& engine,
                             const ShaderFrameOptions& options);

/// Linear colours, cut at 1, as a screen shows them.
Raster shader_picture(const Raster& color);

}  // namespace retrace
