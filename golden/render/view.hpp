// From a scene to primary rays: a camera node of the glTF file, or, without one, a view that frames the scene.
// Conventions are glTF's: a camera looks along its local -z axis, +y is up; pixel (0, 0) is at the top left, its centre
// at (0.5, 0.5).
#pragma once
#include <glm/glm.hpp>
#include <limits>
#include <string>

#include "golden/engine/engine.hpp"
#include "golden/scene/geometry.hpp"
#include "golden/scene/scene.hpp"

namespace retrace {

/// A camera in world space. `world` is orthonormal: scale of the camera's node has no effect, mirroring has.
struct ViewCamera {
  std::string name;       ///< of the camera or its node; "default" if the scene has none
  glm::dmat4 world{1.0};  ///< camera to world: columns right, up, back, eye
  bool perspective = true;
  double yfov = 0.8;              ///< radians, perspective
  double aspect = 0.0;            ///< width / height the camera was meant for; 0: any
  double xmag = 1.0, ymag = 1.0;  ///< half extents, orthographic
  double znear = 0.0, zfar = std::numeric_limits<double>::infinity();  ///< along the viewing axis: clip what is seen

  glm::dvec3 eye() const { return glm::dvec3(world[3]); }

  /// Ray through the point (px, py) of an image of width x height square pixels, in world units, direction of unit
  /// length, t from the near to the far plane. An image of another shape than the camera's shows more, never less, and
  /// is never stretched.
  WorldRay ray(double px, double py, int width, int height) const;
};

/// View of the scene. `camera` picks a camera node that is reachable from the scene's roots: its number among those (in
/// the order of Scene::reachable()), or the name of the node or camera; empty: the first one, or, if there is none, a
/// view from above and in front that frames all triangles that have an area on the grid. A camera that cannot be used
/// (Camera::fault) is passed over unless it is asked for. Throws Error that lists the cameras if `camera` names none, or
/// says why the one it names cannot be used, or that the camera's transform is singular.
ViewCamera default_view(const Scene& scene, const WorldTriangles& triangles, const std::string& camera = {});

}  // namespace retrace
