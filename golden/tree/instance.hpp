// Instance records: where an object, on a grid of its own, stands on the grid of the world.
#pragma once
#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <optional>

#include "golden/contract/contract_records.hpp"

namespace retrace {

/// Objects keep their root boxes inside this on every axis, so that rays enter them inside [-1, 1].
inline constexpr double kObjectReach = 7.0 / 8.0;

/// Largest factor by which an instance may stretch its object in any direction: a ray's direction must not get shorter than 1/2.
inline constexpr double kInstanceStretch = 1.96;

/// An affine map between grids, both in units of [-1, 1].
struct Placement {
  glm::dmat3 linear{1.0};  ///< columns
  glm::dvec3 offset{0.0};
};

/// The record of an object that `to_world` places in the world, or nothing where no record can say that: it makes the object flat, stretches it
/// by more than kInstanceStretch, makes it smaller than 2^-15 on some axis, or puts it so far away that an offset does not fit. Such
/// objects are flattened into the world. `box`: the root box of the object's tree, position codes by face.
std::optional<contract::InstanceRecord> make_instance(const Placement& to_world, const std::array<std::int32_t, 6>& box,
                                                      std::uint32_t root, std::uint32_t first_id);

/// What a record says: the map from the world's grid to the object's, without rounding.
Placement object_from_world(const contract::InstanceRecord& record);

/// Faces of an object's root box as a record holds them: in steps of 2^-7, rounded outward.
std::array<std::int32_t, 6> coarse_box(const std::array<std::int32_t, 6>& root_box);

/// The box in the world, position codes by face, that holds all points which a record takes to the object's root box. Ends at 2^30.
std::array<std::int32_t, 6> world_box(const contract::InstanceRecord& record,
                                      const std::array<std::int32_t, 6>& root_box);

/// Largest factor by which a matrix stretches a vector.
double largest_stretch(const glm::dmat3& matrix);

}  // namespace retrace
