// hit_finish in double: barycentric coordinates of the best hit.
// Counterparts: hls/stages/hit_finish.hpp, rtl/isect/rt_hit_finish.sv. Source: Woop et al. 2005, section 3.2.
#pragma once
#include "golden/engine/engine.hpp"
#include "tri_test.hpp"

namespace retrace::golden {

inline Hit hit_finish(const Candidate& best) {
  Hit hit;
  hit.status = contract::kStatusHit;
  hit.id = best.triangle->id;
  hit.t = best.t;
  hit.u = best.edge_u / best.dz;
  hit.v = best.edge_v / best.dz;
  return hit;
}

}  // namespace retrace::golden
