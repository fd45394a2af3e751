// Barrel kernel: see trace.hpp. Stages do the arithmetic; this file holds contexts, memory reads with bounds checks, and control.
// Two levels: a leaf of instances sends the ray into an object (enter_object), with the object's ray in `state` and the world's in `world`; at the
// end of the object's tree the ray returns to that leaf, which is read again (leave_object), and goes on with its next reference.
// Source: Lee 2007 (dedicated kd-backtrack traversal with parent links); Foley & Sugerman 2005.
#include "trace.hpp"

#include "image_view.hpp"

#include "../stages/hit_finish.hpp"
#include "../stages/instance_enter.hpp"
#include "../stages/kd_backtrack.hpp"
#include "../stages/kd_descend.hpp"
#include "../stages/leaf_exit.hpp"
#include "../stages/ray_setup.hpp"
#include "../stages/tri_test.hpp"

namespace retrace::hls {

typedef ap_uint<3> phase_t;
static const int kPhaseIdle = 0;    // take the next ray
static const int kPhaseDown = 1;    // read a node: descend, or arrive at a leaf
static const int kPhaseTest = 2;    // one reference of the leaf
static const int kPhaseUp = 3;      // one parent link
static const int kPhaseFinish = 4;  // write the hit

static const unsigned long long kMaxIterations = 1ULL << 48;  // a static bound; 32 days at 100 MHz
typedef ap_uint<contract::kPositionBits> size_code_t;         // the bits of a leaf's split

struct context {
  phase_t phase;
  ap_uint<32> ray;
  ray_setup_out_record state;
  node_index_t node;
  t_t t;
  ap_uint<32> steps;
  // Leaf in progress.
  leaf_exit_out_record exit;
  node_index_t link;    // face link of the exit face
  node_index_t parent;  // of `node`, on the way up
  triangle_index_t count, next;
  list_index_t list_base;
  axis_t kind;
  triangle_index_t refs[contract::kLeafInline];
  // Level: 1 inside an object.
  flag_t level;
  flag_t fresh;       // no leaf of the object has been reached yet
  flag_t resumes;     // back from an object: the leaf is known, go on at `next`
  node_index_t root;  // of the tree that the ray walks
  ray_setup_out_record world;
  node_index_t saved_node;
  triangle_index_t saved_next;
  t_t saved_t;
  triangle_index_t instance;
  triangle_id_t first_id;
  entry_scale_t scale;
  entry_start_t start;
  triangle_index_t instance_mail[RETRACE_INSTANCE_MAILBOX];  // the last instances entered
  ap_uint<4> instance_next;
  ap_uint<4> instance_used;
  // What a hit of the tree at hand has to come before: the best one, or inside an object, what is as good there.
  t_limit_t near_t;
  triangle_id_t near_id;
  // Best hit so far.
  status_t status;
  triangle_index_t best_instance;
  t_limit_t best_t;
  triangle_id_t best_id;
  edge_t edge_u, edge_v;
  row_direction_t dz;
  exponent_t exponent_u, exponent_v;
  // Mailbox: the last triangles tested.
  triangle_index_t mail[RETRACE_MAILBOX];
  ap_uint<4> mail_next;
  ap_uint<4> mail_used;
  work_record work;
};

inline void fail(context& c, int status) {
  RT_INLINE
  c.status = status;
  c.phase = kPhaseFinish;
}

// Counts a step; false if the ray has used up the image's limit.
inline bool count_step(context& c, const image_view& view) {
  RT_INLINE
  if (c.steps >= view.step_limit) {
    fail(c, contract::kStatusStepLimit);
    return false;
  }
  c.steps += 1;
  return true;
}

inline node_pair_record read_pair(const word_t* pairs, const image_view& view, const pair_index_t& index) {
  RT_INLINE
  word_t words[kNodePairWords];
  words[0] = pairs[word_address(view.pair_offset, index, kNodePairStride).to_uint64()];
  return unpack_node_pair(words);
}

inline void start_ray(context& c, const word_t* rays, const image_view& view, const ap_uint<32>& index, bool entered) {
  word_t words[kRayWords];
READ_RAY:
  for (int i = 0; i < kRayWords; ++i) {
    RT_PIPELINE(1)
    words[i] = rays[index.to_uint64() * kRayStride + i];
  }
  const ray_record ray = unpack_ray(words);
  ray_setup_in_record in;
COPY_RAY:
  for (int axis = 0; axis < 3; ++axis) {
    RT_UNROLL
    in.origin[axis] = ray.origin[axis];
    in.direction[axis] = ray.direction[axis];
    in.box[2 * axis] = view.box[2 * axis];
    in.box[2 * axis + 1] = view.box[2 * axis + 1];
    if (entered) {  // any origin will do
      in.box[2 * axis] = -(1 << (contract::kPositionBits - 1));
      in.box[2 * axis + 1] = (1 << (contract::kPositionBits - 1)) - 1;
    }
  }
  in.t_max = ray.t_max;
  in.any = ray.any;
  c.state = ray_setup(in);
  c.ray = index;
  c.node = 0;
  c.t = 0;
  c.steps = 0;
  c.status = contract::kStatusMiss;
  c.level = 0;
  c.fresh = 0;
  c.resumes = 0;
  c.root = 0;
  c.instance_next = 0;
  c.instance_used = 0;
  c.best_instance = 0;
  c.best_t = ray.t_max;
  c.best_id = contract::kNoTriangle;
  c.near_t = ray.t_max;
  c.near_id = contract::kNoTriangle;
  c.edge_u = 0;
  c.edge_v = 0;
  c.dz = 0;
  c.exponent_u = 0;
  c.exponent_v = 0;
  c.mail_next = 0;
  c.mail_used = 0;
  c.work.down = 0;
  c.work.up = 0;
  c.work.leaf = 0;
  c.work.tests = 0;
  c.work.skipped = 0;
  c.phase = kPhaseDown;
  if (!c.state.valid) fail(c, contract::kStatusBadRay);
}

// The tree at hand is done: the ray is finished, or goes on at the leaf that sent it into the object.
inline void leave_tree(context& c) {
  RT_INLINE
  c.phase = kPhaseFinish;
  if (c.level) {
    c.phase = kPhaseDown;
    c.level = 0;
    c.resumes = 1;
    c.state = c.world;
    c.root = 0;
    c.node = c.saved_node;
    c.t = c.saved_t;
    c.next = c.saved_next;
    c.near_t = c.best_t;
    c.near_id = c.best_id;
  }
}

// All references of the leaf are done: the tree is, or on through the exit face.
inline void leave_leaf(context& c, bool parent_links) {
  RT_INLINE
  flag_t last = c.link == 0;
  if (parent_links) last = c.node == c.root;  // the root itself may be the leaf
  const flag_t ends = last || !c.exit.exits || c.near_t <= c.exit.t_exit;
  c.t = c.exit.t_exit;
  if (ends) {
    leave_tree(c);
  } else if (parent_links) {
    c.phase = kPhaseUp;
  } else {
    c.node = c.link;
    c.phase = kPhaseDown;
  }
}

inline void arrive_at_leaf(context& c, const word_t* leaves, const image_view& view, const pair_index_t& index,
                           const size_code_t& size, bool parent_links) {
  if (index >= view.leaf_count) {
    fail(c, contract::kStatusBadIndex);
    return;
  }
  word_t words[kLeafWords];
  const address_t address = word_address(view.leaf_offset, index, kLeafStride);
READ_LEAF:
  for (int i = 0; i < kLeafWords; ++i) {
    RT_PIPELINE(1)
    words[i] = leaves[address.to_uint64() + i];
  }
  const leaf_record leaf = unpack_leaf(words);
  leaf_exit_in_record in;
COPY_LEAF:
  for (int axis = 0; axis < 3; ++axis) {
    RT_UNROLL
    in.bound[2 * axis] = leaf.bound[2 * axis];
    in.bound[2 * axis + 1] = leaf.bound[2 * axis + 1];
    in.origin[axis] = c.state.origin[axis];
    in.reciprocal[axis] = c.state.reciprocal[axis];
    in.shift[axis] = c.state.shift[axis];
    in.zero[axis] = c.state.zero[axis];
    in.negative[axis] = c.state.negative[axis];
  }
  in.t = c.t;
  c.exit = leaf_exit(in);
  c.link = 0;
LINK:
  for (int face = 0; face < 6; ++face) {
    RT_UNROLL
    if (c.exit.face == face) c.link = leaf.link[face];
  }
  c.parent = leaf.parent;
  // The node says how many references there are, unless the list is needed.
  c.count = leaf.count;
  if (size < contract::kLeafLong) c.count = size;
  c.list_base = leaf.list_base;
  c.kind = leaf.kind;
  if (!c.resumes) {
    c.next = 0;
    c.work.leaf += 1;
  }
  c.resumes = 0;
  const flag_t first_of_object = c.fresh;
  c.fresh = 0;
REFS:
  for (int i = 0; i < contract::kLeafInline; ++i) {
    RT_UNROLL
    c.refs[i] = leaf.refs[i];
  }
  c.phase = kPhaseTest;
  const flag_t instances_may_be = view.two_levels & flag_t(!c.level);
  if (leaf.kind != contract::kKindTriangles && (leaf.kind != contract::kKindInstance || !instances_may_be)) {
    fail(c, contract::kStatusBadRecord);
  } else if (c.exit.broken) {
    // A ray that passes the root box of an object by, within the tolerance of its entry, leaves the first cell before t = 0.
    if (first_of_object) {
      leave_tree(c);
    } else {
      fail(c, contract::kStatusInvariant);
    }
  } else if (c.next >= c.count) {
    leave_leaf(c, parent_links);
  }
}

inline void step_down(context& c, const word_t* pairs, const word_t* leaves, const image_view& view,
                      bool parent_links) {
  if (!count_step(c, view)) return;
  const pair_index_t pair_index = c.node >> 1;
  if (pair_index >= view.pair_count) {
    fail(c, contract::kStatusBadIndex);
    return;
  }
  const node_pair_record pair = read_pair(pairs, view, pair_index);
  const flag_t right = c.node;
  position_t split = pair.left_split;
  axis_t axis = pair.left_axis;
  pair_index_t child = pair.left_child;
  if (right) {
    split = pair.right_split;
    axis = pair.right_axis;
    child = pair.right_child;
  }
  if (c.resumes && axis != contract::kAxisLeaf) {  // the memory changed under the ray
    fail(c, contract::kStatusBadRecord);
    return;
  }
  if (axis == contract::kAxisLeaf) {
    const size_code_t size = split;
    arrive_at_leaf(c, leaves, view, child, size, parent_links);
    return;
  }
  kd_descend_in_record in;
  in.split = split;
  in.child = child;
  in.origin = c.state.origin[0];
  in.reciprocal = c.state.reciprocal[0];
  in.shift = c.state.shift[0];
  in.zero = c.state.zero[0];
  in.negative = c.state.negative[0];
SELECT_AXIS:
  for (int i = 1; i < 3; ++i) {
    RT_UNROLL
    if (axis == i) {
      in.origin = c.state.origin[i];
      in.reciprocal = c.state.reciprocal[i];
      in.shift = c.state.shift[i];
      in.zero = c.state.zero[i];
      in.negative = c.state.negative[i];
    }
  }
  in.t = c.t;
  c.node = kd_descend(in).node;
  c.work.down += 1;
}

// Reference `index` of a leaf of instances: into its object, unless the ray was there or passes its box by.
inline void enter_object(context& c, const word_t* records, const image_view& view, const triangle_index_t& index,
                         bool mailbox, bool parent_links) {
  // The object of the best hit has been searched to its end.
  flag_t known = c.status == contract::kStatusHit && index == c.best_instance;
  if (mailbox) {
  INSTANCE_MAIL:
    for (int i = 0; i < RETRACE_INSTANCE_MAILBOX; ++i) {
      RT_UNROLL
      if (i < c.instance_used && c.instance_mail[i] == index) known = 1;
    }
  }
  if (known) {
    c.work.skipped += 1;
    if (c.next == c.count) leave_leaf(c, parent_links);
    return;
  }
  if (mailbox) {
    c.instance_mail[c.instance_next.to_uint()] = index;
    c.instance_next += 1;
    if (c.instance_next == RETRACE_INSTANCE_MAILBOX) c.instance_next = 0;
    if (c.instance_used < RETRACE_INSTANCE_MAILBOX) c.instance_used += 1;
  }
  word_t words[kInstanceWords];
  const address_t address = word_address(view.instance_offset, index, kInstanceStride);
READ_INSTANCE:
  for (int i = 0; i < kInstanceWords; ++i) {
    RT_PIPELINE(1)
    words[i] = records[address.to_uint64() + i];
  }
  const instance_record record = unpack_instance(words);
  instance_enter_in_record in;
COPY_ROWS:
  for (int i = 0; i < 9; ++i) {
    RT_UNROLL
    in.m[i] = record.m[i];
  }
COPY_BOX:
  for (int face = 0; face < 6; ++face) {
    RT_UNROLL
    in.box[face] = record.box[face];
  }
COPY_AXES:
  for (int axis = 0; axis < 3; ++axis) {
    RT_UNROLL
    in.b[axis] = record.b[axis];
    in.e[axis] = record.e[axis];
    in.origin[axis] = c.state.origin[axis];
    in.direction[axis] = c.state.direction[axis];
  }
  in.reach = c.best_t;
  if (c.status != contract::kStatusHit || index < c.best_instance) in.reach += 1;
  const instance_enter_out_record entry = instance_enter(in);
  if (entry.bad) {
    fail(c, contract::kStatusBadRecord);
  } else if (!entry.enters) {
    if (c.next == c.count) leave_leaf(c, parent_links);
  } else {
    c.world = c.state;
  ENTER:
    for (int axis = 0; axis < 3; ++axis) {
      RT_UNROLL
      c.state.origin[axis] = entry.origin[axis];
      c.state.direction[axis] = entry.direction[axis];
      c.state.reciprocal[axis] = entry.reciprocal[axis];
      c.state.shift[axis] = entry.shift[axis];
      c.state.zero[axis] = entry.zero[axis];
      c.state.negative[axis] = entry.negative[axis];
    }
    c.level = 1;
    c.fresh = 1;
    c.saved_node = c.node;
    c.saved_t = c.t;
    c.saved_next = c.next;
    c.instance = index;
    c.first_id = record.first_id;
    c.scale = entry.scale;
    c.start = entry.start;
    c.near_t = entry.t_max;
    c.near_id = contract::kNoTriangle;
    c.mail_next = 0;
    c.mail_used = 0;
    c.root = record.root;
    c.root <<= 1;
    c.node = c.root;
    c.t = 0;
    c.phase = kPhaseDown;
  }
}

inline void step_test(context& c, const word_t* list, const word_t* triangles, const image_view& view, bool mailbox,
                      bool parent_links) {
  if (!count_step(c, view)) return;
  const bool instances = c.kind == contract::kKindInstance;
  ap_uint<32> records = view.triangle_count;
  if (instances) records = view.instance_count;
  triangle_index_t index = c.refs[0];
INLINE_REFS:
  for (int i = 1; i < contract::kLeafInline; ++i) {
    RT_UNROLL
    if (c.next == i) index = c.refs[i];
  }
  if (c.next >= contract::kLeafInline) {
    ap_uint<32> entry = c.list_base;
    entry += c.next;
    entry -= contract::kLeafInline;
    if (entry >= view.list_count) {
      fail(c, contract::kStatusBadIndex);
      return;
    }
    ap_uint<32> word_index = entry >> 2;
    word_t word = list[word_address(view.list_offset, word_index, 1).to_uint64()];
    const ap_uint<2> lane = entry;
    ap_uint<7> bit = lane;
    bit <<= 5;
    word >>= bit;
    const ap_uint<32> wide = word;
    index = wide;
    if (wide >= records) {
      fail(c, contract::kStatusBadIndex);
      return;
    }
  }
  if (index >= records) {
    fail(c, contract::kStatusBadIndex);
    return;
  }
  c.next += 1;
  if (instances) {
    enter_object(c, triangles, view, index, mailbox, parent_links);
    return;
  }

  flag_t known = 0;
  if (mailbox) {
  MAIL:
    for (int i = 0; i < RETRACE_MAILBOX; ++i) {
      RT_UNROLL
      if (i < c.mail_used && c.mail[i] == index) known = 1;
    }
  }
  if (known) {
    c.work.skipped += 1;
  } else {
    if (mailbox) {
      c.mail[c.mail_next.to_uint()] = index;
      c.mail_next += 1;
      if (c.mail_next == RETRACE_MAILBOX) c.mail_next = 0;
      if (c.mail_used < RETRACE_MAILBOX) c.mail_used += 1;
    }
    word_t words[kTriangleWords];
    const address_t address = word_address(view.triangle_offset, index, kTriangleStride);
  READ_TRIANGLE:
    for (int i = 0; i < kTriangleWords; ++i) {
      RT_PIPELINE(1)
      words[i] = triangles[address.to_uint64() + i];
    }
    const triangle_record triangle = unpack_triangle(words);
    tri_test_in_record in;
  COPY_TRIANGLE:
    for (int axis = 0; axis < 3; ++axis) {
      RT_UNROLL
      in.u[axis] = triangle.u[axis];
      in.v[axis] = triangle.v[axis];
      in.n[axis] = triangle.n[axis];
      in.origin[axis] = c.state.origin[axis];
      in.direction[axis] = c.state.direction[axis];
    }
    in.offset_u = triangle.offset_u;
    in.offset_v = triangle.offset_v;
    in.offset_n = triangle.offset_n;
    in.exponent_u = triangle.exponent_u;
    in.exponent_v = triangle.exponent_v;
    in.id = triangle.id;
    const tri_test_out_record candidate = tri_test(in);
    c.work.tests += 1;
    if (candidate.hit && is_nearer(candidate.t, candidate.id, c.near_t, c.near_id)) {
      c.status = contract::kStatusHit;
      c.near_t = candidate.t;
      c.near_id = candidate.id;
      c.best_t = candidate.t;
      c.best_id = candidate.id;
      if (c.level) {
        c.best_t = world_t(candidate.t, c.start, c.scale);
        c.best_id += c.first_id;
        c.best_instance = c.instance;
      }
      c.edge_u = candidate.edge_u;
      c.edge_v = candidate.edge_v;
      c.dz = candidate.dz;
      c.exponent_u = candidate.exponent_u;
      c.exponent_v = candidate.exponent_v;
      if (c.state.any) {
        c.phase = kPhaseFinish;
        return;
      }
    }
  }
  if (c.next == c.count) leave_leaf(c, parent_links);
}

inline void step_up(context& c, const word_t* pairs, const image_view& view) {
  if (!count_step(c, view)) return;
  const pair_index_t pair_index = c.parent >> 1;
  if (pair_index >= view.pair_count) {
    fail(c, contract::kStatusBadIndex);
    return;
  }
  const node_pair_record pair = read_pair(pairs, view, pair_index);
  const flag_t right = c.parent;
  kd_backtrack_in_record in;
  in.face = c.exit.face;
  in.plane = c.exit.plane;
  in.node = c.node;
  in.parent = c.parent;
  in.parent_split = pair.left_split;
  in.parent_axis = pair.left_axis;
  in.parent_child = pair.left_child;
  if (right) {
    in.parent_split = pair.right_split;
    in.parent_axis = pair.right_axis;
    in.parent_child = pair.right_child;
  }
  const kd_backtrack_out_record out = kd_backtrack(in);
  c.work.up += 1;
  c.node = out.node;
  c.parent = pair.parent;
  if (out.bad) {
    fail(c, contract::kStatusBadRecord);
  } else if (!out.matched && in.parent == c.root) {
    leave_tree(c);
  } else if (out.matched) {
    c.phase = kPhaseDown;
  }
}

inline void finish_ray(context& c, word_t* hits, word_t* work, bool write_work, bool placed) {
  hit_finish_in_record in;
  in.status = c.status;
  in.t = c.best_t;
  in.id = c.best_id;
  in.edge_u = c.edge_u;
  in.edge_v = c.edge_v;
  in.dz = c.dz;
  in.exponent_u = c.exponent_u;
  in.exponent_v = c.exponent_v;
  const hit_record hit = hit_finish(in);
  word_t words[1];
  if (placed) {
    placed_hit_record place;
    place.t = hit.t;
    place.reserved = 0;
    place.status = hit.status;
    place.id = hit.id;
    place.number = c.best_instance;
    pack_placed_hit(place, words);
  } else {
    pack_hit(hit, words);
  }
  hits[c.ray.to_uint()] = words[0];
  if (write_work) {
    pack_work(c.work, words);
    work[c.ray.to_uint()] = words[0];
  }
  c.phase = kPhaseIdle;
}

}  // namespace retrace::hls

