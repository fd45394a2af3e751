#include "two_level_walk.hpp"

#include <algorithm>
#include <array>
#include <tuple>

#include "reference.hpp"
#include "stage_inputs.hpp"

namespace retrace {
namespace {

constexpr auto kBad = static_cast<std::uint32_t>(contract::kStatusBadRecord);

/// Down from the root, across faces by links. `visit(leaf, number, t_exit)` says whether the ray is finished.
template <typename Visit>
void walk_tree(const MemoryImage& image, const contract::RaySetupOutRecord& ray, std::uint64_t& down, Visit visit) {
  std::uint32_t index = 0;
  std::int32_t t = 0;
  for (std::uint32_t step = 0; step < image.header().step_limit; ++step) {
    const WalkedNode node = node_of(image, index);
    if (node.axis != contract::kAxisLeaf) {
      ++down;
      index = reference::kd_descend(kd_descend_in(node, ray, t)).node;
      continue;
    }
    const auto leaf = image.leaf(node.child);
    const auto exit = reference::leaf_exit(leaf_exit_in(leaf, ray, t));
    // An object's ray that passes its root box by within the tolerance of the entry leaves it behind itself: nothing is there.
    if (exit.broken || !exit.exits) return;
    if (visit(leaf, node.child, static_cast<std::uint32_t>(exit.t_exit))) return;
    t = exit.t_exit;
    index = leaf.link[exit.face];
    if (index == 0) return;
  }
}

contract::TriTestOutRecord test(const contract::TriangleRecord& triangle, const contract::RaySetupOutRecord& ray) {
  return reference::tri_test(tri_test_in(triangle, ray));
}

/// The nearest hit in a tree of triangles, up to a limit; of a ray that asks for any, the first one found.
struct TreeHit {
  bool hit = false;
  std::uint32_t t = 0, id = contract::kNoTriangle;
  std::int32_t dz = 0;
};
TreeHit search_tree(const MemoryImage& image, const contract::RaySetupOutRecord& ray, bool any, TwoLevelWork& count,
                    std::vector<std::uint32_t>* visits) {
  TreeHit best;
  best.t = ray.t_max;
  walk_tree(image, ray, count.down, [&](const contract::LeafRecord& leaf, std::uint32_t number, std::uint32_t t_exit) {
    ++count.leaf;
    if (visits) visits->push_back(number);
    for (std::uint32_t i = 0; i < leaf.count; ++i) {
      ++count.tests;
      const auto hit = test(image.triangle(image.reference(leaf, i)), ray);
      if (!hit.hit || hit.t > best.t || (best.hit && hit.t == best.t && hit.id >= best.id)) continue;
      best = {true, hit.t, hit.id, hit.dz};
      if (any) return true;
    }
    return best.t <= t_exit;
  });
  return best;
}

/// The ray at the root box of an image.
contract::RaySetupOutRecord set_up(const contract::RayRecord& ray, const MemoryImage& image) {
  contract::RaySetupInRecord start;
  start.origin = ray.origin;
  start.direction = ray.direction;
  start.t_max = ray.t_max;
  start.any = ray.any;
  for (std::size_t face = 0; face < 6; ++face) start.box[face] = static_cast<std::int32_t>(image.header().box[face]);
  return reference::ray_setup(start);
}

contract::RaySetupOutRecord state_of(const contract::InstanceEnterOutRecord& entry) {
  contract::RaySetupOutRecord ray;
  ray.origin = entry.origin;
  ray.direction = entry.direction;
  ray.reciprocal = entry.reciprocal;
  ray.shift = entry.shift;
  ray.zero = entry.zero;
  ray.negative = entry.negative;
  ray.t_max = entry.t_max;
  ray.valid = 1;
  return ray;
}

contract::InstanceEnterOutRecord enter(const contract::InstanceRecord& record, const contract::RayRecord& ray,
                                       std::uint32_t reach) {
  return reference::instance_enter(instance_enter_in(record, ray, reach));
}

}  // namespace

bool TwoLevelHit::comes_before(const TwoLevelHit& other) const {
  if (!hit || !other.hit) return hit;
  return std::tie(t, instance, t_object, id) < std::tie(other.t, other.instance, other.t_object, other.id);
}

std::optional<contract::InstanceEnterOutRecord> enter_instance(const contract::InstanceRecord& record,
                                                               const contract::RayRecord& ray, std::uint32_t reach) {
  const auto entry = enter(record, ray, reach);
  return entry.enters ? std::optional(entry) : std::nullopt;
}

TwoLevelHit trace_one_level(const MemoryImage& image, const contract::RayRecord& ray,
                            std::vector<std::uint32_t>& visits) {
  visits.clear();
  const auto state = set_up(ray, image);
  if (!state.valid) return {};
  TwoLevelWork count;
  const TreeHit found = search_tree(image, state, ray.any != 0, count, &visits);
  return found.hit ? TwoLevelHit{true, found.t, 0, found.t, found.id, found.dz} : TwoLevelHit{};
}

TwoLevelHit trace_two_levels(const TwoLevelScene& scene, const contract::RayRecord& ray, TwoLevelWork* work,
                             std::uint32_t* status, TwoLevelVisits* visits) {
  TwoLevelWork unwanted;
  TwoLevelWork& count = work ? *work : unwanted;
  std::uint32_t fault = 0;
  const auto state = set_up(ray, scene.top);
  TwoLevelHit best;
  best.t = ray.t_max;
  std::array<std::uint32_t, kInstanceMailbox> mailbox{};
  std::size_t held = 0, next = 0;
  const auto search_object = [&](std::uint32_t number) {
    // The limit of the object's ray: nearer than the best hit, or as near with a lower number.
    const bool ties = !best.hit || number < best.instance;
    const auto entry = enter(scene.instances[number], ray, best.t + (ties ? 1 : 0));
    ++count.entries;
    if (entry.bad) fault = kBad;
    if (!entry.enters) {
      ++count.rejected;
      return;
    }
    const auto object_ray = state_of(entry);
    const MemoryImage& object = scene.objects[scene.object_of[number]];
    const TreeHit found =
        search_tree(object, object_ray, ray.any != 0, count, visits ? &visits->objects[number] : nullptr);
    if (found.hit)
      best = {true, reference::world_t(found.t, entry.start, entry.scale), number, found.t, found.id, found.dz};
  };
  if (state.valid) {
    const auto at_leaf = [&](const contract::LeafRecord& leaf, std::uint32_t place, std::uint32_t t_exit) {
      ++count.top_leaf;
      if (visits) visits->top.push_back(place);
      for (std::uint32_t i = 0; i < leaf.count; ++i) {
        const std::uint32_t number = scene.top.triangle(scene.top.reference(leaf, i)).id;
        const auto end = mailbox.begin() + static_cast<std::ptrdiff_t>(held);
        if ((best.hit && number == best.instance) || std::find(mailbox.begin(), end, number) != end) {
          ++count.saved;
          continue;
        }
        mailbox[next] = number;
        next = (next + 1) % mailbox.size();
        held = std::min(held + 1, mailbox.size());
        search_object(number);
        if (fault != 0 || (best.hit && ray.any)) return true;
      }
      return best.t <= t_exit;
    };
    walk_tree(scene.top, state, count.top_down, at_leaf);
  }
  if (fault != 0) best = {};
  if (status)
    *status = fault != 0     ? fault
              : !state.valid ? static_cast<std::uint32_t>(contract::kStatusBadRay)
                             : static_cast<std::uint32_t>(best.hit ? contract::kStatusHit : contract::kStatusMiss);
  if (!best.hit) best = {};
  return best;
}

TwoLevelHit brute_force_two_levels(const TwoLevelScene& scene, const contract::RayRecord& ray,
                                   std::span<const TwoLevelTriangle> without) {
  TwoLevelHit best;
  for (std::uint32_t number = 0; number < scene.instances.size(); ++number) {
    const auto entry = enter(scene.instances[number], ray, ray.t_max + 1);
    if (!entry.enters) continue;
    const auto object_ray = state_of(entry);
    const MemoryImage& object = scene.objects[scene.object_of[number]];
    for (std::uint32_t i = 0; i < object.header().triangle_count; ++i) {
      const auto hit = test(object.triangle(i), object_ray);
      if (!hit.hit || hit.t > entry.t_max) continue;
      const TwoLevelHit found{true, reference::world_t(hit.t, entry.start, entry.scale), number, hit.t, hit.id, hit.dz};
      if (!found.comes_before(best)) continue;
      if (std::find(without.begin(), without.end(), TwoLevelTriangle{number, hit.id}) != without.end()) continue;
      best = found;
    }
  }
  return best;
}

}  // namespace retrace
