// The one translation unit that holds tinygltf's implementation. Files and images are no business of its own here (see
// gltf_document.hpp); the definitions that say so are set for the whole library in CMakeLists.txt, since they change
// the class.
#include <fstream>  // missing in tinygltf without its file callbacks

#define TINYGLTF_IMPLEMENTATION
#include <tiny_gltf.h>
