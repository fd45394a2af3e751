// Numbers as people read them, and text as XML takes it.
#pragma once
#include <cstdint>
#include <string>

namespace retrace {

/// 1234567 -> "1,234,567".
std::string with_commas(std::uint64_t value);
/// 1234567 -> "1.23 M".
std::string with_unit(double value);
/// "a < b" -> "a &lt; b": for the text of an element.
std::string escape_xml(const std::string& text);

}  // namespace retrace
