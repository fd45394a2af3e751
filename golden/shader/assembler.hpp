// Assembler of the shader unit: the published dialect of the RPU (Woop, Schmittler, Slusallek 2005) as words, and words as text again.
// docs/shader.md describes the language, docs/shader-isa.md the words.
#pragma once
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "golden/base/error.hpp"
#include "golden/shader/isa.hpp"

namespace retrace::shader {

/// A program that cannot be assembled: where, what was expected and what stands there.
struct AssemblyError : Error {
  AssemblyError(std::string_view file, int line_, int column_, const std::string& what)
      : Error(std::string(file) + ":" + std::to_string(line_) + ":" + std::to_string(column_) + ": " + what),
        line(line_),
        column(column_) {}
  int line, column;
};

/// What a program may rely on without knowing: spellings that mean something else here, order in a `par`, rounded immediates.
struct Note {
  int line = 0, column = 0;
  std::string text;
};

struct Assembled {
  std::vector<Word> words;
  std::vector<int> lines;  ///< of the source, a word each
  std::map<std::string, std::uint32_t> labels;
  std::vector<Note> notes;
};

/// Throws AssemblyError. `file` is the name that messages carry.
Assembled assemble(std::string_view text, std::string_view file);

/// One instruction as the assembler takes it; `.word` and its digits, where no other text gives the word.
std::string disassemble(const Word& word);
/// A whole program, with labels.
std::string disassemble(const std::vector<Word>& words);

/// Places, words, instructions, the source's lines, notes and labels.
std::string listing(const Assembled& program, std::string_view text);

/// Words as bytes, 16 a word, and back. Throws Error for anything that is no program.
std::string to_bytes(const std::vector<Word>& words);
std::vector<Word> from_bytes(std::string_view bytes, std::string_view file);

/// Whether the machine knows every field of the word.
bool is_valid(const Instruction& instruction);

}  // namespace retrace::shader
