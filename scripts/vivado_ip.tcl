# Packages the core as an IP in the vendor's format. Sourced by FuseSoC (target vivado_ip) inside the project it has made, or by hand:
#   vivado -mode batch -source scripts/vivado_ip.tcl -tclargs OUTPUT_FOLDER [CONFIG]
# CONFIG is a configuration of rtl/pkg/rt_config_pkg.sv, default ConfigEcp5. Writes OUTPUT_FOLDER/component.xml and the sources beside it.
set root [file normalize [file join [file dirname [info script]] ..]]
set output [expr {[llength $argv] > 0 ? [lindex $argv 0] : "retrace_ip"}]
set config [expr {[llength $argv] > 1 ? [lindex $argv 1] : "ConfigEcp5"}]
# Width of the data bus: the IP catalog shows it, and the wrapper has to agree with the package.
set channel [open [file join $root rtl pkg rt_config_pkg.sv]]
foreach {match name bits} [regexp -all -inline {localparam config_t (Config\w+) = '\{[^\}]*?data_bits: (\d+)} [read $channel]] { set data_bits($name) $bits }
close $channel
if {![info exists data_bits($config)]} {
  error "retrace: there is no configuration '$config'; there are: [lsort [array names data_bits]]"
}
if {[catch {current_project}]} {
  create_project -in_memory -part xczu3eg-sbva484-1-e
  # Packages first, each after those it uses.
  set files {}
  set channel [open [file join $root rtl packages.txt]]
  foreach name [split [read $channel] "\n"] {
    if {$name ne "" && ![string match "#*" $name] && ![string match "board/*" $name]} { lappend files [file join $root rtl $name] }
  }
  close $channel
  set channel [open [file join $root rtl rooms.txt]]
  foreach room [split [read $channel] "\n"] {
    if {$room eq "" || [string match "#*" $room] || $room eq "board"} { continue }
    foreach file [lsort [glob -nocomplain [file join $root rtl $room rt_*.sv]]] {
      if {[lsearch $files $file] < 0} { lappend files $file }
    }
  }
  close $channel
  read_verilog -sv $files
  read_verilog [file join $root rtl shell rt_axi.v]
}
# FuseSoC sources this script before it sets the include folders of its project.
set_property include_dirs [list [file join $root rtl pkg]] [current_fileset]
set_property verilog_define [list RT_CONFIG=$config] [current_fileset]
# Defines of this project do not travel with the IP, so the configuration does as a global include.
file mkdir $output
set header [file normalize [file join $output retrace_config.vh]]
set channel [open $header w]
puts $channel "`ifndef RT_CONFIG\n`define RT_CONFIG $config\n`endif"
close $channel
add_files -norecurse $header
set_property file_type {Verilog Header} [get_files $header]
set_property is_global_include true [get_files $header]
set_property top rt_axi [current_fileset]
update_compile_order -fileset [current_fileset]

ipx::package_project -root_dir $output -vendor retrace -library core -taxonomy /UserIP -import_files -force
set core [ipx::current_core]
set_property name retrace $core
set_property version 0.1 $core
set_property display_name "Retrace ray tracing core ($config)" $core
set_property description "Kd-backtrack traversal with parent links and unit-triangle intersection, no stack" $core
set_property value $data_bits($config) [ipx::get_user_parameters C_M_AXI_IMAGE_DATA_WIDTH -of_objects $core]
set_property value_resolve_type constant [ipx::get_user_parameters C_M_AXI_IMAGE_DATA_WIDTH -of_objects $core]
ipx::infer_bus_interface aclk xilinx.com:signal:clock_rtl:1.0 $core
ipx::infer_bus_interface aresetn xilinx.com:signal:reset_rtl:1.0 $core
ipx::infer_bus_interface interrupt xilinx.com:signal:interrupt_rtl:1.0 $core
foreach bus {s_axi_control m_axi_image} { ipx::associate_bus_interfaces -busif $bus -clock aclk $core }
ipx::create_xgui_files $core
ipx::update_checksums $core
ipx::check_integrity $core
ipx::save_core $core
puts "retrace: packaged $config in [file normalize $output]"
