// Entry of `retrace`.
#include "testbench/cli/commands.hpp"

int main(int argc, char** argv) { return retrace::cli::run(argc, argv); }
