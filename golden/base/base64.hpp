// Base64 (RFC 4648, section 4).
#pragma once
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace retrace {

std::string encode_base64(std::span<const std::uint8_t> bytes);

/// White space is skipped, padding is optional. Throws Error (without a location).
std::vector<std::uint8_t> decode_base64(std::string_view text);

}  // namespace retrace
