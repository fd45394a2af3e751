// Entry of `retrace`.
#include "testbench/program/commands.hpp"

int main(int argc, char** argv) { return retrace::cli::run(argc, argv); }
