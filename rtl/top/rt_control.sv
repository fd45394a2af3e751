// Control of a run: header, checks, flush of the caches, rays, end; sticky faults.
//
// Sequence    start -> read the two header lines -> magic and version -> the four sections, each in three clocks -> caches are empty (their flush begins with
//             the start) -> rays -> done when all
//             hits are acknowledged. A header that cannot be used ends the run at once with image_fault, without a read outside of it.
// Source      read_header, section_fits in hls/top/trace.cpp.
`include "rt_assert.svh"
module rt_control #(
    parameter int unsigned DataBits = 64
) (
    input  logic                             clk_i,
    input  logic                             rst_ni,
    input  logic                             start_i,
    input  logic [rt_core_pkg::AddrBits-1:0] image_base_i,
    input  logic [31:0]                      image_lines_i,
    input  logic [31:0]                      ray_count_i,
    input  logic                             own_step_limit_i,
    input  logic [31:0]                      step_limit_i,
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
    output logic                             rays_start_o,
    input  logic                             hit_written_i,
    input  logic                             ray_fault_i,
    input  rt_contract_pkg::status_t         ray_fault_status_i,
    input  logic [31:0]                      ray_fault_ray_i,
    input  logic                             write_fault_i,
    input  logic [31:0]                      write_fault_ray_i,
    output logic                             started_o,
    output logic                             busy_o,
    output logic                             done_o,
    output logic [1:0]                       image_fault_o,
    output logic                             ray_fault_o,
    output rt_contract_pkg::status_t         first_fault_o,
    output logic [31:0]                      fault_ray_o,
    output logic                             write_fault_o,
    output logic [31:0]                      write_fault_ray_o
);
  localparam int unsigned HeaderBits = (rt_contract_pkg::HeaderBoxWord + 6) * 32;  // what is used of it
  localparam int unsigned HeaderBeats = rt_contract_pkg::HeaderBytes * 8 / DataBits;
  localparam int unsigned KeptBeats = (HeaderBits + DataBits - 1) / DataBits;
  localparam int unsigned BeatBits = $clog2(HeaderBeats);
  localparam int unsigned HeaderLines = rt_contract_pkg::HeaderBytes / 64;

  localparam logic [1:0] FaultNone = 2'd0;
  localparam logic [1:0] FaultHeader = 2'd1;
  localparam logic [1:0] FaultLayout = 2'd2;
  localparam logic [1:0] FaultBus = 2'd3;

  typedef enum logic [2:0] {
    Idle,
    Ask,
    Read,
    Check,
    Sections,
    Flush,
    Rays,
    Done
  } state_e;

  state_e                                  state_q;
  logic [KeptBeats-1:0][DataBits-1:0]      header_q;
  logic [31:0]                             word[HeaderBits/32];
  logic [BeatBits-1:0]                     beat_q;
  logic                                    bus_error_q;
  logic [1:0]                              section_q, fault_q;
  logic [31:0]                             written_q;
  rt_core_pkg::image_view_t                view_q;
  logic                                    ray_fault_q, write_fault_q, rays_start_q, flushing_q;
  rt_contract_pkg::status_t                first_fault_q;
  logic [31:0]                             fault_ray_q, write_fault_ray_q;

  for (genvar i = 0; i < HeaderBits / 32; i++) begin : gen_word
    assign word[i] = header_q[i*32/DataBits][i*32%DataBits+:32];
  end

  // --- one section: its place in the header, then the lines it needs and where it begins, then the verdict ---
  localparam int unsigned LinesBits = 40 - rt_core_pkg::LineShift;
  typedef enum logic [1:0] {
    Choose,
    Measure,
    Judge
  } phase_e;
  phase_e                           phase_q;
  logic [31:0]                      offset, count, offset_q;
  logic [39:0]                      bytes, bytes_q;
  logic [LinesBits:0]               section_end_q;
  logic [rt_core_pkg::AddrBits-1:0] section_base_q;
  always_comb begin
    offset = word[rt_contract_pkg::HeaderPairOffsetWord];
    count  = word[rt_contract_pkg::HeaderPairCountWord];
    bytes  = 40'(count) << $clog2(rt_contract_pkg::NodePairBytes);
    case (section_q)
      2'd1: begin
        offset = word[rt_contract_pkg::HeaderLeafOffsetWord];
        count  = word[rt_contract_pkg::HeaderLeafCountWord];
        bytes  = 40'(count) << $clog2(rt_contract_pkg::LeafBytes);
      end
      2'd2: begin
        offset = word[rt_contract_pkg::HeaderListOffsetWord];
        count  = word[rt_contract_pkg::HeaderListCountWord];
        bytes  = 40'(count) << 2;
      end
      2'd3: begin
        offset = word[rt_contract_pkg::HeaderTriangleOffsetWord];
        count  = word[rt_contract_pkg::HeaderTriangleCountWord];
        bytes  = 40'(count) << $clog2(rt_contract_pkg::TriangleBytes);
      end
      default: ;
    endcase
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
    image_base_q   <= image_base_i;
    image_lines_q  <= image_lines_i;
    offset_q       <= offset;
    bytes_q        <= bytes;
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
    if (hit_written_i) written_q <= written_q + 1'b1;
    case (state_q)
      Idle, Done: begin
        if (start_i) begin
          fault_q       <= image_lines_i < 32'(HeaderLines) ? FaultLayout : FaultNone;
          state_q       <= image_lines_i < 32'(HeaderLines) ? Done : Ask;
          beat_q        <= '0;
          section_q     <= '0;
          bus_error_q   <= 1'b0;
          written_q     <= '0;
          ray_fault_q   <= 1'b0;
          write_fault_q <= 1'b0;
        end
      end
      Ask: if (fetch_ready_i) state_q <= Read;
      Read: begin
        if (fill_valid_q) begin
          beat_q <= beat_q + 1'b1;
          for (int unsigned i = 0; i < KeptBeats; i++) if (beat_q == BeatBits'(i)) header_q[i] <= fill_data_q;
          if (fill_error_q) bus_error_q <= 1'b1;
          if (fill_last_q) state_q <= Check;
        end
      end
      Check: begin
        if (bus_error_q) begin
          fault_q <= FaultBus;
          state_q <= Done;
        end else if (word[rt_contract_pkg::HeaderMagicWord] != rt_contract_pkg::ImageMagic ||
                     word[rt_contract_pkg::HeaderVersionWord] != rt_contract_pkg::ImageVersion) begin
          fault_q <= FaultHeader;
          state_q <= Done;
        end else begin
          state_q <= Sections;
        end
        view_q.pair_count     <= word[rt_contract_pkg::HeaderPairCountWord];
        view_q.leaf_count     <= word[rt_contract_pkg::HeaderLeafCountWord];
        view_q.list_count     <= word[rt_contract_pkg::HeaderListCountWord];
        view_q.triangle_count <= word[rt_contract_pkg::HeaderTriangleCountWord];
        view_q.step_limit     <= own_step_limit_i ? step_limit_i : word[rt_contract_pkg::HeaderStepLimitWord];
        for (int unsigned face = 0; face < 6; face++) begin
          view_q.box[face] <= word[rt_contract_pkg::HeaderBoxWord+face][rt_contract_pkg::PositionBits-1:0];
        end
      end
      Sections: begin
        if (phase_q == Judge) begin
          case (section_q)
            2'd0: view_q.pair_base <= section_base_q;
            2'd1: view_q.leaf_base <= section_base_q;
            2'd2: view_q.list_base <= section_base_q;
            default: view_q.triangle_base <= section_base_q;
          endcase
          section_q <= section_q + 1'b1;
          if (section_end_q > (LinesBits + 1)'(image_lines_q)) begin
            fault_q <= FaultLayout;
            state_q <= Done;
          end else if (section_q == 2'd3) begin
            state_q <= Flush;
          end
        end
      end
      Flush: if (!flushing_q) state_q <= Rays;
      Rays: if (written_q == ray_count_i) state_q <= Done;
      default: state_q <= Idle;
    endcase
    if (ray_fault_i && !ray_fault_q) begin
      ray_fault_q   <= 1'b1;
      first_fault_q <= ray_fault_status_i;
      fault_ray_q   <= ray_fault_ray_i;
    end
    if (write_fault_i && !write_fault_q) begin
      write_fault_q     <= 1'b1;
      write_fault_ray_q <= write_fault_ray_i;
    end
    if (!rst_ni) begin
      state_q           <= Idle;
      rays_start_q      <= 1'b0;
      fault_q           <= FaultNone;
      ray_fault_q       <= 1'b0;
      write_fault_q     <= 1'b0;
      first_fault_q     <= '0;
      fault_ray_q       <= '0;
      write_fault_ray_q <= '0;
    end
  end

  assign fetch_valid_o = state_q == Ask;
  assign fetch_o = '{
          addr: image_base_q,
          len: 8'(HeaderBeats - 1),
          source: rt_core_pkg::SourceBits'(rt_core_pkg::SourceHeader),
          mshr: '0
      };
  assign view_o            = view_q;
  assign flush_o           = started_o;
  assign rays_start_o      = rays_start_q;
  assign started_o         = start_i && (state_q == Idle || state_q == Done);
  assign busy_o            = state_q != Idle && state_q != Done;
  assign done_o            = state_q == Done;
  assign image_fault_o     = fault_q;
  assign ray_fault_o       = ray_fault_q;
  assign first_fault_o     = first_fault_q;
  assign fault_ray_o       = fault_ray_q;
  assign write_fault_o     = write_fault_q;
  assign write_fault_ray_o = write_fault_ray_q;
endmodule
