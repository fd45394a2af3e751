// Reading (every property of animations, skins and targets is checked where it is used; the document and its accessors
// were checked by gltf_document.cpp) and evaluation.
#include "animation.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <glm/gtc/matrix_inverse.hpp>
#include <set>

#include "golden/scene/gltf_document.hpp"

namespace retrace {
namespace {

using gltf::Document;
using gltf::quote_name;
using nlohmann::json;
using Path = AnimationTrack::Path;
using Interpolation = AnimationTrack::Interpolation;

constexpr std::size_t kMaxElements = std::size_t{1} << 26;  // of one accessor
constexpr std::size_t kMaxZeros = std::size_t{1} << 20;     // of one without a bufferView
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

/// Numbers of an accessor, as doubles; the document has checked the types of its properties.
struct Numbers {
  std::size_t count = 0, components = 0;
  std::vector<double> values;
};

class Reader {
 public:
  Reader(Document& document, const Scene& scene) : document_(document), scene_(scene) {}

  Animation run(std::size_t chosen) {
    Animation animation;
    load_skins(animation);
    load_deformations(animation);
    load_nodes(animation);
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
      track.node = static_cast<std::uint32_t>(index(target, "node", scene_.nodes.size(), "node", place));
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
      if (track.path == Path::kWeights) {
        track.components = static_cast<std::uint32_t>(animation.node_weights[track.node].size());
        if (track.components == 0) fail(place, "node " + number(track.node) + " has no morph targets");
      }
      const std::size_t s = index(channels[c], "sampler", samplers.size(), "sampler", place);
      if (!samplers[s].is_object()) fail(where + " sampler " + number(s), "must be an object");
      load_sampler(samplers[s], where + " sampler " + number(s), track);
      animation.duration = std::max(animation.duration, track.times.back());
      animation.tracks.push_back(std::move(track));
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

  // -------------------------------------------------------------------------------------------------------- accessors

  static std::size_t bytes_of(int component) { return component <= 5121 ? 1 : component <= 5123 ? 2 : 4; }
  static double value(const std::uint8_t* p, int component, bool normalized) {
    const auto as = [&](auto x) {
      std::memcpy(&x, p, sizeof x);
      return static_cast<double>(x);
    };
    switch (component) {
      case 5120:
        return normalized ? std::max(as(std::int8_t{}) / 127.0, -1.0) : as(std::int8_t{});
      case 5121:
        return normalized ? as(std::uint8_t{}) / 255.0 : as(std::uint8_t{});
      case 5122:
        return normalized ? std::max(as(std::int16_t{}) / 32767.0, -1.0) : as(std::int16_t{});
      case 5123:
        return normalized ? as(std::uint16_t{}) / 65535.0 : as(std::uint16_t{});
      case 5125:
        return as(std::uint32_t{});
      default:
        return as(float{});
    }
  }
  std::span<const std::uint8_t> bytes(const json& o, std::size_t count, std::size_t stride, std::size_t element,
                                      const std::string& where) {
    std::span<const std::uint8_t> all;
    try {
      all = document_.view(o.at("bufferView").get<std::size_t>());
    } catch (const Error& e) {
      fail(where, e.what());
    }
    const std::uint64_t offset = o.value("byteOffset", std::uint64_t{0});
    if (count > 0 && (offset > all.size() || element > all.size() - offset ||
                      (count - 1) > (all.size() - offset - element) / stride))
      fail(where, number(count) + " elements from byte " + number(offset) + " reach outside the bufferView of " +
                      number(all.size()) + " bytes");
    return count > 0 ? all.subspan(offset) : std::span<const std::uint8_t>{};
  }

  Numbers numbers(std::size_t accessor, const std::string& user, bool integers = false) {
    const std::string where = user + " accessor " + number(accessor);
    if (accessor >= size("accessors")) fail(where, "there is no such accessor");
    const json& a = document_.at("accessors", accessor);
    const std::string type = a.at("type");
    const int component = a.at("componentType");
    const bool normalized = a.value("normalized", false);
    if (!integers && component != 5126 && !normalized) fail(where, "must hold floats or normalised integers");
    if (integers && (normalized || (component != 5121 && component != 5123 && component != 5125)))
      fail(where, "must hold unsigned integers");
    Numbers out;
    out.count = a.at("count").get<std::size_t>();
    out.components = type == "SCALAR" ? 1
                     : type == "VEC2" ? 2
                     : type == "VEC3" ? 3
                     : type == "VEC4" ? 4
                     : type == "MAT4" ? 16
                                      : 0;
    if (out.components == 0) fail(where, "type " + type + " cannot stand here");
    // What has no bytes in the file must not cost memory.
    const std::size_t most = a.contains("bufferView") ? kMaxElements / out.components : kMaxZeros;
    if (out.count > most) fail(where, "'count' is too large");
    const std::size_t width = bytes_of(component), element = width * out.components;
    const auto fill = [&](const std::uint8_t* p, std::size_t to) {
      for (std::size_t k = 0; k < out.components; ++k)
        out.values[to * out.components + k] = value(p + k * width, component, normalized);
    };
    if (a.contains("bufferView")) {
      const json& view = document_.at("bufferViews", index(a, "bufferView", size("bufferViews"), "bufferView", where));
      const std::size_t stride = view.value("byteStride", element);
      if (stride < element) fail(where, "'byteStride' is less than an element");
      const auto data = bytes(a, out.count, stride, element, where);
      out.values.assign(out.count * out.components, 0.0);
      for (std::size_t i = 0; i < out.count; ++i) fill(data.data() + i * stride, i);
    } else if (!a.contains("sparse")) {
      fail(where, "has neither a bufferView nor sparse values");
    }
    out.values.resize(out.count * out.components, 0.0);
    if (a.contains("sparse")) {
      const json &sparse = a["sparse"], &at = sparse.at("indices"), &values = sparse.at("values");
      const auto count = sparse.at("count").get<std::size_t>();
      const int index_component = at.at("componentType");
      if (count > out.count) fail(where + " sparse", "more values than the accessor has elements");
      if (index_component != 5121 && index_component != 5123 && index_component != 5125)
        fail(where + " sparse", "indices must be unsigned integers");
      const std::size_t index_width = bytes_of(index_component);
      const auto indices = bytes(at, count, index_width, index_width, where + " sparse indices");
      const auto data = bytes(values, count, element, element, where + " sparse values");
      for (std::size_t i = 0; i < count; ++i) {
        const auto to = static_cast<std::size_t>(value(indices.data() + i * index_width, index_component, false));
        if (to >= out.count) fail(where + " sparse", "index " + number(i) + " is out of range");
        fill(data.data() + i * element, to);
      }
    }
    for (std::size_t i = 0; i < out.values.size(); ++i)
      if (!std::isfinite(out.values[i])) fail(where, "element " + number(i / out.components) + " is not finite");
    return out;
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
    const Numbers times = numbers(index(o, "input", size("accessors"), "accessor", where), where + " input");
    if (times.components != 1) fail(where + " input", "must be scalars");
    if (times.count == 0) fail(where + " input", "has no keys");
    for (std::size_t i = 0; i < times.count; ++i) {
      if (times.values[i] < 0.0) fail(where + " input", "key " + number(i) + " lies before time 0");
      if (i > 0 && !(times.values[i] > times.values[i - 1]))
        fail(where + " input", "keys are not in ascending order: key " + number(i) + " at " + shown(times.values[i]) +
                                   " s follows one at " + shown(times.values[i - 1]) + " s");
    }
    Numbers values = numbers(index(o, "output", size("accessors"), "accessor", where), where + " output");
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

  void load_skins(Animation& animation) {
    for (std::size_t s = 0; s < size("skins"); ++s) {
      const json& o = entry("skins", s);
      Skin skin;
      skin.name = text(o, "name", "", "skin " + number(s));
      const std::string where = "skin " + number(s) + quote_name(skin.name);
      const json& joints = array(o, "joints", where);
      if (joints.empty()) fail(where, "has no joints");
      if (joints.size() > 65535) fail(where, "has more than 65535 joints");
      for (const json& joint : joints)
        skin.joints.push_back(static_cast<std::uint32_t>(index(joint, scene_.nodes.size(), "node", where)));
      skin.inverse_bind.assign(skin.joints.size(), glm::dmat4(1.0));
      if (o.contains("inverseBindMatrices")) {
        const Numbers m = numbers(index(o, "inverseBindMatrices", size("accessors"), "accessor", where),
                                  where + " inverseBindMatrices");
        if (m.components != 16) fail(where + " inverseBindMatrices", "must be matrices of 4 x 4");
        if (m.count < skin.joints.size())
          fail(where,
               "has " + number(skin.joints.size()) + " joints, but only " + number(m.count) + " inverse bind matrices");
        for (std::size_t j = 0; j < skin.joints.size(); ++j)
          for (int c = 0; c < 4; ++c)
            for (int r = 0; r < 4; ++r)
              skin.inverse_bind[j][c][r] =
                  r == 3 ? (c == 3 ? 1.0 : 0.0) : m.values[j * 16 + static_cast<std::size_t>(4 * c + r)];
      }
      animation.skins.push_back(std::move(skin));
    }
  }

  /// Numbers in the file of the vertices that the loader kept of a primitive; empty: all, in order.
  std::vector<std::uint32_t> kept_vertices(const json& p, std::size_t count, std::size_t kept,
                                           const std::string& where) {
    if (kept == count) return {};
    std::vector<std::uint32_t> used;
    if (p.contains("indices")) {
      const Numbers indices =
          numbers(index(p, "indices", size("accessors"), "accessor", where), where + " indices", true);
      const std::size_t n = p.value("mode", 4) == 4 ? indices.count / 3 * 3 : indices.count;
      for (std::size_t i = 0; i < n; ++i) used.push_back(static_cast<std::uint32_t>(indices.values[i]));
      std::sort(used.begin(), used.end());
      used.erase(std::unique(used.begin(), used.end()), used.end());
    }
    if (used.size() != kept || (!used.empty() && used.back() >= count))
      fail(where, "the vertices do not belong to this scene");
    return used;
  }

  void load_deformations(Animation& animation) {
    if (size("meshes") != scene_.meshes.size()) throw Error("the scene was not loaded from this file");
    animation.deformations.resize(scene_.meshes.size());
    for (std::size_t m = 0; m < scene_.meshes.size(); ++m) {
      const json& mesh = entry("meshes", m);
      const std::string name = "mesh " + number(m) + quote_name(scene_.meshes[m].name);
      const json& primitives = array(mesh, "primitives", name);
      if (primitives.size() != scene_.meshes[m].primitives.size())
        throw Error("the scene was not loaded from this file");
      std::size_t targets = 0;
      for (std::size_t k = 0; k < primitives.size(); ++k) {
        const json& p = primitives[k];
        const std::string where = name + " primitive " + number(k);
        Deformation d;
        const std::size_t kept = scene_.meshes[m].primitives[k].positions.size();
        const json& attributes = object(p, "attributes", where);
        if (kept > 0 && attributes.contains("POSITION")) {
          const std::size_t position = index(attributes, "POSITION", size("accessors"), "accessor", where);
          const auto count = document_.at("accessors", position).at("count").get<std::size_t>();
          if (p.contains("targets") || attributes.contains("JOINTS_0")) {
            const std::vector<std::uint32_t> used = kept_vertices(p, count, kept, where);
            load_targets(p, count, used, where, d);
            load_influences(attributes, count, used, where, d);
          }
        }
        if (k > 0 && kept > 0 && d.targets.size() != targets && targets_known_)
          fail(where, "has " + number(d.targets.size()) + " morph targets, other primitives " + number(targets));
        if (kept > 0) targets = d.targets.size(), targets_known_ = true;
        animation.deformations[m].push_back(std::move(d));
      }
      targets_known_ = false;
    }
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
        const Numbers n =
            numbers(index(targets[t], "POSITION", size("accessors"), "accessor", place_name), place_name + " POSITION");
        if (n.components != 3) fail(place_name + " POSITION", "must have 3 components");
        if (n.count != count)
          fail(place_name + " POSITION",
               "has " + number(n.count) + " elements, but there are " + number(count) + " positions");
        for (std::size_t i = 0; i < kept; ++i)
          for (int c = 0; c < 3; ++c)
            moves[i][c] = static_cast<float>(n.values[place(used, i) * 3 + static_cast<std::size_t>(c)]);
      }
      d.targets.push_back(std::move(moves));
    }
  }

