// What moves in a glTF file, and how skins and morph targets stand at rest. Translation, rotation, scale and weight channels with all
// three interpolations, morph targets and skins (glTF 2.0, sections 3.7.2.2, 3.7.3, 3.11 and appendix C), on top of a
// loaded Scene.
//
// Motion comes in the three classes of I. Wald, C. Benthin, P. Slusallek, Distributed interactive ray tracing of
// dynamic scenes, PVG 2003, section 3: static; affine (the node or an ancestor moves); unstructured (vertices move on
// their own: morph targets, skins).
#pragma once
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "golden/scene/scene.hpp"

namespace retrace {

namespace gltf {
class Document;
class Accessors;
}  // namespace gltf

struct AnimationTrack {
  enum class Path { kTranslation, kRotation, kScale, kWeights };
  enum class Interpolation { kStep, kLinear, kCubicSpline };
  std::uint32_t node = kNone;
  Path path = Path::kTranslation;
  Interpolation interpolation = Interpolation::kLinear;
  std::uint32_t components = 3;  ///< numbers a value; for weights the number of morph targets
  std::vector<double> times;     ///< seconds, strictly ascending, at least one
  std::vector<double> values;    ///< by key; cubic splines: in-tangent, value, out-tangent

  /// The value at a time; before the first and after the last key that key's. Rotations are unit quaternions x, y, z,
  /// w.
  void evaluate(double time, std::span<double> out) const;
};

struct Skin {
  std::string name;
  std::vector<std::uint32_t> joints;     ///< nodes
  std::vector<glm::dmat4> inverse_bind;  ///< one a joint
};

/// What deforms one primitive. All vectors have one entry a vertex of the Scene's primitive.
struct Deformation {
  static constexpr int kInfluences = 8;
  std::vector<std::vector<glm::vec3>> targets;                 ///< by morph target: displacement of the vertices
  std::vector<std::array<std::uint16_t, kInfluences>> joints;  ///< empty without JOINTS_0
  std::vector<std::array<float, kInfluences>> weights;
};

struct Animation {
  std::string name;
  std::vector<AnimationTrack> tracks;
  double duration = 0.0;  ///< time of the last key of all tracks
  std::vector<Skin> skins;
  std::vector<std::uint32_t> node_skin;                ///< by node; kNone
  std::vector<std::vector<Deformation>> deformations;  ///< by mesh and primitive
  std::vector<std::vector<double>> node_weights;       ///< by node: weights at rest; empty without morph targets
};

/// Reads animation number `index` of the file that `scene` was loaded from (not posed), and the skins and morph targets
/// of all meshes that it shows. A file without animations gives one without tracks. Throws Error that names file, object and what is wrong: missing or
/// unsorted keys, a vertex whose joint the skin does not have, a channel whose target cannot move.
Animation load_animation(const std::filesystem::path& path, const Scene& scene, std::uint32_t index = 0);
/// The same from memory.
Animation load_animation_memory(std::span<const std::uint8_t> bytes, const Scene& scene, std::uint32_t index = 0);
/// Applies skins and morph weights at rest. A node whose skin or targets are malformed keeps its mesh as stored, with a
/// note. Throws Error for a pose that is not finite.
void pose_at_rest(gltf::Document& document, gltf::Accessors& accessors, Scene& scene);
/// Number of animations in a glTF file.
std::size_t count_animations(const std::filesystem::path& path);

enum class Motion { kStatic, kAffine, kUnstructured };

/// A scene that moves.
class AnimatedScene {
 public:
  AnimatedScene(Scene scene, Animation animation);

  double duration() const { return animation_.duration; }
  bool animated() const { return !animation_.tracks.empty(); }
  /// The scene as it stands at a time: node transforms, and for every unstructured node a mesh of its own with the
  /// vertices (and normals: recomputed, smooth where they were) where they are. Nodes, numbers of primitives and
  /// triangles, and so triangle ids, are the same at all times. Valid until the next call. Throws Error for a vertex
  /// that leaves the range of float.
  const Scene& at(double time);
  const Scene& scene() const { return scene_; }
  /// The scene as it stands, for good.
  Scene release() && { return std::move(scene_); }
  /// By node.
  Motion motion(std::uint32_t node) const { return motion_[node]; }
  /// Whether the vertices of an unstructured node may change with time (a skin whose joints rest does not).
  bool deforms(std::uint32_t node) const { return deforms_[node]; }

 private:
  void deform(std::uint32_t node, const std::vector<glm::dmat4>& world);

  Animation animation_;
  Scene scene_;
  std::vector<Mesh> rest_;                ///< meshes as the file has them, by mesh
  std::vector<std::uint32_t> rest_mesh_;  ///< by node: the file's mesh
  std::vector<Motion> motion_;
  std::vector<bool> deforms_;
  std::vector<std::vector<double>> weights_;  ///< by node, now
  bool posed_ = false;
};

}  // namespace retrace
