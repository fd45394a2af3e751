"""Mutants of the RTL: each patches one rule in a copy, verilates the models that contain it, links the tests against those and expects a failure.

The tests and everything but the mutated model come from an existing Ninja build, so a mutant costs one verilation and one link. The core is too
large for that: its mutants (core_mutants.py) are all in one model, and RETRACE_MUTANT in the environment of a test says which of them is broken.
"""
import argparse
import glob
import os
import re
import resource
import shutil
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor

import core_mutants
from rtl_rooms import rtl_packages, rtl_rooms

# (what is broken, file below rtl/, old text, new text, (model to verilate, test program, tests that must notice))
STAGE = {name: ("rt_" + name, "rtl_stages_test", "*" + name) for name in
         ("ray_setup", "kd_descend", "leaf_exit", "kd_backtrack", "tri_test", "hit_finish", "instance_enter")}
LIB = ("tb_lib", "rtl_lib_test", "*")
CACHES = ("tb_cache", "rtl_cache_test", "*")
GENERATIONS = ("tb_generation", "rtl_generation_test", "*")
PIXELS = ("tb_pixels", "rtl_pixels_test", "Pixels/Granule64.*")
PARTS = ("tb_board", "board_units_test", "*")
BOARD = ("rt_board", "board_test", "BoardLink.*")
DRAM = ("tb_dram_port", "dram_port_test", "*Word128*")

