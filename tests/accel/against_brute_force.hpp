// Every structure of the catalogue against brute force over all triangles.
#pragma once
#include <gtest/gtest.h>

#include <cstddef>
#include <span>
#include <vector>

#include "golden/accel/catalogue.hpp"

namespace retrace::accel {

struct Agreement {
  std::vector<Hit> expected;  ///< of brute force, in the order of the rays
  std::size_t hits = 0, techniques = 0;
};

/// Hits are equal in every bit; of an any-hit ray only whether there is one. Fails fatally at the first difference. Brute force is the first technique.
inline void compare_with_brute_force(Workshop& workshop, std::span<const Ray> rays, Agreement& agreement) {
  double seconds;
  for (const Technique& technique : catalogue()) {
    const auto structure = technique.make(workshop, seconds);
    Probe probe;
    for (std::size_t i = 0; i < rays.size(); ++i) {
      const Hit hit = structure->trace(rays[i], probe);
      if (technique.key == "brute-force") {
        agreement.expected.push_back(hit);
        agreement.hits += hit.hit();
      } else if (rays[i].any) {
        ASSERT_EQ(agreement.expected[i].hit(), hit.hit()) << technique.key << ", ray " << i;
      } else {
        ASSERT_EQ(agreement.expected[i], hit) << technique.key << ", ray " << i;
      }
    }
    ++agreement.techniques;
  }
}

}  // namespace retrace::accel
