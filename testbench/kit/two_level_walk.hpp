// The walk over two levels in integers, stage by stage, and brute force over all triangles of all instances.
//
// The top tree is walked as a tree of triangles is. At a leaf, each instance that is not in the mailbox and does not hold the best hit already is
// entered through instance_enter; the object's tree is walked with the object's ray, from its root and from t = 0, and then the leaf goes on.
// Order of hits: (t in the world, instance, t in the object, id): total, so it does not depend on the order of visits. That is why the
// instance of the best hit is never entered again (it was searched to its end), and why one with a lower number may still win at the same t.
#pragma once
#include <map>
#include <optional>
#include <span>
#include <vector>

#include "golden/engine/engine.hpp"
#include "golden/tree/two_level_scene.hpp"

namespace retrace {

struct TwoLevelHit {
  bool hit = false;
  std::uint32_t t = 0;         ///< in the world, code
  std::uint32_t instance = 0;  ///< lower ones win on equal t
  std::uint32_t t_object = 0;
  std::uint32_t id = contract::kNoTriangle;  ///< within the object
  std::int32_t dz = 0;                       ///< d'z of the test, code
  bool comes_before(const TwoLevelHit& other) const;
  friend bool operator==(const TwoLevelHit&, const TwoLevelHit&) = default;
};

struct TwoLevelWork {
  std::uint64_t top_down = 0, top_leaf = 0, entries = 0, rejected = 0, saved = 0, down = 0, leaf = 0, tests = 0;
};

inline constexpr int kInstanceMailbox = 4;

/// The leaves that a walk visited, by number in their tree: of the top level, and of the object of each instance that was entered.
struct TwoLevelVisits {
  std::vector<std::uint32_t> top;
  std::map<std::uint32_t, std::vector<std::uint32_t>> objects;
};

/// Closest hit, or for a ray that asks for any, the first one found. `status`: status_hit, status_miss, status_bad_ray or status_bad_record.
TwoLevelHit trace_two_levels(const TwoLevelScene& scene, const contract::RayRecord& ray, TwoLevelWork* work = nullptr,
                             std::uint32_t* status = nullptr, TwoLevelVisits* visits = nullptr);

/// The same walk over a tree of one level, in the fields that it has: hit, t, id.
TwoLevelHit trace_one_level(const MemoryImage& image, const contract::RayRecord& ray,
                            std::vector<std::uint32_t>& visits);

/// An instance and a triangle of its object.
struct TwoLevelTriangle {
  std::uint32_t instance, id;
  friend bool operator==(const TwoLevelTriangle&, const TwoLevelTriangle&) = default;
};

/// Closest hit over all triangles of all instances; those `without` do not count.
TwoLevelHit brute_force_two_levels(const TwoLevelScene& scene, const contract::RayRecord& ray,
                                   std::span<const TwoLevelTriangle> without = {});

/// The ray of an instance's object, as entered; nothing if it is not.
std::optional<contract::InstanceEnterOutRecord> enter_instance(const contract::InstanceRecord& record,
                                                               const contract::RayRecord& ray, std::uint32_t reach);

}  // namespace retrace
