// Malformed files: each ends in one Error of one line that says where and what. The table is the specification of the
// messages.
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <fstream>
#include <functional>

#include "gltf_builder.hpp"
#include "golden/scene/geometry.hpp"
#include "golden/scene/gltf_loader.hpp"
#include "testbench/csim/random.hpp"

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
    {"texture transform required",
     [](GltfBuilder& b) {
       b.root["extensionsRequired"] = {"KHR_lights_punctual", "KHR_texture_transform"};
     },
     {"'KHR_texture_transform'"}},
    {"newlines in names", [](GltfBuilder& b) { b.root["extensionsRequired"] = {"a\nb\tc\x7f"}; }, {"'a?b?c?'"}},
    {"nodes is an object",
     [](GltfBuilder& b) {
       b.root["nodes"] = {{"mesh", 0}};
     },
     {"'nodes' must be an array"}},
    {"node is a number", [](GltfBuilder& b) { b.root["nodes"][0] = 7; }, {"node 0: must be an object, is 7"}},
    {"extension is a string",
     [](GltfBuilder& b) { b.root["nodes"][0]["extensions"]["X"] = "y"; },
     {"node 0: extension 'X' must be an object"}},
    {"too deep",
     [](GltfBuilder& b) {
       json deep = 1;
       for (int i = 0; i < 100; ++i) deep = json::array({deep});
       b.root["extras"] = deep;
     },
     {"nested deeper than 64"}},
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
    {"camera of node", [](GltfBuilder& b) { b.root["nodes"][0]["camera"] = 0; }, {"node 0: there is no camera 0"}},
    {"light of node",
     [](GltfBuilder& b) { b.root["nodes"][0]["extensions"]["KHR_lights_punctual"]["light"] = 3; },
     {"node 0: there is no light 3"}},
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
    // The hierarchy.
    {"own child", [](GltfBuilder& b) { b.root["nodes"][0]["children"] = {0}; }, {"node 0: is its own ancestor"}},
    {"cycle",
     [](GltfBuilder& b) {
       b.add("nodes", {{"children", {2}}});
       b.add("nodes", {{"children", {1}}});
     },
     {"node 1: is its own ancestor"}},
    {"two parents",
     [](GltfBuilder& b) {
       b.add("nodes", {{"children", {3}}});
       b.add("nodes", {{"children", {3}}});
       b.add("nodes", {{"name", "x"}});
     },
     {"node 3 'x': is a child of node 1 and of node 2"}},
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
    {"zero rotation",
     [](GltfBuilder& b) {
       b.root["nodes"][0]["rotation"] = {0, 0, 0, 0};
     },
     {"node 0: 'rotation' is not a unit quaternion"}},
    {"overflowing hierarchy",
     [](GltfBuilder& b) {
       b.root["nodes"][0]["scale"] = {1e200, 1, 1};
       b.root["nodes"][0]["children"] = {1};
       b.add("nodes", {{"scale", {1e200, 1, 1}}, {"mesh", 0}});
     },
     {"node 1: the world transform is not finite"}},
    // Accessors and buffers.
    {"no POSITION data",
     [](GltfBuilder& b) { positions(b).erase("bufferView"); },
     {"POSITION accessor 0: has neither a bufferView nor sparse values"}},
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
     {"bufferView 0: 'byteStride' must be a multiple of 4"}},
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
    {"indices without a view",
     [](GltfBuilder& b) { indices(b).erase("bufferView"); },
     {"accessor[1] invalid bufferView"}},
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
    {"text data URI",
     [](GltfBuilder& b) {
       b.root["buffers"] = {{{"byteLength", 3}, {"uri", "data:text/plain,abc"}}};
     },
     {"buffer 0: data URI: is not base64"}},
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
    {"alpha mode",
     [](GltfBuilder& b) {
       b.add("materials", {{"alphaMode", "CUT"}});
     },
     {"material 0: 'alphaMode' must be OPAQUE, MASK or BLEND, is 'CUT'"}},
    {"three factors",
     [](GltfBuilder& b) {
       b.add("materials", {{"pbrMetallicRoughness", {{"baseColorFactor", {1, 1, 1}}}}});
     },
     {"material 0: 'baseColorFactor' must be 4 numbers"}},
    {"factor beyond float",
     [](GltfBuilder& b) {
       b.add("materials", {{"emissiveFactor", {1, 1e60, 1}}});
     },
     {"material 0: 'emissiveFactor' must be 3 numbers"}},
    {"double-sided is 1",
     [](GltfBuilder& b) {
       b.add("materials", {{"doubleSided", 1}});
     },
     {"material 0: 'doubleSided' must be true or false, is 1"}},
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
     {"light 0: 'intensity' is out of range: -1"}},
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
     {"light 0: 'innerConeAngle' must be less"}},
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
     {"image 0: must have either 'uri' or 'bufferView'"}},
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
     {"image 0: the images of the file have too many pixels in total"}},
    {"wrap mode",
     [](GltfBuilder& b) {
       add_texture(b, {{"uri", "x"}});
       b.root["textures"][0]["sampler"] = 0;
       b.add("samplers", {{"wrapS", 1}});
     },
     {"texture 0: wrap mode 1 does not exist"}},
};

