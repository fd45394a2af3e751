// SPDX-License-Identifier: Apache-2.0
// The models of ECP5 cells in testbench/sim/netlist/, with vectors as ports: multipliers and block RAMs (of both widths) without and with
// registers.
module tb_cells (
    input  logic        clk_i,
    input  logic        rst_ni,  // nothing happens while 0: inputs start with random values
    input  logic [17:0] mul_a_i,
    input  logic [17:0] mul_b_i,
    input  logic        mul_signed_a_i,
    input  logic        mul_signed_b_i,
    input  logic        mul_source_i,
    input  logic        mul_enable_i,
    output logic [35:0] mul_p_o[4],

    input  logic        a_enable_i,
    input  logic        a_write_i,
    input  logic [13:0] a_addr_i,  // the low bits are byte enables
    input  logic        b_enable_i,
    input  logic        b_write_i,
    input  logic        b_reset_i,
    input  logic [13:0] b_addr_i,
    input  logic [35:0] data_i,
    output logic [35:0] wide_o,
    output logic [17:0] narrow_a_o,
    output logic [17:0] narrow_b_o,
    output logic [35:0] wide_late_o,
    output logic [17:0] narrow_b_late_o
);
  localparam logic [17:0] Zero = '0;
  // Contents at the start: 16 words of 18 bits, 20 bits apart; the first and the last 16 of each RAM.
  function automatic logic [319:0] words(input int first, input int step);
    for (int i = 0; i < 16; i++) words[20*i+:20] = 20'({2'b00, 18'(first + step * i)});
  endfunction

  // Without registers, with those of the inputs, of the output, of both.
  for (genvar mode = 0; mode < 4; mode++) begin : gen_mul
    localparam bit Inputs = mode % 2 == 1;
    localparam bit Output = mode >= 2;
    logic [35:0] mul_p;
    assign mul_p_o[mode] = mul_p;
    MULT18X18D #(
        .REG_INPUTA_CLK(Inputs ? "CLK0" : "NONE"),
        .REG_INPUTB_CLK(Inputs ? "CLK0" : "NONE"),
        .REG_OUTPUT_CLK(Output ? "CLK0" : "NONE")
    ) u_mul (
        .A17(mul_a_i[17]), .A16(mul_a_i[16]), .A15(mul_a_i[15]), .A14(mul_a_i[14]), .A13(mul_a_i[13]), .A12(mul_a_i[12]),
        .A11(mul_a_i[11]), .A10(mul_a_i[10]), .A9(mul_a_i[9]), .A8(mul_a_i[8]), .A7(mul_a_i[7]), .A6(mul_a_i[6]),
        .A5(mul_a_i[5]), .A4(mul_a_i[4]), .A3(mul_a_i[3]), .A2(mul_a_i[2]), .A1(mul_a_i[1]), .A0(mul_a_i[0]),
        .B17(mul_b_i[17]), .B16(mul_b_i[16]), .B15(mul_b_i[15]), .B14(mul_b_i[14]), .B13(mul_b_i[13]), .B12(mul_b_i[12]),
        .B11(mul_b_i[11]), .B10(mul_b_i[10]), .B9(mul_b_i[9]), .B8(mul_b_i[8]), .B7(mul_b_i[7]), .B6(mul_b_i[6]),
        .B5(mul_b_i[5]), .B4(mul_b_i[4]), .B3(mul_b_i[3]), .B2(mul_b_i[2]), .B1(mul_b_i[1]), .B0(mul_b_i[0]),
        .C17(Zero[17]), .C16(Zero[16]), .C15(Zero[15]), .C14(Zero[14]), .C13(Zero[13]), .C12(Zero[12]),
        .C11(Zero[11]), .C10(Zero[10]), .C9(Zero[9]), .C8(Zero[8]), .C7(Zero[7]), .C6(Zero[6]),
        .C5(Zero[5]), .C4(Zero[4]), .C3(Zero[3]), .C2(Zero[2]), .C1(Zero[1]), .C0(Zero[0]),
        .P35(mul_p[35]), .P34(mul_p[34]), .P33(mul_p[33]), .P32(mul_p[32]), .P31(mul_p[31]), .P30(mul_p[30]),
        .P29(mul_p[29]), .P28(mul_p[28]), .P27(mul_p[27]), .P26(mul_p[26]), .P25(mul_p[25]), .P24(mul_p[24]),
        .P23(mul_p[23]), .P22(mul_p[22]), .P21(mul_p[21]), .P20(mul_p[20]), .P19(mul_p[19]), .P18(mul_p[18]),
        .P17(mul_p[17]), .P16(mul_p[16]), .P15(mul_p[15]), .P14(mul_p[14]), .P13(mul_p[13]), .P12(mul_p[12]),
        .P11(mul_p[11]), .P10(mul_p[10]), .P9(mul_p[9]), .P8(mul_p[8]), .P7(mul_p[7]), .P6(mul_p[6]),
        .P5(mul_p[5]), .P4(mul_p[4]), .P3(mul_p[3]), .P2(mul_p[2]), .P1(mul_p[1]), .P0(mul_p[0]),
        .SIGNEDA(mul_signed_a_i),
        .SIGNEDB(mul_signed_b_i),
        .SOURCEA(mul_source_i && rst_ni),
        .SOURCEB(1'b0),
        .CLK0(clk_i),
        .CE0(mul_enable_i || !rst_ni),
        .RST0(1'b0)
    );
  end

  logic [35:0] wide[2];
  logic [17:0] narrow_a[2], narrow_b[2];
  assign wide_o          = wide[0];
  assign wide_late_o     = wide[1];
  assign narrow_a_o      = narrow_a[0];
  assign narrow_b_o      = narrow_b[0];
  assign narrow_b_late_o = narrow_b[1];
  for (genvar late = 0; late < 2; late++) begin : gen_late
    localparam bit Late = late == 1;
    DP16KD #(
        .DATA_WIDTH_A(36),
        .DATA_WIDTH_B(36),
        .WRITEMODE_A ("NORMAL"),
        .REGMODE_A   (Late ? "OUTREG" : "NOREG"),
        .REGMODE_B   (Late ? "OUTREG" : "NOREG"),
        .INITVAL_00  (words(5, 11)),
        .INITVAL_3F  (words(262143, -3))
    ) u_wide (
        .DIA17(data_i[17]), .DIA16(data_i[16]), .DIA15(data_i[15]), .DIA14(data_i[14]), .DIA13(data_i[13]), .DIA12(data_i[12]),
        .DIA11(data_i[11]), .DIA10(data_i[10]), .DIA9(data_i[9]), .DIA8(data_i[8]), .DIA7(data_i[7]), .DIA6(data_i[6]),
        .DIA5(data_i[5]), .DIA4(data_i[4]), .DIA3(data_i[3]), .DIA2(data_i[2]), .DIA1(data_i[1]), .DIA0(data_i[0]),
        .DIB17(data_i[35]), .DIB16(data_i[34]), .DIB15(data_i[33]), .DIB14(data_i[32]), .DIB13(data_i[31]), .DIB12(data_i[30]),
        .DIB11(data_i[29]), .DIB10(data_i[28]), .DIB9(data_i[27]), .DIB8(data_i[26]), .DIB7(data_i[25]), .DIB6(data_i[24]),
        .DIB5(data_i[23]), .DIB4(data_i[22]), .DIB3(data_i[21]), .DIB2(data_i[20]), .DIB1(data_i[19]), .DIB0(data_i[18]),
        .ADA13(a_addr_i[13]), .ADA12(a_addr_i[12]), .ADA11(a_addr_i[11]), .ADA10(a_addr_i[10]), .ADA9(a_addr_i[9]), .ADA8(a_addr_i[8]),
        .ADA7(a_addr_i[7]), .ADA6(a_addr_i[6]), .ADA5(a_addr_i[5]), .ADA4(a_addr_i[4]), .ADA3(a_addr_i[3]), .ADA2(a_addr_i[2]),
        .ADA1(a_addr_i[1]), .ADA0(a_addr_i[0]),
        .ADB13(b_addr_i[13]), .ADB12(b_addr_i[12]), .ADB11(b_addr_i[11]), .ADB10(b_addr_i[10]), .ADB9(b_addr_i[9]), .ADB8(b_addr_i[8]),
        .ADB7(b_addr_i[7]), .ADB6(b_addr_i[6]), .ADB5(b_addr_i[5]), .ADB4(b_addr_i[4]), .ADB3(b_addr_i[3]), .ADB2(b_addr_i[2]),
        .ADB1(b_addr_i[1]), .ADB0(b_addr_i[0]),
        .DOA17(wide[Late][17]), .DOA16(wide[Late][16]), .DOA15(wide[Late][15]), .DOA14(wide[Late][14]), .DOA13(wide[Late][13]), .DOA12(wide[Late][12]),
        .DOA11(wide[Late][11]), .DOA10(wide[Late][10]), .DOA9(wide[Late][9]), .DOA8(wide[Late][8]), .DOA7(wide[Late][7]), .DOA6(wide[Late][6]),
        .DOA5(wide[Late][5]), .DOA4(wide[Late][4]), .DOA3(wide[Late][3]), .DOA2(wide[Late][2]), .DOA1(wide[Late][1]), .DOA0(wide[Late][0]),
        .DOB17(wide[Late][35]), .DOB16(wide[Late][34]), .DOB15(wide[Late][33]), .DOB14(wide[Late][32]), .DOB13(wide[Late][31]), .DOB12(wide[Late][30]),
        .DOB11(wide[Late][29]), .DOB10(wide[Late][28]), .DOB9(wide[Late][27]), .DOB8(wide[Late][26]), .DOB7(wide[Late][25]), .DOB6(wide[Late][24]),
        .DOB5(wide[Late][23]), .DOB4(wide[Late][22]), .DOB3(wide[Late][21]), .DOB2(wide[Late][20]), .DOB1(wide[Late][19]), .DOB0(wide[Late][18]),
        .CEA(a_enable_i && rst_ni), .OCEA(Late), .CLKA(clk_i), .WEA(a_write_i), .RSTA(1'b0), .CSA2(1'b0), .CSA1(1'b0), .CSA0(1'b0),
        .CEB(b_enable_i && rst_ni), .OCEB(1'b1), .CLKB(clk_i), .WEB(b_write_i && rst_ni), .RSTB(b_reset_i && rst_ni), .CSB2(1'b0), .CSB1(1'b0), .CSB0(1'b0)
    );

    DP16KD #(
        .DATA_WIDTH_A(18),
        .DATA_WIDTH_B(18),
        .WRITEMODE_A ("READBEFOREWRITE"),
        .REGMODE_B   (Late ? "OUTREG" : "NOREG"),
        .INITVAL_00  (words(5, 11)),
        .INITVAL_3F  (words(262143, -3))
    ) u_narrow (
        .DIA17(data_i[17]), .DIA16(data_i[16]), .DIA15(data_i[15]), .DIA14(data_i[14]), .DIA13(data_i[13]), .DIA12(data_i[12]),
        .DIA11(data_i[11]), .DIA10(data_i[10]), .DIA9(data_i[9]), .DIA8(data_i[8]), .DIA7(data_i[7]), .DIA6(data_i[6]),
        .DIA5(data_i[5]), .DIA4(data_i[4]), .DIA3(data_i[3]), .DIA2(data_i[2]), .DIA1(data_i[1]), .DIA0(data_i[0]),
        .DIB17(data_i[35]), .DIB16(data_i[34]), .DIB15(data_i[33]), .DIB14(data_i[32]), .DIB13(data_i[31]), .DIB12(data_i[30]),
        .DIB11(data_i[29]), .DIB10(data_i[28]), .DIB9(data_i[27]), .DIB8(data_i[26]), .DIB7(data_i[25]), .DIB6(data_i[24]),
        .DIB5(data_i[23]), .DIB4(data_i[22]), .DIB3(data_i[21]), .DIB2(data_i[20]), .DIB1(data_i[19]), .DIB0(data_i[18]),
        .ADA13(a_addr_i[13]), .ADA12(a_addr_i[12]), .ADA11(a_addr_i[11]), .ADA10(a_addr_i[10]), .ADA9(a_addr_i[9]), .ADA8(a_addr_i[8]),
        .ADA7(a_addr_i[7]), .ADA6(a_addr_i[6]), .ADA5(a_addr_i[5]), .ADA4(a_addr_i[4]), .ADA3(a_addr_i[3]), .ADA2(a_addr_i[2]),
        .ADA1(a_addr_i[1]), .ADA0(a_addr_i[0]),
        .ADB13(b_addr_i[13]), .ADB12(b_addr_i[12]), .ADB11(b_addr_i[11]), .ADB10(b_addr_i[10]), .ADB9(b_addr_i[9]), .ADB8(b_addr_i[8]),
        .ADB7(b_addr_i[7]), .ADB6(b_addr_i[6]), .ADB5(b_addr_i[5]), .ADB4(b_addr_i[4]), .ADB3(b_addr_i[3]), .ADB2(b_addr_i[2]),
        .ADB1(b_addr_i[1]), .ADB0(b_addr_i[0]),
        .DOA17(narrow_a[Late][17]), .DOA16(narrow_a[Late][16]), .DOA15(narrow_a[Late][15]), .DOA14(narrow_a[Late][14]), .DOA13(narrow_a[Late][13]), .DOA12(narrow_a[Late][12]),
        .DOA11(narrow_a[Late][11]), .DOA10(narrow_a[Late][10]), .DOA9(narrow_a[Late][9]), .DOA8(narrow_a[Late][8]), .DOA7(narrow_a[Late][7]), .DOA6(narrow_a[Late][6]),
        .DOA5(narrow_a[Late][5]), .DOA4(narrow_a[Late][4]), .DOA3(narrow_a[Late][3]), .DOA2(narrow_a[Late][2]), .DOA1(narrow_a[Late][1]), .DOA0(narrow_a[Late][0]),
        .DOB17(narrow_b[Late][17]), .DOB16(narrow_b[Late][16]), .DOB15(narrow_b[Late][15]), .DOB14(narrow_b[Late][14]), .DOB13(narrow_b[Late][13]), .DOB12(narrow_b[Late][12]),
        .DOB11(narrow_b[Late][11]), .DOB10(narrow_b[Late][10]), .DOB9(narrow_b[Late][9]), .DOB8(narrow_b[Late][8]), .DOB7(narrow_b[Late][7]), .DOB6(narrow_b[Late][6]),
        .DOB5(narrow_b[Late][5]), .DOB4(narrow_b[Late][4]), .DOB3(narrow_b[Late][3]), .DOB2(narrow_b[Late][2]), .DOB1(narrow_b[Late][1]), .DOB0(narrow_b[Late][0]),
        .CEA(a_enable_i && rst_ni), .OCEA(1'b1), .CLKA(clk_i), .WEA(a_write_i), .RSTA(1'b0), .CSA2(1'b0), .CSA1(1'b0), .CSA0(1'b0),
        .CEB(b_enable_i && rst_ni), .OCEB(1'b1), .CLKB(clk_i), .WEB(b_write_i && rst_ni), .RSTB(b_reset_i && rst_ni), .CSB2(1'b0), .CSB1(1'b0), .CSB0(1'b0)
    );
  end
endmodule