MUTANTS = [
    # Roundings and saturations.
    ("t_plane rounds toward zero", "arith/rt_t_plane.sv", "shifted_q    <= product >>> shift;",
     "shifted_q    <= (product + (product < 0 ? ((ProductBits'(1) <<< shift) - 1'b1) : '0)) >>> shift;", STAGE["kd_descend"]),
    ("t_plane wraps instead of saturating", "arith/rt_t_plane.sv", "t_q          <= fits ?", "t_q          <= 1'b1 ?", STAGE["leaf_exit"]),
    ("a row product truncates", "arith/rt_row_product.sv", "+ (rounded_t'(1) <<< HalfShift);", ";", STAGE["tri_test"]),
    ("ties of a row product go down", "arith/rt_row_product.sv", "(low_q + high_q) >>> RowShift", "(low_q + high_q - 1'b1) >>> RowShift",
     STAGE["tri_test"]),
    ("V is aligned with a logical shift", "isect/rt_unit_test.sv", "edge_v_q >>> difference", "edge_v_q >> difference", STAGE["tri_test"]),
    ("the reciprocal wraps at a power of two", "arith/rt_reciprocal.sv", "unsigned_reciprocal = {1'b0, quotient}",
     "unsigned_reciprocal = {1'b0, overflow_unused ? QuotBits'(0) : quotient}", STAGE["ray_setup"]),
    ("a barycentric saturates below 1", "isect/rt_hit_finish.sv", "value = {1'b1, {QuotBits{1'b0}}}", "value = {1'b0, quotient}", STAGE["hit_finish"]),
    ("bits shifted out of a barycentric are lost", "isect/rt_hit_finish.sv", "verdict_3q.over || lost_q != '0", "verdict_3q.over",
     STAGE["hit_finish"]),
    ("a quotient bit is wrong where remainder and divisor are equal", "arith/rt_div.sv", "difference = wide - {1'b0, den_q[i]};",
     "difference = wide - {1'b0, den_q[i]}; if (difference == '0) difference = '1;", LIB),
    ("the low partial product is missing", "arith/rt_mul.sv", "outer_q    <= {high_q, low_q};", "outer_q    <= {high_q, {(2 * PieceBits) {1'b0}}};", LIB),
    # Ties and bounds.
    ("a tie goes near", "walk/rt_kd_descend.sv", "late.t < plane", "late.t <= plane", STAGE["kd_descend"]),
    ("an origin in the split plane goes left", "walk/rt_kd_descend.sv", "early_q.origin < early_q.split", "early_q.origin <= early_q.split",
     STAGE["kd_descend"]),
    ("the highest axis wins a tie", "leaf/rt_leaf_exit.sv", "t_plane[1] < t_plane[0]", "t_plane[1] <= t_plane[0]", STAGE["leaf_exit"]),
    ("an exit at t counts as broken", "leaf/rt_leaf_exit.sv", "t_plane[axis] < late.t", "t_plane[axis] <= late.t", STAGE["leaf_exit"]),
    ("axes of direction zero exit", "leaf/rt_leaf_exit.sv", "if (!sides_q.zero[2]) begin", "begin", STAGE["leaf_exit"]),
    ("the far child turns as well", "walk/rt_kd_backtrack.sv", "&& right != upper", "", STAGE["kd_backtrack"]),
    ("a match at the root ends the ray", "walk/rt_kd_backtrack.sv", "!turn_d.matched && in_data_i.parent == '0", "in_data_i.parent == '0",
     STAGE["kd_backtrack"]),
    ("U at its lower end is outside", "isect/rt_unit_test.sv", "edge_u_q >= -rt_contract_pkg::EpsUv", "edge_u_q > -rt_contract_pkg::EpsUv",
     STAGE["tri_test"]),
    ("V at its upper end is outside", "isect/rt_unit_test.sv", "edge_v_q <= EdgeBits'(highest_v_q)", "edge_v_q < EdgeBits'(highest_v_q)",
     STAGE["tri_test"]),
    ("W at its end is outside", "isect/rt_unit_test.sv", "rest_q >= SumBits'(aligned_v_q)", "rest_q > SumBits'(aligned_v_q)", STAGE["tri_test"]),
    ("a hit at t = 0 is lost", "isect/rt_unit_test.sv", "oz_q <= 0", "oz_q < 0", STAGE["tri_test"]),
    ("t = 8 is a hit", "isect/rt_unit_test.sv", "unsigned'(height_q) < {", "unsigned'(height_q) <= {", STAGE["tri_test"]),
    ("the length of an object's direction has a low bound", "isect/rt_object_ray.sv", "BoundBits'(magnitude) + 1'b1", "BoundBits'(magnitude)",
     STAGE["instance_enter"]),
    ("an object's direction is truncated", "isect/rt_object_ray.sv", "(long_t'(1) <<< (LongFrac - rt_contract_pkg::DirectionFrac - 1))", "long_t'(0)",
     STAGE["instance_enter"]),
    ("an object's origin is truncated", "isect/rt_object_ray.sv", "(step_t'(1) <<< (OriginShift - 1))", "step_t'(0)", STAGE["instance_enter"]),
    ("the lower side of an object's box does not grow", "isect/rt_object_ray.sv", "lower_1q - rt_contract_pkg::SlabPad", "lower_1q",
     STAGE["instance_enter"]),
    ("an axis of direction 0 is never outside", "isect/rt_object_ray.sv", "outside_q      <= course_slab_q.zero && (at_2q < lower_2q || at_2q > upper_2q);",
     "outside_q      <= 1'b0;", STAGE["instance_enter"]),
    ("a hit at the reach counts", "isect/rt_object_ray.sv", "{1'b0, start_q, {StepShift{1'b0}}} - 1'b1", "{1'b0, start_q, {StepShift{1'b0}}}",
     STAGE["instance_enter"]),
    ("the slabs of the last input count", "isect/rt_object_ray.sv", "assign first_plane = token[rt_stage_pkg::EnterPlane];", "assign first_plane = 1'b0;",
     STAGE["instance_enter"]),
    ("a scale of 17 is entered", "isect/rt_object_ray.sv", "scale_sum > size_t'(CourseUnit + ScaleMax)", "scale_sum > size_t'(CourseUnit + ScaleMax + 1)",
     STAGE["instance_enter"]),
    ("a row exponent of 16 is entered", "isect/rt_object_ray.sv", "row_size.exponent > rt_contract_pkg::RowExponentMax",
     "row_size.exponent > rt_contract_pkg::RowExponentMax + 1'b1", STAGE["instance_enter"]),
    ("an origin on the box is outside", "ray/rt_ray_setup.sv", "origin > upper", "origin >= upper", STAGE["ray_setup"]),
    # Handshakes.
    ("a result too many is admitted", "stream/rt_pipe_ctrl.sv", "credit_q    <= CountBits'(Credits);", "credit_q    <= CountBits'(Credits + 1);", LIB),
    ("a stage takes inputs without credit", "stream/rt_pipe_ctrl.sv", "in_ready_q  <= (leave || credit_q != CountBits'(enter)) && !busy_next;", "in_ready_q  <= !busy_next;",
     STAGE["kd_descend"]),
    ("a credit too few costs throughput", "pkg/rt_lib_pkg.sv", "return (latency + 2 + interval - 1) / interval;",
     "return (latency + 1 + interval - 1) / interval;", STAGE["tri_test"]),
    ("a shared datapath takes its next input too early", "stream/rt_pipe_ctrl.sv", "assign busy_next = enter || wait_q > WaitBits'(1);",
     "assign busy_next = enter && wait_q > WaitBits'(1);", STAGE["hit_finish"]),
    ("the tag of the wrong clock", "stream/rt_pipe_ctrl.sv", "if (entered_q) begin\n      tag_mem_q", "if (enter) begin\n      tag_mem_q",
     STAGE["leaf_exit"]),
    ("the skid buffer takes a word it has no room for", "stream/rt_skid.sv", "assign in_ready_o = !spill_valid_q;", "assign in_ready_o = 1'b1;", LIB),
    ("the skid of half the rate takes a word over another", "stream/rt_skid.sv", "assign in_ready_o = !out_valid_q;", "assign in_ready_o = 1'b1;", LIB),
    ("a full FIFO takes a word", "stream/rt_fifo.sv", "full_q <= grows ? usage_q == UsageBits'(Depth - 1) : full_q && !shrinks;",
     "full_q <= 1'b0;", LIB),
    ("a block RAM FIFO reads ahead too far", "stream/rt_fifo.sv", "ahead_q != 2'(OutputBuffer)", "1'b1", LIB),
    ("a counter keeps the sum of the run before", "mem/rt_counters.sv", "(s2_fresh_q ? '0 : s2_stored_q)", "s2_stored_q", LIB),
    ("a counter counts twice what it has stored", "mem/rt_counters.sv", "(s0_index_q == index_t'(i) ? '0 : waiting_q)", "waiting_q", LIB),
    ("the arbiter changes its mind", "stream/rt_arbiter.sv", "locked_q <= !(out_ready_i && in_last_i[index]);", "locked_q <= 1'b0;", LIB),
    ("the arbiter always prefers the lowest input", "stream/rt_arbiter.sv", "after_q[i] <= i > int'(index);", "after_q[i] <= 1'b1;", LIB),
    ("turns prefer the lowest input", "stream/rt_turns.sv", "after_q <= ~(chosen | (chosen - 1'b1));", "after_q <= '1;", LIB),
    ("turns serve an input twice", "stream/rt_turns.sv", "assign waiting = in_valid_i & ~grant_q;", "assign waiting = in_valid_i;", LIB),
    ("a queue forgets what is on its way", "stream/rt_queue.sv", "<= Depth - 2 - Ahead;", "<= Depth - 1 - Ahead;", LIB),
    ("the sequential divider forgets to wait for its output", "arith/rt_div_seq.sv", "default: if (out_ready_i) state_q <= Idle;",
     "default: state_q <= Idle;", LIB),
    ("the RAM does not forward", "stream/rt_ram_sdp.sv", "use_forward_q ? forward_q : read_q", "read_q", LIB),
    # The caches.
    ("a line is hit while it is overwritten", "mem/rt_cache.sv", ": taken_q && taken_way_q == 1'(w));", ": 1'b0);", CACHES),
    ("a tag is believed while it is written", "mem/rt_cache.sv", "unsure2_q[p]    <= unsure1_q[p];", "unsure2_q[p]    <= 1'b0;", CACHES),
    ("two misses on one line fetch it twice", "mem/rt_cache.sv", "same_q[free_q] <= place_miss_q.key == match_miss_q.key;", "same_q[free_q] <= 1'b0;", CACHES),
    ("a line that could not be read stays", "mem/rt_cache.sv", "ending_q && !ending_error_q;", "ending_q;", CACHES),
    ("a way is taken while it is filled", "mem/rt_cache.sv", "set_q & (active_q | fresh_q)", "set_q & fresh_q", CACHES),
    ("a line is joined that has just ended", "mem/rt_cache.sv", "&& !(done_q && line[done_mshr_q]);", ";", CACHES),
    ("a miss register is taken while somebody waits for its line", "mem/rt_cache.sv", "~active_q & ~waited_for &", "~active_q &", CACHES),
    ("a one-way cache does not see its hits", "mem/rt_cache.sv", "Ways == 2 && way_hit_q[hit_port][Ways-1];", "way_hit_q[hit_port][Ways-1];", CACHES),
    ("a line nobody comes for is kept", "mem/rt_cache.sv", "fresh_q & ~seen & ~(stale_q & ~waited_for);", "fresh_q & ~seen;", ("tb_cache", "rtl_cache_test", "*Lease*")),
    ("the last of a list is not woken", "mem/rt_waiters.sv", "walk_q        <= walk_waiter_q != walk_last_q;", "walk_q        <= walk_next_waiter != walk_last_q;", CACHES),
    # Generations of contexts.
    ("no generation ever ends", "pipe/rt_generation.sv", "if (clock_q == '1) hold_q <= 1'b1;", "if (1'b0) hold_q <= 1'b1;", GENERATIONS),
    # Rays from a camera, pixels from hits.
    ("a slot is given out while its pixel is not finished", "ray/rt_raster.sv", "assign new_left   = !new_q[SlotBits];", "assign new_left   = 1'b1;", PIXELS),
    ("a ray that leaves the box behind it is traced", "ray/rt_raster.sv", "signed'(entry.direction[a]) <= 0) passes = 1'b1;", "1'b0) passes = 1'b1;", PIXELS),
    ("a tile is as wide as the frame", "ray/rt_raster.sv", "next_x_q == tile_right_q || next_x_q == frame_i.width", "next_x_q == frame_i.width", PIXELS),
    ("a tile begins in the row where the one before ended", "ray/rt_raster.sv", "ends_band ? next_row_q : tile_row_q;", "next_row_q;", PIXELS),
    ("the camera is done with samples on their way", "ray/rt_raster.sv", "state_q == Idle && inside_q == '0 &&", "state_q == Idle &&", PIXELS),
    ("every triangle has the material of the one before", "mem/rt_lookup.sv", "last_valid_d && last_key_d == in_key_i;", "last_valid_d;", PIXELS),
    ("an error in a beat is forgotten", "mem/rt_lookup.sv", "error_q <= fill_error && !fill_last;", "error_q <= 1'b0;", PIXELS),
    ("a slot keeps the sum of its last pixel", "ray/rt_shade.sv", "store && !last ?", "store ?", PIXELS),
    ("samples of a pixel share a slot", "ray/rt_raster.sv", "slot_q | SlotBits'(sample_q), pixel_q", "slot_q, pixel_q", PIXELS),
    ("an eye moves with its pixel", "ray/rt_raster.sv", "if (orthographic) begin", "if (1'b1) begin", PIXELS),
    ("a shared camera looks at its own plane", "ray/rt_raster.sv", "camera.data.direction[2] = direction_t'(1) <<<", "camera.data.direction[2] = direction_t'(0) <<<",
     PIXELS),
    ("a camera's ray sets out without a place to come back to", "isect/rt_entry.sv", "ray_ready && free_q != '0;", "ray_ready;", PIXELS),
    ("a camera's ray is lost to a context", "isect/rt_entry.sv", "lets_in        = !in_valid_i &&", "lets_in        = 1'b1 &&", PIXELS),
    ("a context waits as a camera's ray", "isect/rt_entry.sv", "of_context     = valid && !tag.camera;", "of_context     = valid;", PIXELS),
    ("a camera's ray has the tag of the one before", "isect/rt_entry.sv", "record_tag_q.entry.steps <= camera_i.tag;", "record_tag_q.entry.steps <= record_tag_q.entry.steps;", PIXELS),
    ("a record of two beats is one of them, twice", "mem/rt_lookup.sv", "beat_q == where.beat + BeatBits'(s) ?", "beat_q == where.beat ?", PIXELS),
    ("a shadow ray begins at the hit", "ray/rt_shadow.sv", "pending.t - back}", "pending.t}", PIXELS),
    ("a hit at the eye is behind it", "ray/rt_shadow.sv", "pending.t < rt_contract_pkg::ShadowBack ?", "1'b0 ?", PIXELS),
    ("a light of 0 shines", "ray/rt_shadow.sv", "passes = frame_i.light == '0;", "passes = 1'b0;", PIXELS),
    ("a light is longer than 1", "ray/rt_shadow.sv", "frame_i.light[a] == {1'b1, (rt_contract_pkg::NormalBits - 1)'(0)}", "1'b0", PIXELS),
    ("every hit is lit", "ray/rt_shadow.sv", "shadow: in_q.hit, id: kept.id", "shadow: 1'b0, id: kept.id", PIXELS),
    ("what stands before the light is shown", "ray/rt_shadow.sv", "shadow: in_q.hit, id: kept.id", "shadow: in_q.hit, id: in_q.id", PIXELS),
    ("a frame is done with shadow rays to come", "ray/rt_shadow.sv", "assign busy_o = inside_q != '0;", "assign busy_o = 1'b0;", PIXELS),
    ("a light is turned by one row alone", "ray/rt_turn.sv", "in_data_i[2:0] : turn_q[5:3];", "in_data_i[2:0] : in_data_i[2:0];", PIXELS),
    ("an instance's materials are those of its ids", "ray/rt_shade.sv", "placed.index = 32'(index);", "placed.index = turning.sample.id;", PIXELS),
    ("the world's light falls on an instance", "ray/rt_shade.sv", "placed.light = turned;", "placed.light = light;", PIXELS),
    ("instances beyond the table have a record", "ray/rt_shade.sv", "32'(in.number) < placed_i", "1'b1", PIXELS),
    ("an instance that could not be read has a material", "ray/rt_shade.sv", "known: !turning.failed}", "known: 1'b1}", PIXELS),
    ("a shadow is as bright as the light", "ray/rt_light.sv", "in_shadow_i ? '0 : in_data_i.normal[a]", "in_data_i.normal[a]", PIXELS),
    ("bright light wraps", "ray/rt_light.sv", "lit_sum[LitBits] ? '1 :", "1'b0 ? '1 :", PIXELS),
    ("the back of a surface is dark", "ray/rt_light.sv", "sum_q < 0 ? (SumBits - 1)'(-sum_q)", "sum_q < 0 ? '0", PIXELS),
    # The board.
    ("a damaged frame is carried out", "board/rt_link_rx.sv", "good_o  <= crc_q == rt_board_pkg::CrcGood &&", "good_o  <=", BOARD),
    ("a repeated frame is carried out again", "board/rt_link.sv", "assign repeated = last_valid_q &&", "assign repeated = 1'b0 &&", BOARD),
    ("a repetition is known by its numbers alone", "board/rt_link.sv", "&& last_crc_q == frame_crc;", ";", BOARD),
    ("any session will do", "board/rt_link.sv", "session_valid_q && session_q == head_q[39:24]", "session_valid_q", BOARD),
    ("a frame is taken while another is answered", "board/rt_link.sv", "assign take            = state_q == Idle;",
     "assign take            = 1'b1;", BOARD),
    ("an error of the bus is not told", "board/rt_link.sv", "if (r_i.resp[1]) begin", "if (1'b0) begin", BOARD),
    ("flags in an answer are not escaped", "board/rt_link_tx.sv", "value_q == rt_board_pkg::Flag || value_q == rt_board_pkg::Escape",
     "value_q == rt_board_pkg::Escape", BOARD),
    ("one sample decides a bit", "board/rt_uart_rx.sv", "(line_q[1] && line_q[2]) || (line_q[2] && line_q[3]) || (line_q[1] && line_q[3])", "line_q[2]",
     PARTS),
    ("the receiver drops fractions", "board/rt_uart_rx.sv", "CountBits'(fraction_d[8])", "CountBits'(1'b0)", PARTS),
    ("a break never ends", "board/rt_uart_rx.sv", "state_q     <= level_q ? Idle : Break;", "state_q     <= Idle;", PARTS),
    ("a read does not wait for a write of its word", "board/rt_board_memory.sv", " && !(write_q && write_word_q[NearBits-1:0] == ar_q.word[NearBits-1:0])", "", PARTS),
    ("strobes are ignored", "board/rt_board_memory.sv", "write_q && write_strobe_q[i]", "write_q", PARTS),
    ("a burst outside changes the memory", "board/rt_board_memory.sv", "write_fire && aw_q.resp == rt_board_pkg::RespOkay", "write_fire", PARTS),
    ("the memory takes beats it has no place for", "board/rt_board_memory.sv", "ar_active_q && room_q &&", "ar_active_q &&", PARTS),
    ("write data of the masters are mixed up", "board/rt_axi_mux.sv", ".in_data_i  (aw_index),", ".in_data_i  (!aw_index),", PARTS),
    # Its DRAM.
    ("reads of an id change the port at any time", "board/rt_dram_order.sv", "assign go_o      = !clear_q &&", "assign go_o      = !clear_q || 1'b0 &&", DRAM),
    ("more reads of an id than are counted", "board/rt_dram_order.sv", " && in_flight != '1));", "));", DRAM),
    ("old counts survive a reset", "board/rt_dram_order.sv", "clear_q       <= 1'b1;", "clear_q       <= 1'b0;", DRAM),
    ("a command without a place for its word", "board/rt_dram_read_port.sv", "&& held_q != HeldBits'(Places) ", "", DRAM),
    ("a burst in the middle of a word is short", "board/rt_dram_read_port.sv", "9'(in_beat_i[LaneBits-1:0])", "9'd0", DRAM),
    ("a word is given away with its first beat", "board/rt_dram_read_port.sv", "out_take && (lane_last || out_data_o.last)", "out_take", DRAM),
    ("an offered read command is taken back", "board/rt_dram_read_port.sv", "(offered_q || !hold_i)", "!hold_i", DRAM),
    ("strobes of the last word stay", "board/rt_dram_writes.sv", "word_done ? '0 : word_in.strobe", "word_in.strobe", DRAM),
    ("a beat is a write", "board/rt_dram_writes.sv", "word_done = w_i.last || lane == '1;", "word_done = 1'b1;", DRAM),
    ("words without a byte are written", "board/rt_dram_writes.sv", "word_in.strobe != '0 && aw_resp_i", "aw_resp_i", DRAM),
    ("a burst that is refused writes", "board/rt_dram_writes.sv", "word_in.strobe != '0 && aw_resp_i == rt_board_pkg::RespOkay", "word_in.strobe != '0", DRAM),
    ("a write is answered before its command", "board/rt_dram_writes.sv", ".in_valid_i (command_take && command.last)",
     ".in_valid_i (push && command_in.last)", DRAM),
    ("nobody is patient", "board/rt_dram_port.sv", "late_q != '0 && !late_q[i]", "1'b0", DRAM),
    ("a read across 4 KB goes on", "board/rt_dram_port.sv", "|| crosses ||", "||", DRAM),
    ("the memory answers before it is ready", "board/rt_dram_port.sv", "|| !initialised", "", DRAM),
    ("reads beyond the memory wrap", "board/rt_dram_port.sv", "b.resp = rt_board_pkg::RespDecErr;", "b.resp = rt_board_pkg::RespOkay;", DRAM),
]

