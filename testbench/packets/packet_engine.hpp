// Engine "packets": static SaarCOR (J. Schmittler, I. Wald, P. Slusallek: SaarCOR - A Hardware Architecture for Ray Tracing, Graphics Hardware 2002) as a
// cycle model. A packet of rays goes through the kd-tree together, with one stack; a node, a leaf, a list entry or a triangle is read once for all
// its rays. Traversal, list and intersection are units of their own, with packets in turn. The arithmetic is that of the core's stages
// (testbench/kit/reference.hpp), over the same memory image.
#pragma once
#include <cstdint>
#include <memory>

#include "golden/engine/registry.hpp"

namespace retrace {

/// Sizes of the machine. The paper's own are not taken: this is its structure at the size of the project's cores.
struct PacketMachine {
  int rays = 64;               ///< a packet
  int packets = 16;            ///< in flight
  int traversal_lanes = 4;     ///< rays against a plane a clock
  int intersection_lanes = 1;  ///< rays against a triangle a clock
  int node_lines = 2048;       ///< of the caches: nodes of 16 bytes, others of 64
  int leaf_lines = 256, list_lines = 256, triangle_lines = 512;
};

struct PacketTotals {
  std::uint64_t rays = 0, packets = 0;
  std::uint64_t nodes = 0;      ///< visited by packets
  std::uint64_t ray_nodes = 0;  ///< and by the rays that were active in them
  std::uint64_t leaves = 0, ray_leaves = 0;
  std::uint64_t triangles = 0;                                            ///< read by packets
  std::uint64_t tests = 0;                                                ///< of their active rays
  std::uint64_t bytes = 0;                                                ///< read and written, after the caches
  double clocks = 0, traversal = 0, list = 0, intersection = 0, bus = 0;  ///< of the run; busy
  double node_hits = 1, leaf_hits = 1, list_hits = 1, triangle_hits = 1;
  /// Share of a packet's rays that a visited node concerns.
  double coherence(int rays_a_packet) const {
    return nodes ? static_cast<double>(ray_nodes) / (static_cast<double>(nodes) * rays_a_packet) : 1.0;
  }
};

class PacketEngine : public Engine {
 public:
  virtual const PacketTotals& totals() const = 0;
};

/// `image` outlives it.
std::unique_ptr<PacketEngine> make_packet_engine(const MemoryImage& image, const PacketMachine& machine = {});

EngineKind packet_engine_kind();

}  // namespace retrace
