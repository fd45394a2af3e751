// The subcommands of `retrace`. Each adds itself to the program; its callback does the work, throws Error, or sets the exit code.
#pragma once
#include <functional>
#include <string>

#include "testbench/program/workspace.hpp"

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace retrace::cli {

struct Program {
  Common common;
  int exit_code = 0;
};

void add_render(CLI::App& app, Program& program);
void add_compare(CLI::App& app, Program& program);
void add_trace(CLI::App& app, Program& program);
void add_explain(CLI::App& app, Program& program);
void add_pack(CLI::App& app, Program& program);
void add_info(CLI::App& app, Program& program);
void add_make_scene(CLI::App& app, Program& program);
void add_bench(CLI::App& app, Program& program);
void add_machines(CLI::App& app, Program& program);

/// The whole program: parses, runs, prints errors. Returns the exit code: 0, 1 for an error or a violation, 2 for wrong usage.
int run(int argc, const char* const* argv);

/// --mailbox[=N].
CLI::Option* add_mailbox(CLI::App& command, int& entries);
/// --threads and --quiet.
void add_common(CLI::App& command, Program& program);
/// --two-level.
void add_two_level(CLI::App& command, Program& program);

}  // namespace retrace::cli
