// Checks of command-line options that CLI11 lacks.
#pragma once
#include <CLI/CLI.hpp>
#include <cmath>
#include <limits>
#include <string>

namespace retrace {

/// A number from `low` to `high`. CLI::Range lets NaN pass.
class RealRange : public CLI::Validator {
 public:
  RealRange(double low, double high) : CLI::Validator("FLOAT in [" + text(low) + " - " + text(high) + "]") {
    func_ = [low, high](std::string& input) {
      double value = std::numeric_limits<double>::quiet_NaN();
      const bool good = CLI::detail::lexical_cast(input, value) && value >= low && value <= high;
      return good ? std::string() : "'" + input + "' is not a number from " + text(low) + " to " + text(high);
    };
  }

 private:
  static std::string text(double value) {
    std::string result = std::to_string(value);
    result.erase(result.find_last_not_of('0') + 1);
    if (result.back() == '.') result.pop_back();
    return result;
  }
};

/// A finite number above zero.
class PositiveReal : public CLI::Validator {
 public:
  PositiveReal() : CLI::Validator("POSITIVE") {
    func_ = [](std::string& input) {
      double value = std::numeric_limits<double>::quiet_NaN();
      const bool good = CLI::detail::lexical_cast(input, value) && std::isfinite(value) && value > 0;
      return good ? std::string() : "'" + input + "' is not a finite number above 0";
    };
  }
};

}  // namespace retrace
