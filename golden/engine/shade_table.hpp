// What shading needs of a scene, as it stands in memory: a record of 16 bytes for each instance, then the materials, 8 bytes each.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "golden/contract/contract_records.hpp"

namespace retrace {

struct ShadeTable {
  std::vector<std::uint64_t> words;
  std::uint32_t instances = 0;

  ShadeTable() = default;
  /// Of a scene without instances. Implicit: a list of materials is such a table.
  ShadeTable(std::span<const contract::MaterialRecord> materials) { append(materials); }
  ShadeTable(const std::vector<contract::MaterialRecord>& materials) : ShadeTable(std::span(materials)) {}
  ShadeTable(std::span<const contract::InstanceShadeRecord> placed,
             std::span<const contract::MaterialRecord> materials) {
    append(placed);
    instances = static_cast<std::uint32_t>(placed.size());
    append(materials);
  }
  /// Records of 8 bytes, those of instances counted twice.
  std::uint32_t size() const { return static_cast<std::uint32_t>(words.size()); }

 private:
  template <class Record>
  void append(std::span<const Record> records) {
    for (const Record& record : records) {
      words.resize(words.size() + Record::kWords);
      record.pack(&words[words.size() - Record::kWords]);
    }
  }
};

}  // namespace retrace
