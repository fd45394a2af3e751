// Reading (every property of animations, skins and targets is checked where it is used; the document and its accessors
// were checked by gltf_document.cpp) and evaluation.
#include "golden/gltf/animation.hpp"

#include <algorithm>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <set>

#include "golden/gltf/gltf_accessor.hpp"
#include "golden/gltf/gltf_document.hpp"

namespace retrace {
namespace {

using gltf::Accessor;
using gltf::Accessors;
using gltf::Document;
using gltf::Numbers;
using gltf::quote_name;
using nlohmann::json;
using Path = AnimationTrack::Path;
using Interpolation = AnimationTrack::Interpolation;

constexpr std::size_t kMaxTargets = 1024;

std::string number(std::size_t n) { return std::to_string(n); }
[[noreturn]] void fail(const std::string& where, const std::string& what) { throw Error(where + ": " + what); }

const json& object(const json& o, const char* key, const std::string& where) {
  const auto it = o.find(key);
  if (it == o.end() || !it->is_object()) fail(where, std::string("'") + key + "' is missing or not an object");
  return *it;
}
const json& array(const json& o, const char* key, const std::string& where) {
  const auto it = o.find(key);
  if (it == o.end() || !it->is_array()) fail(where, std::string("'") + key + "' is missing or not an array");
  return *it;
}
std::size_t index(const json& value, std::size_t count, const char* what, const std::string& where) {
  if (!value.is_number_unsigned()) fail(where, std::string("the ") + what + " must be an index");
  const auto i = value.get<std::uint64_t>();
  if (i >= count) fail(where, std::string("there is no ") + what + " " + number(i));
  return i;
}
std::size_t index(const json& o, const char* key, std::size_t count, const char* what, const std::string& where) {
  const auto it = o.find(key);
  if (it == o.end()) fail(where, std::string("'") + key + "' is missing");
  return index(*it, count, what, where);
}
std::string text(const json& o, const char* key, const std::string& fallback, const std::string& where) {
  const auto it = o.find(key);
  if (it == o.end()) return fallback;
  if (!it->is_string()) fail(where, std::string("'") + key + "' must be a string");
  return *it;
}

class Reader {
 public:
  Reader(Document& document, Accessors& accessors, const Scene& scene)
      : document_(document), accessors_(accessors), scene_(scene) {
    const bool same = size("meshes") == scene.meshes.size() && size("nodes") <= scene.nodes.size() &&
                      std::all_of(scene.nodes.begin() + static_cast<std::ptrdiff_t>(size("nodes")), scene.nodes.end(),
                                  [&](const Node& node) { return node.source < size("nodes"); });
    if (!same) throw Error("the scene was not loaded from this file");
  }

  Animation run(std::size_t chosen) {
    document_.use_array("animations");
    document_.use_array("skins");
    Animation animation = still();
    std::vector<bool> shown(scene_.nodes.size(), false);
    for (const std::uint32_t node : scene_.reachable()) {
      load_node(animation, node);
      shown[node] = true;
    }
    const std::size_t count = size("animations");
    if (count == 0 && chosen == 0) return animation;
    if (chosen >= count) throw Error("there is no animation " + number(chosen) + "; the file has " + number(count));
    const json& source = entry("animations", chosen);
    animation.name = text(source, "name", "", "animation " + number(chosen));
    const std::string where = "animation " + number(chosen) + quote_name(animation.name);
    const json &channels = array(source, "channels", where), &samplers = array(source, "samplers", where);
    std::set<std::pair<std::uint32_t, Path>> targets;
    for (std::size_t c = 0; c < channels.size(); ++c) {
      const std::string place = where + " channel " + number(c);
      if (!channels[c].is_object()) fail(place, "must be an object");
      const json& target = object(channels[c], "target", place);
      if (!target.contains("node")) continue;  // glTF: ignored
      AnimationTrack track;
      track.node = static_cast<std::uint32_t>(index(target, "node", size("nodes"), "node", place));
      if (!shown[track.node]) continue;
      const std::string path = text(target, "path", "", place);
      if (path == "translation") {
        track.path = Path::kTranslation;
      } else if (path == "rotation") {
        track.path = Path::kRotation;
      } else if (path == "scale") {
        track.path = Path::kScale;
      } else if (path == "weights") {
        track.path = Path::kWeights;
      } else {
        fail(place, "'path' must be translation, rotation, scale or weights, is" + quote_name(path));
      }
      if (!targets.insert({track.node, track.path}).second)
        fail(place, "another channel drives " + path + " of node " + number(track.node));
      if (track.path != Path::kWeights && scene_.nodes[track.node].has_matrix)
        fail(place, "node " + number(track.node) + " has a matrix, which cannot be animated");
      track.components = track.path == Path::kRotation ? 4 : 3;
      std::vector<std::uint32_t> driven{track.node};
      if (track.path == Path::kWeights) {
        for (std::uint32_t n = static_cast<std::uint32_t>(size("nodes")); n < scene_.nodes.size(); ++n)
          if (scene_.nodes[n].source == track.node) driven.push_back(n);
        track.components = static_cast<std::uint32_t>(animation.node_weights[driven.back()].size());
        if (track.components == 0) fail(place, "node " + number(track.node) + " has no morph targets");
        std::erase_if(driven, [&](std::uint32_t n) { return animation.node_weights[n].empty(); });
      }
      const std::size_t s = index(channels[c], "sampler", samplers.size(), "sampler", place);
      if (!samplers[s].is_object()) fail(where + " sampler " + number(s), "must be an object");
      load_sampler(samplers[s], where + " sampler " + number(s), track);
      animation.duration = std::max(animation.duration, track.times.back());
      for (const std::uint32_t node : driven) {
        animation.tracks.push_back(track);
        animation.tracks.back().node = node;
      }
    }
    return animation;
  }

