#include "test_instances.hpp"

#include <algorithm>
#include <cmath>
#include <glm/gtc/quaternion.hpp>

namespace retrace {
namespace {

glm::dmat3 random_rotation(Random& random) {
  // A quaternion from the unit ball, without functions whose last bit depends on the library.
  for (;;) {
    const glm::dquat q(random.real(-1, 1), random.real(-1, 1), random.real(-1, 1), random.real(-1, 1));
    const double square = glm::dot(q, q);
    if (square > 0.01 && square <= 1.0) return glm::mat3_cast(q / std::sqrt(square));
  }
}

glm::dmat3 diagonal(double x, double y, double z) {
  glm::dmat3 matrix(1.0);
  matrix[0][0] = x;
  matrix[1][1] = y;
  matrix[2][2] = z;
  return matrix;
}

glm::dmat3 random_matrix(Random& random, InstanceShape shape) {
  const glm::dmat3 turn = random_rotation(random);
  const int axis = static_cast<int>(random.below(3));
  glm::dmat3 squash(1.0);
  squash[axis][axis] = 0.01;
  const auto size = [&](double least) {
    double result = 0.0;
    while (result < least) result = std::ldexp(random.real(0.5, 1.0), -static_cast<int>(random.below(15)));
    return result;
  };
  switch (shape) {
    case InstanceShape::kScaled:
      return turn * size(1e-3);
    case InstanceShape::kSmallest:
      return turn * std::ldexp(random.real(0.6, 1.0), -14);
    case InstanceShape::kSquashed:
      return turn * squash * size(0.05);
    case InstanceShape::kSquashedWorld:
      return squash * turn * size(0.05);
    case InstanceShape::kSheared: {
      glm::dmat3 shear(1.0);
      shear[axis][(axis + 1) % 3] = random.real(-2, 2);
      shear[(axis + 2) % 3][axis] = random.real(-2, 2);
      return turn * shear * size(0.01);
    }
    case InstanceShape::kMirrored:
      return turn * diagonal(-1, 1, 1) * size(0.01);
    case InstanceShape::kPermuted: {
      glm::dmat3 permuted(0.0);
      for (int i = 0; i < 3; ++i) permuted[i][(i + axis) % 3] = random.chance(2) ? 1.0 : -1.0;
      return permuted * std::ldexp(random.chance(2) ? 1.0 : 0.75, -static_cast<int>(random.below(10)));
    }
    default:
      return turn;
  }
}

}  // namespace

Placement random_placement(Random& random, InstanceShape shape, double reach) {
  Placement result;
  result.linear = random_matrix(random, shape);
  // Half extents in the world; a map that does not fit is made smaller.
  glm::dvec3 half(0.0);
  for (int column = 0; column < 3; ++column) half += glm::abs(result.linear[column]) * reach;
  const double largest = std::max({half.x, half.y, half.z});
  if (largest > 0.999) {
    result.linear *= 0.999 / largest;
    half *= 0.999 / largest;
  }
  for (int i = 0; i < 3; ++i) result.offset[i] = random.real(-1, 1) * (0.9999 - half[i]);
  return result;
}

}  // namespace retrace
