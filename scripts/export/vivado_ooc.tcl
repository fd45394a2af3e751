# Synthesis, place and route of one block by itself, with a timing gate: for the Verilog of an exported kernel, or of the core.
#   vivado -mode batch -source vivado_ooc.tcl -tclargs TOP XDC VERILOG_FOLDER...
# TOP is retrace_trace, tri_test_top, ..., XDC one of constraints/*.xdc (its first line names the part), VERILOG_FOLDER e.g.
# build/vitis_hls/trace_zynq/solution/impl/ip/hdl/verilog. The core: rt_axi with the folders of rtl/rooms.txt below board, in this
# order. Reports go to build/ooc_TOP; fails where the slack is negative.
if {[llength $argv] < 3} { error "retrace: usage: vivado -mode batch -source vivado_ooc.tcl -tclargs TOP XDC VERILOG_FOLDER..." }
set top [lindex $argv 0]
set constraints [lindex $argv 1]
set channel [open $constraints]
set line [gets $channel]
close $channel
if {![regexp {^# part: (\S+)$} $line -> part]} { error "retrace: the first line of $constraints does not name a part ('# part: NAME')" }
# Packages first, in the order of the folders.
set folders [lrange $argv 2 end]
set packages {}
set files {}
foreach folder $folders {
  set here [concat [glob -nocomplain -directory $folder *.v] [glob -nocomplain -directory $folder *.sv]]
  if {$here eq ""} { error "retrace: no Verilog in $folder" }
  foreach file [lsort $here] {
    if {[string match *_pkg.sv $file]} { lappend packages $file } else { lappend files $file }
  }
}
set reports [file join build ooc_$top]
file mkdir $reports
create_project -in_memory -part $part
read_verilog -sv [concat $packages $files]
read_xdc -mode out_of_context $constraints
synth_design -top $top -part $part -mode out_of_context -include_dirs $folders
opt_design
place_design
phys_opt_design
route_design
report_timing_summary -file [file join $reports timing.txt]
report_utilization -hierarchical -file [file join $reports utilization.txt]
set slack [get_property SLACK [get_timing_paths -max_paths 1 -setup]]
puts "retrace: $top on $part, slack $slack ns"
if {$slack eq "" || $slack < 0} { error "retrace: timing is not met: slack $slack ns, see $reports/timing.txt" }
