# part: xcu50-fsvh2104-2-e
# Alveo U50: a block by itself, 300 MHz, the default kernel clock of the platform. In a linked .xclbin the platform brings its own constraints.
create_clock -name core -period 3.333 [get_ports -quiet {ap_clk aclk}]
set_property HD.CLK_SRC BUFGCE_X0Y0 [get_ports -quiet {ap_clk aclk}]
# A third of the clock for the interconnect on either side.
set_input_delay -clock core -max 1.111 [get_ports -filter {DIRECTION == IN && NAME !~ "*clk"}]
set_input_delay -clock core -min 0.150 [get_ports -filter {DIRECTION == IN && NAME !~ "*clk"}]
set_output_delay -clock core -max 1.111 [get_ports -filter {DIRECTION == OUT}]
set_output_delay -clock core -min 0.000 [get_ports -filter {DIRECTION == OUT}]
