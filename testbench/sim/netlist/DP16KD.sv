// SPDX-License-Identifier: Apache-2.0
// DP16KD: 18 Kbit block RAM of an ECP5, as Yosys uses it, in two widths.
//
// 36 / 36     Pseudo dual port, 512 words of 36 bits. A writes when CEA and WEA: word ADA[13:5], data {DIB, DIA}, byte enables (9 bits) ADA[3:0]. B
//             reads when CEB: word ADB[13:5] to {DOB, DOA}.
// 18 / 18     True dual port, 1024 words of 18 bits. Port A takes part when CEA: word ADA[13:4]; with WEA it writes the bytes ADA[1:0] and, as
//             READBEFOREWRITE says, shows the word as it was. B reads when CEB: word ADB[13:4] to DOB.
// Latency     1 clock from the edge that sees the enable; outputs stay until the next one. With REGMODE_B OUTREG (and REGMODE_A at 36 bits, where
//             the halves are those of the two ports) a register behind them takes them in every clock: one clock more.
// Collision   The word that A writes and B reads in the same clock is undefined: B gets the complement of the new word, which no test overlooks.
// Contents    INITVAL_00 .. INITVAL_3F: 16 words of 18 bits each, 20 bits apart. Outputs start at 0.
// Modes       Any other mode is an error: parameters at elaboration; resets, chip selects, B writing and two clocks in simulation.
// Source      Lattice TN1264, ECP5 and ECP5-5G Memory Usage Guide; halves of the 36-bit port and initial values as in Yosys' brams_map_16kd.v.
module DP16KD #(
    parameter DATA_WIDTH_A = 18,
    parameter DATA_WIDTH_B = 18,
    parameter REGMODE_A = "NOREG",
    parameter REGMODE_B = "NOREG",
    parameter RESETMODE = "SYNC",
    parameter ASYNC_RESET_RELEASE = "SYNC",
    parameter CSDECODE_A = "0b000",
    parameter CSDECODE_B = "0b000",
    parameter WRITEMODE_A = "NORMAL",
    parameter WRITEMODE_B = "NORMAL",
    parameter CLKAMUX = "CLKA",
    parameter CLKBMUX = "CLKB",
    parameter GSR = "ENABLED",
    parameter [319:0] INITVAL_00 = '0, INITVAL_01 = '0, INITVAL_02 = '0, INITVAL_03 = '0,
    parameter [319:0] INITVAL_04 = '0, INITVAL_05 = '0, INITVAL_06 = '0, INITVAL_07 = '0,
    parameter [319:0] INITVAL_08 = '0, INITVAL_09 = '0, INITVAL_0A = '0, INITVAL_0B = '0,
    parameter [319:0] INITVAL_0C = '0, INITVAL_0D = '0, INITVAL_0E = '0, INITVAL_0F = '0,
    parameter [319:0] INITVAL_10 = '0, INITVAL_11 = '0, INITVAL_12 = '0, INITVAL_13 = '0,
    parameter [319:0] INITVAL_14 = '0, INITVAL_15 = '0, INITVAL_16 = '0, INITVAL_17 = '0,
    parameter [319:0] INITVAL_18 = '0, INITVAL_19 = '0, INITVAL_1A = '0, INITVAL_1B = '0,
    parameter [319:0] INITVAL_1C = '0, INITVAL_1D = '0, INITVAL_1E = '0, INITVAL_1F = '0,
    parameter [319:0] INITVAL_20 = '0, INITVAL_21 = '0, INITVAL_22 = '0, INITVAL_23 = '0,
    parameter [319:0] INITVAL_24 = '0, INITVAL_25 = '0, INITVAL_26 = '0, INITVAL_27 = '0,
    parameter [319:0] INITVAL_28 = '0, INITVAL_29 = '0, INITVAL_2A = '0, INITVAL_2B = '0,
    parameter [319:0] INITVAL_2C = '0, INITVAL_2D = '0, INITVAL_2E = '0, INITVAL_2F = '0,
    parameter [319:0] INITVAL_30 = '0, INITVAL_31 = '0, INITVAL_32 = '0, INITVAL_33 = '0,
    parameter [319:0] INITVAL_34 = '0, INITVAL_35 = '0, INITVAL_36 = '0, INITVAL_37 = '0,
    parameter [319:0] INITVAL_38 = '0, INITVAL_39 = '0, INITVAL_3A = '0, INITVAL_3B = '0,
    parameter [319:0] INITVAL_3C = '0, INITVAL_3D = '0, INITVAL_3E = '0, INITVAL_3F = '0,
    parameter INIT_DATA = "STATIC"
) (
    input DIA17, DIA16, DIA15, DIA14, DIA13, DIA12, DIA11, DIA10, DIA9, DIA8, DIA7, DIA6, DIA5, DIA4, DIA3, DIA2, DIA1, DIA0,
    input ADA13, ADA12, ADA11, ADA10, ADA9, ADA8, ADA7, ADA6, ADA5, ADA4, ADA3, ADA2, ADA1, ADA0,
    input CEA, OCEA, CLKA, WEA, RSTA, CSA2, CSA1, CSA0,
    output DOA17, DOA16, DOA15, DOA14, DOA13, DOA12, DOA11, DOA10, DOA9, DOA8, DOA7, DOA6, DOA5, DOA4, DOA3, DOA2, DOA1, DOA0,
    input DIB17, DIB16, DIB15, DIB14, DIB13, DIB12, DIB11, DIB10, DIB9, DIB8, DIB7, DIB6, DIB5, DIB4, DIB3, DIB2, DIB1, DIB0,
    input ADB13, ADB12, ADB11, ADB10, ADB9, ADB8, ADB7, ADB6, ADB5, ADB4, ADB3, ADB2, ADB1, ADB0,
    input CEB, OCEB, CLKB, WEB, RSTB, CSB2, CSB1, CSB0,
    output DOB17, DOB16, DOB15, DOB14, DOB13, DOB12, DOB11, DOB10, DOB9, DOB8, DOB7, DOB6, DOB5, DOB4, DOB3, DOB2, DOB1, DOB0
);
  localparam bit Wide = DATA_WIDTH_A == 36;
  localparam int unsigned ByteBits = 9;
  localparam int unsigned HalfBits = 18;
  localparam int unsigned Words = 1024;
  localparam int unsigned InitStride = 20;
  // Not one vector: Verilator 5.006 loses the upper bits of a concatenation this wide.
  localparam logic [319:0] Init[64] = '{
      INITVAL_00, INITVAL_01, INITVAL_02, INITVAL_03, INITVAL_04, INITVAL_05, INITVAL_06, INITVAL_07,
      INITVAL_08, INITVAL_09, INITVAL_0A, INITVAL_0B, INITVAL_0C, INITVAL_0D, INITVAL_0E, INITVAL_0F,
      INITVAL_10, INITVAL_11, INITVAL_12, INITVAL_13, INITVAL_14, INITVAL_15, INITVAL_16, INITVAL_17,
      INITVAL_18, INITVAL_19, INITVAL_1A, INITVAL_1B, INITVAL_1C, INITVAL_1D, INITVAL_1E, INITVAL_1F,
      INITVAL_20, INITVAL_21, INITVAL_22, INITVAL_23, INITVAL_24, INITVAL_25, INITVAL_26, INITVAL_27,
      INITVAL_28, INITVAL_29, INITVAL_2A, INITVAL_2B, INITVAL_2C, INITVAL_2D, INITVAL_2E, INITVAL_2F,
      INITVAL_30, INITVAL_31, INITVAL_32, INITVAL_33, INITVAL_34, INITVAL_35, INITVAL_36, INITVAL_37,
      INITVAL_38, INITVAL_39, INITVAL_3A, INITVAL_3B, INITVAL_3C, INITVAL_3D, INITVAL_3E, INITVAL_3F
  };

  if (DATA_WIDTH_A != DATA_WIDTH_B || (DATA_WIDTH_A != 36 && DATA_WIDTH_A != 18)) begin : gen_no_width
    $error("DP16KD: only widths 36 / 36 and 18 / 18 are modelled");
  end
  if (!Wide && WRITEMODE_A != "READBEFOREWRITE") begin : gen_no_write_mode
    $error("DP16KD: only WRITEMODE_A READBEFOREWRITE is modelled at 18 bits");
  end
  localparam bit Late = REGMODE_B == "OUTREG";
  if (REGMODE_A != (Wide && Late ? "OUTREG" : "NOREG") || (REGMODE_B != "NOREG" && !Late)) begin : gen_no_register
    $error("DP16KD: only output registers of port B are modelled, and at 36 bits those of both");
  end
  if (CSDECODE_A != "0b000" || CSDECODE_B != "0b000" || CLKAMUX != "CLKA" || CLKBMUX != "CLKB" || INIT_DATA != "STATIC") begin : gen_no_mux
    $error("DP16KD: chip select decoding, inverted clocks and INIT_DATA are not modelled");
  end

  logic [HalfBits-1:0] mem_q[Words];
  logic [HalfBits-1:0] doa_q, dob_q, doa_late_q, dob_late_q;
  logic [2*HalfBits-1:0] data, mask;
  logic [8:0] pair_a, pair_b;
  logic write, read, collision;
  initial begin
    for (int i = 0; i < Words; i++) mem_q[i] = Init[i/16][InitStride*(i%16)+:HalfBits];
    doa_q = '0;
    dob_q = '0;
  end

  assign write  = CEA && WEA;
  assign read   = CEB && !WEB;
  assign pair_a = {ADA13, ADA12, ADA11, ADA10, ADA9, ADA8, ADA7, ADA6, ADA5};
  assign pair_b = {ADB13, ADB12, ADB11, ADB10, ADB9, ADB8, ADB7, ADB6, ADB5};
  assign data   = {DIB17, DIB16, DIB15, DIB14, DIB13, DIB12, DIB11, DIB10, DIB9, DIB8, DIB7, DIB6, DIB5, DIB4, DIB3, DIB2, DIB1, DIB0,
                   DIA17, DIA16, DIA15, DIA14, DIA13, DIA12, DIA11, DIA10, DIA9, DIA8, DIA7, DIA6, DIA5, DIA4, DIA3, DIA2, DIA1, DIA0};
  assign mask   = {{ByteBits{ADA3}}, {ByteBits{ADA2}}, {ByteBits{ADA1}}, {ByteBits{ADA0}}};

  if (Wide) begin : gen_wide
    assign collision = write && read && pair_a == pair_b && {ADA3, ADA2, ADA1, ADA0} != '0;
    always_ff @(posedge CLKA) begin
      if (write) begin
        mem_q[{pair_a, 1'b0}] <= (mem_q[{pair_a, 1'b0}] & ~mask[HalfBits-1:0]) | (data[HalfBits-1:0] & mask[HalfBits-1:0]);
        mem_q[{pair_a, 1'b1}] <= (mem_q[{pair_a, 1'b1}] & ~mask[2*HalfBits-1:HalfBits]) | (data[2*HalfBits-1:HalfBits] & mask[2*HalfBits-1:HalfBits]);
      end
      if (read) {dob_q, doa_q} <= collision ? ~data : {mem_q[{pair_b, 1'b1}], mem_q[{pair_b, 1'b0}]};
    end
  end else begin : gen_narrow
    logic [9:0] word_a, word_b;
    assign word_a    = {pair_a, ADA4};
    assign word_b    = {pair_b, ADB4};
    assign collision = write && read && word_a == word_b && {ADA1, ADA0} != '0;
    always_ff @(posedge CLKA) begin
      if (write) mem_q[word_a] <= (mem_q[word_a] & ~mask[HalfBits-1:0]) | (data[HalfBits-1:0] & mask[HalfBits-1:0]);
      if (CEA) doa_q <= mem_q[word_a];
      if (read) dob_q <= collision ? ~data[HalfBits-1:0] : mem_q[word_b];
    end
  end

  always_ff @(posedge CLKB) begin
    doa_late_q <= doa_q;
    dob_late_q <= dob_q;
  end
  assign {DOA17, DOA16, DOA15, DOA14, DOA13, DOA12, DOA11, DOA10, DOA9, DOA8, DOA7, DOA6, DOA5, DOA4, DOA3, DOA2, DOA1, DOA0} =
      Wide && Late ? doa_late_q : doa_q;
  assign {DOB17, DOB16, DOB15, DOB14, DOB13, DOB12, DOB11, DOB10, DOB9, DOB8, DOB7, DOB6, DOB5, DOB4, DOB3, DOB2, DOB1, DOB0} =
      Late ? dob_late_q : dob_q;

  always_ff @(posedge CLKA) begin
    if (WEB) $error("DP16KD: port B writing is not modelled");
    if (RSTA || RSTB) $error("DP16KD: resets are not modelled");
    if (CSA2 || CSA1 || CSA0 || CSB2 || CSB1 || CSB0) $error("DP16KD: chip selects are not modelled");
    if (!OCEB || ((!Wide || Late) && !OCEA)) $error("DP16KD: OCE has no meaning without output registers; 0 is not modelled");
    if (!CLKB) $error("DP16KD: two clocks are not modelled");
  end
endmodule
