// SPDX-License-Identifier: MIT
// What slot 2 promises, from the first reset on; the counter's and the filters' own promises stand beside their modules.
reg f_ran = 1'b0;
always @(posedge clk) f_ran <= f_ran || !rst_n;

// registers as the contract has them, from the bus alone
reg [1:0]  f_control;
reg [16:0] f_counts;
reg [15:0] f_filter;
always @(posedge clk)
    if (!rst_n) begin
        f_control <= 2'd0;
        f_counts  <= 17'd4096;
        f_filter  <= 16'd0;
    end else if (write)
        case ({addr, 2'b00})
        8'h00: f_control <= wdata[1:0];
        8'h04: f_counts  <= wdata < 32'd4 ? 17'd4 : wdata > 32'd65536 ? 17'd65536 : wdata[16:0];
        8'h20: f_filter  <= wdata[15:0];
        default: ;
        endcase

always @(posedge clk) if (f_ran) begin
    assert (control == f_control && {filter_hall, filter_encoder} == f_filter);
    assert (counts == f_counts && {1'b0, top} + 17'd1 == f_counts);
    if (sel)
        case ({addr, 2'b00})
        8'h00: assert (rdata == {30'd0, f_control});
        8'h04: assert (rdata == {15'd0, f_counts});
        8'h08: assert (rdata == {16'd0, position} && rdata < {15'd0, f_counts});
        8'h0C: assert (rdata == {16'd0, latched});
        8'h10: assert (rdata == {16'd0, index});
        8'h14: assert (rdata == {29'd0, signal_lost, illegal_seen, index_seen});
        8'h18: assert (rdata == edge_time);
        8'h1C: assert (rdata == latch_time);
        8'h20: assert (rdata == {16'd0, f_filter});
        8'h24: assert (rdata == {25'd0, hall_state, 1'b0, hall_latched});
        8'h28: assert (rdata == hall_time);
        default: assert (rdata == 32'd0);
        endcase
    else
        assert (rdata == 32'd0);
    assert (load_top >= 16'd3 && position <= top);
    assert (faulty == (signal_lost || illegal_seen));
end

// the index and the loss of a line as the pins had them
reg f_z, f_lost, f_lost_sync;
always @(posedge clk) begin
    f_z         <= rst_n && z;
    f_lost_sync <= rst_n && pin_lost;
    f_lost      <= rst_n && f_lost_sync;
end
wire f_loads   = write && {addr, 2'b00} == 8'h04;
wire f_clears  = write && {addr, 2'b00} == 8'h14;
wire f_indexed = f_control[0] && !f_lost && z && !f_z;

always @(posedge clk) if (f_ran)
    assert (z_was == f_z && lost == f_lost && lost_sync[0] == f_lost_sync);

always @(posedge clk) if (f_ran) begin
    if (!$past(rst_n)) begin
        assert (now == 32'd0 && latched == 16'd0 && index == 16'd0 && edge_time == 32'd0 && latch_time == 32'd0);
        assert (!index_seen && !illegal_seen && !signal_lost && edge_now == 32'd0);
    end else begin
        assert (now == $past(now) + 32'd1);
        // the time of an edge is that of the clock in which the count moved
        assert (edge_now == ($past(counted) ? $past(now) : $past(edge_now)));
        // what is latched is of one instant, and of nothing but the trigger's
        if ($past(trigger))
            assert (latched == $past(position) && edge_time == $past(edge_now) && latch_time == $past(now));
        else
            assert (latched == $past(latched) && edge_time == $past(edge_time) && latch_time == $past(latch_time));
        // the index takes the position as it is after its clock
        assert (index == ($past(f_indexed) ? position : $past(index)));
        // flags: set in spite of a clearing in the same clock, else cleared by a 1, else kept
        assert (index_seen == ($past(f_indexed) || ($past(index_seen) && !($past(f_clears) && $past(wdata[0])))));
        assert (illegal_seen == ($past(illegal) || ($past(illegal_seen) && !($past(f_clears) && $past(wdata[1])))));
        assert (signal_lost == ($past(f_lost) || ($past(signal_lost) && !($past(f_clears) && $past(wdata[2])))));
        // while the count stands, so do position and time
        if (!$past(counted) && !$past(f_loads))
            assert (position == $past(position));
    end
end
