"""Mutants of the whole core: (what is broken, file below rtl/top, text with the expression between @, what stands for it instead).

All of them are compiled into one model, in which the environment chooses one (mutants.py), so each is an expression in place of another.
"""
MUTANTS = [
    # The pipe of contexts.
    ("a parked context goes on", "rt_context_pipe.sv", "<= @stage_valid_o[k-1] && !park_i[k-1]@", "stage_valid_o[k-1]"),
    ("a context with more to do is forgotten", "rt_context_pipe.sv", "<= @(retry_i || again_i)@", "retry_i"),
    ("a retry is forgotten", "rt_context_pipe.sv", "<= @(retry_i || again_i)@", "again_i"),
    ("the context behind is tried again", "rt_context_pipe.sv", "retry_context_q <= @stage_context_o[Last]@;", "stage_context_o[Last-1]"),
    ("a read error is not told", "rt_ready.sv", "'{error: @wake_error_i[i]@,", "1'b0"),
    ("a push counts as a read error", "rt_ready.sv", "'{error: @push_error_i[i]@,", "1'b1"),
    # The lane.
    ("a node's side is taken on the way up", "rt_lane.sv", "s5_right   = @s5_state_q.up ? s5_state_q.parent[0] : s5_state_q.node[0]@;", "s5_state_q.node[0]"),
    ("a step up is lost to a launch", "rt_lane.sv", "backtrack_take = @!launch_valid_i@;", "1'b1"),
    ("a step down is lost to one up", "rt_lane.sv", "descend_take   = @!launch_valid_i && !backtrack_valid@;", "!launch_valid_i"),
    ("an arrival is lost where its queue is full", "rt_lane.sv", "|| @(s5_out && !out_ready)@;", "1'b0"),
    ("a miss counts as a hit in the lane", "rt_lane.sv", "park[5] = @s5_look_q && !s5_hit_q@;", "1'b0"),
    ("every segment begins at the origin", "rt_lane.sv", "descend_in.t     = @s5_segment_q.t@;", "'0"),
    # The leaf unit.
    ("a leaf of three is read like one of two", "rt_leaf_unit.sv", "if (@in_data_q.size <= 3'd2@)", "in_data_q.size <= 3'd3"),
    ("parents of empty leaves are not read", "rt_leaf_unit.sv", "if (@in_data_q.size == '0 && !parent_links_i@)", "in_data_q.size == '0"),
    ("links of the other side", "rt_leaf_unit.sv", "= @p6_ray_q.negative[axis]@ ?", "!p6_ray_q.negative[axis]"),
    ("the link of another axis", "rt_leaf_unit.sv", "leave_o.link = @tag_out.link[axis]@;", "tag_out.link[0]"),
    ("a long leaf has as many references as its code", "rt_leaf_unit.sv", "p6_count  = @p6_size_q < rt_core_pkg::leaf_size_t'(rt_contract_pkg::LeafLong)@ ?", "1'b1"),
    ("a miss counts as a hit in the leaf unit", "rt_leaf_unit.sv", "park[5] = @p5_look && !p5_hit@;", "1'b0"),
    ("tests are no steps", "rt_leaf_unit.sv", "leave_o.steps  = @tag_out.steps + 32'(tag_out.count)@;", "tag_out.steps"),
    ("an empty leaf is tested", "rt_leaf_unit.sv", "at_once         = @result != rt_core_pkg::EventGoOn || tag_out.count == '0@;", "result != rt_core_pkg::EventGoOn"),
    # The reference unit.
    ("one test too many", "rt_reference_unit.sv", "if (@LimitBits'(i2_next_q) >= i2_refs_q.steps_end@)", "LimitBits'(i2_next_q) > i2_refs_q.steps_end"),
    ("a leaf begins where the one before ended", "rt_reference_unit.sv", "<= @i1_first_q ? '0 : i1_stored.next@;", "i1_stored.next"),
    ("the last reference is left out", "rt_reference_unit.sv", "i4_final_q       <= @i3_after_q == i3_count_q@;", "i3_after_q + 1'b1 == i3_count_q"),
    ("a reference keeps the index of the one before", "rt_reference_unit.sv", "if (@done_q@) resolved_q[done_context_q] <= 1'b0;", "1'b0"),
    ("a test is lost where the stage is busy", "rt_reference_unit.sv", "i9_replay = @i9_send && !out_ready_i@;", "1'b0"),
    ("a list miss counts as a hit", "rt_reference_unit.sv", "park[5] = @i5_list_look && !i5_list_hit@;", "1'b0"),
    ("the list begins a reference late", "rt_reference_unit.sv", "!i2_resolved_q && @i2_next_q >= 24'(rt_contract_pkg::LeafInline)@;", "i2_next_q > 24'(rt_contract_pkg::LeafInline)"),
    ("the first entry of each word of the list", "rt_reference_unit.sv", "i3_entry_q       <= @i2_entry[WordEntryBits-1:0]@;", "'0"),
    # The result unit.
    ("the last of two equal hits wins", "rt_result_unit.sv", "|| @(r4_same_q && r4_lower_id_q)@", "r4_same_q"),
    ("a ray goes on behind its hit", "rt_result_unit.sv", "@signed'({2'b0, r5_best_q.t}) <= signed'({r5_leave_q.exit.t_exit[27], r5_leave_q.exit.t_exit})@", "1'b0"),
    ("a way up follows face links", "rt_result_unit.sv", "r5_target = @parent_links_i ? r5_leave_q.node : r5_leave_q.link@;", "r5_leave_q.link"),
    ("a ray begins with the hit of the one before", "rt_result_unit.sv", "if (@ray_valid_i@) has_hit_q[ray_context_i] <= 1'b0;", "1'b0"),
    # The ray source.
    ("a row of a tile goes on in the next tile", "rt_ray_source.sv", "in_tile_q   <= @(TileBits + 1)'(TileWidth) - done_q@;", "(TileBits + 1)'(TileWidth)"),
    ("the source is done with rays on their way", "rt_ray_source.sv", "done_o = @left_q == '0 && !order_valid && !ray_valid_q@;", "left_q == '0"),
    # Launch.
    ("contexts are given out twice", "rt_launch.sv", "new_left_q  <= @new_block_q != '1@;", "1'b1"),
    ("a bad ray is traced", "rt_launch.sv", "else if (@!setup_out.valid[0]@)", "1'b0"),
    ("a ray is launched with its first axis", "rt_launch.sv", "setup_take     = @next_valid_q && launch_ready_i && axis_is_last@;", "next_valid_q && launch_ready_i"),
    ("a launch does not wait for a return", "rt_launch.sv", "launch         = @launch_valid_o && launch_ready_i@;", "launch_valid_o"),
    ("contexts that are freed still count", "rt_launch.sv", "- @(ContextBits + 1)'(free_valid_i)@;", "(ContextBits + 1)'(1'b0)"),
    ("every axis has the direction of the first", "rt_launch.sv", "direction: @setup_out.direction[axis_q]@,", "setup_out.direction[0]"),
    # Control.
    ("the first line of the header is read twice", "rt_control.sv", "@(rt_core_pkg::AddrBits'(beat_q) << $clog2(DataBits / 8))@,", "'0"),
    ("the host's step limit is ignored", "rt_control.sv", "<= @run_i.own_step_limit@ ?", "1'b0"),
    ("a run ends with rays in flight", "rt_control.sv", "@!ray_taken_i && in_flight_q == '0@)", "!ray_taken_i"),
    ("a run does not wait for its hits", "rt_control.sv", "Drained: if (@sinks_done_i@)", "1'b1"),
    ("a fault stays for the next run", "rt_control.sv", "          ray_fault_q   <= @1'b0@;", "ray_fault_q"),
    # The hit sink.
    ("hits go to the line that is there", "rt_hit_sink.sv", "same_line  = @entry.number == number_q@;", "1'b1"),
    ("a line is overwritten while it is read", "rt_hit_sink.sv", "blocked    = @out_reading_q && out_place_q == place_q@;", "1'b0"),
    ("lines are not flushed", "rt_hit_sink.sv", "leave          = @flush_i && !flushed_q && !in_valid_i && !free_place && leave_open@;", "1'b0"),
    ("done does not wait for the last answers", "rt_hit_sink.sv", "empty_o   = @flushed_q && !order_valid@;", "flushed_q"),
    # Isolation, and the wires.
    ("a ray is launched beside a return", "rt_core.sv", "ray_ready      = @!return_valid_q@;", "1'b1"),
    ("an end is lost where the arbiter is busy", "rt_core.sv", "arrival_ready = @!arrival_ends || end_ready[0]@;", "1'b1"),
    ("every hit counts as a fault", "rt_core.sv", "hit_fault = hit_taken && @hit_o.hit.status > status_t'(rt_contract_pkg::StatusHit)@;", "1'b1"),
    ("steps down are counted as steps up", "rt_core.sv", "steps.up                = rt_config_pkg::counter_step_t'($countones(@lane_up@));", "lane_down"),
]