SOURCES = rtl_packages()
# Models that a test program has under another name or with parameters of its own, as CMake verilates them.
PREFIX = {"tb_pixels": "Vtb_pixels_g64", "rt_board": "Vrt_board_small", "tb_dram_port": "Vtb_dram_port_w128"}
PARAMETERS = {"tb_pixels": ["-GDataBits=64", "-GGranuleBytes=64", "-GLevels=2"], "rt_board": ["+define+RT_CONFIG=ConfigSmall", "-GDivisor=1024", "-GMemoryBytes=32768"]}


CACHE = ["ccache"] if shutil.which("ccache") else []  # most of a large model is what it was


def run(command, **options):
    return subprocess.run(command, capture_output=True, text=True, **options)


def link_command(build, target):
    commands = run(["ninja", "-C", build, "-t", "commands", target]).stdout.strip().splitlines()
    line = [c for c in commands if re.search(r" -o \S*%s( |$)" % target, c)][-1]
    return line.split("&&")[1].strip()


def source_of(mutant):
    """Text of the file that a mutant changes; RuntimeError if what it replaces is not there."""
    name, path, old, *_ = mutant
    with open(os.path.join("rtl", path)) as file:
        text = file.read()
    if old not in text:
        raise RuntimeError("%s: text not found in %s: %s" % (name, path, old))
    return text


