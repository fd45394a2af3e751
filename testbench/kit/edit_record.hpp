// Changes one record in the words of a memory image, as a test of damaged images does.
#pragma once
#include <cstdint>
#include <functional>
#include <vector>

#include "golden/tree/memory_image.hpp"

namespace retrace {

/// `offset` in lines, of the table of these records.
template <typename Record>
void edit_record(std::vector<std::uint64_t>& words, std::uint64_t offset, std::size_t index,
                 const std::function<void(Record&)>& change) {
  std::uint64_t* at = words.data() + offset * MemoryImage::kLineWords + index * Record::kWords;
  Record record = Record::unpack(at);
  change(record);
  record.pack(at);
}

}  // namespace retrace
