// All structures of the lab by name, built on demand over one scene; what several of them share (trees) is built once.
#pragma once
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "golden/tree/kd_builder.hpp"
#include "structures.hpp"

namespace retrace::accel {

/// Which kd-tree.
enum class KdRecipe {
  kSah,        ///< the project's own: triangles clipped to the cells, costs that pay in hardware
  kUnclipped,  ///< as renderers built it around 2005: triangles by bounding box, small leaves, deep
  kSpatialMedian,
  kObjectMedian,
};

/// What is built once for a scene, with the processor time it took, in seconds; build one after the other.
class Workshop {
 public:
  explicit Workshop(const GridScene& scene) : scene_(scene), set_(from_grid(scene)) {}
  const TriangleSet& set() const { return set_; }
  std::shared_ptr<const KdTree> kd(KdRecipe recipe, double& seconds);
  std::shared_ptr<const Bvh> bvh(BvhBuilder builder, int slabs, double& seconds);
  std::shared_ptr<const Structure> grid(GridDensity density, double& seconds);

 private:
  template <class T>
  struct Made {
    std::shared_ptr<const T> thing;
    double seconds = 0.0;
  };
  const GridScene& scene_;
  TriangleSet set_;
  std::map<int, Made<KdTree>> kd_;
  std::map<int, Made<Bvh>> bvh_;
  std::map<int, Made<Structure>> grid_;
};

struct Technique {
  std::string key;          ///< unique, for machines: "kd-sah/stack"
  std::string structure;    ///< "kd-tree, SAH"
  std::string traversal;    ///< "stack"
  std::string source;       ///< paper
  bool duplicates = false;  ///< references may be duplicated: mailboxes are worth measuring
  std::function<std::shared_ptr<const Structure>(Workshop&, double& build_seconds)> make;
};

/// Every structure with every traversal, brute force first.
const std::vector<Technique>& catalogue();

}  // namespace retrace::accel
