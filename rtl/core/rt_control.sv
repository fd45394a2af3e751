// SPDX-License-Identifier: Apache-2.0
// Control of a run: header, checks, flush of the caches, rays, end; sticky faults.
//
// Sequence    start -> read the header, a line at a time, as a base may end a page of 4 KB -> magic and version -> the sections, each in three clocks: four,
//             and a fifth of instances in an image of two levels, which only a core of two levels reads
//             -> caches are empty (their flush begins with the start) -> rays -> drained: the sources are done and every ray that was taken has
//             retired -> done when the sinks are done too. A header that cannot be used ends the run at once with image_fault, without a read
//             outside of it.
// In flight   Rays are counted where they are taken and where their hits are; at most InFlight fit between the two.
// Source      read_header, section_fits in hls/top/trace.cpp.
`include "rt_assert.svh"
module rt_control #(
    parameter int unsigned DataBits = 64,
    parameter int unsigned Levels = 1,
    parameter int unsigned InFlight = 256
) (
    input  logic                             clk_i,
    input  logic                             rst_ni,
    input  logic                             start_i,
    input  rt_core_pkg::run_t                run_i,
    output rt_core_pkg::run_status_t         status_o,
    output logic                             fetch_valid_o,
    input  logic                             fetch_ready_i,
    output rt_core_pkg::read_request_t       fetch_o,
    input  logic                             fill_valid_i,
    input  logic [DataBits-1:0]              fill_data_i,
    input  logic                             fill_last_i,
    input  logic                             fill_error_i,
    output rt_core_pkg::image_view_t         view_o,
    output logic                             flush_o,
    input  logic                             flushing_i,
    output logic                             rays_start_o,    // from the next clock on rays are taken
    output logic                             rays_open_o,
    input  logic                             sources_done_i,  // no ray will come; falls in the clock after rays_start_o where some will
    output logic                             drained_o,
    input  logic                             sinks_done_i,    // all hits are where they belong
    input  logic                             ray_taken_i,
    input  logic                             hit_taken_i,
    input  logic                             hit_fault_i,     // and it carries an error
    input  rt_core_pkg::tagged_hit_t         hit_i
);
  localparam int unsigned HeaderBits = (rt_contract_pkg::HeaderBoxWord + 6) * 32;  // what is used of it
  localparam int unsigned HeaderBeats = rt_contract_pkg::HeaderBytes * 8 / DataBits;
  localparam int unsigned KeptBeats = (HeaderBits + DataBits - 1) / DataBits;
  localparam int unsigned BeatBits = $clog2(HeaderBeats);
  localparam int unsigned HeaderLines = rt_contract_pkg::HeaderBytes / 64;
  localparam int unsigned LineBeats = HeaderBeats / HeaderLines;
  localparam int unsigned SectionBits = Levels > 1 ? 3 : 2;
  localparam int unsigned SectionInstances = 4;
  localparam int unsigned InFlightBits = $clog2(InFlight + 1);
  `RT_ASSERT_INIT(HeaderIsLines, rt_contract_pkg::HeaderBytes == 64 * HeaderLines && HeaderBeats == LineBeats * HeaderLines)

  localparam logic [1:0] FaultNone = 2'd0;
  localparam logic [1:0] FaultHeader = 2'd1;
  localparam logic [1:0] FaultLayout = 2'd2;
  localparam logic [1:0] FaultBus = 2'd3;

  typedef enum logic [3:0] {
    Idle,
    Ask,
    Read,
    Check,
    Sections,
    Flush,
    Rays,
    Drained,
    Done
  } state_e;

  state_e                                  state_q;
  logic [KeptBeats-1:0][DataBits-1:0]      header_q;
  logic [31:0]                             word[HeaderBits/32];
  logic [BeatBits-1:0]                     beat_q;
  logic                                    bus_error_q;
  logic [1:0]                              fault_q;
  logic [SectionBits-1:0]                  section_q;
  logic                                    two_levels;
  logic [InFlightBits-1:0]                 in_flight_q;
  rt_core_pkg::image_view_t                view_q;
  logic                                    ray_fault_q, rays_start_q, flushing_q;
  rt_contract_pkg::status_t                first_fault_q;
  rt_core_pkg::ray_tag_t                   fault_tag_q;

  for (genvar i = 0; i < HeaderBits / 32; i++) begin : gen_word
    assign word[i] = header_q[i*32/DataBits][i*32%DataBits+:32];
  end

  assign two_levels = Levels > 1 && word[rt_contract_pkg::HeaderVersionWord] == rt_contract_pkg::ImageVersionTwoLevels;

  // --- one section: its place in the header, then the lines it needs and where it begins, then the verdict ---
  localparam int unsigned LinesBits = 40 - rt_core_pkg::LineShift;
  typedef enum logic [1:0] {
    Choose,
    Measure,
    Judge
  } phase_e;
  phase_e                           phase_q;
  logic [31:0]                      offset, count, offset_q;
  logic                             too_many, too_many_q;  // more records than an index can name
  function automatic logic exceeds(logic [31:0] value, int unsigned bits);  // value > 2^bits
    return (value >> (bits + 1)) != '0 || (value[bits] && (value & ((32'd1 << bits) - 1'b1)) != '0);
  endfunction
  logic [39:0]                      bytes, bytes_q;
  logic [LinesBits:0]               section_end_q;
  logic [rt_core_pkg::AddrBits-1:0] section_base_q;
  always_comb begin
    offset = word[rt_contract_pkg::HeaderPairOffsetWord];
    count  = word[rt_contract_pkg::HeaderPairCountWord];
    bytes  = 40'(count) << $clog2(rt_contract_pkg::NodePairBytes);
    case (section_q)
      SectionBits'(1): begin
        offset = word[rt_contract_pkg::HeaderLeafOffsetWord];
        count  = word[rt_contract_pkg::HeaderLeafCountWord];
        bytes  = 40'(count) << $clog2(rt_contract_pkg::LeafBytes);
      end
      SectionBits'(2): begin
        offset = word[rt_contract_pkg::HeaderListOffsetWord];
        count  = word[rt_contract_pkg::HeaderListCountWord];
        bytes  = 40'(count) << 2;
      end
      SectionBits'(3): begin
        offset = word[rt_contract_pkg::HeaderTriangleOffsetWord];
        count  = word[rt_contract_pkg::HeaderTriangleCountWord];
        bytes  = 40'(count) << $clog2(rt_contract_pkg::TriangleBytes);
      end
      default: ;
    endcase
    case (section_q)
      SectionBits'(2): too_many = exceeds(count, rt_contract_pkg::ListIndexBits);
      SectionBits'(3): too_many = exceeds(count, rt_contract_pkg::TriangleIndexBits);
      default: too_many = exceeds(count, rt_contract_pkg::PairIndexBits);
    endcase
    if (32'(section_q) == SectionInstances) begin
      offset   = word[rt_contract_pkg::HeaderInstanceOffsetWord];
      count    = word[rt_contract_pkg::HeaderInstanceCountWord];
      bytes    = 40'(count) << $clog2(rt_contract_pkg::InstanceBytes);
      too_many = exceeds(count, rt_contract_pkg::TriangleIndexBits);
    end
  end
  logic [rt_core_pkg::AddrBits-1:0] image_base_q;  // as the host wrote it before the start
  logic [31:0]                      image_lines_q;
  logic                             fill_valid_q, fill_last_q, fill_error_q;
  logic [DataBits-1:0]              fill_data_q;
  always_ff @(posedge clk_i) begin
    fill_valid_q <= fill_valid_i && rst_ni;
    if (fill_valid_i) begin
      fill_data_q  <= fill_data_i;
      fill_last_q  <= fill_last_i;
      fill_error_q <= fill_error_i;
    end
    image_base_q   <= run_i.image_base;
    image_lines_q  <= run_i.image_lines;
    offset_q       <= offset;
    bytes_q        <= bytes;
    too_many_q     <= too_many;
    section_end_q  <= (LinesBits + 1)'((bytes_q + 40'd63) >> rt_core_pkg::LineShift) + (LinesBits + 1)'(offset_q);
    section_base_q <= image_base_q + (rt_core_pkg::AddrBits'(offset_q) << rt_core_pkg::LineShift);
    case (phase_q)
      Choose: if (state_q == Sections) phase_q <= Measure;
      Measure: phase_q <= Judge;
      default: phase_q <= Choose;
    endcase
    if (!rst_ni) phase_q <= Choose;
  end

  always_ff @(posedge clk_i) begin
    // The flush begins with the run and lasts longer than a register.
    flushing_q   <= flushing_i;
    rays_start_q <= state_q == Flush && !flushing_q;
    in_flight_q  <= in_flight_q + InFlightBits'(ray_taken_i) - InFlightBits'(hit_taken_i);
    case (state_q)
      Idle, Done: begin
        if (start_i) begin
          fault_q       <= run_i.image_lines < 32'(HeaderLines) ? FaultLayout : FaultNone;
          state_q       <= run_i.image_lines < 32'(HeaderLines) ? Done : Ask;
          beat_q        <= '0;
          section_q     <= '0;
          bus_error_q   <= 1'b0;
          ray_fault_q   <= 1'b0;
        end
      end
      Ask: if (fetch_ready_i) state_q <= Read;
      Read: begin
        if (fill_valid_q) begin
          beat_q <= beat_q + 1'b1;
          for (int unsigned i = 0; i < KeptBeats; i++) if (beat_q == BeatBits'(i)) header_q[i] <= fill_data_q;
          if (fill_error_q) bus_error_q <= 1'b1;
          if (fill_last_q) state_q <= beat_q == BeatBits'(HeaderBeats - 1) ? Check : Ask;
        end
      end
      Check: begin
        if (bus_error_q) begin
          fault_q <= FaultBus;
          state_q <= Done;
        end else if (word[rt_contract_pkg::HeaderMagicWord] != rt_contract_pkg::ImageMagic ||
                     (word[rt_contract_pkg::HeaderVersionWord] != rt_contract_pkg::ImageVersion && !two_levels)) begin
          fault_q <= FaultHeader;
          state_q <= Done;
        end else begin
          state_q <= Sections;
        end
        view_q.pair_count     <= word[rt_contract_pkg::HeaderPairCountWord];
        view_q.leaf_count     <= word[rt_contract_pkg::HeaderLeafCountWord];
        view_q.list_count     <= word[rt_contract_pkg::HeaderListCountWord];
        view_q.triangle_count <= word[rt_contract_pkg::HeaderTriangleCountWord];
        view_q.instance_count <= two_levels ? word[rt_contract_pkg::HeaderInstanceCountWord] : '0;
        view_q.step_limit     <= run_i.own_step_limit ? run_i.step_limit : word[rt_contract_pkg::HeaderStepLimitWord];
        for (int unsigned face = 0; face < 6; face++) begin
          view_q.box[face] <= word[rt_contract_pkg::HeaderBoxWord+face][rt_contract_pkg::PositionBits-1:0];
        end
      end
      Sections: begin
        if (phase_q == Judge) begin
          case (section_q)
            SectionBits'(0): view_q.pair_base <= section_base_q;
            SectionBits'(1): view_q.leaf_base <= section_base_q;
            SectionBits'(2): view_q.list_base <= section_base_q;
            SectionBits'(3): view_q.triangle_base <= section_base_q;
            default: view_q.instance_base <= section_base_q;
          endcase
          section_q <= section_q + 1'b1;
          if (section_end_q > (LinesBits + 1)'(image_lines_q) || too_many_q) begin
            fault_q <= FaultLayout;
            state_q <= Done;
          end else if (section_q == (two_levels ? SectionBits'(SectionInstances) : SectionBits'(3))) begin
            state_q <= Flush;
          end
        end
      end
      Flush: if (!flushing_q) state_q <= Rays;
      // The answer of the sources to the start is there a clock after it.
      Rays: if (!rays_start_q && sources_done_i && !ray_taken_i && in_flight_q == '0) state_q <= Drained;
      Drained: if (sinks_done_i) state_q <= Done;
      default: state_q <= Idle;
    endcase
    if (hit_fault_i && !ray_fault_q) begin
      ray_fault_q   <= 1'b1;
      first_fault_q <= hit_i.hit.status;
      fault_tag_q   <= hit_i.tag;
    end
    if (!rst_ni) begin
      state_q           <= Idle;
      rays_start_q      <= 1'b0;
      fault_q           <= FaultNone;
      ray_fault_q       <= 1'b0;
      first_fault_q     <= '0;
      fault_tag_q       <= '0;
      in_flight_q       <= '0;
    end
  end

  assign fetch_valid_o = state_q == Ask;
  assign fetch_o = '{
          // The line of the next beat.
          addr: image_base_q + (rt_core_pkg::AddrBits'(beat_q) << $clog2(DataBits / 8)),
          len: 8'(LineBeats - 1),
          source: rt_core_pkg::SourceBits'(rt_config_pkg::SourceHeader),
          mshr: '0
      };
  assign view_o            = view_q;
  assign flush_o           = status_o.started;
  assign rays_start_o      = rays_start_q;
  assign rays_open_o       = state_q == Rays && !rays_start_q;
  assign drained_o         = state_q == Drained;
  assign status_o = '{
          started: start_i && (state_q == Idle || state_q == Done),
          busy: state_q != Idle && state_q != Done,
          done: state_q == Done,
          image_fault: fault_q,
          ray_fault: ray_fault_q,
          first_fault: first_fault_q,
          fault_tag: fault_tag_q
      };

  `RT_ASSERT(RaysFit, in_flight_q <= InFlightBits'(InFlight))
  `RT_ASSERT(HitsAreOfRays, !hit_taken_i || in_flight_q != '0)
endmodule
