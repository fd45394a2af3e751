// The programs that the project brings along (golden/shader/programs), as text.
#pragma once
#include <span>
#include <string_view>

namespace retrace::shader {

struct LibraryProgram {
  std::string_view name, text;
};
std::span<const LibraryProgram> library();

}  // namespace retrace::shader