  /// Without tracks, and only what changes a mesh at rest.
  Animation rest() {
    Animation animation = still();
    for (const std::uint32_t node : scene_.reachable()) {
      if (scene_.nodes[node].mesh == kNone) continue;
      try {
        load_node(animation, node, true);
        continue;
      } catch (const Error& e) {
        document_.note(std::string(e.what()) + "; the mesh stays as it is stored");
      } catch (const json::exception& e) {
        document_.note("node " + number(node) + ": malformed skin or morph targets; the mesh stays as it is stored");
      }
      animation.node_skin[node] = kNone;
      animation.node_weights[node].clear();
    }
    return animation;
  }

 private:
  std::size_t size(const char* key) const { return document_.size(key); }
  const json& entry(const char* key, std::size_t i) const {
    const json& o = document_.at(key, i);
    if (!o.is_object()) throw Error(std::string(key) + " " + number(i) + ": must be an object");
    return o;
  }

  Animation still() const {
    Animation animation;
    animation.skins.resize(size("skins"));
    animation.deformations.resize(scene_.meshes.size());
    animation.node_skin.assign(scene_.nodes.size(), kNone);
    animation.node_weights.resize(scene_.nodes.size());
    return animation;
  }

  Accessor open(const json& o, const char* key, const std::string& where, const std::string& user,
                bool bounded = false) {
    return accessors_.open(index(o, key, size("accessors"), "accessor", where), user, bounded);
  }
  Numbers numbers(const json& o, const char* key, int components, const std::string& where) {
    const Accessor accessor = open(o, key, where, where + " " + key);
    if (components > 0) accessor.expect(components, components, gltf::kAnyShort);
    if (!accessor.normalized && accessor.component == gltf::kUnsignedInt)
      fail(accessor.where, "must hold floats or short integers");
    return accessors_.numbers(accessor);
  }

  // --------------------------------------------------------------------------------------------------------- channels

