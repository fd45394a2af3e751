// The main() of testbenches and tools: CLI11 reads the command line, errors are one line.
#pragma once
#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <string>
#include <utility>

namespace retrace {

/// Parses, then returns what run() returns. Wrong usage: 2. An exception: `error_code`. --help: 0.
template <class Run>
int run_program(CLI::App& app, int argc, const char* const* argv, const Run& run, int error_code = 1) {
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& asked) {
    return app.exit(asked);
  } catch (const CLI::ParseError& error) {
    std::fprintf(stderr, "%s: error: %s (see --help)\n", app.get_name().c_str(), error.what());
    return 2;
  }
  try {
    return run();
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s: error: %s\n", app.get_name().c_str(), error.what());
    return error_code;
  }
}

/// FIRST-END or X,Y: two integers from 0 with `separator` between them.
inline CLI::Option* add_pair(CLI::App& app, const std::string& name, std::pair<int, int>& pair, char separator,
                             const std::string& help) {
  const auto read = [&pair, separator](const CLI::results_t& texts) {
    char between = 0, end = 0;
    return std::sscanf(texts.front().c_str(), "%d%c%d%c", &pair.first, &between, &pair.second, &end) == 3 &&
           between == separator && pair.first >= 0 && pair.second >= 0;
  };
  return app.add_option(name, read, help)->type_name(separator == ',' ? "X,Y" : "FIRST-END")->expected(1);
}

struct ImageSize {
  int width = 0, height = 0;
};
/// WIDTHxHEIGHT, both from 1 to `most`.
inline CLI::Option* add_size(CLI::App& app, const std::string& name, ImageSize& size, int most,
                             const std::string& help) {
  const auto read = [&size, most](const CLI::results_t& texts) {
    char end = 0;
    return std::sscanf(texts.front().c_str(), "%dx%d%c", &size.width, &size.height, &end) == 2 && size.width >= 1 &&
           size.height >= 1 && size.width <= most && size.height <= most;
  };
  return app.add_option(name, read, help + ", 1 to " + std::to_string(most) + " each")
      ->type_name("WIDTHxHEIGHT")
      ->expected(1);
}

}  // namespace retrace
