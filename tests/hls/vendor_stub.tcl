# Stands in for the vendor's tools: every command of theirs prints itself and its arguments, one a line after "CALL", and nothing else is stubbed, so
# that a misspelt command or variable is an error. usage: tclsh vendor_stub.tcl SCRIPT ARGUMENT...
foreach command {open_project set_top add_files open_solution set_part create_clock set_clock_uncertainty config_interface csim_design csynth_design
                 cosim_design export_design create_project read_verilog read_xdc set_property update_compile_order synth_design opt_design place_design
                 phys_opt_design route_design report_timing_summary report_utilization ipx::package_project ipx::infer_bus_interface
                 ipx::associate_bus_interfaces ipx::create_xgui_files ipx::update_checksums ipx::check_integrity ipx::save_core} {
  if {[string match ipx::* $command]} { namespace eval ipx {} }
  proc ::$command {args} "puts \[list CALL $command {*}\$args\]"
}
proc current_project {} { if {![info exists ::env(STUB_OPEN_PROJECT)]} { error "no open project" } }
proc current_fileset {} { return sources_1 }
proc get_files {args} { return [lindex $args end] }
proc get_timing_paths {args} { return path }
proc get_property {name object} { return [expr {[info exists ::env(STUB_SLACK)] ? $::env(STUB_SLACK) : 0.1}] }
proc ::ipx::current_core {} { return core }
proc ::ipx::get_user_parameters {name args} { return $name }
rename csynth_design csynth_call
# csynth leaves the header with the registers, here a copy of what the test has prepared.
proc csynth_design {args} {
  csynth_call {*}$args
  if {[info exists ::env(STUB_HW_H)]} {
    set folder [file join [pwd] $::env(STUB_PROJECT) solution impl ip drivers retrace_trace_v1_0 src]
    file mkdir $folder
    file copy -force $::env(STUB_HW_H) [file join $folder xretrace_trace_hw.h]
  }
}
set script [lindex $argv 0]
set argv [lrange $argv 1 end]
if {[catch {source $script} message]} {
  puts stderr $message
  exit 1
}
