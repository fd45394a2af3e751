// NumPy's .npy files, as far as `retrace trace` needs them: rays in, hits out.
// Source: numpy.lib.format, format versions 1.0 to 3.0 (NEP 1).
#pragma once
#include <array>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "golden/render/ray_rows.hpp"

namespace retrace::cli {

/// A ray of a file: origin, t_min, direction, t_max, in scene units; direction of any length, t counts in its lengths.
using NpyRay = std::array<double, 8>;

/// Header of a .npy file.
struct NpyHeader {
  std::string descr;  ///< such as "<f8"
  bool fortran_order = false;
  std::vector<std::uint64_t> shape;
  std::size_t data_offset = 0;
};

/// Reads magic, version and header. `name` is for messages. Throws Error.
NpyHeader parse_npy_header(std::string_view bytes, const std::string& name);

/// N x 8 little-endian float64 in C order. Throws Error that names the file and what is wrong with it.
std::vector<NpyRay> parse_rays(std::string_view bytes, const std::string& name);
std::vector<NpyRay> read_rays(const std::filesystem::path& path);

/// A structured array with the fields t, mesh, primitive, triangle, node, u, v.
std::string format_hits(std::span<const SceneHit> hits);

}  // namespace retrace::cli
