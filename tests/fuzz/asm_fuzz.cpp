// libFuzzer target: any text as a program of the shader unit. What is assembled has only words that the machine knows, and text that gives the same words.
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "golden/shader/assembler.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace retrace::shader;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  try {
    const Assembled program = assemble(text, "fuzz");
    const std::string shown = listing(program, text);
    if (assemble(disassemble(program.words), "again").words != program.words) std::abort();
    if (from_bytes(to_bytes(program.words), "bytes") != program.words) std::abort();
  } catch (const AssemblyError& error) {
    if (error.line < 1 || error.column < 1) std::abort();
  }
  return 0;
}
