// What is thrown for the user to read.
#pragma once
#include <stdexcept>

namespace retrace {

/// A user-facing error: what is wrong and where, in one line. The program prints it and exits with 1.
struct Error : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Arguments that cannot be meant; the program exits with 2.
struct UsageError : Error {
  using Error::Error;
};

}  // namespace retrace
