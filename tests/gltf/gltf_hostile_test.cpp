// Malformed files: a fault in what the scene shows ends in one Error of one line that says where and what; any other
// fault is one note, and the file loads. The tables are the specification of the messages.
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <fstream>
#include <functional>

#include "gltf_builder.hpp"
#include "golden/gltf/gltf_loader.hpp"
#include "golden/scene/geometry.hpp"
#include "testbench/kit/random.hpp"

namespace retrace {
namespace {

using nlohmann::json;
using test::Bytes;
using test::GltfBuilder;

struct Case {
  const char* name;
  std::function<void(GltfBuilder&)> spoil;
  std::vector<std::string> expected;  // parts of the message
};

std::string message_of(const Bytes& bytes) {
  try {
    load_gltf_memory(bytes);
  } catch (const Error& e) {
    return e.what();
  }
  return "";
}

void expect_message(const std::string& message, const std::vector<std::string>& parts) {
  EXPECT_FALSE(message.empty()) << "loaded";
  EXPECT_EQ(message.find('\n'), std::string::npos) << message;
  EXPECT_LT(message.size(), 500u);
  for (const std::string& part : parts)
    EXPECT_NE(message.find(part), std::string::npos) << "no '" << part << "' in: " << message;
}

json& positions(GltfBuilder& b) { return b.root["accessors"][0]; }
json& indices(GltfBuilder& b) { return b.root["accessors"][1]; }

void add_camera(GltfBuilder& b, json parameters) {
  b.add("cameras", {{"type", "perspective"}, {"perspective", std::move(parameters)}});
}

void add_sparse(GltfBuilder& b, const std::vector<std::uint16_t>& which, int count) {
  const int i = b.view(which), v = b.view(std::vector<float>(3 * which.size()));
  positions(b)["sparse"] = {
      {"count", count}, {"indices", {{"bufferView", i}, {"componentType", 5123}}}, {"values", {{"bufferView", v}}}};
}

void add_texture(GltfBuilder& b, json image) {
  b.add("images", std::move(image));
  b.add("textures", {{"source", 0}});
  b.add("materials", {{"name", "wood"}, {"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}}});
}

const Case kCases[] = {
    // The document.
    {"no asset", [](GltfBuilder& b) { b.root.erase("asset"); }, {"glTF: 'asset' is missing"}},
    {"old version",
     [](GltfBuilder& b) { b.root["asset"]["version"] = "1.0"; },
     {"asset", "version '1.0' is not supported"}},
    {"version is a number",
     [](GltfBuilder& b) { b.root["asset"]["version"] = 2; },
     {"asset", "'version' must be a string, is 2"}},
    {"draco",
     [](GltfBuilder& b) { b.root["extensionsRequired"] = {"KHR_draco_mesh_compression"}; },
     {"requires the extension 'KHR_draco_mesh_compression'"}},
    {"unknown extension required",
     [](GltfBuilder& b) {
       b.root["extensionsRequired"] = {"KHR_lights_punctual", "EXT_unheard_of"};
     },
     {"requires the extension 'EXT_unheard_of'"}},
    {"compressed primitive",
     [](GltfBuilder& b) {
       b.primitive()["extensions"]["KHR_draco_mesh_compression"] = {{"bufferView", 0}};
       positions(b).erase("bufferView");
     },
     {"mesh 0 primitive 0: is compressed (KHR_draco_mesh_compression)"}},
    {"compressed view",
     [](GltfBuilder& b) {
       b.root["buffers"] = {{{"byteLength", 42}}};
       b.root["bufferViews"][0]["extensions"]["EXT_meshopt_compression"] = {{"buffer", 0}};
     },
     {"bufferView 0: is compressed (EXT_meshopt_compression)"}},
    {"too deep",
     [](GltfBuilder& b) {
       json deep = 1;
       for (int i = 0; i < 100; ++i) deep = json::array({deep});
       b.root["nodes"][0]["extensions"]["X"] = deep;
     },
     {"nested deeper than 64"}},
    {"newlines in names", [](GltfBuilder& b) { b.root["extensionsRequired"] = {"a\nb\tc\x7f"}; }, {"'a?b?c?'"}},
    {"nodes is an object",
     [](GltfBuilder& b) {
       b.root["nodes"] = {{"mesh", 0}};
     },
     {"'nodes' must be an array"}},
    {"node is a number", [](GltfBuilder& b) { b.root["nodes"][0] = 7; }, {"node 0: must be an object, is 7"}},
    // Indices between objects.
    {"mesh of node",
     [](GltfBuilder& b) {
       b.root["nodes"][0]["mesh"] = 1;
       b.root["nodes"][0]["name"] = "n";
     },
     {"node 0 'n': there is no mesh 1"}},
    {"negative mesh",
     [](GltfBuilder& b) { b.root["nodes"][0]["mesh"] = -1; },
     {"node 0: 'mesh' must be an index, is -1"}},
    {"mesh 2^32",
     [](GltfBuilder& b) { b.root["nodes"][0]["mesh"] = 4294967296; },
     {"node 0: 'mesh' must be an index, is 4294967296"}},
    {"fractional mesh", [](GltfBuilder& b) { b.root["nodes"][0]["mesh"] = 0.5; }, {"'mesh' must be an index, is 0.5"}},
    {"child of node", [](GltfBuilder& b) { b.root["nodes"][0]["children"] = {9}; }, {"node 0: there is no node 9"}},
    {"material",
     [](GltfBuilder& b) {
       b.primitive()["material"] = 4;
       b.root["meshes"][0]["name"] = "m";
     },
     {"mesh 0 'm' primitive 0: there is no material 4"}},
    {"accessor",
     [](GltfBuilder& b) { b.primitive()["attributes"]["POSITION"] = 12; },
     {"mesh 0 primitive 0: POSITION accessor 12: there is no such accessor"}},
    {"buffer view",
     [](GltfBuilder& b) { positions(b)["bufferView"] = 9; },
     {"POSITION accessor 0: there is no bufferView 9"}},
    {"buffer", [](GltfBuilder& b) { b.root["bufferViews"][0]["buffer"] = 1; }, {"bufferView 0: there is no buffer 1"}},
    {"scene", [](GltfBuilder& b) { b.root["scene"] = 3; }, {"'scene' is 3, but the file has 1 scenes"}},
    {"root of scene", [](GltfBuilder& b) { b.root["scenes"][0]["nodes"] = {5}; }, {"scene 0: there is no node 5"}},
    // The hierarchy.
    {"own child", [](GltfBuilder& b) { b.root["nodes"][0]["children"] = {0}; }, {"node 0: is its own ancestor"}},
    {"two parents, shown",
     [](GltfBuilder& b) {
       b.root["nodes"][0]["children"] = {1, 2};
       b.add("nodes", {{"children", {3}}});
       b.add("nodes", {{"children", {3}}});
       b.add("nodes", {{"name", "x"}});
     },
     {"node 3 'x': is a child of node 1 and of node 2"}},
    {"instances of unequal counts",
     [](GltfBuilder& b) {
       const int move = b.floats({0, 0, 0, 1, 0, 0}, "VEC3"), size = b.floats({1, 1, 1}, "VEC3");
       b.root["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"] = {{"SCALE", size},
                                                                                    {"TRANSLATION", move}};
     },
     {"node 0 EXT_mesh_gpu_instancing: TRANSLATION accessor 2: has 2 elements, but another attribute has 1"}},
    {"a billion instances",
     [](GltfBuilder& b) {
       const int move = b.accessor(-1, GltfBuilder::kFloat, 1000000000, "VEC3");
       b.root["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"]["TRANSLATION"] = move;
     },
     {"TRANSLATION accessor 2: too many elements without a bufferView"}},
    {"child twice",
     [](GltfBuilder& b) {
       b.root["nodes"][0]["children"] = {1, 1};
       b.add("nodes", json::object());
     },
     {"node 1: is a child of node 0 and of node 0"}},
    {"child as root",
     [](GltfBuilder& b) {
       b.root["nodes"][0]["children"] = {1};
       b.root["scenes"][0]["nodes"] = {1};
       b.add("nodes", json::object());
     },
     {"scene 0: node 1 is a root and a child of node 0"}},
    // Transforms.
    {"short matrix",
     [](GltfBuilder& b) {
       b.root["nodes"][0]["matrix"] = {1, 0, 0};
     },
     {"node 0: 'matrix' must be 16 numbers"}},
    {"projective matrix",
     [](GltfBuilder& b) { b.root["nodes"][0]["matrix"] = {1, 0, 0, 1, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}; },
     {"node 0: 'matrix' is not affine"}},
    {"text in translation",
     [](GltfBuilder& b) {
       b.root["nodes"][0]["translation"] = {1, "2", 3};
     },
     {"node 0: 'translation' must be 3 numbers, is [1,\"2\",3]"}},
    {"overflowing hierarchy",
     [](GltfBuilder& b) {
       b.root["nodes"][0]["scale"] = {1e200, 1, 1};
       b.root["nodes"][0]["children"] = {1};
       b.add("nodes", {{"scale", {1e200, 1, 1}}, {"mesh", 0}});
     },
     {"node 1: the world transform is not finite"}},
    // Accessors and buffers.
    {"count too large",
     [](GltfBuilder& b) { positions(b)["count"] = 4; },
     {"POSITION accessor 0: 4 elements from byte 0 reach outside the bufferView of 36 bytes"}},
    {"huge count",
     [](GltfBuilder& b) { positions(b)["count"] = 4000000000u; },
     {"POSITION accessor 0", "reach outside"}},
    {"count beyond 2^32",
     [](GltfBuilder& b) { positions(b)["count"] = 1ull << 40; },
     {"POSITION accessor 0: 'count' is too large"}},
    {"count beyond 2^53",
     [](GltfBuilder& b) { positions(b)["count"] = 1ull << 60; },
     {"accessor 0: 'count' must be a non-negative integer"}},
    {"negative count",
     [](GltfBuilder& b) { positions(b)["count"] = -3; },
     {"accessor 0: 'count' must be a non-negative integer, is -3"}},
    {"offset beyond the view",
     [](GltfBuilder& b) { positions(b)["byteOffset"] = 1ull << 52; },
     {"POSITION accessor 0", "reach outside"}},
    {"view beyond the buffer",
     [](GltfBuilder& b) { b.root["bufferViews"][0]["byteLength"] = 1000; },
     {"bufferView 0: 1000 bytes from 0 reach outside buffer 0 of 42 bytes"}},
    {"view offset overflow",
     [](GltfBuilder& b) { b.root["bufferViews"][0]["byteOffset"] = (1ull << 53) - 1; },
     {"bufferView 0", "reach outside buffer 0"}},
    {"stride below element",
     [](GltfBuilder& b) { b.root["bufferViews"][0]["byteStride"] = 8; },
     {"'byteStride' of bufferView 0 is 8, less than an element of 12 bytes"}},
    {"odd stride",
     [](GltfBuilder& b) { b.root["bufferViews"][0]["byteStride"] = 13; },
     {"POSITION accessor 0: 3 elements from byte 0 reach outside the bufferView of 36 bytes"}},
    {"unknown component type",
     [](GltfBuilder& b) { positions(b)["componentType"] = 5130; },
     {"accessor 0: 'componentType' 5130 does not exist"}},
    {"integer positions",
     [](GltfBuilder& b) { positions(b)["componentType"] = 5125; },
     {"POSITION accessor 0: component type UNSIGNED_INT is not allowed"}},
    {"unknown type",
     [](GltfBuilder& b) { positions(b)["type"] = "VEC5"; },
     {"accessor 0: 'type' 'VEC5' does not exist"}},
    {"positions of two components",
     [](GltfBuilder& b) { positions(b)["type"] = "VEC2"; },
     {"POSITION accessor 0: must have 3 components, has 2"}},
    {"matrix positions",
     [](GltfBuilder& b) {
       positions(b)["type"] = "MAT2";
       positions(b)["count"] = 1;
     },
     {"POSITION accessor 0: matrices cannot stand here"}},
    {"float indices",
     [](GltfBuilder& b) {
       indices(b)["componentType"] = 5126;
       indices(b)["count"] = 1;
     },
     {"indices accessor 1: must be unsigned integer scalars"}},
    {"vector indices",
     [](GltfBuilder& b) {
       indices(b)["type"] = "VEC3";
       indices(b)["count"] = 1;
     },
     {"indices accessor 1: must be unsigned integer scalars"}},
    {"index out of range",
     [](GltfBuilder& b) { b.buffer[40] = 3; },
     {"indices accessor 1: index 2 is 3, but there are 3 vertices"}},
    {"primitive restart", [](GltfBuilder& b) { b.buffer[40] = b.buffer[41] = 255; }, {"index 2 is 65535"}},
    {"unequal counts",
     [](GltfBuilder& b) {
       b.primitive()["attributes"]["NORMAL"] = b.floats({0, 0, 1}, "VEC3");
     },
     {"NORMAL accessor 2: has 1 elements, but there are 3 positions"}},
    {"unsigned normals",
     [](GltfBuilder& b) {
       b.primitive()["attributes"]["NORMAL"] = b.values(std::vector<std::uint8_t>(9), 5121, "VEC3");
     },
     {"NORMAL accessor 2: component type UNSIGNED_BYTE is not allowed"}},
    {"colours of two components",
     [](GltfBuilder& b) {
       b.primitive()["attributes"]["COLOR_0"] = b.floats({0, 0, 1, 1, 0, 0}, "VEC2");
     },
     {"COLOR_0 accessor 2: must have 3 or 4 components, has 2"}},
    {"infinite vertex",
     [](GltfBuilder& b) {
       b.buffer[14] = 0x80;
       b.buffer[15] = 0x7f;
     },
     {"POSITION accessor 0: vertex 1 is not finite"}},
    {"NaN vertex",
     [](GltfBuilder& b) {
       b.buffer[35] = 0xff;
       b.buffer[34] = 0xff;
     },
     {"POSITION accessor 0: vertex 2 is not finite"}},
    {"unknown mode",
     [](GltfBuilder& b) { b.primitive()["mode"] = 7; },
     {"mesh 0 primitive 0: 'mode' 7 does not exist"}},
    {"no attributes",
     [](GltfBuilder& b) { b.primitive().erase("attributes"); },
     {"mesh 0 primitive 0: 'attributes' is missing"}},
    {"attribute is a string",
     [](GltfBuilder& b) { b.primitive()["attributes"]["NORMAL"] = "0"; },
     {"mesh 0 primitive 0: 'attributes 'NORMAL'' must be an index, is \"0\""}},
    {"sparse too many",
     [](GltfBuilder& b) {
       add_sparse(b, {0, 1}, 4);
     },
     {"POSITION accessor 0 sparse: more values than the accessor has elements"}},
    {"sparse outside",
     [](GltfBuilder& b) {
       add_sparse(b, {0, 1}, 3);
     },
     {"POSITION accessor 0 sparse indices: 3 elements", "reach outside"}},
    {"sparse not ascending",
     [](GltfBuilder& b) {
       add_sparse(b, {1, 1}, 2);
     },
     {"sparse indices: index 1 is 1, not ascending"}},
    {"sparse out of range",
     [](GltfBuilder& b) {
       add_sparse(b, {0, 3}, 2);
     },
     {"sparse indices: index 1 is 3, out of range"}},
    {"sparse by float",
     [](GltfBuilder& b) {
       add_sparse(b, {0, 1}, 2);
       positions(b)["sparse"]["indices"]["componentType"] = 5126;
     },
     {"sparse indices: component type FLOAT is not allowed"}},
    {"a billion zeros",
     [](GltfBuilder& b) {
       add_sparse(b, {0, 1}, 2);
       positions(b).erase("bufferView");
       positions(b)["count"] = 1000000000;
     },
     {"POSITION accessor 0: too many elements without a bufferView"}},
    {"buffer shorter than it says",
     [](GltfBuilder& b) {
       b.root["buffers"] = {{{"byteLength", 100}, {"uri", "data:;base64,AAAA"}}};
     },
     {"buffer 0: 'byteLength' is 100, but there are 3 bytes"}},
    {"bad base64",
     [](GltfBuilder& b) {
       b.root["buffers"] = {{{"byteLength", 3}, {"uri", "data:;base64,AA!A"}}};
     },
     {"buffer 0: data URI: a character is not base64"}},
    {"cut base64",
     [](GltfBuilder& b) {
       b.root["buffers"] = {{{"byteLength", 3}, {"uri", "data:;base64,AAAAA"}}};
     },
     {"buffer 0: data URI: base64 text is cut off"}},
    {"no URI",
     [](GltfBuilder& b) {
       b.root["buffers"] = {{{"byteLength", 42}}};
     },
     {"buffer 0: has no URI"}},
    {"external file from memory",
     [](GltfBuilder& b) {
       b.root["buffers"] = {{{"byteLength", 42}, {"uri", "a.bin"}}};
     },
     {"buffer 0: external file 'a.bin' cannot be opened when loading from memory"}},
    // Materials, cameras, lights, images.
    {"three factors",
     [](GltfBuilder& b) {
       b.primitive()["material"] = b.add("materials", {{"pbrMetallicRoughness", {{"baseColorFactor", {1, 1, 1}}}}});
     },
     {"material 0: 'baseColorFactor' must be 4 numbers"}},
    {"factor beyond float",
     [](GltfBuilder& b) {
       b.primitive()["material"] = b.add("materials", {{"emissiveFactor", {1, 1e60, 1}}});
     },
     {"material 0: 'emissiveFactor' must be 3 numbers"}},
    {"double-sided is 1",
     [](GltfBuilder& b) {
       b.primitive()["material"] = b.add("materials", {{"doubleSided", 1}});
     },
     {"material 0: 'doubleSided' must be true or false, is 1"}},
};

/// Faults in what the scene does not show, or that leave something to show: the file loads with one note.
const Case kNoted[] = {
    {"extension that the file does not declare",
     [](GltfBuilder& b) { b.root["materials"][0]["extensions"]["KHR_materials_transmission"] = json::object(); },
     {"extension 'KHR_materials_transmission' is not supported and left out"}},
    {"minVersion", [](GltfBuilder& b) { b.root["asset"]["minVersion"] = "2.9"; }, {"asset: 'minVersion' is \"2.9\""}},
    {"extension is a string",
     [](GltfBuilder& b) { b.root["nodes"][0]["extensions"]["X"] = "y"; },
     {"node 0: extension 'X' must be an object"}},
    {"camera of node", [](GltfBuilder& b) { b.root["nodes"][0]["camera"] = 0; }, {"node 0: there is no camera 0"}},
    {"light of node",
     [](GltfBuilder& b) { b.root["nodes"][0]["extensions"]["KHR_lights_punctual"]["light"] = 3; },
     {"node 0: there is no light 3"}},
    {"texture",
     [](GltfBuilder& b) {
       add_texture(b, {{"uri", "x"}});
       b.root["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]["index"] = 8;
     },
     {"material 0 'wood' base colour: there is no texture 8"}},
    {"image of texture",
     [](GltfBuilder& b) {
       add_texture(b, {{"uri", "x"}});
       b.root["textures"][0]["source"] = 2;
     },
     {"texture 0: there is no image 2"}},
    {"sampler of texture",
     [](GltfBuilder& b) {
       add_texture(b, {{"uri", "x"}});
       b.root["textures"][0]["sampler"] = 0;
     },
     {"texture 0: there is no sampler 0"}},
    {"zero rotation",
     [](GltfBuilder& b) {
       b.root["nodes"][0]["rotation"] = {0, 0, 0, 0};
     },
     {"node 0: 'rotation' is not a unit quaternion"}},
    {"cycle",
     [](GltfBuilder& b) {
       b.add("nodes", {{"children", {2}}});
       b.add("nodes", {{"children", {1}}});
     },
     {"node 1: is its own ancestor, or below one that is; it is not used"}},
    {"two parents",
     [](GltfBuilder& b) {
       b.add("nodes", {{"children", {3}}});
       b.add("nodes", {{"children", {3}}});
       b.add("nodes", {{"name", "x"}});
     },
     {"node 3 'x': is a child of node 1 and of node 2"}},
    {"alpha mode",
     [](GltfBuilder& b) {
       b.add("materials", {{"alphaMode", "CUT"}});
     },
     {"material 0: 'alphaMode' must be OPAQUE, MASK or BLEND, is 'CUT'; OPAQUE is taken"}},
    {"camera type",
     [](GltfBuilder& b) {
       b.add("cameras", {{"type", "fish-eye"}});
     },
     {"camera 0: 'type' must be perspective or orthographic, is 'fish-eye'"}},
    {"camera without data",
     [](GltfBuilder& b) {
       b.add("cameras", {{"type", "perspective"}});
     },
     {"camera 0: 'perspective' is missing"}},
    {"flat camera",
     [](GltfBuilder& b) {
       add_camera(b, {{"yfov", 0}, {"znear", 1}});
     },
     {"camera 0: 'yfov' is out of range: 0"}},
    {"wide camera",
     [](GltfBuilder& b) {
       add_camera(b, {{"yfov", 3.2}, {"znear", 1}});
     },
     {"camera 0: 'yfov' is out of range: 3.2"}},
    {"camera without width",
     [](GltfBuilder& b) {
       b.add("cameras",
             {{"type", "orthographic"}, {"orthographic", {{"xmag", 0}, {"ymag", 1}, {"znear", 0}, {"zfar", 1}}}});
     },
     {"camera 0: 'xmag' must not be 0"}},
    {"light type",
     [](GltfBuilder& b) {
       b.root["extensions"]["KHR_lights_punctual"]["lights"] = {{{"type", "area"}}};
     },
     {"light 0: 'type' must be directional, point or spot, is 'area'"}},
    {"negative light",
     [](GltfBuilder& b) {
       b.root["extensions"]["KHR_lights_punctual"]["lights"] = {{{"type", "point"}, {"intensity", -1}}};
     },
     {"light 0: 'intensity' is out of range: -1; the light is left out"}},
    {"spot without cone",
     [](GltfBuilder& b) {
       b.root["extensions"]["KHR_lights_punctual"]["lights"] = {{{"type", "spot"}}};
     },
     {"light 0: 'spot' is missing"}},
    {"inner cone beyond outer",
     [](GltfBuilder& b) {
       b.root["extensions"]["KHR_lights_punctual"]["lights"] = {
           {{"type", "spot"}, {"spot", {{"innerConeAngle", 1}, {"outerConeAngle", 0.5}}}}};
     },
     {"light 0: the cone angles must be 0 <= inner < outer <= pi / 2, are 1.0 and 0.5"}},
    {"lights is an object",
     [](GltfBuilder& b) { b.root["extensions"]["KHR_lights_punctual"]["lights"] = json::object(); },
     {"'lights' must be an array"}},
    {"image from nowhere",
     [](GltfBuilder& b) {
       add_texture(b, {{"name", "bark"}});
     },
     {"image 0 'bark': must have either 'uri' or 'bufferView'"}},
    {"image from two places",
     [](GltfBuilder& b) {
       add_texture(b, {{"uri", "x"}, {"bufferView", 0}});
     },
     {"image 0: is neither PNG nor JPEG; the texture is left out"}},
    {"image is no image",
     [](GltfBuilder& b) {
       add_texture(b, {{"bufferView", 0}});
     },
     {"image 0: is neither PNG nor JPEG"}},
    {"image is cut off",
     [](GltfBuilder& b) {
       add_texture(b, {{"uri", "data:image/png;base64,iVBORw0KGgoAAAANSUhEUgAA"}});
     },
     {"image 0: cannot be decoded: is cut off"}},
    {"image of a wrong checksum",
     [](GltfBuilder& b) {
       add_texture(b, {{"uri",
                        "data:image/"
                        "png;base64,iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAAAAAA6fptUAAAACklEQVR4nGNgAAAAAgABSK+"
                        "kcQAAAABJRU5ErkJggg=="}});
     },
     {"image 0: cannot be decoded: the checksum of a chunk is wrong"}},
    {"image with broken pixels",
     [](GltfBuilder& b) {
       add_texture(
           b,
           {{"uri",
             "data:image/"
             "png;base64,iVBORw0KGgoAAAANSUhEUgAAAAIAAAABCAAAAADRSSBWAAAAB0lEQVRnYXJiYWdliKMwNwAAAABJRU5ErkJggg=="}});
     },
     {"image 0: cannot be decoded"}},
    {"image without pixels",
     [](GltfBuilder& b) {
       add_texture(
           b, {{"uri",
                "data:image/png;base64,iVBORw0KGgoAAAANSUhEUgAAAAAAAAABCAAAAADVvPBrAAAAAElEQVQ1rwYeAAAAAElFTkSuQmCC"}});
     },
     {"image 0: is 0 x 1 pixels"}},
    {"image is too wide",
     [](GltfBuilder& b) {
       add_texture(
           b, {{"uri",
                "data:image/png;base64,iVBORw0KGgoAAAANSUhEUgABhqAAAAABCAAAAAB4FUkJAAAAAElEQVQ1rwYeAAAAAElFTkSuQmCC"}});
     },
     {"image 0: is 100000 x 1 pixels; 1 to 16384 on a side are supported"}},
    {"image is too large",
     [](GltfBuilder& b) {
       add_texture(
           b, {{"uri",
                "data:image/png;base64,iVBORw0KGgoAAAANSUhEUgAAQAAAAEAACAAAAACMo09YAAAAAElEQVQ1rwYeAAAAAElFTkSuQmCC"}});
     },
     {"image 0: has more than 134217728 pixels"}},
    {"wrap mode",
     [](GltfBuilder& b) {
       add_texture(b, {{"uri", "x"}});
       b.root["textures"][0]["sampler"] = 0;
       b.add("samplers", {{"wrapS", 1}});
     },
     {"texture 0: wrap mode 1 does not exist"}},
    {"three factors of a material that nobody uses",
     [](GltfBuilder& b) {
       b.add("materials", {{"pbrMetallicRoughness", {{"baseColorFactor", {1, 1, 1}}}}});
     },
     {"material 0: 'baseColorFactor' must be 4 numbers", "; it is not used"}},
    {"bounds that are null",
     [](GltfBuilder& b) {
       positions(b)["min"] = {nullptr, nullptr, nullptr};
     },
     {"accessor 0: 'min' must be numbers", "bounds are not used"}},
    {"bounds that are none",
     [](GltfBuilder& b) { positions(b)["max"] = "none"; },
     {"accessor 0: 'max' must be numbers, is \"none\"; bounds are not used"}},
    {"camera without shape",
     [](GltfBuilder& b) {
       add_camera(b, {{"yfov", 1}, {"znear", 1}, {"aspectRatio", 0}});
     },
     {"camera 0: 'aspectRatio' is out of range: 0; that of the image is taken"}},
    {"camera that ends before it begins",
     [](GltfBuilder& b) {
       add_camera(b, {{"yfov", 1}, {"znear", 1}, {"zfar", 0.5}});
     },
     {"camera 0: 'zfar' must be more than 'znear', is 0.5; neither clips"}},
    {"camera behind itself",
     [](GltfBuilder& b) {
       add_camera(b, {{"yfov", 1}, {"znear", -1}});
     },
     {"camera 0: 'znear' is out of range: -1; 0 is taken"}},
    {"equal cones",
     [](GltfBuilder& b) {
       b.root["extensions"]["KHR_lights_punctual"]["lights"] = {
           {{"type", "spot"}, {"spot", {{"innerConeAngle", 0.5}, {"outerConeAngle", 0.5}}}}};
     },
     {"light 0: the cone angles must be 0 <= inner < outer <= pi / 2, are 0.5 and 0.5"}},
    {"negative range",
     [](GltfBuilder& b) {
       b.root["extensions"]["KHR_lights_punctual"]["lights"] = {{{"type", "point"}, {"range", -1}}};
     },
     {"light 0: 'range' is out of range: -1; the light is not limited"}},
    {"INT accessor that nobody uses",
     [](GltfBuilder& b) { b.accessor(0, 5124, 3, "VEC3"); },
     {"accessor 2: 'componentType' 5124 does not exist; it is not used"}},
    {"stride 2 on indices",
     [](GltfBuilder& b) { b.root["bufferViews"][1]["byteStride"] = 2; },
     {"bufferView 1: 'byteStride' should be a multiple of 4 up to 252, is 2; it is taken as it stands"}},
    {"mesh that nobody shows",
     [](GltfBuilder& b) {
       b.mesh({{"POSITION", 99}});
     },
     {"mesh 1 primitive 0: POSITION accessor 99: there is no such accessor; it is not used"}},
    {"node that nobody shows",
     [](GltfBuilder& b) {
       b.add("nodes", {{"mesh", 7}});
     },
     {"node 1: there is no mesh 7; it is not used"}},
    {"name is a number",
     [](GltfBuilder& b) { b.root["nodes"][0]["name"] = 5; },
     {"node 0: 'name' must be a string, is 5; it is left out"}},
    {"cameras is an object",
     [](GltfBuilder& b) {
       b.root["cameras"] = json::object({{"0", 1}});
     },
     {"glTF: 'cameras' must be an array", "; it is not used"}},
    {"animations is a string",
     [](GltfBuilder& b) { b.root["animations"] = "walk"; },
     {"glTF: 'animations' must be an array, is \"walk\"; it is not used"}},
    {"extension for shading only",
     [](GltfBuilder& b) { b.root["extensionsRequired"] = b.root["extensionsUsed"] = {"KHR_materials_clearcoat"}; },
     {"extension 'KHR_materials_clearcoat' is not supported and left out"}},
    {"light emits less than nothing",
     [](GltfBuilder& b) {
       b.add("materials", {{"emissiveFactor", {1, -1, 1}}});
     },
     {"material 0: emits less than nothing; nothing is taken"}},
    {"texture of another format",
     [](GltfBuilder& b) {
       add_texture(b, {{"uri", "data:image/webp;base64,UklGRgAAAABXRUJQ"}});
     },
     {"image 0: is neither PNG nor JPEG (but WebP); the texture is left out"}},
    {"missing texture",
     [](GltfBuilder& b) {
       add_texture(b, {{"uri", "nothere.png"}});
     },
     {"image 0: external file 'nothere.png' cannot be opened", "; the texture is left out"}},
    {"texture -1",
     [](GltfBuilder& b) {
       b.primitive()["material"] = b.add("materials", {{"emissiveTexture", {{"index", -1}}}, {"occlusionTexture", 7}});
     },
     {"material 0 emissive emissiveTexture: 'index' must be an index, is -1; the texture is left out"}},
    {"third texture coordinates",
     [](GltfBuilder& b) {
       add_texture(b, {{"uri", "x"}});
       b.root["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]["texCoord"] = 2;
     },
     {"material 0 'wood' base colour: texture coordinates 2 are not supported (0 and 1 are); the texture is left out"}},
    {"normal map",
     [](GltfBuilder& b) {
       for (int i = 0; i < 3; ++i) b.add("materials", {{"normalTexture", {{"index", 0}}}});
     },
     {"normal textures are not supported and left out (material 0 and 2 more)"}},
    {"instances without attributes",
     [](GltfBuilder& b) { b.root["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"] = json::object(); },
     {"node 0 EXT_mesh_gpu_instancing: has no attributes; the mesh is shown once"}},
    {"skin that does not exist",
     [](GltfBuilder& b) { b.root["nodes"][0]["skin"] = 3; },
     {"node 0: there is no skin 3; the mesh stays as it is stored"}},
    {"skin without joints",
     [](GltfBuilder& b) {
       b.root["nodes"][0]["skin"] = b.add("skins", {{"joints", json::array()}});
     },
     {"skin 0: has no joints; the mesh stays as it is stored"}},
    {"morph target without data",
     [](GltfBuilder& b) {
       b.primitive()["targets"] = {{{"POSITION", 99}}};
       b.root["meshes"][0]["weights"] = {1};
     },
     {"mesh 0 primitive 0 target 0: there is no accessor 99; the mesh stays as it is stored"}},
};

TEST(GltfHostile, EachFaultHasItsMessage) {
  for (const Case& c : kCases) {
    SCOPED_TRACE(c.name);
    GltfBuilder b = GltfBuilder::triangle();
    c.spoil(b);
    expect_message(message_of(b.gltf()), c.expected);
  }
}

TEST(GltfHostile, WhatIsNotUsedIsNoted) {
  for (const Case& c : kNoted) {
    SCOPED_TRACE(c.name);
    GltfBuilder b = GltfBuilder::triangle();
    c.spoil(b);
    std::vector<std::string> notes;
    try {
      const Scene scene = load_gltf_memory(b.gltf(), {.scene = {}, .posed = true}, &notes);
      EXPECT_EQ(flatten(scene).vertices.size(), 1u);
    } catch (const Error& e) {
      ADD_FAILURE() << "refused: " << e.what();
      continue;
    }
    bool found = false;
    for (const std::string& note : notes) {
      bool all = true;
      for (const std::string& part : c.expected) all = all && note.find(part) != std::string::npos;
      found = found || all;
      EXPECT_EQ(note.find('\n'), std::string::npos) << note;
    }
    EXPECT_TRUE(found) << "no note with '" << c.expected[0] << "' among " << notes.size() << ": "
                       << (notes.empty() ? "" : notes[0]);
    EXPECT_LE(notes.size(), 2u);
  }
}

TEST(GltfHostile, ExtrasCostNothingHoweverDeep) {
  const GltfBuilder b = GltfBuilder::triangle();
  for (const std::size_t depth : {70u, 200000u}) {
    GltfBuilder c = b;
    c.root["nodes"][0]["extras"] = "here";
    const Bytes bytes = c.gltf();
    std::string json_text(bytes.begin(), bytes.end());
    json_text.replace(json_text.find("\"here\""), 6,
                      std::string(depth, '[') + "{\"extras\":1}" + std::string(depth, ']'));
    std::vector<std::string> notes;
    EXPECT_EQ(load_gltf_memory(Bytes(json_text.begin(), json_text.end()), {}, &notes).meshes.size(), 1u);
    EXPECT_TRUE(notes.empty());
  }
}

TEST(GltfHostile, BrokenContainers) {
  const GltfBuilder b = GltfBuilder::triangle();
  const auto text = [](const char* s) { return Bytes(s, s + std::strlen(s)); };
  expect_message(message_of({}), {"is not valid JSON"});
  expect_message(message_of(text("{")), {"is not valid JSON"});
  expect_message(message_of(text("null")), {"the JSON is not an object"});
  expect_message(message_of(text("[1, 2]")), {"the JSON is not an object"});
  expect_message(message_of(text("{\"asset\": {\"version\": \"2.0\"}, \"x\": 1e999}")), {"is not valid JSON", "1e999"});
  expect_message(message_of(text("{\"asset\": \"\xff\xfe\"}")), {"'asset' must be an object"});  // read as Latin-1
  expect_message(message_of(text("glTF")), {"GLB header is cut off"});
  const Bytes whole = b.glb();
  Bytes bytes = whole;
  bytes[4] = 3;
  expect_message(message_of(bytes), {"GLB version 3"});
  bytes = whole;
  bytes[15] = 0xff;
  expect_message(message_of(bytes), {"GLB chunk 0: is cut off"});
  bytes = whole;
  bytes[16] = 'B';
  expect_message(message_of(bytes), {"GLB chunk 0: is not JSON"});
  // No binary chunk, but a buffer that wants it.
  nlohmann::json root = b.root;
  root["buffers"] = nlohmann::json::array({{{"byteLength", b.buffer.size()}}});
  expect_message(message_of(GltfBuilder::glb(root.dump(), {})),
                 {"buffer 0: has no URI, and the file has no binary chunk"});
  // Every shorter file is an error, too.
  for (std::size_t n = 0; n < whole.size() - 2; ++n) {  // the last two bytes are padding
    Bytes cut(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(n));
    ASSERT_NE(message_of(cut), "") << n;
    if (n >= 12) {
      for (std::size_t i = 0; i < 4; ++i) cut[8 + i] = static_cast<std::uint8_t>(n >> (8 * i));
      ASSERT_NE(message_of(cut), "") << n;
    }
  }
}

TEST(GltfHostile, ContainersThatCountWrong) {
  const GltfBuilder b = GltfBuilder::triangle();
  const auto notes_of = [](const Bytes& bytes) {
    std::vector<std::string> notes;
    try {
      EXPECT_EQ(flatten(load_gltf_memory(bytes, {}, &notes)).vertices.size(), 1u);
    } catch (const Error& e) {
      ADD_FAILURE() << e.what();
    }
    EXPECT_EQ(notes.size(), 1u);
    return notes.empty() ? std::string() : notes[0];
  };
  const Bytes whole = b.glb();
  for (const int change : {-4, 4, 1000}) {
    Bytes bytes = whole;
    const std::size_t says = whole.size() + static_cast<std::size_t>(change);
    bytes[8] = static_cast<std::uint8_t>(says), bytes[9] = static_cast<std::uint8_t>(says >> 8);
    EXPECT_NE(notes_of(bytes).find("GLB says it has " + std::to_string(says) + " bytes, the file has "),
              std::string::npos);
  }
  for (std::size_t stray = 1; stray < 8; ++stray) {
    Bytes bytes = whole;
    bytes.resize(bytes.size() + stray, 7);
    const std::size_t says = bytes.size();
    bytes[8] = static_cast<std::uint8_t>(says), bytes[9] = static_cast<std::uint8_t>(says >> 8);
    EXPECT_NE(notes_of(bytes).find("GLB: " + std::to_string(stray) + " bytes at the end belong to no chunk"),
              std::string::npos);
  }
  Bytes unpadded = whole;  // the chunk counts the padding, the file has none
  unpadded.resize(unpadded.size() - 2);
  const std::size_t says = unpadded.size();
  unpadded[8] = static_cast<std::uint8_t>(says), unpadded[9] = static_cast<std::uint8_t>(says >> 8);
  EXPECT_NE(notes_of(unpadded).find("GLB chunk 1: says it has 44 bytes, there are 42"), std::string::npos);
  // JSON padded with zeros; names in Latin-1.
  GltfBuilder named = b;
  named.root["nodes"][0]["name"] = "Gr?n";
  Bytes bytes = named.glb();
  bytes[std::find(bytes.begin(), bytes.end(), '?') - bytes.begin()] = 0xfc;
  std::vector<std::string> notes;
  EXPECT_EQ(load_gltf_memory(bytes, {}, &notes).nodes[0].name, "Gr\xc3\xbcn");
  ASSERT_EQ(notes.size(), 1u);
  EXPECT_NE(notes[0].find("the JSON is not UTF-8; it is read as Latin-1"), std::string::npos);
  const Bytes text = b.gltf();
  Bytes zeros = text;
  zeros.resize(zeros.size() + 3, 0);
  EXPECT_EQ(load_gltf_memory(zeros).meshes.size(), 1u);
}

TEST(GltfHostile, FilesOutsideTheFolderAreNotOpened) {
  std::string name = (std::filesystem::temp_directory_path() / "retrace-XXXXXX").string();
  const std::filesystem::path folder = ::mkdtemp(name.data());
  const GltfBuilder b = GltfBuilder::triangle();
  const auto write = [](const std::filesystem::path& path, const Bytes& bytes) {
    std::ofstream(path, std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  };
  const std::filesystem::path home = folder / "a" / "b" / "scene";
  std::filesystem::create_directories(home / "in");
  for (const auto& path : {folder / "secret.bin", folder / "a" / "far.bin", folder / "a" / "b" / "up.bin",
                           home / "in" / "s.bin", home / "a%41.bin"})
    write(path, b.buffer);
  ASSERT_EQ(::mkfifo((home / "pipe").c_str(), 0600), 0);
  const auto message = [&](const std::string& uri) -> std::string {
    GltfBuilder c = b;
    c.root["buffers"] = nlohmann::json::array({{{"byteLength", c.buffer.size()}, {"uri", uri}}});
    write(home / "a.gltf", c.gltf());
    try {
      load_gltf(home / "a.gltf");
    } catch (const Error& e) {
      return e.what();
    }
    return "";
  };
  for (const char* uri : {"../up.bin", "%2e%2e/up.bin", "x/../../up.bin", "..%2Fup.bin", "../../far.bin",
                          "../scene/in/s.bin", "in\\s.bin", "in/%73.bin", "a%41.bin", "a%2541.bin", "..\\up.bin"})
    EXPECT_EQ(message(uri), "") << uri;
  for (const char* uri :
       {"../../../secret.bin", "%2e%2e/..%2f../secret.bin", "in/../../../../secret.bin", "..\\..\\..\\secret.bin"})
    expect_message(message(uri), {"a.gltf", "buffer 0", "lies more than 2 folders above that of the glTF file"});
  expect_message(message((folder / "secret.bin").string()), {"a.gltf", "buffer 0", "absolute paths are not opened"});
  expect_message(message("%2Fetc/passwd"), {"absolute paths are not opened"});
  expect_message(message(".."), {"not a regular file"});
  expect_message(message("http://localhost/x.bin"), {"only files and data URIs are supported"});
  expect_message(message(""), {"is not a file name"});
  expect_message(message("a%00b"), {"is not a file name"});
  expect_message(message("."), {"not a regular file"});
  expect_message(message("none.bin"), {"file 'none.bin' cannot be opened"});
  expect_message(message("pipe"),
                 {"file 'pipe' cannot be opened: not a regular file"});  // and does not wait for a writer
  try {
    load_gltf(home);
    ADD_FAILURE();
  } catch (const Error& e) {
    expect_message(e.what(), {"scene: cannot be opened: not a regular file"});
  }
  std::filesystem::remove_all(folder);
}

/// Random damage to a valid file: it loads or ends in an Error, and what loads can be flattened and snapped or ends in
/// an Error.
TEST(GltfHostile, RandomDamage) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE(seed);
  Random random(seed);
  GltfBuilder b = GltfBuilder::triangle();
  b.add("cameras", {{"type", "perspective"}, {"perspective", {{"yfov", 0.5}, {"znear", 0.1}}}});
  b.root_node({{"camera", 0}, {"children", {2}}});
  b.add("nodes", {{"mesh", 0}, {"rotation", {0, 0, 0, 1}}});
  b.add("materials", {{"pbrMetallicRoughness", {{"baseColorFactor", {1, 1, 1, 1}}}}});
  b.primitive()["material"] = 0;
  const Bytes originals[] = {b.gltf(), b.glb()};
  const std::string alphabet = "0123456789-.eE,:[]{}\"truefalsn ";
  int loaded = 0, refused = 0;
  for (int i = 0; i < 6000; ++i) {
    Bytes bytes = originals[i % 2];
    for (std::uint64_t k = 1 + random.below(4); k > 0; --k) {
      const std::size_t at = random.below(bytes.size());
      if (random.chance(3))
        bytes[at] = static_cast<std::uint8_t>(random.bits());
      else if (random.chance(5))
        bytes.erase(bytes.begin() + static_cast<std::ptrdiff_t>(at));
      else
        bytes[at] = static_cast<std::uint8_t>(alphabet[random.below(alphabet.size())]);
    }
    try {
      snap(flatten(load_gltf_memory(bytes)));
      ++loaded;
    } catch (const Error& e) {
      ++refused;
      ASSERT_EQ(std::string(e.what()).find('\n'), std::string::npos) << e.what();
    }
  }
  EXPECT_GT(loaded, 100);
  EXPECT_GT(refused, 1000);
}

}  // namespace
}  // namespace retrace
