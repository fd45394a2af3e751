// See chip_frame.hpp.
#include "golden/render/chip_frame.hpp"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "golden/engine/pixels.hpp"
#include "golden/render/tonemap.hpp"
#include "golden/tree/instance.hpp"

namespace retrace {
namespace {

constexpr double kGridUnit = 1 << contract::kPositionFrac;
constexpr double kFrameSide = 1 << contract::kFrameSizeLog2;

std::uint32_t shade_code(double value) {
  return static_cast<std::uint32_t>(std::lround(255.0 * std::clamp(value, 0.0, 1.0)));
}

std::array<std::int32_t, 3> normal_codes(const glm::dvec3& n) {
  constexpr double kOne = 1 << contract::kNormalFrac;
  std::array<std::int32_t, 3> codes{};
  for (int i = 0; i < 3; ++i)
    codes[static_cast<std::size_t>(i)] =
        static_cast<std::int32_t>(std::clamp(std::round(n[i] * kOne), -kOne, kOne - 1));
  return codes;
}

}  // namespace

contract::CameraRecord chip_camera(const ViewCamera& view, const GridScene& grid, int width, int height) {
  const glm::dvec3 right(view.world[0]), up(view.world[1]), ahead = -glm::dvec3(view.world[2]);
  const glm::dvec3 eye = grid.transform.to_grid(view.eye());
  double deepest = 0.0;  // of the box, along the view
  for (unsigned corner = 0; corner < 8; ++corner) {
    glm::dvec3 point;
    for (unsigned axis = 0; axis < 3; ++axis)
      point[static_cast<int>(axis)] = grid.box[2 * axis + (corner >> axis & 1)] / kGridUnit;
    deepest = std::max(deepest, glm::dot(point - eye, ahead));
  }
  // t counts in half of `unit` along the view: all of the box lies before 8.
  double unit = 2.0;
  while (deepest > 4.0 * unit) unit *= 2.0;

  const double shape = static_cast<double>(width) / height;
  glm::dvec3 step_x, step_y;  // of the whole frame, twice, at t = 1 (perspective) or anywhere
  if (view.perspective) {
    double tan_y = std::tan(view.yfov / 2);
    if (view.aspect > 0 && shape < view.aspect) tan_y *= view.aspect / shape;
    step_x = right * (tan_y * shape * unit);
    step_y = -up * (tan_y * unit);
  } else {
    const double half_y = std::max(view.ymag, view.xmag / shape) * grid.transform.scale;
    step_x = right * (2.0 * half_y * shape);
    step_y = -up * (2.0 * half_y);
  }
  // A record's x is 1/2 at the edge of a frame of 2^frame_size_log2 pixels.
  const glm::dmat3 linear(step_x * (kFrameSide / width), step_y * (kFrameSide / height), ahead * unit);

  contract::CameraRecord camera;
  const auto refuse = [&]() -> Error {
    return Error("camera '" + view.name +
                 "': too far away, or its frame too wide, for the record of a camera on the chip");
  };
  for (int i = 0; i < 3; ++i) {
    const auto at = static_cast<std::size_t>(i);
    const glm::dvec3 row(linear[0][i], linear[1][i], linear[2][i]);
    constexpr double kRowNorm = 1.0 - 0x1p-20;
    const double norm = std::max(glm::length(row), std::abs(eye[i]) / 3.99);
    if (!(norm < std::ldexp(kRowNorm, contract::kRowExponentMax))) throw refuse();
    int exponent = 0;
    while (norm >= std::ldexp(kRowNorm, exponent)) ++exponent;
    camera.e[at] = static_cast<std::uint32_t>(exponent);
    const double code = std::ldexp(1.0, contract::kInstanceCoefficientFrac - exponent);
    for (int j = 0; j < 3; ++j)
      camera.m[3 * at + static_cast<std::size_t>(j)] = static_cast<std::int32_t>(std::llround(row[j] * code));
    camera.b[at] = std::llround(eye[i] * code);
    constexpr int kStep = contract::kPositionFrac - contract::kBoxFaceFrac;
    camera.box[2 * at] = grid.box[2 * at] >> kStep;
    camera.box[2 * at + 1] = -(-grid.box[2 * at + 1] >> kStep);
    if (camera.box[2 * at] < -128 || camera.box[2 * at + 1] > 127) throw Error("camera: the scene's box is too large");
  }
  constexpr double kMostReach = (1u << contract::kTReachBits) - 1;
  const double zfar = view.zfar * grid.transform.scale * 2.0 / unit;
  camera.reach = static_cast<std::uint32_t>(std::min(std::floor(zfar * (1 << contract::kTReachFrac)) + 1, kMostReach));
  camera.orthographic = view.perspective ? 0 : 1;
  return camera;
}

contract::FrameRecord chip_frame(const ViewCamera& view, const ChipOptions& options) {
  contract::FrameRecord frame;
  const auto size = [](int pixels) { return static_cast<std::uint32_t>(std::clamp(pixels, 0, 8191)); };
  frame.width = size(options.width);
  frame.height = size(options.height);
  frame.tile_x = frame.tile_y = 4;
  frame.samples = options.samples == 4 ? 2 : options.samples == 2 ? 1 : options.samples == 1 ? 0 : 3;
  frame.kind = options.kind;
  frame.ambient = 40;
  frame.diffuse = 215;
  frame.background = {46, 52, 61};
  if (options.samples == 1) frame.offset_x = frame.offset_y = {128, 128, 128, 128};
  if (options.samples == 2) frame.offset_x = {64, 192, 64, 192}, frame.offset_y = {64, 192, 192, 64};
  // A square on its corner: no two samples in a row or a column.
  if (options.samples == 4) frame.offset_x = {96, 224, 32, 160}, frame.offset_y = {32, 96, 160, 224};
  const glm::dvec3 right(view.world[0]), up(view.world[1]), back(view.world[2]);
  frame.light = normal_codes(options.shadows ? glm::normalize(0.5 * right + 0.8 * up + 0.6 * back) : back);
  frame.shadows = options.shadows ? 1 : 0;
  check_frame(frame);
  return frame;
}

namespace {

/// The material of a triangle of the world, with that normal.
contract::MaterialRecord material_of(const Surfaces& surfaces, std::uint32_t id, const glm::dvec3& normal) {
  Hit hit;
  hit.status = contract::kStatusHit;
  hit.id = id;
  hit.u = hit.v = 1.0 / 3.0;
  const SurfacePoint point = surfaces.at(hit, -surfaces.front(id));
  contract::MaterialRecord material;
  material.normal = normal_codes(normal);
  const bool emits = luminance(point.emissive) > 0.0f;
  const glm::vec3 colour = srgb_encode(glm::clamp(glm::vec3(point.base) + point.emissive, 0.0f, 1.0f));
  for (int c = 0; c < 3; ++c) material.colour[static_cast<std::size_t>(c)] = shade_code(colour[c]);
  material.unlit = emits || point.unlit ? 1 : 0;
  return material;
}

/// The rotation, or the rotation and reflection, from the world's axes to the object's; nothing where the object is stretched.
std::optional<glm::dmat3> turn_of(const contract::InstanceRecord& record) {
  glm::dmat3 turn = object_from_world(record).linear;
  const double scale = std::cbrt(std::abs(glm::determinant(turn)));
  if (!(scale > 0.0)) return std::nullopt;
  turn *= 1.0 / scale;
  const glm::dmat3 off = turn * glm::transpose(turn) - glm::dmat3(1.0);
  constexpr double kTolerance = 0x1p-9;  // of a normal's length: below a step of what a screen shows
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      if (std::abs(off[i][j]) > kTolerance) return std::nullopt;
  return turn;
}

}  // namespace

ShadeTable chip_shading(const Surfaces& surfaces) {
  const GridScene& grid = surfaces.grid();
  const auto each = [](std::size_t count, const auto& body) {
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, count, 4096), [&](const auto& range) {
      for (std::size_t i = range.begin(); i < range.end(); ++i) body(i);
    });
  };
  if (!grid.two_levels) {
    std::vector<contract::MaterialRecord> materials(surfaces.world().vertices.size());
    each(materials.size(), [&](std::size_t i) {
      const auto id = static_cast<std::uint32_t>(i);
      if (surfaces.exists(id)) materials[i] = material_of(surfaces, id, surfaces.front(id));  // others are never hit
    });
    return materials;
  }
  std::vector<contract::InstanceShadeRecord> placed(grid.instances.size());
  std::vector<contract::MaterialRecord> materials;
  std::vector<std::optional<std::size_t>> first(grid.objects.size());  // of the objects that instances share
  const std::size_t before = contract::InstanceShadeRecord::kWords * placed.size();
  for (std::size_t number = 0; number < placed.size(); ++number) {
    const contract::InstanceRecord& record = grid.instances[number].record;
    const std::vector<GridTriangle>& triangles = grid.objects[record.root].triangles;
    const std::optional<glm::dmat3> turn = turn_of(record);
    std::size_t at = materials.size();
    if (turn && first[record.root]) {
      at = *first[record.root];
    } else {
      if (turn) first[record.root] = at;
      materials.resize(at + (triangles.empty() ? 0 : triangles.back().id + std::size_t{1}));
      each(triangles.size(), [&](std::size_t i) {
        const std::uint32_t id = record.first_id + triangles[i].id;
        const glm::dvec3 normal = surfaces.front(id);
        materials[at + triangles[i].id] = material_of(surfaces, id, turn ? *turn * normal : normal);
      });
    }
    constexpr std::size_t kMost = std::size_t{1} << contract::kMaterialIndexBits;
    if (before + materials.size() > kMost)
      throw Error("the scene has more materials than a table for the chip can hold");
    placed[number].material =
        static_cast<std::uint32_t>(before + at - record.first_id) & static_cast<std::uint32_t>(kMost - 1);
    constexpr double kOne = 1 << contract::kTurnFrac;
    for (std::size_t i = 0; i < 9; ++i) {
      const double component = turn ? (*turn)[static_cast<int>(i % 3)][static_cast<int>(i / 3)] : (i % 4 == 0 ? 1 : 0);
      placed[number].turn[i] = static_cast<std::int32_t>(std::clamp(std::round(component * kOne), -kOne, kOne - 1));
    }
  }
  return ShadeTable(placed, materials);
}

Raster chip_picture(const std::vector<std::uint32_t>& pixels, int width, int height) {
  Raster picture(width, height, 3);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      for (int c = 0; c < 3; ++c)
        picture.at(x, y)[c] =
            static_cast<float>(
                pixels[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)] >>
                    8 * c &
                255) /
            255.0f;
  return picture;
}

}  // namespace retrace