def verilate(model, rtl, objects, configuration=None):
    """Makes the C++ of a model whose sources are in `rtl`; a core has a configuration."""
    prefix, parameters = PREFIX.get(model, "V" + model), PARAMETERS.get(model, [])
    if configuration:
        prefix, parameters = "Vrt_" + configuration, ["+define+RT_CONFIG=Config" + configuration.capitalize()]
    top = "testbench/sim/sv/%s.sv" % model if model.startswith("tb_") else glob.glob("%s/*/%s.sv" % (rtl, model))[0]
    step = run(["verilator", "--cc", "--assert", "-O3", "--x-assign", "fast", "--x-initial", "unique", "-Wno-fatal", "-Wno-lint", "--output-split", "20000",
                *[word for room in rtl_rooms() for word in ("-y", os.path.join(rtl, room))], "+incdir+" + rtl + "/pkg", "--Mdir", objects,
                "--prefix", prefix, "--top-module", model, *parameters, *[os.path.join(rtl, s) for s in SOURCES], top])
    if step.returncode != 0:
        raise RuntimeError("verilator: %s" % step.stderr[-2000:])


def compile_model(model, objects, jobs):
    """Compiles what verilate() made; returns the object files."""
    root = run(["verilator", "--getenv", "VERILATOR_ROOT"]).stdout.strip()

    def one(source):
        # The library's bench takes longer to compile than to run.
        level = "-O0" if "Slow" in source or model.startswith("tb_") else "-O1"
        step = run([*CACHE, "c++", "-std=c++20", "-w", level, "-I" + objects, "-I" + root + "/include", "-I" + root + "/include/vltstd",
                    "-DVL_TIME_CONTEXT", "-c", source, "-o", source[:-4] + ".o"])
        if step.returncode != 0:
            raise RuntimeError("compiler: %s" % step.stderr[-2000:])
        return os.path.abspath(source[:-4] + ".o")

    with ThreadPoolExecutor(jobs) as pool:
        return list(pool.map(one, sorted(glob.glob(objects + "/*.cpp"))))