extern "C" void retrace_trace(const retrace::hls::word_t* pairs, const retrace::hls::word_t* leaves,
                              const retrace::hls::word_t* list, const retrace::hls::word_t* triangles,
                              const retrace::hls::word_t* rays, retrace::hls::word_t* hits, retrace::hls::word_t* work,
                              ap_uint<64>* summary, ap_uint<32> image_lines, ap_uint<32> ray_count,
                              ap_uint<8> options) {
  using namespace retrace::hls;
// clang-format off
#if defined(__BAMBU__)  // one master a port: words of different widths never share one
#pragma HLS interface mode=m_axi port=pairs offset=direct bundle=bus_pairs
#pragma HLS interface mode=m_axi port=leaves offset=direct bundle=bus_leaves
#pragma HLS interface mode=m_axi port=list offset=direct bundle=bus_list
#pragma HLS interface mode=m_axi port=triangles offset=direct bundle=bus_triangles
#pragma HLS interface mode=m_axi port=rays offset=direct bundle=bus_rays
#pragma HLS interface mode=m_axi port=hits offset=direct bundle=bus_hits
#pragma HLS interface mode=m_axi port=work offset=direct bundle=bus_work
#pragma HLS interface mode=m_axi port=summary offset=direct bundle=bus_summary
#else
  RT_MEMORY(pairs, gmem_pairs, RETRACE_COSIM_IMAGE_WORDS)
  RT_MEMORY(leaves, gmem_leaves, RETRACE_COSIM_IMAGE_WORDS)
  RT_MEMORY(list, gmem_leaves, RETRACE_COSIM_IMAGE_WORDS)
  RT_MEMORY(triangles, gmem_triangles, RETRACE_COSIM_IMAGE_WORDS)
  RT_MEMORY(rays, gmem_rays, RETRACE_COSIM_RAY_WORDS)
  RT_MEMORY(hits, gmem_rays, RETRACE_COSIM_RAYS)
  RT_MEMORY(work, gmem_rays, RETRACE_COSIM_RAYS)
  RT_MEMORY(summary, gmem_summary, RETRACE_COSIM_SUMMARY_WORDS)
  RT_CONTROL(image_lines)
  RT_CONTROL(ray_count)
  RT_CONTROL(options)
  RT_CONTROL(return)
#endif
  // clang-format on

  ap_uint<64> totals[kSummaryWords];
CLEAR_TOTALS:
  for (int i = 0; i < kSummaryWords; ++i) {
    RT_UNROLL
    totals[i] = 0;
  }
  image_view view;
  const int fault = read_header(pairs, image_lines, view);
  totals[kSummaryStatus] = fault;

  const bool parent_links = options[0] == 1;
  const bool mailbox = options[1] == 1;
  const bool write_work = options[2] == 1;
  const bool entered = options[3] == 1;
  context contexts[RETRACE_CONTEXTS];
  RT_PARTITION(totals)
CLEAR_CONTEXTS:
  for (int i = 0; i < RETRACE_CONTEXTS; ++i) {
    RT_PIPELINE(1)
    contexts[i].phase = kPhaseIdle;
  }

  ap_uint<32> next_ray = 0;
  ap_uint<32> finished = 0;
  ap_uint<8> turn = 0;
BARREL:
  for (unsigned long long iteration = 0; iteration < kMaxIterations; ++iteration) {
    RT_PIPELINE(1)
    RT_INDEPENDENT(contexts, RETRACE_CONTEXTS)
    if (fault != kFaultNone || finished == ray_count) break;
    context& c = contexts[turn.to_uint()];
    if (c.phase == kPhaseIdle) {
      if (next_ray != ray_count) {
        start_ray(c, rays, view, next_ray, entered);
        next_ray += 1;
      }
    } else if (c.phase == kPhaseDown) {
      totals[kSummarySteps] += 1;
      step_down(c, pairs, leaves, view, parent_links);
    } else if (c.phase == kPhaseTest) {
      totals[kSummarySteps] += 1;
      step_test(c, list, triangles, view, mailbox, parent_links);
    } else if (c.phase == kPhaseUp) {
      totals[kSummarySteps] += 1;
      step_up(c, pairs, view);
    } else {
      totals[kSummaryDown] += c.work.down;
      totals[kSummaryUp] += c.work.up;
      totals[kSummaryLeaf] += c.work.leaf;
      totals[kSummaryTests] += c.work.tests;
      totals[kSummarySkipped] += c.work.skipped;
      if (c.status > retrace::contract::kStatusHit) totals[kSummaryFaults] += 1;
      finish_ray(c, hits, work, write_work, entered);
      finished += 1;
    }
    turn += 1;
    if (turn == RETRACE_CONTEXTS) turn = 0;
  }
  totals[kSummaryRays] = finished;
WRITE_SUMMARY:
  for (int i = 0; i < kSummaryWords; ++i) {
    RT_PIPELINE(1)
    summary[i] = totals[i];
  }
}
