# All steps of the older vitis_hls (2021.1 to 2023.1); newer releases: hls_config*.cfg. Choices come from the environment:
#   RETRACE_TOP     trace (default), ray_setup, kd_descend, leaf_exit, kd_backtrack, tri_test, hit_finish, instance_enter
#   RETRACE_TARGET  zynq (default; Zynq UltraScale+ XCZU3EG) or alveo (Alveo U50)
#   RETRACE_STEPS   any of csim csynth cosim ip xo, in this order; default "csim csynth"
#   RETRACE_PERIOD  clock period in ns, default that of the target
# e.g. RETRACE_TOP=tri_test RETRACE_STEPS="csim csynth cosim ip" vitis_hls -f vitis_hls.tcl
# Writes build/vitis_hls/TOP_TARGET; `ip` and `xo` leave retrace_TOP.zip and retrace_TOP.xo there.
set root [file dirname [file normalize [info script]]]

proc setting {name default} {
  global env
  if {[info exists env($name)] && $env($name) ne ""} { return $env($name) }
  return $default
}
proc choose {name value choices} {
  if {$value ni $choices} { error "retrace: $name is '$value'; it must be one of: $choices" }
  return $value
}

# Offsets of host/retrace_kernel.h against the header that csynth writes.
proc check_registers {root solution} {
  set names {PAIRS pairs LEAVES leaves LIST list TRIANGLES triangles RAYS rays HITS hits WORK work SUMMARY summary
             IMAGE_LINES image_lines RAY_COUNT ray_count OPTIONS options}
  set found [glob -nocomplain -directory $solution -types f impl/ip/drivers/*/src/xretrace_trace_hw.h impl/misc/drivers/*/src/xretrace_trace_hw.h]
  if {$found eq ""} { error "retrace: csynth has left no xretrace_trace_hw.h below $solution/impl" }
  set channel [open [lindex $found 0]]
  set theirs [read $channel]
  close $channel
  set channel [open [file join $root host retrace_kernel.h]]
  set ours [read $channel]
  close $channel
  foreach {name argument} $names {
    if {![regexp "#define RETRACE_KERNEL_$name +0x(\[0-9a-f\]+)" $ours -> our]} { error "retrace: host/retrace_kernel.h does not define $name" }
    # A port whose name is a keyword of Verilog gets the suffix _r.
    if {![regexp -nocase "#define XRETRACE_TRACE_CONTROL_ADDR_${argument}(_R)?_DATA +0x(\[0-9a-f\]+)" $theirs -> suffix their]} {
      error "retrace: [lindex $found 0] has no register for '$argument'"
    }
    if {[scan $our %x] != [scan $their %x]} { error "retrace: register of '$argument' is at 0x$their, host/retrace_kernel.h says 0x$our" }
  }
  puts "retrace: the registers are where host/retrace_kernel.h says"
}

set stages {ray_setup kd_descend leaf_exit kd_backtrack tri_test hit_finish instance_enter}
set top [choose RETRACE_TOP [setting RETRACE_TOP trace] [concat trace $stages]]
set target [choose RETRACE_TARGET [setting RETRACE_TARGET zynq] {zynq alveo}]
set steps [setting RETRACE_STEPS "csim csynth"]
foreach step $steps { choose RETRACE_STEPS $step {csim csynth cosim ip xo} }
array set part {zynq xczu3eg-sbva484-1-e alveo xcu50-fsvh2104-2-e}
array set period {zynq 5.0 alveo 3.333}
if {$top eq "trace"} {
  set function retrace_trace
  set source [file join $root hls top trace.cpp]
} else {
  set function ${top}_top
  set source [file join $root hls stages $top.cpp]
}

set folder [file join $root build vitis_hls]
file mkdir $folder
cd $folder
open_project -reset ${top}_$target
set_top $function
add_files $source -cflags "-std=c++17"
add_files -tb [file join $root testbench vendor tb_$top.cpp] -cflags "-std=c++17"
open_solution -reset solution -flow_target [expr {"xo" in $steps ? "vitis" : "vivado"}]
set_part $part($target)
create_clock -period [setting RETRACE_PERIOD $period($target)] -name default
set_clock_uncertainty 15%
if {$top eq "trace"} { config_interface -m_axi_addr64 }

if {"csim" in $steps} { csim_design -clean }
if {"csynth" in $steps} {
  csynth_design
  if {$top eq "trace"} { check_registers $root [file join $folder ${top}_$target solution] }
}
if {"cosim" in $steps} { cosim_design -rtl verilog }
foreach {step format extension} {ip ip_catalog zip xo xo xo} {
  if {$step in $steps} {
    export_design -format $format -vendor retrace -library hls -ipname retrace_$top -version 0.1 -display_name "Retrace $top" \
      -output [file join $folder ${top}_$target retrace_$top.$extension]
  }
}
exit
