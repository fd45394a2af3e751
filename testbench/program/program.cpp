// The program: subcommands, exit codes, one line an error.
#include <tbb/global_control.h>

#include <algorithm>
#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <iostream>
#include <map>
#include <memory>
#include <new>
#include <thread>

#include "golden/base/interrupt.hpp"
#include "golden/engine/registry.hpp"
#include "testbench/lab/lab.hpp"
#include "testbench/program/commands.hpp"

namespace retrace::cli {
namespace {

/// One line, whatever the message holds.
void print_error(std::string message) {
  std::replace_if(
      message.begin(), message.end(), [](unsigned char c) { return c < 0x20 || c == 0x7f; }, ' ');
  std::fprintf(stderr, "retrace: error: %s\n", message.c_str());
}

/// The exit code, or an error if something could not be printed.
int check_printed(int exit_code) {
  const bool flushed = std::fflush(stdout) == 0 && std::ferror(stdout) == 0;
  if (std::cout.flush() && flushed) return exit_code;
  print_error("cannot write to standard output");
  return 1;
}

}  // namespace

CLI::Option* add_mailbox(CLI::App& command, int& entries) {
  // A flag by itself would take the 8 of "8.5".
  return command.add_flag("--mailbox{8}", entries, "Remember the last triangles tested (8 unless =N)")
      ->check(CLI::Range(0, kMaxMailbox));
}

void add_common(CLI::App& command, Program& program) {
  command.add_option("--threads", program.common.threads, "Threads; default: all cores")
      ->check(CLI::Range(1, 4096))
      ->type_name("N");
  command.add_flag("-q,--quiet", program.common.quiet, "No progress and no notes");
}

void add_two_level(CLI::App& command, Program& program) {
  static const std::map<std::string, TwoLevels> kChoices = {
      {"off", TwoLevels::kOff}, {"auto", TwoLevels::kAuto}, {"on", TwoLevels::kOn}};
  command
      .add_option("--two-level", program.common.two_levels,
                  "Whether instances of a mesh stay instances, with one tree a mesh and one over the instances: off, "
                  "on, or auto, where they "
                  "show at least twice the triangles that the meshes hold")
      ->transform(CLI::Transformer(kChoices))
      ->check(CLI::IsMember(std::vector<TwoLevels>{TwoLevels::kOff, TwoLevels::kAuto, TwoLevels::kOn}))
      ->option_text("off|auto|on");
}

int run(int argc, const char* const* argv) {
  Program program;
  CLI::App app(
      "Retrace: ray tracing with a kd-tree core, through a floating-point model and through the fixed-point hardware "
      "kernels.",
      "retrace");
  app.require_subcommand(1);
  app.get_formatter()->column_width(34);
  app.footer(
      "Start here:\n"
      "  retrace make-scene room -o room.glb           write a scene\n"
      "  retrace render room.glb -o room.png           render it in double precision\n"
      "  retrace render room.glb -o csim.png --engine csim    the same through the fixed-point kernels\n"
      "  retrace compare room.glb --engines golden,csim       ray by ray\n"
      "  retrace explain room.glb --pixel 320,240             one ray, stage by stage\n"
      "'retrace COMMAND --help' explains each command with examples.\n"
      "Exit codes: 0 done, 1 error (or a violation found by compare), 2 wrong usage.");
  app.set_version_flag("--version", "retrace " RETRACE_VERSION);
  register_engines();
  add_render(app, program);
  add_compare(app, program);
  add_trace(app, program);
  add_explain(app, program);
  add_pack(app, program);
  add_info(app, program);
  add_make_scene(app, program);
  add_bench(app, program);
  add_machines(app, program);
  lab::register_lab(app);

  // Callbacks run inside parse(), after all options of the subcommand are known.
  std::unique_ptr<tbb::global_control> limit;
  for (CLI::App* command : app.get_subcommands({})) {
    command->parse_complete_callback([&] {
      if (program.common.threads > 0) {
        limit = std::make_unique<tbb::global_control>(tbb::global_control::max_allowed_parallelism,
                                                      static_cast<std::size_t>(program.common.threads));
      }
    });
  }
  install_signal_handlers();
  try {
    if (argc > 1 && argv[1][0] != '-') {
      const std::string wanted = argv[1];
      std::string known;
      bool found = false;
      for (const CLI::App* command : app.get_subcommands({})) {
        found = found || command->get_name() == wanted;
        known += (known.empty() ? "" : ", ") + command->get_name();
      }
      if (!found) throw UsageError("there is no command '" + wanted + "'; there are: " + known);
    }
    app.parse(argc, argv);
    return check_printed(program.exit_code);
  } catch (const CLI::Success& success) {
    return check_printed(app.exit(success));
  } catch (const CLI::ParseError& error) {
    std::string command;
    for (const CLI::App* used : app.get_subcommands()) command += " " + used->get_name();
    print_error(std::string(error.what()) + " (see retrace" + command + " --help)");
    return 2;
  } catch (const UsageError& error) {
    print_error(error.what());
    return 2;
  } catch (const Error& error) {
    print_error(error.what());
  } catch (const std::bad_alloc&) {
    print_error("out of memory");
  } catch (const std::exception& error) {
    print_error(error.what());
  }
  return 1;
}

}  // namespace retrace::cli