TEST(GltfHostile, EachFaultHasItsMessage) {
  for (const Case& c : kCases) {
    SCOPED_TRACE(c.name);
    GltfBuilder b = GltfBuilder::triangle();
    c.spoil(b);
    expect_message(message_of(b.gltf()), c.expected);
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
  expect_message(message_of(text("{\"asset\": \"\xff\xfe\"}")), {"is not valid JSON"});
  expect_message(message_of(text("glTF")), {"GLB header is cut off"});
  const Bytes whole = b.glb();
  Bytes bytes = whole;
  bytes[4] = 3;
  expect_message(message_of(bytes), {"GLB version 3"});
  bytes = whole;
  bytes[10] = 1;
  expect_message(message_of(bytes), {"GLB says it has"});
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
  for (std::size_t n = 0; n < whole.size(); ++n) {
    Bytes cut(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(n));
    ASSERT_NE(message_of(cut), "") << n;
    if (n >= 12) {
      for (std::size_t i = 0; i < 4; ++i) cut[8 + i] = static_cast<std::uint8_t>(n >> (8 * i));
      ASSERT_NE(message_of(cut), "") << n;
    }
  }
}

TEST(GltfHostile, FilesOutsideTheFolderAreNotOpened) {
  std::string name = (std::filesystem::temp_directory_path() / "retrace-XXXXXX").string();
  const std::filesystem::path folder = ::mkdtemp(name.data());
  const GltfBuilder b = GltfBuilder::triangle();
  const auto write = [](const std::filesystem::path& path, const Bytes& bytes) {
    std::ofstream(path, std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  };
  std::filesystem::create_directory(folder / "scene");
  write(folder / "secret.bin", b.buffer);
  ASSERT_EQ(::mkfifo((folder / "scene" / "pipe").c_str(), 0600), 0);
  const auto message = [&](const std::string& uri) -> std::string {
    GltfBuilder c = b;
    c.root["buffers"] = nlohmann::json::array({{{"byteLength", c.buffer.size()}, {"uri", uri}}});
    write(folder / "scene" / "a.gltf", c.gltf());
    try {
      load_gltf(folder / "scene" / "a.gltf");
    } catch (const Error& e) {
      return e.what();
    }
    return "";
  };
  for (const std::string& uri :
       {std::string("../secret.bin"), std::string("%2e%2e/secret.bin"), std::string("x/../../secret.bin"),
        (folder / "secret.bin").string(), std::string("..")})
    expect_message(message(uri), {"a.gltf", "buffer 0", "lies outside the folder of the glTF file"});
  expect_message(message("http://localhost/x.bin"), {"only files and data URIs are supported"});
  expect_message(message(""), {"is not a file name"});
  expect_message(message("a%00b"), {"is not a file name"});
  expect_message(message("."), {"not a regular file"});
  expect_message(message("none.bin"), {"file 'none.bin' cannot be opened"});
  expect_message(message("pipe"),
                 {"file 'pipe' cannot be opened: not a regular file"});  // and does not wait for a writer
  try {
    load_gltf(folder / "scene");
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
