// Numbers as people read them.
#pragma once
#include <cstdint>
#include <string>

namespace retrace {

/// 1234567 -> "1,234,567".
std::string with_commas(std::uint64_t value);
/// 1234567 -> "1.23 M".
std::string with_unit(double value);

}  // namespace retrace
