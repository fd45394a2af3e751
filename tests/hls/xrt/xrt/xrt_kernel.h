// See xrt_device.h. A run ends before start returns.
#pragma once
#include <array>

#include "hls/top/trace.hpp"
#include "xrt_device.h"

namespace xrt {

class run {
 public:
  void wait() {}
};

class kernel {
 public:
  kernel(const device&, const uuid&, const std::string& name) {
    if (name != "retrace_trace") throw std::runtime_error("No compute units matching '" + name + "'");
  }
  int group_id(int argument) const { return 100 + argument; }

  run operator()(const bo& pairs, const bo& leaves, const bo& list, const bo& triangles, const bo& rays, const bo& hits,
                 const bo& work, const bo& summary, std::uint32_t image_lines, std::uint32_t ray_count,
                 std::uint32_t options) {
    using retrace::hls::word_t;
    const std::array<const bo*, 8> arguments{&pairs, &leaves, &list, &triangles, &rays, &hits, &work, &summary};
    const std::array<std::size_t, 8> least{64ul * image_lines, 64ul * image_lines, 64ul * image_lines,
                                           64ul * image_lines, 32ul * ray_count,   16ul * ray_count,
                                           16ul * ray_count,   8ul * kSummaryWords};
    std::array<std::vector<word_t>, 8> words;
    for (std::size_t i = 0; i < 8; ++i) {
      const std::vector<char>& bytes = arguments[i]->device_memory();
      if (arguments[i]->group() != group_id(static_cast<int>(i)))
        throw std::runtime_error("argument " + std::to_string(i) + " lies in the wrong bank");
      if (bytes.size() < least[i]) throw std::runtime_error("argument " + std::to_string(i) + " is too short");
      std::vector<std::uint64_t> parts(bytes.size() / 16 * 2 + 2);
      std::memcpy(parts.data(), bytes.data(), bytes.size());
      for (std::size_t w = 0; w < parts.size(); w += 2) {
        word_t word = parts[w + 1];
        word <<= 64;
        words[i].push_back(word | word_t(parts[w]));
      }
    }
    std::array<ap_uint<64>, kSummaryWords> totals;
    retrace_trace(words[0].data(), words[1].data(), words[2].data(), words[3].data(), words[4].data(), words[5].data(),
                  words[6].data(), totals.data(), image_lines, ray_count, options);
    for (const std::size_t i : {5, 6}) {
      std::vector<char>& bytes = arguments[i]->device_memory();
      for (std::size_t w = 0; 16 * w + 16 <= bytes.size(); ++w) {
        const std::uint64_t parts[2] = {static_cast<ap_uint<64>>(words[i][w]).to_uint64(),
                                        static_cast<ap_uint<64>>(words[i][w] >> 64).to_uint64()};
        std::memcpy(bytes.data() + 16 * w, parts, 16);
      }
    }
    for (std::size_t w = 0; w < totals.size(); ++w) {
      const std::uint64_t part = totals[w].to_uint64();
      std::memcpy(summary.device_memory().data() + 8 * w, &part, 8);
    }
    return {};
  }
};

}  // namespace xrt
