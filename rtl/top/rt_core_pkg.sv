// Configurations of the core and the records that travel between its units.
//
// Purpose     One place for what a build may choose. rt_top takes one of the named configurations; every width below follows from it.
// Rules       contexts_per_lane (16 or more), lines and ways are powers of two; data_bits is 64 or 128; mshrs is 2 .. 8; lanes is 1 .. 8.
package rt_core_pkg;

  typedef struct packed {
    logic [31:0] lanes;              // traversal lanes, one step a clock each
    logic [31:0] contexts_per_lane;  // rays in flight a lane
    logic [31:0] data_bits;          // AXI data bus
    logic [31:0] node_pairs;         // node pairs of the node cache, 16 bytes each; every lane has a copy
    logic [31:0] node_line_pairs;    // pairs a line: 1, 2 or 4
    logic [31:0] leaf_lines;
    logic [31:0] list_lines;
    logic [31:0] triangle_lines;     // 48 bytes each
    logic [31:0] ways;               // 1 or 2, every cache
    logic [31:0] mshrs;              // misses in flight a cache
    logic [31:0] mail_entries;       // entries a ray, 0 for none
  } config_t;

  // One lane: for tests and for small parts.
  localparam config_t ConfigSmall = '{
      lanes: 1, contexts_per_lane: 64, data_bits: 64, node_pairs: 1024, node_line_pairs: 4,
      leaf_lines: 256, list_lines: 64, triangle_lines: 512, ways: 2, mshrs: 8, mail_entries: 8};
  // ECP5-85F: four lanes and 128 contexts. Here the bus is the limit, so a line is one pair: nothing is read that no ray asked for.
  localparam config_t ConfigEcp5 = '{
      lanes: 4, contexts_per_lane: 32, data_bits: 64, node_pairs: 2048, node_line_pairs: 1,
      leaf_lines: 1024, list_lines: 128, triangle_lines: 1024, ways: 2, mshrs: 8, mail_entries: 8};
  // The same with fewer lanes, and with six; then the block RAMs of the part hold half a node cache for each.
  localparam config_t ConfigEcp5l1 = '{
      lanes: 1, contexts_per_lane: 32, data_bits: 64, node_pairs: 2048, node_line_pairs: 1,
      leaf_lines: 1024, list_lines: 128, triangle_lines: 1024, ways: 2, mshrs: 8, mail_entries: 8};
  localparam config_t ConfigEcp5l2 = '{
      lanes: 2, contexts_per_lane: 32, data_bits: 64, node_pairs: 2048, node_line_pairs: 1,
      leaf_lines: 1024, list_lines: 128, triangle_lines: 1024, ways: 2, mshrs: 8, mail_entries: 8};
  localparam config_t ConfigEcp5l6 = '{
      lanes: 6, contexts_per_lane: 32, data_bits: 64, node_pairs: 1024, node_line_pairs: 1,
      leaf_lines: 1024, list_lines: 128, triangle_lines: 1024, ways: 2, mshrs: 8, mail_entries: 8};
  // Four lanes with a bus of 16 bytes. Now lanes are the limit, so a line is two pairs (fewer misses), and twice as many contexts keep them busy.
  localparam config_t ConfigEcp5x128 = '{
      lanes: 4, contexts_per_lane: 64, data_bits: 128, node_pairs: 2048, node_line_pairs: 2,
      leaf_lines: 1024, list_lines: 128, triangle_lines: 1024, ways: 2, mshrs: 8, mail_entries: 8};
  // For larger parts.
  localparam config_t ConfigWide = '{
      lanes: 8, contexts_per_lane: 32, data_bits: 128, node_pairs: 1024, node_line_pairs: 2,
      leaf_lines: 512, list_lines: 64, triangle_lines: 1024, ways: 2, mshrs: 8, mail_entries: 8};

  localparam int unsigned AddrBits = 40;
  localparam int unsigned LineShift = 6;  // 64-byte lines
  localparam int unsigned MshrIdBits = 3;
  localparam int unsigned SourceBits = 4;
  localparam int unsigned IdBits = SourceBits + MshrIdBits;

  // Sources of read requests: the upper bits of ARID.
  localparam int unsigned SourceHeader = 0;
  localparam int unsigned SourceRay = 1;
  localparam int unsigned SourceLeaf = 2;
  localparam int unsigned SourceList = 3;
  localparam int unsigned SourceTriangle = 4;
  localparam int unsigned SourceNode = 5;
  localparam int unsigned Sources = 6;

  typedef struct packed {
    logic [AddrBits-1:0]   addr;
    logic [7:0]            len;  // beats - 1
    logic [SourceBits-1:0] source;
    logic [MshrIdBits-1:0] mshr;
  } read_request_t;

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
    logic [31:0]               index;
    rt_contract_pkg::flag_t    any;
    rt_contract_pkg::t_limit_t t_max;
  } ray_info_t;

  // Where a context goes on in its lane.
  typedef struct packed {
    rt_contract_pkg::position_t   plane;   // of the exit face, on the way up
    rt_contract_pkg::face_t       face;
    rt_contract_pkg::t_t          t;
    logic [31:0]                  steps;
    rt_contract_pkg::status_t     fault;   // not EventGoOn: what the context finishes with
    logic                         up;      // climb: read `parent`; otherwise descend: read `node`
    rt_contract_pkg::node_index_t parent;
    rt_contract_pkg::node_index_t node;
  } launch_t;

  // What a lane says about a ctx: it has arrived at a leaf (event EventGoOn), or it ends.
  typedef struct packed {
    rt_contract_pkg::status_t     event_code;
    rt_contract_pkg::pair_index_t leaf;
    leaf_size_t                   size;
    rt_contract_pkg::node_index_t node;
    rt_contract_pkg::t_t          t;
    logic [31:0]                  steps;
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
    logic [31:0]                                                          steps;  // before the first test
    rt_contract_pkg::list_index_t                                         list_base;
    rt_contract_pkg::triangle_index_t                                     count;
    rt_contract_pkg::triangle_index_t [rt_contract_pkg::LeafInline-1:0]   refs;
  } references_t;

  // The header, as far as the walk needs it.
  typedef struct packed {
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

  // Counters of the register map, in its order, and the largest increment of each.
  localparam int unsigned CounterCount = 34;
  localparam int unsigned CounterStepBits = 9;
  typedef logic [CounterStepBits-1:0] counter_step_t;
  function automatic counter_step_t [CounterCount-1:0] counter_max_step(config_t config_i);
    counter_step_t [CounterCount-1:0] result;
    for (int unsigned i = 0; i < CounterCount; i++) result[i] = counter_step_t'(1);
    result[3]  = counter_step_t'(config_i.lanes);  // down, up
    result[4]  = counter_step_t'(config_i.lanes);
    result[8]  = counter_step_t'(config_i.lanes);  // node_hits
    result[18] = counter_step_t'(config_i.lanes);  // lane_busy, lane_starved, lane_blocked
    result[19] = counter_step_t'(config_i.lanes);
    result[20] = counter_step_t'(config_i.lanes);
    result[33] = counter_step_t'(config_i.lanes * config_i.contexts_per_lane);  // context_clocks
    return result;
  endfunction

  // One-clock events for the counters of a unit that works on contexts.
  typedef struct packed {
    logic hit;      // cache
    logic miss;
    logic busy;     // did something useful in this clock
    logic starved;  // had no context to work on
  } unit_events_t;

endpackage