  void load_sampler(const json& o, const std::string& where, AnimationTrack& track) {
    const std::string name = text(o, "interpolation", "LINEAR", where);
    if (name == "STEP") {
      track.interpolation = Interpolation::kStep;
    } else if (name == "LINEAR") {
      track.interpolation = Interpolation::kLinear;
    } else if (name == "CUBICSPLINE") {
      track.interpolation = Interpolation::kCubicSpline;
    } else {
      fail(where, "'interpolation' must be STEP, LINEAR or CUBICSPLINE, is" + quote_name(name));
    }
    const Numbers times = numbers(o, "input", 1, where);
    if (times.count == 0) fail(where + " input", "has no keys");
    for (std::size_t i = 0; i < times.count; ++i) {
      if (times.values[i] < 0.0) fail(where + " input", "key " + number(i) + " lies before time 0");
      if (i > 0 && !(times.values[i] > times.values[i - 1]))
        fail(where + " input", "keys are not in ascending order: key " + number(i) + " at " + shown(times.values[i]) +
                                   " s follows one at " + shown(times.values[i - 1]) + " s");
    }
    Numbers values = numbers(o, "output", 0, where);
    const std::size_t each = track.interpolation == Interpolation::kCubicSpline ? 3 : 1;
    const bool weights = track.path == Path::kWeights;
    if (values.components != (weights ? 1 : track.components))
      fail(where + " output",
           "must have " + number(weights ? 1 : track.components) + " components, has " + number(values.components));
    const std::size_t expected = times.count * each * (weights ? track.components : 1);
    if (values.count != expected)
      fail(where + " output",
           "has " + number(values.count) + " values, but " + number(times.count) + " keys need " + number(expected));
    track.times = times.values;
    track.values = std::move(values.values);
    if (track.path == Path::kRotation) {
      for (std::size_t key = 0; key < times.count; ++key) {
        double* q = track.values.data() + (key * each + (each == 3 ? 1 : 0)) * 4;
        const double length = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
        if (!(length > 1e-6))
          fail(where + " output", "the rotation of key " + number(key) + " is not a unit quaternion");
        if (each == 1)
          for (int k = 0; k < 4; ++k) q[k] /= length;
      }
    }
  }
  static std::string shown(double x) {
    char out[32];
    std::snprintf(out, sizeof out, "%g", x);
    return out;
  }

  // -------------------------------------------------------------------------------------------- skins, morph targets

  void load_skin(Animation& animation, std::size_t s) {
    Skin& skin = animation.skins[s];
    if (!skin.joints.empty()) return;
    const json& o = entry("skins", s);
    Skin loaded;
    loaded.name = text(o, "name", "", "skin " + number(s));
    const std::string where = "skin " + number(s) + quote_name(loaded.name);
    const json& joints = array(o, "joints", where);
    if (joints.empty()) fail(where, "has no joints");
    if (joints.size() > 65535) fail(where, "has more than 65535 joints");
    for (const json& joint : joints)
      loaded.joints.push_back(static_cast<std::uint32_t>(index(joint, size("nodes"), "node", where)));
    loaded.inverse_bind.assign(loaded.joints.size(), glm::dmat4(1.0));
    if (o.contains("inverseBindMatrices")) {
      const Numbers m = numbers(o, "inverseBindMatrices", 16, where);
      if (m.count < loaded.joints.size())
        fail(where,
             "has " + number(loaded.joints.size()) + " joints, but only " + number(m.count) + " inverse bind matrices");
      for (std::size_t j = 0; j < loaded.joints.size(); ++j)
        for (int c = 0; c < 4; ++c)
          for (int r = 0; r < 4; ++r)
            loaded.inverse_bind[j][c][r] =
                r == 3 ? (c == 3 ? 1.0 : 0.0) : m.values[j * 16 + static_cast<std::size_t>(4 * c + r)];
    }
    skin = std::move(loaded);
  }

  /// Numbers in the file of the vertices that the loader kept of a primitive; empty: all, in order.
  std::vector<std::uint32_t> kept_vertices(const json& p, std::size_t count, std::size_t kept,
                                           const std::string& where) {
    if (kept == count) return {};
    std::vector<std::uint32_t> used;
    if (p.contains("indices")) {
      const Accessor indices = open(p, "indices", where, where + " indices");
      indices.expect(1, 1, gltf::kIndices);
      const std::size_t n = p.value("mode", 4) == 4 ? indices.count / 3 * 3 : indices.count;
      for (std::size_t i = 0; i < n; ++i) used.push_back(indices.index(i));
      std::sort(used.begin(), used.end());
      used.erase(std::unique(used.begin(), used.end()), used.end());
    }
    if (used.size() != kept || (!used.empty() && used.back() >= count))
      fail(where, "the vertices do not belong to this scene");
    return used;
  }

