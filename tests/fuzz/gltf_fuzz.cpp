// libFuzzer target of the glTF path: bytes to Scene (.gltf and .glb, textures included), and, where that succeeds, on
// to world triangles, grid triangles and a camera. Anything but success or retrace::Error is a finding. Half of the
// mutations change one value of the JSON, which bytes changed at random seldom survive; a .glb keeps its container.
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <random>

#include "golden/gltf/gltf_loader.hpp"
#include "golden/render/view.hpp"
#include "golden/scene/geometry.hpp"
#include "tests/gltf/gltf_builder.hpp"

extern "C" std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t max_size);

namespace {

using nlohmann::json;
using retrace::test::Bytes;

using Engine = std::minstd_rand;

std::uint32_t little_u32(const std::uint8_t* p) {
  std::uint32_t x;
  std::memcpy(&x, p, 4);
  return x;
}

void collect(json& value, std::vector<json*>& all) {
  all.push_back(&value);
  if (value.is_structured())
    for (json& child : value) collect(child, all);
}

json interesting_value(Engine& random, const std::vector<json*>& all) {
  static const json kValues[] = {
      0,     1,           2,    3,      4,      5,        6,      7,    -1,    255,     256,           65535,
      65536, 1e9,         5120, 5121,   5122,   5123,     5125,   5126, 1e38,  1e39,    1e-9,          0.5,
      -0.25, 4294967295u, 1e18, "MASK", "VEC3", "SCALAR", "spot", true, false, nullptr, json::array(), json::object()};
  if (random() % 3 == 0) return *all[random() % all.size()];  // something from elsewhere in the file
  return kValues[random() % std::size(kValues)];
}

void mutate_json(json& root, Engine& random) {
  std::vector<json*> all;
  collect(root, all);
  json& target = *all[random() % all.size()];
  const json value = interesting_value(random, all);  // a copy: the target may hold it
  if (target.is_number_integer() && random() % 2) {
    target = target.get<std::int64_t>() + static_cast<std::int64_t>(random() % 5) - 2;
  } else if (target.is_array() && random() % 2) {
    if (random() % 2 || target.empty())
      target.push_back(target.empty() ? value : target[random() % target.size()]);
    else
      target.erase(target.begin() + static_cast<std::ptrdiff_t>(random() % target.size()));
  } else if (target.is_object() && !target.empty() && random() % 2) {
    auto it = target.begin();
    std::advance(it, random() % target.size());
    target.erase(it);
  } else {
    target = value;
  }
}

}  // namespace

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t max_size,
                                               unsigned seed) {
  Engine random(seed);
  if (random() % 2) return LLVMFuzzerMutate(data, size, max_size);
  const bool binary = size >= 20 && std::memcmp(data, "glTF", 4) == 0;
  std::size_t first = 0, length = size;
  Bytes bin;
  if (binary) {
    first = 20;
    length = little_u32(data + 12);
    if (length > size - 20) return LLVMFuzzerMutate(data, size, max_size);
    if (size - 20 - length > 8) bin.assign(data + 28 + length, data + size);
  }
  json root = json::parse(data + first, data + first + length, nullptr, false);
  if (root.is_discarded()) return LLVMFuzzerMutate(data, size, max_size);
  if (binary && !bin.empty() && random() % 3 == 0) {
    const std::size_t room = bin.size();
    bin.resize(LLVMFuzzerMutate(bin.data(), bin.size(), room));
  } else {
    mutate_json(root, random);
  }
  const std::string text = root.dump(-1, ' ', false, json::error_handler_t::replace);
  const Bytes out = binary ? retrace::test::GltfBuilder::glb(text, bin) : Bytes(text.begin(), text.end());
  if (out.size() > max_size) return LLVMFuzzerMutate(data, size, max_size);
  std::memcpy(data, out.data(), out.size());
  return out.size();
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace retrace;
  try {
    const Scene scene = load_gltf_memory({data, size}, {.scene = {}, .posed = true});
    // Instances make much of little; the bound on them is flatten's own test.
    std::size_t triangles = 0;
    for (const std::uint32_t node : scene.reachable())
      if (scene.nodes[node].mesh != kNone)
        for (const Primitive& p : scene.meshes[scene.nodes[node].mesh].primitives) triangles += p.triangles.size();
    if (triangles > 100000) return 0;
    const WorldTriangles world = flatten(scene);
    const GridScene grid = snap(world);
    if (grid.triangles.size() + grid.degenerate != world.vertices.size()) __builtin_trap();
    default_view(scene, world).ray(1, 2, 4, 3);
  } catch (const Error&) {
    // One clear line; anything else ends the fuzzer.
  }
  return 0;
}
