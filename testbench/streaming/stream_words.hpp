// Between records of 64-bit words and the words of the kernels' streams and ports.
#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "hls/streaming/kernels.hpp"

namespace retrace {

/// The image as the kernels' ports see it.
struct StreamMemory {
  std::vector<hls::word_t> words;
  std::vector<hls::line_t> lines;
  ap_uint<32> count;

  explicit StreamMemory(std::span<const std::uint64_t> image) : words(image.size() / 2), lines(image.size() / 8) {
    for (std::size_t i = 0; i < words.size(); ++i) {
      words[i] = image[2 * i + 1];
      words[i] <<= 64;
      words[i] |= hls::word_t(image[2 * i]);
    }
    for (std::size_t i = 0; i < lines.size(); ++i) {
      for (int part = 3; part >= 0; --part) {
        lines[i] <<= 128;
        lines[i] |= hls::line_t(words[4 * i + static_cast<std::size_t>(part)]);
      }
    }
    count = static_cast<unsigned>(lines.size());
    // Something to point at.
    if (words.empty()) words.emplace_back(0);
    if (lines.empty()) lines.emplace_back(0);
  }
};

/// A record as the word of its stream.
template <class Word, class Record>
Word stream_word(const Record& record) {
  std::array<std::uint64_t, Record::kWords> words;
  record.pack(words.data());
  Word word = 0;
  for (std::size_t i = words.size(); i-- > 0;) {
    word <<= 64;
    word |= Word(words[i]);
  }
  return word;
}

/// And back.
template <class Record, class Word>
Record stream_record(const Word& word) {
  std::array<std::uint64_t, Record::kWords> words;
  for (std::size_t i = 0; i < words.size(); ++i)
    words[i] = static_cast<ap_uint<64>>(word >> static_cast<int>(64 * i)).to_uint64();
  return Record::unpack(words.data());
}

}  // namespace retrace