  void load_influences(const json& attributes, std::size_t count, const std::vector<std::uint32_t>& used,
                       const std::string& where, Deformation& d) {
    if (attributes.contains("JOINTS_2")) fail(where, "more than two sets of joints are not supported");
    for (int set = 0; set < 2; ++set) {
      const std::string joints_name = "JOINTS_" + number(static_cast<std::size_t>(set)),
                        weights_name = "WEIGHTS_" + number(static_cast<std::size_t>(set));
      if (!attributes.contains(joints_name)) break;
      const Numbers j = numbers(index(attributes, joints_name.c_str(), size("accessors"), "accessor", where),
                                where + " " + joints_name, true);
      const Numbers w = numbers(index(attributes, weights_name.c_str(), size("accessors"), "accessor", where),
                                where + " " + weights_name);
      if (j.components != 4 || w.components != 4)
        fail(where, joints_name + " and " + weights_name + " must have 4 components");
      if (j.count != count || w.count != count)
        fail(where, joints_name + " has " + number(j.count) + " elements and " + weights_name + " " + number(w.count) +
                        ", but there are " + number(count) + " positions");
      const std::size_t kept = used.empty() ? count : used.size();
      d.joints.resize(kept), d.weights.resize(kept);
      for (std::size_t i = 0; i < kept; ++i) {
        for (std::size_t c = 0; c < 4; ++c) {
          const std::size_t from = place(used, i) * 4 + c, to = static_cast<std::size_t>(set) * 4 + c;
          d.joints[i][to] = static_cast<std::uint16_t>(std::min(j.values[from], 65535.0));
          d.weights[i][to] = static_cast<float>(w.values[from]);
        }
      }
    }
  }

