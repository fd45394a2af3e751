// retrace-asm FILE.asm -o FILE.bin [--listing]: a program of the shader unit as words, or words as a program again.
#include <fstream>
#include <iostream>
#include <iterator>

#include "golden/base/output_file.hpp"
#include "golden/shader/assembler.hpp"
#include "testbench/kit/command_line.hpp"

namespace {

std::string read_file(const std::string& path) {
  if (std::filesystem::is_directory(path)) throw retrace::Error(path + ": cannot be read, it is a folder");
  std::ifstream file(path, std::ios::binary);
  std::string text((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  if (!file.is_open() || file.bad()) throw retrace::Error(path + ": cannot be read");
  return text;
}

struct Arguments {
  std::string input, output;
  bool listing = false, disassemble = false, quiet = false;
};

int run(const Arguments& a) {
  if (a.output.empty() && !a.listing && !a.disassemble)
    throw retrace::UsageError("nothing to do: -o FILE, --listing or --disassemble");
  retrace::OutputFiles files;
  files.reads(a.input);
  retrace::OutputFile* const output = a.output.empty() ? nullptr : &files.add(a.output);
  const std::string text = read_file(a.input);
  std::string made, shown;
  if (a.disassemble) {
    const auto words = retrace::shader::from_bytes(text, a.input);
    made = retrace::shader::disassemble(words);
    if (output == nullptr) shown = made;
    if (a.listing) shown = retrace::shader::listing(retrace::shader::assemble(made, a.input), made);
  } else {
    const retrace::shader::Assembled program = retrace::shader::assemble(text, a.input);
    made = retrace::shader::to_bytes(program.words);
    if (a.listing) shown = retrace::shader::listing(program, text);
    if (!a.listing && !a.quiet) {
      for (const auto& note : program.notes)
        std::cerr << a.input << ":" << note.line << ":" << note.column << ": note: " << note.text << "\n";
    }
  }
  if (output != nullptr) {
    output->write(std::move(made));
    files.commit();
  }
  std::cout << shown << std::flush;
  if (!std::cout) throw retrace::Error("the listing cannot be written to the standard output");
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Assembler of the shader unit; docs/shader.md has its language", "retrace-asm");
  Arguments a;
  app.add_option("input", a.input, "Program; with --disassemble words")->required()->type_name("FILE");
  app.add_option("-o,--output", a.output, "Words, 16 bytes each; with --disassemble a program")->type_name("FILE");
  app.add_flag("-l,--listing", a.listing, "Print lines, words, what they are, and notes");
  app.add_flag("-d,--disassemble", a.disassemble, "Make a program of words");
  app.add_flag("-q,--quiet", a.quiet, "Print no notes");
  return retrace::run_program(app, argc, argv, [&] {
    try {
      return run(a);
    } catch (const retrace::UsageError& error) {
      std::cerr << "retrace-asm: error: " << error.what() << " (see --help)\n";
      return 2;
    }
  });
}
