// The list of all structures and traversals. A new one is added in make_catalogue().
#include "catalogue.hpp"

#include <algorithm>
#include <cmath>
#include <ctime>

namespace retrace::accel {
namespace {

/// Seconds of processor time, of all threads: what else the machine does must not decide between structures.
template <class F>
auto timed(F&& f, double& seconds) {
  const std::clock_t start = std::clock();
  auto result = f();
  seconds = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
  return result;
}

std::vector<Technique> make_catalogue() {
  std::vector<Technique> all;
  all.push_back({"brute-force", "none", "every triangle", "", false, [](Workshop& w, double& seconds) {
                   seconds = 0.0;
                   return std::shared_ptr<const Structure>(make_brute_force(w.set()));
                 }});
  const auto grid = [&](std::string key, std::string name, std::string source, GridDensity density) {
    all.push_back({key, name, "3D-DDA", std::move(source), true,
                   [density](Workshop& w, double& seconds) { return w.grid(density, seconds); }});
  };
  grid("grid-woo", "grid, 20 triangles a voxel", "Woo 1992; Amanatides & Woo 1987", GridDensity::kWoo);
  grid("grid-pharr", "grid, 3 cbrt N a side", "Pharr & Humphreys 2004; Amanatides & Woo 1987", GridDensity::kPharr);
  grid("grid-pharr-exact", "grid, 3 cbrt N a side, exact overlap", "Pharr & Humphreys 2004; Akenine-Moeller 2001",
       GridDensity::kPharrExact);

  struct KdWalk {
    std::string key, name, source;
    KdTraversal traversal;
    int entries;
  };
  std::vector<KdWalk> walks{{"stack", "stack", "Havran 2000", KdTraversal::kStack, 0}};
  for (int n = 2; n <= 8; ++n)
    walks.push_back({"short-stack-" + std::to_string(n), "short stack of " + std::to_string(n), "Horn et al. 2007",
                     KdTraversal::kShortStack, n});
  walks.push_back({"restart", "restart", "Foley & Sugerman 2005", KdTraversal::kRestart, 0});
  walks.push_back({"backtrack-boxes", "backtrack, boxes", "Foley & Sugerman 2005", KdTraversal::kBacktrackBoxes, 0});
  walks.push_back({"backtrack-plane", "backtrack, plane match", "this project", KdTraversal::kBacktrackPlane, 0});
  walks.push_back({"face-links", "backtrack, face links", "this project", KdTraversal::kFaceLinks, 0});
  struct Split {
    std::string key, name, source;
    KdRecipe recipe;
  };
  for (const Split& split :
       {Split{"kd-sah", "kd-tree, SAH", "MacDonald & Booth 1990; ", KdRecipe::kSah},
        Split{"kd-unclipped", "kd-tree, SAH, unclipped", "Pharr & Humphreys 2004; ", KdRecipe::kUnclipped},
        Split{"kd-spatial", "kd-tree, spatial median", "Kaplan 1985; ", KdRecipe::kSpatialMedian},
        Split{"kd-object", "kd-tree, object median", "Jansen 1986; ", KdRecipe::kObjectMedian}}) {
    for (const KdWalk& walk : walks) {
      // All sizes of the short stack on the tree that one would build; one size stands for them on the others.
      if (split.key != "kd-sah" && walk.traversal == KdTraversal::kShortStack && walk.entries != 4) continue;
      all.push_back({split.key + "/" + walk.key, split.name, walk.name, split.source + walk.source, true,
                     [split, walk](Workshop& w, double& seconds) -> std::shared_ptr<const Structure> {
                       return make_kd(w.kd(split.recipe, seconds), walk.traversal, walk.entries);
                     }});
    }
  }

  struct BvhWalk {
    std::string key, name, source;
    BvhTraversal traversal;
  };
  const BvhWalk stack{"stack", "ordered stack", "", BvhTraversal::kStack};
  const BvhWalk heap{"heap", "heap", "Kay & Kajiya 1986", BvhTraversal::kHeap};
  const BvhWalk stackless{"stackless", "parent links, no stack", "Hapala et al. 2011", BvhTraversal::kStackless};
  const auto bvh = [&](std::string key, std::string name, std::string source, BvhBuilder builder, int slabs,
                       const std::vector<BvhWalk>& with) {
    for (const BvhWalk& walk : with) {
      std::string both = source;
      if (!walk.source.empty() && walk.source != source) both += "; " + walk.source;
      all.push_back({key + "/" + walk.key, name, walk.name, both, false,
                     [builder, slabs, traversal = walk.traversal](Workshop& w,
                                                                  double& seconds) -> std::shared_ptr<const Structure> {
                       return make_bvh(w.bvh(builder, slabs, seconds), traversal);
                     }});
    }
  };
  for (const int slabs : {3, 5, 7}) {
    const std::string n = std::to_string(slabs);
    bvh("bvh-kk" + n, "BVH, median cut, " + n + " slab pairs", "Kay & Kajiya 1986", BvhBuilder::kKayKajiya, slabs,
        slabs == 5 ? std::vector{heap} : std::vector{heap, stack, stackless});
  }
  bvh("bvh-gs", "BVH, insertion", "Goldsmith & Salmon 1987", BvhBuilder::kGoldsmithSalmon, 3, {stack, stackless});
  bvh("bvh-sah", "BVH, binned SAH", "Wald 2007", BvhBuilder::kBinnedSah, 3, {stack, heap, stackless});
  return all;
}

BuildOptions build_options(KdRecipe recipe, std::size_t triangles) {
  BuildOptions options;
  switch (recipe) {
    case KdRecipe::kSah:
      break;
    case KdRecipe::kUnclipped:  // depth: Pharr & Humphreys 2004, section 4.5; a test costs many steps, as there
      options.clip = false;
      options.intersection_cost = 20.0, options.empty_bonus = 0.8;
      options.budget = 128;  // meshes take up to 48
      options.max_depth =
          static_cast<int>(std::lround(8 + 1.3 * std::log2(static_cast<double>(std::max<std::size_t>(triangles, 1)))));
      break;
    case KdRecipe::kSpatialMedian:
      options.split = BuildOptions::Split::kSpatialMedian;
      break;
    case KdRecipe::kObjectMedian:
      options.split = BuildOptions::Split::kObjectMedian;
      break;
  }
  return options;
}

}  // namespace

std::shared_ptr<const KdTree> Workshop::kd(KdRecipe recipe, double& seconds) {
  Made<KdTree>& made = kd_[static_cast<int>(recipe)];
  if (!made.thing) {
    const BuildOptions options = build_options(recipe, set_.triangles.size());
    const MemoryImage image = timed([&] { return build_kd(scene_, options); }, made.seconds);
    made.thing = decode_kd(image, set_);
  }
  seconds = made.seconds;
  return made.thing;
}

std::shared_ptr<const Bvh> Workshop::bvh(BvhBuilder builder, int slabs, double& seconds) {
  Made<Bvh>& made = bvh_[static_cast<int>(builder) * 16 + slabs];
  if (!made.thing) made.thing = timed([&] { return build_bvh(set_, builder, slabs); }, made.seconds);
  seconds = made.seconds;
  return made.thing;
}

std::shared_ptr<const Structure> Workshop::grid(GridDensity density, double& seconds) {
  Made<Structure>& made = grid_[static_cast<int>(density)];
  if (!made.thing) {
    made.thing = timed([&] { return std::shared_ptr<const Structure>(make_grid(set_, density)); }, made.seconds);
  }
  seconds = made.seconds;
  return made.thing;
}

const std::vector<Technique>& catalogue() {
  static const std::vector<Technique> all = make_catalogue();
  return all;
}

}  // namespace retrace::accel
