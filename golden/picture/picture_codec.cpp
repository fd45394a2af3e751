// Finds and loads the module with OpenImageIO: beside the program or library that this code is in, or where the build put it.
#include "golden/picture/picture_codec.hpp"

#include <dlfcn.h>

#include "golden/base/error.hpp"

namespace retrace {
namespace {

constexpr char kModule[] = "retrace_pictures.so";

/// The folder of the program or library that this code is in.
std::filesystem::path own_folder() {
  Dl_info here{};
  std::error_code error;
  if (::dladdr(reinterpret_cast<const void*>(&picture_codec), &here) != 0 && here.dli_fname != nullptr) {
    const auto file = std::filesystem::canonical(here.dli_fname, error);
    if (!error && file.extension() == ".so") return file.parent_path();
  }
  return std::filesystem::canonical("/proc/self/exe", error)
      .parent_path();  // a program knows itself by the name it was called
}

const PictureCodec& load() {
  const std::filesystem::path beside = own_folder() / kModule;
  std::error_code error;
  const std::filesystem::path file = std::filesystem::exists(beside, error) ? beside : RETRACE_PICTURES_MODULE;
  void* const module = ::dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (module == nullptr) throw Error(std::string("pictures: cannot load the module with OpenImageIO: ") + ::dlerror());
  using Entry = const PictureCodec* (*)();
  const auto entry = reinterpret_cast<Entry>(::dlsym(module, "retrace_picture_codec"));
  if (entry == nullptr) throw Error("pictures: " + file.string() + " is not the module with OpenImageIO");
  return *entry();
}

}  // namespace

const PictureCodec& picture_codec() {
  static const PictureCodec& codec = load();
  return codec;
}

}  // namespace retrace