  void load_deformations(Animation& animation, std::uint32_t m) {
    if (!animation.deformations[m].empty()) return;
    const Mesh& loaded = scene_.meshes[m];
    const std::string name = "mesh " + number(m) + quote_name(loaded.name);
    const json& primitives = array(entry("meshes", m), "primitives", name);
    if (primitives.size() != loaded.primitives.size()) throw Error("the scene was not loaded from this file");
    std::vector<Deformation> out;
    std::optional<std::size_t> targets;
    for (std::size_t k = 0; k < primitives.size(); ++k) {
      const json& p = primitives[k];
      const std::string where = name + " primitive " + number(k);
      Deformation d;
      const std::size_t kept = loaded.primitives[k].positions.size();
      const json& attributes = object(p, "attributes", where);
      if (kept > 0 && attributes.contains("POSITION")) {
        const std::size_t position = index(attributes, "POSITION", size("accessors"), "accessor", where);
        const auto count = document_.use("accessors", position).at("count").get<std::size_t>();
        if (p.contains("targets") || attributes.contains("JOINTS_0")) {
          const std::vector<std::uint32_t> used = kept_vertices(p, count, kept, where);
          load_targets(p, count, used, where, d);
          load_influences(attributes, count, used, where, d);
        }
        if (targets && d.targets.size() != *targets)
          fail(where, "has " + number(d.targets.size()) + " morph targets, other primitives " + number(*targets));
        targets = d.targets.size();
      }
      out.push_back(std::move(d));
    }
    animation.deformations[m] = std::move(out);
  }

  static std::size_t place(const std::vector<std::uint32_t>& used, std::size_t i) { return used.empty() ? i : used[i]; }

  void load_targets(const json& p, std::size_t count, const std::vector<std::uint32_t>& used, const std::string& where,
                    Deformation& d) {
    if (!p.contains("targets")) return;
    const json& targets = array(p, "targets", where);
    if (targets.size() > kMaxTargets) fail(where, "has more than " + number(kMaxTargets) + " morph targets");
    const std::size_t kept = used.empty() ? count : used.size();
    for (std::size_t t = 0; t < targets.size(); ++t) {
      const std::string place_name = where + " target " + number(t);
      if (!targets[t].is_object()) fail(place_name, "must be an object");
      std::vector<glm::vec3> moves(kept, glm::vec3(0.0f));
      if (targets[t].contains("POSITION")) {
        const Accessor a = open(targets[t], "POSITION", place_name, place_name + " POSITION");
        a.expect(3, 3, gltf::kAnyShort);
        if (a.count != count)
          fail(place_name + " POSITION",
               "has " + number(a.count) + " elements, but there are " + number(count) + " positions");
        const Numbers n = accessors_.numbers(a);
        for (std::size_t i = 0; i < kept; ++i)
          for (int c = 0; c < 3; ++c)
            moves[i][c] = static_cast<float>(n.values[place(used, i) * 3 + static_cast<std::size_t>(c)]);
      }
      d.targets.push_back(std::move(moves));
    }
  }

  void load_influences(const json& attributes, std::size_t count, const std::vector<std::uint32_t>& used,
                       const std::string& where, Deformation& d) {
    if (attributes.contains("JOINTS_2"))
      document_.note(where + ": more than two sets of joints are not supported; the first two count");
    for (int set = 0; set < 2; ++set) {
      const std::string joints_name = "JOINTS_" + number(static_cast<std::size_t>(set)),
                        weights_name = "WEIGHTS_" + number(static_cast<std::size_t>(set));
      if (!attributes.contains(joints_name)) break;
      const Accessor j = open(attributes, joints_name.c_str(), where, where + " " + joints_name, true),
                     w = open(attributes, weights_name.c_str(), where, where + " " + weights_name, true);
      j.expect(4, 4, gltf::kIndices);
      w.expect(4, 4, gltf::kAnyShort);
      if (j.count != count || w.count != count)
        fail(where, joints_name + " has " + number(j.count) + " elements and " + weights_name + " " + number(w.count) +
                        ", but there are " + number(count) + " positions");
      const std::size_t kept = used.empty() ? count : used.size();
      d.joints.resize(kept), d.weights.resize(kept);
      for (std::size_t i = 0; i < kept; ++i) {
        const std::size_t from = place(used, i);
        for (int c = 0; c < 4; ++c) {
          const auto to = static_cast<std::size_t>(set * 4 + c);
          d.joints[i][to] = static_cast<std::uint16_t>(std::min(j.value(from, c), 65535.0));
          const double weight = w.value(from, c);
          if (!std::isfinite(weight)) fail(w.where, "element " + number(from) + " is not finite");
          d.weights[i][to] = static_cast<float>(weight);
        }
      }
    }
  }

