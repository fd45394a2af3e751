// SPDX-License-Identifier: Apache-2.0
// ULX3S with LFE5U-85F: pins, clock and reset around rt_board. Pin sites: constraints/ulx3s.lpf.
//
// Clock       25 MHz oscillator through one EHXPLLL to CoreMhz: 25 MHz * multiplier / divider, phase detector at 3.125 MHz or more, oscillator of the
//             PLL between 400 and 800 MHz (Lattice FPGA-DS-02012). The parameters are searched for at elaboration; a CoreMhz that
//             cannot be made exactly is an error. The macro RT_CORE_MHZ chooses another default.
// Reset       Until the PLL has locked, and while FIRE1 (btn 1) is pressed; then 2^16 clocks (rt_reset).
// Serial      The FTDI chip's USB port, BaudHz. Names are from its side: ftdi_rxd is what it receives.
// Memory      MemoryBytes, what the configuration leaves of 208 block RAMs (docs/board.md); the macro RT_BOARD_MEMORY chooses another default.
// Lamps       led as rt_board, led[6]: PLL locked.
// Other pins  wifi_gpio0 is held at 1, which keeps the ESP32 from taking over the board.
`include "rt_assert.svh"
`ifndef RT_CONFIG
`define RT_CONFIG ConfigEcp5
`endif
`ifndef RT_CORE_MHZ
`define RT_CORE_MHZ 80
`endif
`ifndef RT_BOARD_MEMORY
`define RT_BOARD_MEMORY (rt_config_pkg::`RT_CONFIG.lanes > 1 ? 32768 : 131072)
`endif
module rt_ulx3s #(
    parameter int unsigned CoreMhz = `RT_CORE_MHZ,
    parameter int unsigned BaudHz = 3_000_000,
    parameter int unsigned MemoryBytes = `RT_BOARD_MEMORY
) (
    input  logic       clk_25mhz,
    input  logic       ftdi_txd,
    output logic       ftdi_rxd,
    input  logic [6:0] btn,
    output logic [7:0] led,
    output logic       wifi_gpio0
);
  localparam int unsigned OscillatorMhz = 25;
  localparam int unsigned MostDivider = 8;  // phase detector at 3.125 MHz or more
  localparam int unsigned VcoLowMhz = 400;
  localparam int unsigned VcoHighMhz = 800;
  localparam int unsigned VcoMiddleMhz = 600;

  // The smallest divider of the oscillator that gives the clock exactly; 0 if there is none.
  function automatic int unsigned input_divider();
    for (int unsigned d = 1; d <= MostDivider; d++) begin
      if (CoreMhz * d % OscillatorMhz == 0) return d;
    end
    return 0;
  endfunction
  localparam int unsigned InputDivider = input_divider();
  localparam int unsigned Multiplier = CoreMhz * InputDivider / OscillatorMhz;
  localparam int unsigned OutputDivider = (VcoMiddleMhz + CoreMhz / 2) / CoreMhz;
  localparam int unsigned VcoMhz = CoreMhz * OutputDivider;

  `RT_ASSERT_INIT(ClockIsExact, InputDivider != 0 && Multiplier >= 1 && Multiplier <= 128)
  `RT_ASSERT_INIT(VcoInRange, OutputDivider >= 1 && OutputDivider <= 128 && VcoMhz >= VcoLowMhz && VcoMhz <= VcoHighMhz)

  logic clk, locked, rst_n;
  logic [7:0] lamps;

  (* ICP_CURRENT = "12", LPF_RESISTOR = "8", MFG_ENABLE_FILTEROPAMP = "1", MFG_GMCREF_SEL = "2" *)
  EHXPLLL #(
      .PLLRST_ENA      ("DISABLED"),
      .INTFB_WAKE      ("DISABLED"),
      .STDBY_ENABLE    ("DISABLED"),
      .DPHASE_SOURCE   ("DISABLED"),
      .OUTDIVIDER_MUXA ("DIVA"),
      .OUTDIVIDER_MUXB ("DIVB"),
      .OUTDIVIDER_MUXC ("DIVC"),
      .OUTDIVIDER_MUXD ("DIVD"),
      .CLKI_DIV        (InputDivider),
      .CLKOP_ENABLE    ("ENABLED"),
      .CLKOP_DIV       (OutputDivider),
      .CLKOP_CPHASE    (OutputDivider / 2),
      .CLKOP_FPHASE    (0),
      .FEEDBK_PATH     ("CLKOP"),
      .CLKFB_DIV       (Multiplier)
  ) u_pll (
      .CLKI        (clk_25mhz),
      .CLKFB       (clk),
      .CLKOP       (clk),
      .LOCK        (locked),
      .RST         (1'b0),
      .STDBY       (1'b0),
      .PHASESEL1   (1'b0),
      .PHASESEL0   (1'b0),
      .PHASEDIR    (1'b1),
      .PHASESTEP   (1'b1),
      .PHASELOADREG(1'b1),
      .PLLWAKESYNC (1'b0),
      .ENCLKOP     (1'b0)
  );

  rt_reset u_reset (
      .clk_i (clk),
      .good_i(locked && !btn[1]),
      .rst_no(rst_n)
  );

  rt_board #(
      .Config     (rt_config_pkg::`RT_CONFIG),
      .MemoryBytes(MemoryBytes),
      .ClockHz    (CoreMhz * 1_000_000),
      .BaudHz     (BaudHz)
  ) u_board (
      .clk_i    (clk),
      .rst_ni   (rst_n),
      .uart_rx_i(ftdi_txd),
      .uart_tx_o(ftdi_rxd),
      .irq_o    (),
      .led_o    (lamps)
  );

  assign led        = {lamps[7], locked, lamps[5:0]};
  assign wifi_gpio0 = 1'b1;
endmodule