def link(command, build, binary, compiled):
    # The mutated model comes first on the line, so the linker never needs the one in the library.
    command = re.sub(r" -o \S+", lambda _: " -o %s -Wl,--allow-multiple-definition %s" % (binary, " ".join(compiled)), command, count=1)
    step = run(["sh", "-c", command], cwd=build)
    if step.returncode != 0:
        raise RuntimeError("linker: %s" % step.stderr[-2000:])


def failed_tests(step):
    failed = sorted({f for f in re.findall(r"^\[  FAILED  \] (\S+?)(?:,| |$)", step.stdout, re.M) if "." in f})
    return failed or ([] if step.returncode == 0 else ["crash"])


def check(mutant, build, work, links, vectors):
    """Returns (name, seconds, the test that failed) or raises on a mutant that could not be made."""
    name, path, old, new, (model, test, pattern) = mutant
    start = time.monotonic()
    folder = os.path.join(work, re.sub(r"\W+", "_", name))
    shutil.rmtree(folder, ignore_errors=True)
    rtl = os.path.join(folder, "rtl")
    shutil.copytree("rtl", rtl)
    mutated = source_of(mutant).replace(old, new)
    with open(os.path.join(rtl, path), "w") as file:
        file.write(mutated)
    binary = os.path.abspath(os.path.join(folder, test))
    try:
        verilate(model, rtl, os.path.join(folder, "obj"))
        link(links[test], build, binary, compile_model(model, os.path.join(folder, "obj"), 1))
    except RuntimeError as error:
        raise RuntimeError("%s: %s" % (name, error)) from error
    environment = dict(os.environ, RETRACE_VECTORS=str(vectors))
    try:
        # A broken stream breaks many tests at length; the first one is enough.
        failed = failed_tests(run([binary, "--gtest_fail_fast", "--gtest_filter=" + pattern], env=environment, timeout=600))
    except subprocess.TimeoutExpired:
        failed = ["timeout"]
    shutil.rmtree(folder, ignore_errors=True)
    return name, time.monotonic() - start, failed


