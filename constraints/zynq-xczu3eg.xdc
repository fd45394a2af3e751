# part: xczu3eg-sbva484-1-e
# Zynq UltraScale+ (Ultra96 class): a block by itself, 200 MHz. For an exported HLS kernel (clock ap_clk) and for the core, rt_axi (clock aclk);
# behind the processing system every port is an AXI port, so no pin is placed here.
create_clock -name core -period 5.000 [get_ports -quiet {ap_clk aclk}]
set_property HD.CLK_SRC BUFGCE_X0Y0 [get_ports -quiet {ap_clk aclk}]
# A third of the clock for the interconnect on either side.
set_input_delay -clock core -max 1.667 [get_ports -filter {DIRECTION == IN && NAME !~ "*clk"}]
set_input_delay -clock core -min 0.200 [get_ports -filter {DIRECTION == IN && NAME !~ "*clk"}]
set_output_delay -clock core -max 1.667 [get_ports -filter {DIRECTION == OUT}]
set_output_delay -clock core -min 0.000 [get_ports -filter {DIRECTION == OUT}]
