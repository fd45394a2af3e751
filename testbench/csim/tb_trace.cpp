// C-simulation testbench of the full kernel: rays of every awkward kind through retrace_trace, compared with brute
// force over all triangles with the same test, and across the kernel's modes, bit for bit. Returns 0 on success.
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cinttypes>
#include <cmath>
#include <cstdio>
#include <cstring>

#include "csim_engine.hpp"
#include "golden/compare/compare.hpp"
#include "golden/tree/traced_scene.hpp"
#include "scenes/open_scene.hpp"
#include "testbench/kit/brute_force.hpp"
#include "testbench/kit/command_line.hpp"
#include "testbench/kit/false_hit.hpp"
#include "testbench/kit/test_rays.hpp"

namespace {

using namespace retrace;

// A triangle is referenced where it is, widened by 2^-19. The test accepts a ray that passes within eps of an edge, and its point of
// intersection with the plane then lies up to eps / |d'z| away from the triangle, possibly in a cell that does not reference it. Each difference
// must be proved to be such a false hit (testbench/kit/false_hit.hpp), `edge`, or to lie behind the kernel's hit but for the certified error of t,
// `depth`; the rest of the answer must still be that of brute force.

struct Tally {
  std::uint64_t hits = 0, modes_differ = 0, differ = 0, depth = 0, edge = 0, faults = 0, golden_modes_differ = 0;
};

enum class Cause { kNone, kDepth, kEdge, kDiffers };

bool agree(const contract::RayRecord& ray, const Hit& hit, const BruteForce::Result& truth) {
  if (hit.hit() != truth.hit) return false;
  return !truth.hit || ray.any || (hit.id == truth.id && hit.t * (1 << contract::kTLimitFrac) == truth.t);
}

/// Why a kernel's hit is not that of brute force. Takes hits that are accounted for away one by one.
Cause explain(const Comparator& comparator, const GridScene& scene, const MemoryImage& image, const BruteForce& brute,
              const GridRay& ray, const Hit& hit) {
  std::vector<std::uint32_t> visits, without;
  // The leaves are the kernel's own if the walk says what the kernel says.
  const TwoLevelHit walked = trace_one_level(image, ray.record, visits);
  if (walked.hit != hit.hit() ||
      (walked.hit && (walked.id != hit.id || walked.t != hit.t * (1 << contract::kTLimitFrac))))
    return Cause::kDiffers;
  Cause cause = Cause::kNone;
  while (true) {
    const auto truth = brute.trace(ray.record, without);
    if (agree(ray.record, hit, truth)) return cause;
    if (!truth.hit) return Cause::kDiffers;
    const FalseHit proof = prove_false_hit(scene, image, ray.record, truth.id, truth.t, visits);
    if (proof == FalseHit::kTrueHit) {
      Hit nearer;
      nearer.status = contract::kStatusHit;
      nearer.id = truth.id;
      nearer.t = std::ldexp(truth.t, -contract::kTLimitFrac);
      const Verdict verdict = comparator.compare(ray, nearer, hit);
      if (verdict.agreement == Agreement::kViolation || verdict.lost) return Cause::kDiffers;
      cause = Cause::kDepth;
    } else if (proof == FalseHit::kProved) {
      if (cause == Cause::kNone) cause = Cause::kEdge;
    } else {
      std::printf("  triangle %u: %s\n", truth.id, to_string(proof));
      return Cause::kDiffers;
    }
    without.push_back(truth.id);
  }
}

bool same_bits(const Hit& a, const Hit& b) {
  return a.status == b.status && a.id == b.id && a.t == b.t && a.u == b.u && a.v == b.v;
}

void report(const char* what, std::uint64_t seed, std::size_t index, const contract::RayRecord& ray, const Hit& hit,
            const BruteForce::Result& truth) {
  std::printf("  %s: seed %" PRIu64
              " ray %zu origin %d %d %d direction %d %d %d t_max %u any %u\n"
              "    kernel status %u id %u t %.0f; brute force hit %d id %u t %u d'z %d\n",
              what, seed, index, ray.origin[0], ray.origin[1], ray.origin[2], ray.direction[0], ray.direction[1],
              ray.direction[2], ray.t_max, ray.any, hit.status, hit.id, hit.t * (1 << contract::kTLimitFrac), truth.hit,
              truth.id, truth.t, truth.dz);
}

int run(const char* name, std::uint64_t seed, std::size_t count) {
  const TracedScene traced = prepare_scene(open_scene(name));
  const GridScene& scene = traced.grid;
  const MemoryImage& image = traced.image;
  image.check();
  auto csim = make_csim_engine(image);
  auto golden = make_golden_engine(scene, image);
  const BruteForce brute(image);
  const Comparator comparator(scene);
  Random random(seed);
  Tally tally;
  constexpr std::size_t kBatch = 1 << 16;
  std::size_t printed = 0;
  for (std::size_t done = 0; done < count; done += kBatch) {
    const auto rays = make_test_rays(scene, image, std::min(kBatch, count - done), random);
    const std::size_t size = rays.size();
    std::vector<Hit> face(size), parent(size), mail(size), stack_golden(size), parent_golden(size), face_golden(size);
    TraceOptions options;
    csim->trace(rays, face, {}, options);
    golden->trace(rays, face_golden, {}, options);
    options.way_up = WayUp::kParentLinks;
    csim->trace(rays, parent, {}, options);
    golden->trace(rays, parent_golden, {}, options);
    options.mailbox = kCsimMailbox;
    csim->trace(rays, mail, {}, options);
    options.mailbox = 0;
    options.way_up = WayUp::kStack;
    golden->trace(rays, stack_golden, {}, options);

    std::vector<BruteForce::Result> truth(size);
    tbb::parallel_for(std::size_t{0}, size, [&](std::size_t i) {
      if (!rays[i].outside) truth[i] = brute.trace(rays[i].record);
    });
    for (std::size_t i = 0; i < size; ++i) {
      tally.hits += face[i].hit();
      if (face[i].status > static_cast<std::uint32_t>(contract::kStatusHit)) {
        ++tally.faults;
        if (++printed < 10) report("fault", seed, done + i, rays[i].record, face[i], truth[i]);
      }
      if (!same_bits(face[i], parent[i]) || !same_bits(face[i], mail[i])) {
        ++tally.modes_differ;
        if (++printed < 10) report("modes differ", seed, done + i, rays[i].record, parent[i], truth[i]);
      }
      if (!same_bits(face_golden[i], parent_golden[i]) || !same_bits(face_golden[i], stack_golden[i])) {
        ++tally.golden_modes_differ;
        if (++printed < 10) report("golden modes differ", seed, done + i, rays[i].record, stack_golden[i], truth[i]);
      }
      if (agree(rays[i].record, face[i], truth[i])) continue;
      const Cause cause = explain(comparator, scene, image, brute, rays[i], face[i]);
      ++(cause == Cause::kDepth ? tally.depth : cause == Cause::kEdge ? tally.edge : tally.differ);
      if (cause == Cause::kDiffers && ++printed < 10)
        report("differs", seed, done + i, rays[i].record, face[i], truth[i]);
    }
  }
  std::printf("%-16s %8zu triangles %9zu rays seed %" PRIu64 ": %" PRIu64 " hits, %" PRIu64
              " differ from brute force, %" PRIu64 " depth, %" PRIu64 " edge, %" PRIu64 " between modes, %" PRIu64
              " between golden modes, %" PRIu64 " faults\n",
              name, scene.triangles.size(), count, seed, tally.hits, tally.differ, tally.depth, tally.edge,
              tally.modes_differ, tally.golden_modes_differ, tally.faults);
  return tally.differ + tally.modes_differ + tally.golden_modes_differ + tally.faults == 0 ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  std::string scene = "knot";
  std::uint64_t seed = test_seed();
  std::size_t rays = 9000;
  CLI::App app("The full kernel against brute force over all triangles, and across its modes, bit for bit.",
               "tb_trace");
  app.add_option("scene", scene, "A glTF file or a generated scene")->capture_default_str();
  app.add_option("seed", seed, "Default: RETRACE_SEED")->capture_default_str();
  app.add_option("rays", rays)->capture_default_str();
  return run_program(app, argc, argv, [&] { return run(scene.c_str(), seed, rays); });
}