def with_choices(path, mutants):
    """Text of a file of the core in which each of its mutants, a number and a row of core_mutants.py, is chosen by its number."""
    with open(os.path.join("rtl", path)) as file:
        text = file.read()
    insertions = []  # (where, closing ones first and outer ones before inner ones, what)
    for number, (name, _, context, new) in mutants:
        before, old, after = context.split("@")
        if text.count(before + old + after) != 1:
            raise RuntimeError("%s: text is there %d times in %s: %s" % (name, text.count(before + old + after), path, before + old + after))
        begin = text.index(before + old + after) + len(before)
        insertions.append((begin, 1, -len(old), "(rt_mutant_pkg::chosen == %d ? (%s) : (" % (number, new)))
        insertions.append((begin + len(old), 0, 0, "))"))
    for where, _, _, what in sorted(insertions, reverse=True):
        text = text[:where] + what + text[where:]
    return text


MUTANT_PACKAGE = """package rt_mutant_pkg;
  int unsigned chosen = $c32("(std::getenv(\\"RETRACE_MUTANT\\") ? std::atoi(std::getenv(\\"RETRACE_MUTANT\\")) : 0)");
endpackage
"""
# The tests of the core that take the configuration the model has, the quick ones first: (mutants, configuration, tests).
SMALL_TESTS = [
    ("rtl_core_test", "RtlCore.A*:RtlCore.Counters*:RtlCore.Rays*:RtlCore.StepLimit"),
    ("rtl_core_test", "*_small_*:RtlCore.Rows*:RtlCore.Corrupt*:RtlCore.Header*:RtlCore.Read*:RtlCore.Write*"),
    ("rtl_core_test", "RtlCoreSink.*"),
    ("rtl_bus_test", "RtlBus.Resets*"),
    ("rtl_bus_test", "RtlBus.*"),
    ("rtl_core_test", "RtlCore.Every*"),
]
TWO_LEVEL_TESTS = [
    ("rtl_two_level_test", "*EqualTheKernel*/1:RtlTwoLevel.Headers*"),
    ("rtl_two_level_test", "*EqualTheKernel*/12:RtlTwoLevel.StepLimit*:RtlTwoLevel.Leaves*"),
    ("rtl_two_level_test", "RtlTwoLevel.*:RtlLevels.*"),
    ("rtl_two_level_test", "*EqualTheKernel*/100"),
]
CORES = [(core_mutants.MUTANTS, "small", SMALL_TESTS), (core_mutants.TWO_LEVELS, "saarcor", TWO_LEVEL_TESTS)]


