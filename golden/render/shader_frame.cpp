// See shader_frame.hpp.
#include "golden/render/shader_frame.hpp"

#include <tbb/blocked_range.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>

#include "golden/base/clock.hpp"
#include "golden/render/tonemap.hpp"
#include "golden/shader/float.hpp"
#include "golden/shader/programs.hpp"

namespace retrace {
namespace {

using shader::Vector;

constexpr const char* kPictures = "pictures";
constexpr std::uint32_t kTriangleVectors = 6;
constexpr std::uint32_t kMaterialVectors = 4;
constexpr std::size_t kBatch = 1 << 14;  // threads at a time

float number(double x) { return golden::float_round(std::isfinite(x) ? x : 0.0); }
Vector vector(const glm::dvec3& xyz, double w = 0.0) {
  return {number(xyz.x), number(xyz.y), number(xyz.z), number(w)};
}

/// Labels of the library's pictures: those that have a shader of surfaces, and those that need none.
std::vector<std::string> pictures(const shader::Assembled& code) {
  std::vector<std::string> names{"heightfield", "path"};
  for (const auto& [label, place] : code.labels) {
    constexpr std::string_view kSuffix = "_surface";
    if (label.ends_with(kSuffix)) names.push_back(label.substr(0, label.size() - kSuffix.size()));
  }
  std::ranges::sort(names);
  return names;
}

const shader::Assembled& picture_code(std::string_view* text = nullptr) {
  const auto program = std::ranges::find(shader::library(), kPictures, &shader::LibraryProgram::name);
  static const shader::Assembled code = shader::assemble(program->text, "pictures.asm");
  if (text != nullptr) *text = program->text;
  return code;
}

std::uint32_t label(const shader::Assembled& code, const std::string& name, std::uint32_t otherwise) {
  const auto at = code.labels.find(name);
  return at == code.labels.end() ? otherwise : at->second;
}

/// Rows of an affine map of the place in the frame: (per column, per row, at the corner) by axis.
std::array<Vector, 3> rows(const glm::dvec3& at_0, const glm::dvec3& at_width, const glm::dvec3& at_height, int width,
                           int height) {
  std::array<Vector, 3> made{};
  for (int axis = 0; axis < 3; ++axis) {
    made[static_cast<std::size_t>(axis)] = {number((at_width[axis] - at_0[axis]) / width),
                                            number((at_height[axis] - at_0[axis]) / height), number(at_0[axis]), 0.0f};
  }
  return made;
}

/// Surroundings for mirrors: a sky, a ground and a window, by direction (x, y).
std::vector<Vector> surroundings(std::uint32_t width, std::uint32_t height) {
  std::vector<Vector> texels;
  for (std::uint32_t row = 0; row < height; ++row) {
    for (std::uint32_t column = 0; column < width; ++column) {
      const double x = 2.0 * (column + 0.5) / width - 1, y = 1 - 2.0 * (row + 0.5) / height;
      glm::dvec3 colour = y > 0 ? glm::mix(glm::dvec3(0.75, 0.82, 0.9), glm::dvec3(0.15, 0.3, 0.65), y)
                                : glm::mix(glm::dvec3(0.35, 0.3, 0.25), glm::dvec3(0.1, 0.08, 0.06), -y);
      if (std::abs(x + 0.4) < 0.18 && std::abs(y - 0.5) < 0.2 && std::abs(x + 0.4) > 0.015 && std::abs(y - 0.5) > 0.015)
        colour = glm::dvec3(1.6);
      texels.push_back(vector(colour, 1.0));
    }
  }
  return texels;
}

/// Heights in w, colours in xyz.
std::vector<Vector> hills(std::uint32_t size) {
  std::vector<Vector> texels;
  for (std::uint32_t row = 0; row < size; ++row) {
    for (std::uint32_t column = 0; column < size; ++column) {
      const double x = 2 * M_PI * column / size, y = 2 * M_PI * row / size;
      const double height = 0.5 + 0.2 * std::sin(x) * std::cos(y) + 0.15 * std::sin(2 * x + 1) * std::sin(3 * y) +
                            0.08 * std::cos(5 * x - 2 * y) + 0.04 * std::sin(9 * x) * std::cos(8 * y + 2);
      const glm::dvec3 colour = height < 0.45   ? glm::dvec3(0.2, 0.4, 0.15)
                                : height < 0.65 ? glm::dvec3(0.45, 0.38, 0.28)
                                                : glm::dvec3(0.9);
      texels.push_back(vector(colour, height));
    }
  }
  return texels;
}

/// Where the light stands, on the grid: the scene's first lamp that has a place, or beside the camera.
glm::dvec3 light_place(const Surfaces& surfaces, const ViewCamera& view) {
  const Scene& scene = surfaces.scene();
  const GridTransform& transform = surfaces.grid().transform;
  const std::vector<glm::dmat4> world = scene.world_transforms();
  for (const std::uint32_t node : scene.reachable()) {
    const std::uint32_t light = scene.nodes[node].light;
    if (light != kNone && scene.lights[light].type != Light::Type::kDirectional)
      return transform.to_grid(glm::dvec3(world[node][3]));
  }
  const glm::dvec3 eye = transform.to_grid(view.eye());
  constexpr double kUnit = 1 << contract::kPositionFrac;
  bool inside = true;
  for (unsigned axis = 0; axis < 3; ++axis) {
    const double place = eye[static_cast<int>(axis)] * kUnit;
    inside = inside && place > surfaces.grid().box[2 * axis] && place < surfaces.grid().box[2 * axis + 1];
  }
  return eye + (glm::dvec3(view.world[1]) * 0.7 - glm::dvec3(view.world[0])) * (inside ? 0.05 : 0.7);
}

}  // namespace

std::string shader_program_names() {
  std::string text;
  for (const std::string& name : pictures(picture_code())) text += (text.empty() ? "" : ", ") + name;
  return text;
}

ShaderProgram find_shader_program(const std::string& name) {
  ShaderProgram program;
  program.name = name;
  if (name.find('.') == std::string::npos && name.find('/') == std::string::npos) {
    std::string_view text;
    program.code = picture_code(&text);
    program.text = text;
    if (!std::ranges::count(pictures(program.code), name))
      throw UsageError("there is no program '" + name + "'; there are: " + shader_program_names() + ", or a file .asm");
    program.start = program.code.labels.at(name);
    program.surface = label(program.code, name + "_surface", program.start);
    program.sky = label(program.code, name + "_sky", program.code.labels.at("sky"));
    return program;
  }
  if (std::filesystem::is_directory(name)) throw Error(name + ": cannot be read, it is a folder");
  std::ifstream file(name, std::ios::binary);
  program.text.assign(std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>());
  if (!file.is_open() || file.bad()) throw Error(name + ": cannot be read");
  program.code = shader::assemble(program.text, name);
  program.start = label(program.code, "main", 0);
  program.surface = label(program.code, "surface", program.start);
  program.sky = label(program.code, "sky", program.surface);
  return program;
}

ShaderScene make_shader_scene(const ShaderProgram& program, const Surfaces& surfaces, const ViewCamera& view, int width,
                              int height) {
  const GridScene& grid = surfaces.grid();
  const Scene& scene = surfaces.scene();
  ShaderScene made;
  std::vector<Vector>& memory = made.memory;

  // Textures: one white texel, those of the materials, surroundings, hills.
  struct Placed {
    std::uint32_t at, width, height;
    Vector vector() const {
      return {static_cast<float>(at), static_cast<float>(width), static_cast<float>(height), 0.0f};
    }
  };
  const auto place = [&](const std::vector<Vector>& texels, std::uint32_t columns, std::uint32_t texture_rows) {
    const Placed placed{static_cast<std::uint32_t>(memory.size()), columns, texture_rows};
    memory.insert(memory.end(), texels.begin(), texels.end());
    return placed;
  };
  const Placed white = place({Vector{1, 1, 1, 1}}, 1, 1);
  std::vector<Placed> textures;
  for (const Texture& texture : scene.textures) {
    if (texture.width <= 0 || texture.height <= 0) {
      textures.push_back(white);
      continue;
    }
    std::vector<Vector> texels;
    for (const glm::vec4& texel : texture.texels) texels.push_back(vector(glm::dvec3(texel), texel.a));
    textures.push_back(
        place(texels, static_cast<std::uint32_t>(texture.width), static_cast<std::uint32_t>(texture.height)));
  }
  constexpr std::uint32_t kSide = 128;
  const Placed around = place(surroundings(kSide, kSide), kSide, kSide);
  const Placed field = place(hills(kSide), kSide, kSide);

  // Materials; the last one is that of nothing.
  const auto materials = static_cast<std::uint32_t>(memory.size());
  const auto material = [&](std::uint32_t shader, const glm::dvec3& base, const glm::dvec3& emissive,
                            const Placed& texture) {
    const auto entry = static_cast<float>(shader);
    memory.push_back({entry, entry, entry, entry});
    memory.push_back(vector(base, 1.0));
    memory.push_back(vector(emissive));
    memory.push_back(texture.vector());
  };
  for (const Material& m : scene.materials) {
    material(program.surface, glm::dvec3(m.base_color), glm::dvec3(m.emissive),
             m.base_texture < textures.size() ? textures[m.base_texture] : white);
  }
  material(program.surface, glm::dvec3(0.8), glm::dvec3(0.0), white);
  const auto plain = static_cast<std::uint32_t>(scene.materials.size());
  material(program.sky, glm::dvec3(0.0), glm::dvec3(0.0), white);
  const auto address_of = [&](std::uint32_t m) { return static_cast<double>(materials + kMaterialVectors * m); };

  // Triangles, the vectors of nothing before the first.
  memory.push_back({0, 1, 0, static_cast<float>(address_of(plain + 1))});
  memory.resize(memory.size() + kTriangleVectors - 1);
  made.setting.triangles = static_cast<std::uint32_t>(memory.size());
  made.setting.triangle_vectors = kTriangleVectors;
  const std::size_t end = memory.size() + surfaces.world().vertices.size() * kTriangleVectors;
  if (end >= std::size_t{1} << shader::kIndexBits)
    throw Error("the scene needs " + std::to_string(end) + " vectors of memory; the shader unit addresses " +
                std::to_string(std::size_t{1} << shader::kIndexBits));
  memory.resize(end);
  surfaces.for_each_triangle([&](std::uint32_t id) {
    const glm::dvec3 front = surfaces.front(id);
    const std::uint32_t of = surfaces.primitive(id).material;
    const std::uint32_t known = of < scene.materials.size() ? of : plain;
    Vector* const at = memory.data() + made.setting.triangles + std::size_t{id} * kTriangleVectors;
    for (std::size_t corner = 0; corner < 3; ++corner) {
      Hit hit;
      hit.status = contract::kStatusHit;
      hit.id = id;
      hit.u = corner == 1 ? 1.0 : 0.0;
      hit.v = corner == 2 ? 1.0 : 0.0;
      const SurfacePoint point = surfaces.at(hit, -front);
      at[corner] = vector(point.normal, corner == 0 ? address_of(known) : 0.0);
      glm::vec2 texcoord = point.texcoord;
      if (of < scene.materials.size()) texcoord = scene.materials[of].base_transform.apply(texcoord);
      at[4 + corner / 2][2 * (corner % 2)] = number(static_cast<double>(texcoord.x));
      at[4 + corner / 2][2 * (corner % 2) + 1] = number(static_cast<double>(texcoord.y));
    }
    at[3] = vector(front);
  });

  // Constants. A perspective ray's direction, one unit deep, is affine in the place in the frame.
  auto& c = made.setting.constants;
  const glm::dvec3 ahead = -glm::dvec3(view.world[2]);
  const auto direction = [&](double x, double y) {
    const WorldRay ray = view.ray(x, y, width, height);
    return ray.direction / glm::dot(ray.direction, ahead);
  };
  const auto origin = [&](double x, double y) {
    const WorldRay ray = view.ray(x, y, width, height);
    return grid.transform.to_grid(ray.origin + ray.center);
  };
  const auto directions = rows(direction(0, 0), direction(width, 0), direction(0, height), width, height);
  const auto origins = rows(origin(0, 0), origin(width, 0), origin(0, height), width, height);
  // The place of a point in these numbers is known to 2^-23; the renderer's offset is half of this one.
  c[0] = {0, 0, 0, static_cast<float>(2 * kSurfaceOffset)};
  std::ranges::copy(directions, c.begin() + 1);
  std::ranges::copy(origins, c.begin() + 4);
  c[7] = vector(light_place(surfaces, view), 0.2);
  c[8] = vector(glm::dvec3(0.8), 40.0);
  c[9] = vector(glm::dvec3(0.42, 0.4, 0.38), 0x1p-6);
  c[10] = vector(glm::dvec3(0.45, 0.6, 0.85), 4.0);
  c[11] = around.vector();
  c[12] = vector(glm::dvec3(0.1031, 0.1030, 0.0973), 64.0);
  const double index = 1.5;
  c[13] = {0.96f, number(index), number(1 / index), 0.04f};
  glm::dvec3 low, high;
  constexpr double kUnit = 1 << contract::kPositionFrac;
  for (int axis = 0; axis < 3; ++axis) {
    low[axis] = grid.box[2 * static_cast<unsigned>(axis)] / kUnit;
    high[axis] = grid.box[2 * static_cast<unsigned>(axis) + 1] / kUnit;
  }
  const glm::dvec3 middle = (low + high) / 2.0;
  // Before the scene and to the right.
  const double least = std::min({high.x - low.x, high.y - low.y, high.z - low.z});
  const glm::dvec3 to_eye = grid.transform.to_grid(view.eye()) - middle;
  const glm::dvec3 before = glm::length(to_eye) > 0 ? glm::normalize(to_eye) : -ahead;
  c[14] = vector(middle + (glm::dvec3(view.world[0]) * 0.35 + before * 0.4) * least, 0.22 * least);
  c[15] = field.vector();
  c[15][3] = 0.5f;

  made.setting.start = program.start;
  made.setting.load(program.code.words);
  return made;
}

ShaderFrame run_shader_frame(const ShaderScene& scene, const GridScene& grid, Engine& engine,
                             const ShaderFrameOptions& options) {
  const auto width = static_cast<std::size_t>(options.width), height = static_cast<std::size_t>(options.height);
  const auto samples = static_cast<std::size_t>(options.samples);
  ShaderFrame frame;
  frame.color = Raster(options.width, options.height, 3);
  frame.threads = width * height * samples;
  const bool stores = std::ranges::any_of(scene.setting.program, [](const shader::Instruction& in) {
    return in.op == shader::kOpStore || in.op == shader::kOpTexstore;
  });
  std::vector<Vector> memory = scene.memory;
  const std::size_t batch = stores ? 1 : kBatch;
  tbb::enumerable_thread_specific<std::vector<std::uint64_t>> profiles(
      std::vector<std::uint64_t>(options.profile ? scene.setting.program.size() : 0));
  std::vector<shader::Thread> threads;
  std::vector<std::size_t> waiting;
  std::vector<GridRay> rays;
  std::vector<Hit> hits;

  for (std::size_t first = 0; first < frame.threads; first += batch) {
    threads.assign(std::min(batch, frame.threads - first), {});
    for (std::size_t i = 0; i < threads.size(); ++i) {
      const std::size_t work = first + i, sample = work % samples, pixel = work / samples;
      // Places in a pixel: a sequence of low discrepancy, its first in the middle.
      const double s = static_cast<double>(sample);
      const double dx = std::fmod(0.5 + s * 0.7548776662466927, 1.0), dy = std::fmod(0.5 + s * 0.5698402909980532, 1.0);
      threads[i].parameters = {number(static_cast<double>(pixel % width) + dx),
                               number(static_cast<double>(pixel / width) + dy), number(s),
                               number(static_cast<double>(pixel))};
      threads[i].place = scene.setting.start;
    }
    waiting.resize(threads.size());
    for (std::size_t i = 0; i < waiting.size(); ++i) waiting[i] = i;
    while (!waiting.empty()) {
      const double start = now();
      tbb::parallel_for(tbb::blocked_range<std::size_t>(0, waiting.size(), 64), [&](const auto& range) {
        std::vector<std::uint64_t>& profile = profiles.local();
        for (std::size_t i = range.begin(); i < range.end(); ++i) {
          shader::Thread& thread = threads[waiting[i]];
          while (thread.running()) {
            if (thread.place < profile.size()) ++profile[thread.place];
            shader::step(thread, scene.setting, memory);
          }
        }
      });
      frame.run_s += now() - start;
      std::erase_if(waiting, [&](std::size_t i) { return !threads[i].waits; });
      rays.clear();
      for (const std::size_t i : waiting) {
        const shader::RayRequest& request = threads[i].ray;
        WorldRay ray;
        ray.center = grid.transform.center;
        for (std::size_t axis = 0; axis < 3; ++axis) {
          ray.origin[static_cast<int>(axis)] = request.origin[axis] / grid.transform.scale;
          ray.direction[static_cast<int>(axis)] = request.direction[axis] / grid.transform.scale;
        }
        ray.t_min = request.t_min;
        ray.t_max = request.t_max;
        rays.push_back(quantise(ray, grid.transform, grid.box, request.any));
        if (request.any) ++frame.any_rays;
      }
      const double traced = now();
      hits.assign(rays.size(), {});
      if (!rays.empty()) engine.trace(rays, hits, {}, options.trace);
      frame.trace_s += now() - traced;
      frame.rays += rays.size();
      for (std::size_t i = 0; i < waiting.size(); ++i) {
        shader::RayAnswer answer;
        answer.hit = hits[i].hit();
        answer.t = number(rays[i].t_base + rays[i].t_scale * hits[i].t);
        answer.u = number(hits[i].u);
        answer.v = number(hits[i].v);
        answer.id = hits[i].id;
        shader::wake(threads[waiting[i]], scene.setting, answer);
      }
    }
    for (std::size_t i = 0; i < threads.size(); ++i) {
      const shader::Thread& thread = threads[i];
      frame.steps += thread.steps;
      ++frame.ends[thread.status];
      for (std::size_t k = 0; k < frame.counts.size(); ++k) frame.counts[k] += thread.counts[k];
      const std::size_t pixel = (first + i) / samples;
      float* const color = frame.color.data.data() + 3 * pixel;
      const Vector& shown = thread.fixed[shader::kRegisterO];
      if (thread.status != static_cast<std::uint32_t>(shader::kStatusDone))
        continue;  // a thread that failed gives black
      for (std::size_t k = 0; k < 3; ++k) color[k] += std::max(0.0f, shown[k]) / static_cast<float>(samples);
    }
    if (options.progress)
      options.progress(static_cast<double>(first + threads.size()) / static_cast<double>(frame.threads));
  }
  if (options.profile) {
    frame.profile.resize(scene.setting.program.size());
    for (const auto& profile : profiles)
      for (std::size_t i = 0; i < profile.size(); ++i) frame.profile[i] += profile[i];
  }
  return frame;
}

Raster shader_picture(const Raster& color) {
  Raster picture(color.width, color.height, 3);
  for (std::size_t i = 0; i < picture.data.size(); ++i)
    picture.data[i] = srgb_encode(std::clamp(color.data[i], 0.0f, 1.0f));
  return picture;
}

}  // namespace retrace