  /// What deforms the mesh of a node. At rest, targets of weight 0 are not read.
  void load_node(Animation& animation, std::uint32_t n, bool at_rest = false) {
    const Node& node = scene_.nodes[n];
    if (node.mesh == kNone) return;
    const std::size_t in_file = node.source == kNone ? n : node.source;
    const json &o = entry("nodes", in_file), &mesh = entry("meshes", node.mesh);
    const std::string where = "node " + number(in_file) + quote_name(node.name);
    const json* weights = o.contains("weights") ? &o["weights"] : mesh.contains("weights") ? &mesh["weights"] : nullptr;
    const bool moved =
        weights && std::any_of(weights->begin(), weights->end(), [](const json& w) { return w.get<double>() != 0.0; });
    if (at_rest && !moved && !o.contains("skin")) return;
    load_deformations(animation, node.mesh);
    const std::vector<Deformation>& deformations = animation.deformations[node.mesh];
    std::size_t targets = 0;
    for (const Deformation& d : deformations) targets = std::max(targets, d.targets.size());
    if (targets > 0) {
      animation.node_weights[n].assign(targets, 0.0);
      if (weights) {
        if (weights->size() != targets)
          fail(where, "has " + number(weights->size()) + " weights for " + number(targets) + " morph targets");
        for (std::size_t t = 0; t < targets; ++t) animation.node_weights[n][t] = (*weights)[t].get<double>();
      }
    }
    if (!o.contains("skin") || node.source != kNone) return;
    const std::size_t s = index(o, "skin", animation.skins.size(), "skin", where);
    load_skin(animation, s);
    const Skin& skin = animation.skins[s];
    bool skinned = false;
    for (std::size_t k = 0; k < deformations.size(); ++k) {
      const Deformation& d = deformations[k];
      skinned = skinned || !d.joints.empty();
      for (std::size_t i = 0; i < d.joints.size(); ++i) {
        double sum = 0.0;
        for (int c = 0; c < Deformation::kInfluences; ++c) {
          if (d.weights[i][c] == 0.0f) continue;
          sum += d.weights[i][c];
          if (d.joints[i][c] >= skin.joints.size())
            fail(where, "vertex " + number(i) + " of mesh " + number(node.mesh) + " primitive " + number(k) +
                            " follows joint " + number(d.joints[i][c]) + ", but skin " + number(s) +
                            quote_name(skin.name) + " has only " + number(skin.joints.size()) + " joints");
        }
        if (!(sum > 0.0))
          fail(where, "vertex " + number(i) + " of mesh " + number(node.mesh) + " primitive " + number(k) +
                          " follows no joint");
      }
    }
    if (skinned) animation.node_skin[n] = static_cast<std::uint32_t>(s);
  }