def core_files(numbered):
    return {path: with_choices(path, [m for m in numbered if m[1][1] == path]) for path in sorted({m[1][1] for m in numbered})}


def check_core(numbered, configuration, tests, build, work, links, jobs):
    """Yields (name, seconds, the tests that failed) for each mutant of the core; RuntimeError if the model cannot be made or is wrong without a mutant."""
    folder = os.path.join(work, "core_" + configuration)
    shutil.rmtree(folder, ignore_errors=True)
    rtl, objects = os.path.join(folder, "rtl"), os.path.join(folder, "obj")
    shutil.copytree("rtl", rtl)
    for path, text in core_files(numbered).items():
        with open(os.path.join(rtl, path), "w") as file:
            file.write(text)
    with open(os.path.join(rtl, SOURCES[0]), "a") as file:
        file.write(MUTANT_PACKAGE)
    verilate("rt_top", rtl, objects, configuration)
    compiled = compile_model("rt_top", objects, jobs)
    for test in {test for test, _ in tests}:
        link(links[test], build, os.path.abspath(os.path.join(folder, test)), compiled)

    def run_tests(number, test, pattern, limit):
        """Returns the tests that failed, and the processor's seconds."""
        # Not the clock on the wall: what else the machine does must not catch a mutant.
        step = subprocess.Popen([os.path.join(folder, test), "--gtest_fail_fast", "--gtest_filter=" + pattern], text=True, stdout=subprocess.PIPE,
                                stderr=subprocess.DEVNULL, env=dict(os.environ, RETRACE_MUTANT=str(number)),
                                preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_CPU, (limit, limit)))
        with step.stdout:
            output = step.stdout.read()
        _, status, usage = os.wait4(step.pid, 0)
        step.returncode = os.waitstatus_to_exitcode(status)
        if step.returncode in (-signal.SIGXCPU, -signal.SIGKILL):
            running = re.findall(r"^\[ RUN      \] (\S+)", output, re.M)
            return ["%s does not end" % (running[-1] if running else test)], limit
        return failed_tests(subprocess.CompletedProcess(step.args, step.returncode, output)), usage.ru_utime + usage.ru_stime

    # Most mutants fail in the first group of tests; the others are for those that are left.
    spent = dict.fromkeys((number for number, _ in numbered), 0.0)
    with ThreadPoolExecutor(jobs) as pool:
        for test, pattern in tests:
            if not numbered:
                break
            failed, seconds = run_tests(0, test, pattern, 3600)
            if failed:
                raise RuntimeError("the core without a mutant: %s" % ", ".join(failed))
            limit = int(2 * seconds + 5)
            left = []
            for mutant, (failed, seconds) in zip(numbered, pool.map(lambda m: run_tests(m[0], test, pattern, limit), numbered)):
                spent[mutant[0]] += seconds
                if failed:
                    yield mutant[1][0], spent[mutant[0]], failed
                else:
                    left.append(mutant)
            numbered = left
    for number, mutant in numbered:
        yield mutant[0], spent[number], []
    shutil.rmtree(folder, ignore_errors=True)


