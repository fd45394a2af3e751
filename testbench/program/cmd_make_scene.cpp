// retrace make-scene: the project's own scenes as .glb files.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <sstream>

#include "golden/base/output_file.hpp"
#include "golden/gltf/glb_writer.hpp"
#include "golden/gltf/gltf_loader.hpp"
#include "scenes/animated_scenes.hpp"
#include "scenes/generators.hpp"
#include "testbench/program/commands.hpp"

namespace retrace::cli {
namespace {

struct MakeSceneArguments {
  std::string name, output;
  std::vector<std::string> settings;
  bool list = false;
};

std::string number(double value) {
  std::ostringstream text;
  text << value;
  return text.str();
}

std::vector<SceneGenerator> all_generators() {
  std::vector<SceneGenerator> all(scene_generators().begin(), scene_generators().end());
  all.insert(all.end(), animated_scene_generators().begin(), animated_scene_generators().end());
  return all;
}

bool is_animated(const std::string& name) {
  for (const SceneGenerator& generator : animated_scene_generators()) {
    if (generator.name == name) return true;
  }
  return false;
}

std::string list_generators() {
  std::string text;
  for (const SceneGenerator& generator : all_generators()) {
    text += "  " + generator.name + std::string(generator.name.size() < 14 ? 14 - generator.name.size() : 1, ' ') +
            generator.description + "\n";
    for (const SceneParameter& p : generator.parameters) {
      text += "      " + p.name + "=" + number(p.value) + "  " + p.description + ", " + number(p.lower) + " to " +
              number(p.upper) + "\n";
    }
  }
  return text;
}

void run_make_scene(const MakeSceneArguments& a) {
  if (a.list) {
    std::printf("%s", list_generators().c_str());
    return;
  }
  if (a.name.empty()) throw CLI::RequiredError("name");
  if (a.output.empty()) throw CLI::RequiredError("--output");
  OutputFile file(a.output);
  const SceneParameters parameters = parse_scene_parameters(a.settings);
  std::vector<std::uint8_t> bytes;
  Scene scene;
  if (is_animated(a.name)) {
    bytes = make_animated_glb(a.name, parameters);
    scene = load_gltf_memory(bytes);
  } else {
    scene = make_scene(a.name, parameters);
    bytes = to_glb(scene);
  }
  file.refer({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  file.commit();
  std::size_t triangles = 0;
  for (const std::uint32_t n : scene.reachable()) {
    if (scene.nodes[n].mesh >= scene.meshes.size()) continue;
    for (const Primitive& primitive : scene.meshes[scene.nodes[n].mesh].primitives)
      triangles += primitive.triangles.size();
  }
  std::printf("%s: %s triangles, %s bytes\n", a.output.c_str(), with_commas(triangles).c_str(),
              with_commas(bytes.size()).c_str());
}

}  // namespace

void add_make_scene(CLI::App& app, Program& program) {
  CLI::App* command = app.add_subcommand("make-scene", "Write one of the project's own scenes as a .glb file");
  auto a = std::make_shared<MakeSceneArguments>();
  command->add_option("name", a->name, "Scene, see below")->type_name("NAME");
  command->add_option("-o,--output", a->output, "File to write (.glb)")->type_name("FILE");
  command->add_option("--set", a->settings, "A parameter of the scene; may be repeated")
      ->type_name("KEY=VALUE")
      ->take_all()
      ->allow_extra_args(false);
  command->add_flag("--list", a->list, "List the scenes and their parameters");
  add_common(*command, program);
  command->footer("Scenes:\n" + list_generators() +
                  "Examples:\n"
                  "  retrace make-scene room -o room.glb\n"
                  "  retrace make-scene --list\n");
  command->callback([a] { run_make_scene(*a); });
}

}  // namespace retrace::cli