  Document& document_;
  Accessors& accessors_;
  const Scene& scene_;
};

template <class F>
auto guarded(F&& f) {
  try {
    return f();
  } catch (const json::exception& e) {  // what the checks of the document leave open
    throw Error(std::string("malformed animation: ") + e.what());
  }
}

}  // namespace

Animation load_animation_memory(std::span<const std::uint8_t> bytes, const Scene& scene, std::uint32_t index) {
  return guarded([&] {
    Document document(bytes, std::nullopt);
    Accessors accessors(document);
    return Reader(document, accessors, scene).run(index);
  });
}

Animation load_animation(const std::filesystem::path& path, const Scene& scene, std::uint32_t index) {
  try {
    return guarded([&] {
      const gltf::Bytes bytes = gltf::read_file(path);
      Document document(bytes, path.has_parent_path() ? path.parent_path() : ".");
      Accessors accessors(document);
      return Reader(document, accessors, scene).run(index);
    });
  } catch (const Error& e) {
    throw Error(path.string() + ": " + e.what());
  }
}

void pose_at_rest(Document& document, Accessors& accessors, Scene& scene) {
  Animation animation = Reader(document, accessors, scene).rest();
  const bool skinned =
      std::any_of(animation.node_skin.begin(), animation.node_skin.end(), [](std::uint32_t s) { return s != kNone; });
  const bool moved = std::any_of(animation.node_weights.begin(), animation.node_weights.end(),
                                 [](const std::vector<double>& weights) { return !weights.empty(); });
  if (!skinned && !moved) return;
  AnimatedScene posed(std::move(scene), std::move(animation));
  posed.at(0.0);
  scene = std::move(posed).release();
}

std::size_t count_animations(const std::filesystem::path& path) {
  try {
    const gltf::Bytes bytes = gltf::read_file(path);
    return Document(bytes, path.has_parent_path() ? path.parent_path() : ".").size("animations");
  } catch (const Error& e) {
    throw Error(path.string() + ": " + e.what());
  }
}

// ------------------------------------------------------------------------------------------------------------
// evaluation

void AnimationTrack::evaluate(double time, std::span<double> out) const {
  const std::size_t n = components;
  const bool cubic = interpolation == Interpolation::kCubicSpline;
  const auto at = [&](std::size_t key, std::size_t part) { return values.data() + (cubic ? key * 3 + part : key) * n; };
  const auto copy = [&](std::size_t key) { std::copy_n(at(key, 1), n, out.begin()); };
  const auto next = static_cast<std::size_t>(std::upper_bound(times.begin(), times.end(), time) - times.begin());
  if (next == 0) {
    copy(0);
  } else if (next == times.size() || interpolation == Interpolation::kStep) {
    copy(next - 1);
  } else {
    const std::size_t key = next - 1;
    const double span = times[next] - times[key], t = (time - times[key]) / span;
    const double *a = at(key, 1), *b = at(next, 1);
    if (cubic) {  // appendix C.5
      const double *out_tangent = at(key, 2), *in_tangent = at(next, 0);
      const double t2 = t * t, t3 = t2 * t;
      for (std::size_t k = 0; k < n; ++k)
        out[k] = (2 * t3 - 3 * t2 + 1) * a[k] + span * (t3 - 2 * t2 + t) * out_tangent[k] + (-2 * t3 + 3 * t2) * b[k] +
                 span * (t3 - t2) * in_tangent[k];
    } else if (path == Path::kRotation) {  // appendix C.4: the shorter way round
      const glm::dquat q = glm::slerp(glm::dquat(a[3], a[0], a[1], a[2]), glm::dquat(b[3], b[0], b[1], b[2]), t);
      out[0] = q.x, out[1] = q.y, out[2] = q.z, out[3] = q.w;
    } else {
      for (std::size_t k = 0; k < n; ++k) out[k] = a[k] + t * (b[k] - a[k]);
    }
  }
  if (path == Path::kRotation) {
    const double length = std::sqrt(out[0] * out[0] + out[1] * out[1] + out[2] * out[2] + out[3] * out[3]);
    if (length > 0.0)
      for (std::size_t k = 0; k < 4; ++k) out[k] /= length;
  }
}

AnimatedScene::AnimatedScene(Scene scene, Animation animation)
    : animation_(std::move(animation)), scene_(std::move(scene)) {
  const std::size_t nodes = scene_.nodes.size();
  std::vector<bool> driven(nodes, false), weighted(nodes, false), moves(nodes, false);
  for (const AnimationTrack& track : animation_.tracks)
    (track.path == Path::kWeights ? weighted : driven)[track.node] = true;
  for (const std::uint32_t node : scene_.reachable()) {
    const std::uint32_t parent = scene_.nodes[node].parent;
    moves[node] = driven[node] || (parent != kNone && moves[parent]);
  }
  motion_.assign(nodes, Motion::kStatic);
  deforms_.assign(nodes, false);
  weights_ = animation_.node_weights;
  weights_.resize(nodes);
  for (std::uint32_t node = 0; node < nodes; ++node) {
    rest_mesh_.push_back(scene_.nodes[node].mesh);
    if (moves[node]) motion_[node] = Motion::kAffine;
    if (scene_.nodes[node].mesh == kNone) continue;
    const bool morphs =
        weighted[node] || std::any_of(weights_[node].begin(), weights_[node].end(), [](double w) { return w != 0.0; });
    const std::uint32_t skin = animation_.node_skin.empty() ? kNone : animation_.node_skin[node];
    if (!morphs && skin == kNone) continue;
    motion_[node] = Motion::kUnstructured;
    deforms_[node] = weighted[node];
    if (skin != kNone) {
      for (const std::uint32_t joint : animation_.skins[skin].joints) deforms_[node] = deforms_[node] || moves[joint];
    }
  }
  rest_ = scene_.meshes;
  for (std::uint32_t node = 0; node < nodes; ++node) {
    if (motion_[node] != Motion::kUnstructured) continue;
    scene_.nodes[node].mesh = static_cast<std::uint32_t>(scene_.meshes.size());
    scene_.meshes.push_back(rest_[rest_mesh_[node]]);
    scene_.meshes.back().source = rest_mesh_[node];
  }
}

const Scene& AnimatedScene::at(double time) {
  for (const AnimationTrack& track : animation_.tracks) {
    Node& node = scene_.nodes[track.node];
    if (track.path == Path::kWeights) {
      track.evaluate(time, weights_[track.node]);
      continue;
    }
    std::array<double, 4> v{};
    track.evaluate(time, v);
    if (track.path == Path::kTranslation) node.translation = {v[0], v[1], v[2]};
    if (track.path == Path::kScale) node.scale = {v[0], v[1], v[2]};
    if (track.path == Path::kRotation) node.rotation = glm::dquat(v[3], v[0], v[1], v[2]);
  }
  const std::vector<glm::dmat4> world = scene_.world_transforms();
  for (const std::uint32_t node : scene_.reachable())
    if (motion_[node] == Motion::kUnstructured && (deforms_[node] || !posed_)) deform(node, world);
  posed_ = true;
  return scene_;
}

void AnimatedScene::deform(std::uint32_t node, const std::vector<glm::dmat4>& world) {
  const Mesh& rest = rest_[rest_mesh_[node]];
  Mesh& mesh = scene_.meshes[scene_.nodes[node].mesh];
  const auto& deformations = animation_.deformations[rest_mesh_[node]];
  const std::uint32_t skin_index = animation_.node_skin[node];
  std::vector<glm::dmat4> bones;
  if (skin_index != kNone) {
    // A skin ignores the node's transform (3.7.3.3). Vertices are kept about the first joint, where floats are fine.
    const Skin& skin = animation_.skins[skin_index];
    const glm::dvec3 center(world[skin.joints[0]][3]);
    scene_.nodes[node].mesh_frame = glm::translate(glm::dmat4(1.0), center);
    const glm::dmat4 back = glm::translate(glm::dmat4(1.0), -center);
    for (std::size_t j = 0; j < skin.joints.size(); ++j)
      bones.push_back(back * world[skin.joints[j]] * skin.inverse_bind[j]);
  }
  for (std::size_t k = 0; k < rest.primitives.size(); ++k) {
    const Primitive& from = rest.primitives[k];
    Primitive& to = mesh.primitives[k];
    const Deformation& d = deformations[k];
    for (std::size_t i = 0; i < from.positions.size(); ++i) {
      glm::dvec3 p = from.positions[i];
      for (std::size_t t = 0; t < d.targets.size(); ++t) p += weights_[node][t] * glm::dvec3(d.targets[t][i]);
      if (!bones.empty() && !d.joints.empty()) {
        glm::dmat4 blend(0.0);
        double sum = 0.0;
        for (int c = 0; c < Deformation::kInfluences; ++c) {
          const double w = d.weights[i][c];
          if (w != 0.0) blend += w * bones[d.joints[i][c]], sum += w;
        }
        p = glm::dvec3(blend * glm::dvec4(p, 1.0)) / sum;
      }
      to.positions[i] = glm::vec3(p);
      if (const glm::vec3& q = to.positions[i]; !std::isfinite(q.x) || !std::isfinite(q.y) || !std::isfinite(q.z))
        throw Error("node " + number(node) + quote_name(scene_.nodes[node].name) + ": vertex " + number(i) +
                    " of mesh " + number(rest_mesh_[node]) + " primitive " + number(k) +
                    " leaves the range of single precision");
    }
    if (from.normals.empty()) continue;
    // Smooth where the file is smooth: vertices there are shared, where it has an edge they are split.
    std::fill(to.normals.begin(), to.normals.end(), glm::vec3(0.0f));
    for (const glm::uvec3& t : to.triangles) {
      const glm::vec3 n = glm::cross(to.positions[t.y] - to.positions[t.x], to.positions[t.z] - to.positions[t.x]);
      for (int c = 0; c < 3; ++c) to.normals[t[c]] += n;
    }
    for (std::size_t i = 0; i < to.normals.size(); ++i) {
      const float length = glm::length(to.normals[i]);
      to.normals[i] = length > 0.0f ? to.normals[i] / length : from.normals[i];
    }
  }
}

}  // namespace retrace
