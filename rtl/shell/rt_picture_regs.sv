// SPDX-License-Identifier: Apache-2.0
// Registers of pictures: words behind the register file, all of them at hand at once.
//
// Access      req_i for a clock, with what it wants; read_done_o with data_o, or write_done_o, answers it. A write while open_i is 0 is answered and ignored.
// Latency     1.
module rt_picture_regs #(
    localparam int unsigned Words = 32,
    localparam int unsigned IndexBits = $clog2(Words)
) (
    input  logic                   clk_i,
    input  logic                   rst_ni,
    input  logic                   open_i,
    input  logic                   req_i,
    input  logic                   write_i,
    input  logic [IndexBits-1:0]   index_i,
    input  logic [31:0]            data_i,
    input  logic [31:0]            bits_i,
    output logic                   read_done_o,
    output logic                   write_done_o,
    output logic [31:0]            data_o,
    output logic [Words-1:0][31:0] words_o
);
  logic [Words-1:0][31:0] words_q;
  logic [31:0]            data_q;
  logic                   read_done_q, write_done_q;
  for (genvar w = 0; w < int'(Words); w++) begin : gen_word
    always_ff @(posedge clk_i) begin
      if (req_i && write_i && open_i && index_i == IndexBits'(w)) words_q[w] <= (words_q[w] & ~bits_i) | (data_i & bits_i);
      if (!rst_ni) words_q[w] <= '0;
    end
  end
  always_ff @(posedge clk_i) begin
    read_done_q  <= req_i && !write_i && rst_ni;
    write_done_q <= req_i && write_i && rst_ni;
    data_q       <= words_q[index_i];
  end
  assign read_done_o  = read_done_q;
  assign write_done_o = write_done_q;
  assign data_o       = data_q;
  assign words_o      = words_q;
endmodule
