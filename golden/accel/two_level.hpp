// Two-level structures for scenes that move, after I. Wald, C. Benthin, P. Slusallek, Distributed interactive ray
// tracing of dynamic scenes, PVG 2003: a tree per object, a top-level tree over instances, rays transformed into object
// space.
//   static        all static meshes that stand once are one object in world space, built once
//   affine        an object a mesh, an instance a node: motion changes the instance's matrix and the top-level tree
//   unstructured  an object a node: its tree is rebuilt when its vertices move
// Meshes that stand several times are instances whether they move or not; nothing is copied.
//
// Every object lies on a position grid of its own (golden/scene/geometry.hpp) and has its own memory image, as a
// hardware leaf of kind "instance" would have it. The triangle test is that of the lab, on the object's grid with the
// transformed ray; t is the same in all spaces because directions are transformed without normalising them.
#pragma once
#include <memory>
#include <vector>

#include "golden/engine/engine.hpp"
#include "golden/gltf/animation.hpp"
#include "golden/tree/kd_builder.hpp"
#include "kd.hpp"
#include "structures.hpp"

namespace retrace::accel {

/// What an update cost.
struct TwoLevelUpdate {
  double transforms_s = 0.0;  ///< world matrices, their inverses, boxes of the instances
  double objects_s = 0.0;     ///< trees of objects whose vertices moved
  double top_s = 0.0;         ///< top-level tree
  std::uint32_t objects_rebuilt = 0;
  double total_s() const { return transforms_s + objects_s + top_s; }
};

/// Rays are in world units. Triangle ids are those of flatten().
class TwoLevel final : public Structure {
 public:
  /// Builds all objects from the scene as it stands (AnimatedScene::at() must have been called) and the top level.
  /// Throws Error.
  TwoLevel(const AnimatedScene& scene, const BuildOptions& options = {});
  ~TwoLevel() override;

  /// Follows the scene to where it stands now. Throws Error that names the node if an instance's matrix is singular.
  TwoLevelUpdate update();

  Hit trace(const Ray& ray, Probe& probe) const override;
  Footprint footprint() const override;
  /// Triangles held, each object's once.
  std::size_t size() const override;
  /// Triangles of all instances, degenerate ones too.
  std::uint64_t instanced_triangles() const { return triangles_; }
  std::size_t objects() const { return objects_.size(); }
  std::size_t instances() const { return instances_.size(); }
  double build_s() const { return build_s_; }
  const TwoLevelUpdate& first_update() const { return first_; }

  /// All triangles of all instances, no tree.
  Hit brute_force(const Ray& ray, Probe& probe) const;
  /// Tests one triangle by its id, in the space of its instance. True if it became the best hit.
  bool test(const Ray& ray, std::uint32_t id, Probe& probe, Hit& best) const;

 private:
  struct Object {
    std::vector<std::uint32_t> nodes;  ///< whose meshes it is made of
    bool world_space = false;          ///< vertices in world space (the static object)
    bool deforms = false;
    TriangleSet set;  ///< on the object's grid; id: number within the object
    GridTransform grid;
    std::shared_ptr<const KdTree> tree;
    std::unique_ptr<Structure> walk;
    std::vector<std::uint32_t> ids;  ///< static object: triangle ids; otherwise the instance's first id counts
    std::uint32_t triangles = 0;
    std::uint32_t dropped = 0;  ///< triangles without area on the object's grid
  };
  struct Instance {
    std::uint32_t object = 0, node = kNone, first_id = 0;
    glm::dmat3 linear{1.0};  ///< world to the object's grid
    glm::dvec3 offset{0.0};
    Box box;  ///< world
  };

  void build_object(Object& object);
  void place_instances();
  void build_top();
  std::uint32_t global_id(const Instance& instance, std::uint32_t local) const;
  static Ray into(const Instance& instance, const Ray& ray, double t_max);

  const AnimatedScene& scene_;
  BuildOptions options_;
  std::vector<Object> objects_;
  std::vector<Instance> instances_;
  std::vector<std::uint32_t> instance_of_;  ///< by node: instance; kNone
  struct Span {
    std::uint32_t first_id, node;
  };
  std::vector<Span> spans_;  ///< by ascending first id: which node a triangle belongs to
  struct TopNode {
    Box box;
    std::uint32_t first = 0, count = 0;  ///< children, or entries of order_
    bool leaf = true;
  };
  std::vector<TopNode> top_;
  std::vector<std::uint32_t> order_;
  std::uint64_t triangles_ = 0;
  double build_s_ = 0.0;
  TwoLevelUpdate first_;
};

/// The same frame rebuilt from nothing: world triangles, snapped, one kd-tree over all of them. Its triangles are
/// tested where the two-level structure tests them, in the space of their instance, so that hits must be equal bit for
/// bit; the tree alone differs.
class FlatFrame {
 public:
  FlatFrame(const Scene& frame, const TwoLevel& triangles, const BuildOptions& options = {});
  /// The same over a frame that was flattened and snapped before: build_s alone is measured.
  FlatFrame(const GridScene& frame, const TwoLevel& triangles, const BuildOptions& options = {});
  Hit trace(const Ray& ray, Probe& probe) const;
  double flatten_s = 0.0, snap_s = 0.0, build_s = 0.0;
  std::uint32_t degenerate = 0;  ///< triangles without area on the scene's grid: not in this tree
  double total_s() const { return flatten_s + snap_s + build_s; }

 private:
  void build(const GridScene& frame, const BuildOptions& options);

  const TwoLevel& triangles_;
  GridTransform grid_;
  std::shared_ptr<const KdTree> tree_;
};

/// Engines of the program over either structure: the same pictures bit for bit, see FlatFrame. `grid` is the frame
/// flattened and snapped, which rays are quantised to and shading looks triangles up in; both arguments must outlive
/// the engine and be of the same frame.
std::unique_ptr<Engine> make_two_level_engine(const TwoLevel& scene, const GridScene& grid);
std::unique_ptr<Engine> make_flat_engine(const FlatFrame& frame, const GridScene& grid);

}  // namespace retrace::accel
