// SPDX-License-Identifier: Apache-2.0
// Records that travel into the core, out of it and between its units. What a build may choose is in rt_config_pkg (rtl/targets/core.toml).
//
// Streams     Rays come with a tag and hits leave with it; neither says where they are stored. Requests and fills are the one memory port.
package rt_core_pkg;

  localparam int unsigned AddrBits = 40;
  localparam int unsigned LineShift = 6;  // 64-byte lines
  localparam int unsigned MshrIdBits = 4;
  localparam int unsigned SourceBits = 3;
  localparam int unsigned GenerationBits = 15;  // a generation of contexts every 2^GenerationBits clocks (rt_generation)
  localparam int unsigned IdBits = SourceBits + MshrIdBits;

  typedef struct packed {
    logic [AddrBits-1:0]   addr;
    logic [7:0]            len;  // beats - 1
    logic [SourceBits-1:0] source;
    logic [MshrIdBits-1:0] mshr;
  } read_request_t;
  // A beat of an answer; its data travel beside it, as wide as the bus.
  typedef struct packed {
    logic [rt_config_pkg::Sources-1:0] valid;  // a bit for each source
    logic [MshrIdBits-1:0]             mshr;
    logic                              last;
    logic                              error;
  } fill_t;
  // Bytes that are read where `bytes` are needed: whole granules.
  function automatic int unsigned read_bytes(int unsigned bytes, int unsigned granule);
    return (bytes + granule - 1) / granule * granule;
  endfunction

  // Streams of the core. A ray that could not be read is marked, and its hit says so.
  localparam int unsigned TagBits = 32;
  typedef logic [TagBits-1:0] ray_tag_t;
  typedef struct packed {
    ray_tag_t                            tag;
    logic                                error;
    rt_contract_pkg::flag_t              any;
    rt_contract_pkg::t_limit_t           t_max;
    rt_contract_pkg::direction_t [2:0]   direction;
    rt_contract_pkg::position_t [2:0]    origin;
  } tagged_ray_t;
  typedef struct packed {
    ray_tag_t                     tag;
    rt_contract_pkg::hit_record_t hit;
  } tagged_hit_t;

  // Pixels in flight where rays and pixels are made on the chip: a slot each, or as many as there are samples, and what a depth needs
  // of the ray. A tag is {slot, pixel}; the lower bits of the slot are the sample.
  localparam int unsigned PixelSlotBits = TagBits - rt_contract_pkg::PixelIndexBits;
  localparam int unsigned PixelSlots = 1 << PixelSlotBits;
  typedef logic [PixelSlotBits-1:0] pixel_slot_t;
  typedef struct packed {
    rt_contract_pkg::entry_start_t start;
    rt_contract_pkg::entry_scale_t scale;
  } pixel_place_t;
  // In a core of two levels a camera's ray is made where those of objects are: its record and ray on the way there, the ray of the grid on the way back.
  typedef struct packed {
    ray_tag_t                                   tag;
    rt_contract_pkg::instance_enter_in_record_t data;
  } camera_ray_t;
  typedef struct packed {
    ray_tag_t                          tag;
    logic                              bad;
    logic                              enters;
    rt_contract_pkg::entry_start_t     start;
    rt_contract_pkg::entry_scale_t     scale;
    rt_contract_pkg::t_limit_t         t_max;
    rt_contract_pkg::direction_t [2:0] direction;
    rt_contract_pkg::position_t [2:0]  origin;
  } made_ray_t;
  // What became of a sample, on its way to a pixel.
  typedef struct packed {
    ray_tag_t                         tag;
    logic                             hit;
    logic                             shadow;  // something stands between the hit and the light
    rt_contract_pkg::triangle_id_t    id;
    rt_contract_pkg::triangle_index_t number;  // of the instance
    rt_contract_pkg::t_limit_t        t;
  } sample_t;
  // The light as an object sees it.
  localparam int unsigned TurnedBits = rt_contract_pkg::NormalBits + 2;
  typedef logic [TurnedBits-1:0] turned_t;
  // A pixel on its way to memory: its number, and 32 bits or 64.
  typedef struct packed {
    ray_tag_t    tag;
    logic [63:0] data;
  } pixel_t;

  // What a run is given; constant while it lasts.
  typedef struct packed {
    logic [AddrBits-1:0] image_base;  // a multiple of 64
    logic [31:0]         image_lines;
    logic                parent_links;
    logic                use_mailbox;
    logic                own_step_limit;
    logic [31:0]         step_limit;
    logic                any_origin;  // rays come from rt_raster: origins may lie outside of the root box
  } run_t;
  // What the core says of it. Faults are sticky until the next start.
  typedef struct packed {
    logic                     started;      // pulse
    logic                     busy;
    logic                     done;
    logic [1:0]               image_fault;
    logic                     ray_fault;
    rt_contract_pkg::status_t first_fault;
    ray_tag_t                 fault_tag;
  } run_status_t;

  // What a context is told to do, beside the contract's error statuses (2 .. 7): go on, or finish with the best hit so far.
  localparam rt_contract_pkg::status_t EventGoOn = 4'd0;
  localparam rt_contract_pkg::status_t EventFinish = 4'd15;

  // Size code of a leaf; LeafLong stands for every code that is not a number of references.
  typedef logic [$clog2(rt_contract_pkg::LeafLong+1)-1:0] leaf_size_t;
  // What the leaf cache looks up: how much of the record is needed (40 bytes and as many beats of 8), and the record.
  localparam int unsigned LeafReadBytes = 40;
  typedef struct packed {
    logic [1:0]                   beats;
    rt_contract_pkg::pair_index_t leaf;
  } leaf_key_t;

  // A ray as traversal sees it.
  typedef struct packed {
    rt_contract_pkg::flag_t [2:0]        negative;
    rt_contract_pkg::flag_t [2:0]        zero;
    rt_contract_pkg::recip_shift_t [2:0] shift;
    rt_contract_pkg::reciprocal_t [2:0]  reciprocal;
    rt_contract_pkg::position_t [2:0]    origin;
  } walk_ray_t;

  // A ray as the triangle test sees it.
  typedef struct packed {
    rt_contract_pkg::direction_t [2:0] direction;
    rt_contract_pkg::position_t [2:0]  origin;
  } test_ray_t;

  // Rays are few and the way to all who keep them is long, so one travels axis by axis, x first; and so it is kept (rt_ray_ram).
  localparam int unsigned Axes = 3;
  typedef struct packed {
    rt_contract_pkg::flag_t        negative;
    rt_contract_pkg::flag_t        zero;
    rt_contract_pkg::recip_shift_t shift;
    rt_contract_pkg::reciprocal_t  reciprocal;
    rt_contract_pkg::position_t    origin;
  } walk_axis_t;
  typedef struct packed {
    rt_contract_pkg::direction_t direction;
    rt_contract_pkg::position_t  origin;
  } test_axis_t;
  typedef struct packed {
    logic [1:0]                  axis;
    rt_contract_pkg::direction_t direction;
    walk_axis_t                  walk;
  } ray_axis_t;
  function automatic made_ray_t made_ray_of(ray_tag_t tag, rt_contract_pkg::instance_enter_out_record_t ray);
    return '{
        tag: tag,
        bad: ray.bad[0],
        enters: ray.enters[0],
        start: ray.start,
        scale: ray.scale,
        t_max: ray.t_max,
        direction: ray.direction,
        origin: ray.origin
    };
  endfunction

  function automatic walk_ray_t walk_ray_of(walk_axis_t [Axes-1:0] axes);
    for (int unsigned a = 0; a < Axes; a++) begin
      walk_ray_of.negative[a]   = axes[a].negative;
      walk_ray_of.zero[a]       = axes[a].zero;
      walk_ray_of.shift[a]      = axes[a].shift;
      walk_ray_of.reciprocal[a] = axes[a].reciprocal;
      walk_ray_of.origin[a]     = axes[a].origin;
    end
  endfunction
  function automatic test_ray_t test_ray_of(test_axis_t [Axes-1:0] axes);
    for (int unsigned a = 0; a < Axes; a++) begin
      test_ray_of.direction[a] = axes[a].direction;
      test_ray_of.origin[a]    = axes[a].origin;
    end
  endfunction

  // What the result unit has to know of a ray.
  typedef struct packed {
    ray_tag_t                  tag;
    rt_contract_pkg::flag_t    any;
    rt_contract_pkg::t_limit_t t_max;
  } ray_info_t;

  // The tree that a context walks. All 0 in a configuration of one level.
  typedef struct packed {
    logic                         level;    // 1 in an object
    logic                         fresh;    // no leaf of the object has been reached yet
    logic                         resumes;  // back from an object: `node` is the leaf that sent it there
    rt_contract_pkg::pair_index_t root;     // the tree's root is the left half of this pair
  } tree_t;

  // Where a context goes on in its lane.
  typedef struct packed {
    tree_t                        tree;
    rt_contract_pkg::position_t   plane;   // of the exit face, on the way up
    rt_contract_pkg::face_t       face;
    rt_contract_pkg::t_t          t;
    logic [31:0]                  steps;
    rt_contract_pkg::status_t     fault;   // not EventGoOn: what the context finishes with
    logic                         up;      // climb: read `parent`; otherwise descend: read `node`
    rt_contract_pkg::node_index_t parent;
    rt_contract_pkg::node_index_t node;
    rt_contract_pkg::t_limit_t    t_near;    // t of the best hit, t_max without one; used with Config.leaf_returns
  } launch_t;

  // What a lane says about a ctx: it has arrived at a leaf (event EventGoOn), or it ends.
  typedef struct packed {
    rt_contract_pkg::status_t     event_code;
    rt_contract_pkg::pair_index_t leaf;
    leaf_size_t                   size;
    rt_contract_pkg::node_index_t node;
    rt_contract_pkg::t_t          t;
    logic [31:0]                  steps;       // with this one; where a climb has ended, without
    logic                         level;       // as launched (tree_t)
    logic                         fresh;
    logic                         resumes;
  } arrival_t;

  // How a leaf is left, as far as it is known before the tests.
  typedef struct packed {
    rt_contract_pkg::leaf_exit_out_record_t exit;
    rt_contract_pkg::node_index_t           link;
    rt_contract_pkg::node_index_t           parent;
    rt_contract_pkg::node_index_t           node;
    logic [31:0]                            steps;  // after the last test
  } leave_t;

  // References of a leaf.
  typedef struct packed {
    logic                                                                 level;      // 1 in an object
    logic                                                                 instances;  // numbers of instance records
    rt_contract_pkg::triangle_index_t                                     first;      // those before it are done
    logic [31:0]                                                          steps;      // before the one with number 0
    rt_contract_pkg::list_index_t                                         list_base;
    rt_contract_pkg::triangle_index_t                                     count;
    rt_contract_pkg::triangle_index_t [rt_contract_pkg::LeafInline-1:0]   refs;
  } references_t;

  // The best hit of a ray, as far as entries depend on it. A hit outside of all instances leaves the number as it was.
  typedef struct packed {
    rt_contract_pkg::t_limit_t        t;
    rt_contract_pkg::triangle_index_t number;  // of its instance
  } found_t;

  // A context that enters an object: what its way back and its hits depend on.
  typedef struct packed {
    rt_contract_pkg::t_limit_t        t_max;     // of the object's ray
    rt_contract_pkg::triangle_index_t number;    // of the instance
    rt_contract_pkg::triangle_id_t    first_id;
    rt_contract_pkg::entry_scale_t    scale;
    rt_contract_pkg::entry_start_t    start;
    rt_contract_pkg::pair_index_t     root;
  } entered_t;
  // Where it comes back to.
  typedef struct packed {
    rt_contract_pkg::node_index_t node;
    rt_contract_pkg::t_t          t;
  } saved_t;
  // And the leaf that it comes from, as rt_entry passes it on.
  typedef struct packed {
    logic                             last;      // no reference is left in the leaf
    rt_contract_pkg::triangle_index_t next;      // references done, with this one
    logic [31:0]                      steps;     // with this one
    rt_contract_pkg::triangle_index_t number;
    rt_contract_pkg::triangle_id_t    first_id;
    rt_contract_pkg::pair_index_t     root;
  } entry_t;

  // The header, as far as the walk needs it.
  typedef struct packed {
    logic [AddrBits-1:0]              instance_base;
    logic                             two_levels;
    logic [31:0]                      instance_count;  // 0 in an image of one level
    logic [AddrBits-1:0]              pair_base;
    logic [AddrBits-1:0]              leaf_base;
    logic [AddrBits-1:0]              list_base;
    logic [AddrBits-1:0]              triangle_base;
    logic [31:0]                      pair_count;
    logic [31:0]                      leaf_count;
    logic [31:0]                      list_count;
    logic [31:0]                      triangle_count;
    logic [31:0]                      step_limit;
    rt_contract_pkg::position_t [5:0] box;
  } image_view_t;

  // One-clock events for the counters of a unit that works on contexts.
  typedef struct packed {
    logic hit;      // cache
    logic miss;
    logic busy;     // did something useful in this clock
    logic starved;  // had no context to work on
  } unit_events_t;

endpackage