def main():
    parser = argparse.ArgumentParser(description="Mutants of the RTL and the tests that catch them.")
    parser.add_argument("--build", default="build/release", help="a Ninja build with the tests of the RTL")
    parser.add_argument("--only", default="", help="mutants whose name or file holds this text")
    parser.add_argument("--core", action="store_true", help="only those of the whole core, which are one model")
    parser.add_argument("--config", default="", help="of the core: only the mutants of this configuration, small or saarcor (two levels)")
    parser.add_argument("--list", action="store_true", help="list the mutants; one whose text is not in the RTL is an error")
    parser.add_argument("--vectors", type=int, default=1000000, help="vectors a stage")
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    arguments = parser.parse_args()
    mutants = [m for m in MUTANTS if not arguments.core and (arguments.only in m[0] or arguments.only in m[1])]
    cores = [([(i, m) for i, m in enumerate(rows, 1) if arguments.only in m[0] or arguments.only in m[1]], configuration, tests)
             for rows, configuration, tests in CORES if arguments.config in ("", configuration)]
    core = [mutant for rows, _, _ in cores for mutant in rows]
    if arguments.list:
        stale = 0
        for mutant in mutants:
            print("%-70s %s" % mutant[:2])
            try:
                source_of(mutant)
            except RuntimeError as error:
                print("mutants: %s" % error, file=sys.stderr)
                stale += 1
        for mutant in core:
            print("%-70s %s" % mutant[1][:2])
            try:
                with_choices(mutant[1][1], [mutant])
            except RuntimeError as error:
                print("mutants: %s" % error, file=sys.stderr)
                stale += 1
        return 1 if stale else 0
    tests = sorted({m[4][1] for m in mutants} | {test for rows, _, groups in cores if rows for test, _ in groups})
    step = subprocess.run(["ninja", "-C", arguments.build, *tests], stdout=subprocess.DEVNULL)
    if step.returncode != 0:
        print("mutants: cannot build %s in %s" % (" ".join(tests), arguments.build), file=sys.stderr)
        return 1
    links = {test: link_command(arguments.build, test) for test in tests}
    work = os.path.join(arguments.build, "mutants")
    survivors = 0

    def report(name, seconds, failed):
        print("%-9s %-68s %5.1f s  %s" % ("caught" if failed else "SURVIVED", name, seconds, ", ".join(f.split("/", 1)[-1] for f in failed)), flush=True)
        return not failed

    with ThreadPoolExecutor(arguments.jobs) as pool:
        jobs = [pool.submit(check, m, arguments.build, work, links, arguments.vectors) for m in mutants]
        for job in jobs:
            try:
                survivors += report(*job.result())
            except RuntimeError as error:
                survivors += 1
                print("BROKEN    %s" % error, flush=True)
    for rows, configuration, groups in cores:
        if not rows:
            continue
        try:
            for result in check_core(rows, configuration, groups, arguments.build, work, links, arguments.jobs):
                survivors += report(*result)
        except RuntimeError as error:
            print("mutants: %s" % error, file=sys.stderr)
            return 1
    print("mutants: %d of %d caught" % (len(mutants) + len(core) - survivors, len(mutants) + len(core)))
    return 1 if survivors else 0


if __name__ == "__main__":
    sys.exit(main())
