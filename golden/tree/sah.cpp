// See sah.hpp.
#include "sah.hpp"

namespace retrace::kd {
namespace {

/// Leaf size of the two median structures.
constexpr std::size_t kMedianLeaf = 4;

SplitChoice unless_useless(std::span<const Event> sorted, const Box& box, int axis, std::int32_t position,
                           std::int64_t allowance) {
  if (position <= box[2 * axis] || position >= box[2 * axis + 1]) return {};
  const std::size_t count = sorted.size() / 2;
  std::size_t references = 0;
  for (const Event event : sorted)
    references += is_start(event) ? position_of(event) < position : position_of(event) > position;
  if (2 * references > 3 * count) return {};
  if (static_cast<std::int64_t>(references - count) > allowance - 1) return {};
  return {0.0, static_cast<std::uint32_t>(axis), position};
}

}  // namespace

SplitChoice sah_split(std::span<const Event> sorted, const Box& box, int axis, std::int64_t allowance,
                      const BuildOptions& options) {
  const std::int32_t low = box[2 * axis], high = box[2 * axis + 1];
  const int b = (axis + 1) % 3, c = (axis + 2) % 3;
  const double size_b = box[2 * b + 1] - box[2 * b], size_c = box[2 * c + 1] - box[2 * c];
  const auto count = static_cast<double>(sorted.size() / 2);
  // Half area of a slab of width x: cap + x * rim. Costs are relative to the half area of the box.
  const double cap = size_b * size_c, rim = size_b + size_c, width = static_cast<double>(high) - low;
  const double scale = options.intersection_cost / (cap + width * rim);
  // Triangles on the left and on the right: those that stand on both sides are paid for, and the split itself.
  const double most = count + static_cast<double>(allowance) - 1;
  SplitChoice best;
  // Of several events at one position the first ones see too many triangles on either side; their cost is never below that of the one in the middle,
  // between the ends and the starts, which sees the right numbers.
  double left = 0, right = count;
  for (const Event event : sorted) {
    const bool start = is_start(event);
    right -= start ? 0.0 : 1.0;
    const std::int32_t at = position_of(event);
    if (at > low && at < high) {
      const double x = at - low;
      const double sum = (cap + x * rim) * left + (cap + (width - x) * rim) * right;
      double cost = options.traversal_cost + sum * scale;
      if (left == 0 || right == 0) cost *= options.empty_bonus;
      if (cost < best.cost && left + right <= most) best = {cost, static_cast<std::uint32_t>(axis), at};
    }
    left += start ? 1.0 : 0.0;
  }
  return best;
}

SplitChoice spatial_median_split(std::span<const Event> sorted, const Box& box, int axis, std::int64_t allowance) {
  if (sorted.size() / 2 <= kMedianLeaf) return {};
  return unless_useless(sorted, box, axis, box[2 * axis] + (box[2 * axis + 1] - box[2 * axis]) / 2, allowance);
}

SplitChoice object_median_split(std::span<const Event> sorted, const Box& box, int axis, std::int64_t allowance) {
  if (sorted.size() / 2 <= kMedianLeaf) return {};
  return unless_useless(sorted, box, axis, position_of(sorted[sorted.size() / 2]), allowance);
}

int widest_axis(const Box& box) {
  int widest = 0;
  for (int axis = 1; axis < 3; ++axis)
    if (box[2 * axis + 1] - box[2 * axis] > box[2 * widest + 1] - box[2 * widest]) widest = axis;
  return widest;
}

}  // namespace retrace::kd
