// The scenes that Retrace brings along, made by code: any tessellation, the same bits for the same parameters.
#pragma once
#include <map>
#include <span>
#include <string>
#include <vector>

#include "golden/scene/scene.hpp"

namespace retrace {

struct SceneParameter {
  std::string name;
  double value = 0;  ///< default
  double lower = 0, upper = 0;
  bool integer = true;
  std::string description;
};

struct SceneGenerator {
  std::string name;
  std::string description;
  std::vector<SceneParameter> parameters;
};

using SceneParameters = std::map<std::string, double>;

/// All generators, in the order in which they should be listed.
std::span<const SceneGenerator> scene_generators();

/// Makes a scene; parameters that are not given have their defaults. Throws Error for an unknown scene (listing those
/// there are), an unknown parameter (listing those the scene has), and a value that is out of range or not an integer
/// where one is needed.
Scene make_scene(const std::string& name, const SceneParameters& parameters = {});

/// The generator's defaults with `parameters` put over them. Throws Error as make_scene() does.
SceneParameters check_scene_parameters(const SceneGenerator& generator, const SceneParameters& parameters);

/// "key=value" texts, as the command line has them. Throws Error that names the text.
SceneParameters parse_scene_parameters(std::span<const std::string> texts);

}  // namespace retrace