  void load_nodes(Animation& animation) {
    if (size("nodes") != scene_.nodes.size()) throw Error("the scene was not loaded from this file");
    animation.node_skin.assign(scene_.nodes.size(), kNone);
    animation.node_weights.resize(scene_.nodes.size());
    for (std::size_t n = 0; n < scene_.nodes.size(); ++n) {
      const Node& node = scene_.nodes[n];
      const json& o = entry("nodes", n);
      const std::string where = "node " + number(n) + quote_name(node.name);
      if (node.mesh == kNone) continue;
      const auto& deformations = animation.deformations[node.mesh];
      std::size_t targets = 0;
      for (const Deformation& d : deformations) targets = std::max(targets, d.targets.size());
      if (targets > 0) {
        const json& mesh = document_.at("meshes", node.mesh);
        const json* weights = o.contains("weights")      ? &o["weights"]
                              : mesh.contains("weights") ? &mesh["weights"]
                                                         : nullptr;
        animation.node_weights[n].assign(targets, 0.0);
        if (weights) {
          if (weights->size() != targets)
            fail(where, "has " + number(weights->size()) + " weights for " + number(targets) + " morph targets");
          for (std::size_t t = 0; t < targets; ++t) animation.node_weights[n][t] = (*weights)[t].get<double>();
        }
      }
      if (!o.contains("skin")) continue;
      const std::size_t s = index(o, "skin", animation.skins.size(), "skin", where);
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
  }

  Document& document_;
  const Scene& scene_;
  bool targets_known_ = false;
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
    return Reader(document, scene).run(index);
  });
}

Animation load_animation(const std::filesystem::path& path, const Scene& scene, std::uint32_t index) {
  try {
    return guarded([&] {
      const gltf::Bytes bytes = gltf::read_file(path);
      Document document(bytes, path.has_parent_path() ? path.parent_path() : ".");
      return Reader(document, scene).run(index);
    });
  } catch (const Error& e) {
    throw Error(path.string() + ": " + e.what());
  }
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
      // Vertices are kept in the node's space, so they also change when the node moves under a resting skin.
      deforms_[node] = deforms_[node] || moves[node];
      for (const std::uint32_t joint : animation_.skins[skin].joints) deforms_[node] = deforms_[node] || moves[joint];
    }
  }
  rest_ = scene_.meshes;
  for (std::uint32_t node = 0; node < nodes; ++node) {
    if (motion_[node] != Motion::kUnstructured) continue;
    scene_.nodes[node].mesh = static_cast<std::uint32_t>(scene_.meshes.size());
    scene_.meshes.push_back(rest_[rest_mesh_[node]]);
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
    // A skin ignores the node's transform (3.7.3.3); vertices are stored in the node's space, so its inverse goes in
    // front.
    const Skin& skin = animation_.skins[skin_index];
    const double det = glm::determinant(glm::dmat3(world[node]));
    if (!(std::abs(det) > 0.0) || !std::isfinite(1.0 / det))
      throw Error("node " + number(node) + quote_name(scene_.nodes[node].name) + ": the world matrix is singular");
    const glm::dmat4 inverse = glm::inverse(world[node]);
    for (std::size_t j = 0; j < skin.joints.size(); ++j)
      bones.push_back(inverse * world[skin.joints[j]] * skin.inverse_bind[j]);
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
