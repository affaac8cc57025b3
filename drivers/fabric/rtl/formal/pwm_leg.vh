// SPDX-License-Identifier: MIT
// What a leg promises. Taken for granted, and proved of pwm.v: while enabled, DEAD and MIN_PULSE hold still, and neither the
// clock after a reset nor that after one with `ends` is enabled.
reg f_ran = 1'b0;
always @(posedge clk) f_ran <= 1'b1;
always @* if (!f_ran) assume (!rst_n);

wire [7:0] f_dead     = dead == 8'd0 ? 8'd1 : dead;
wire [7:0] f_shortest = shortest == 8'd0 ? 8'd1 : shortest;
reg       f_was_reset, f_was_ending;
reg [7:0] f_was_dead, f_was_shortest;
always @(posedge clk) begin
    f_was_reset    <= !rst_n;
    f_was_ending   <= ends;
    f_was_dead     <= dead;
    f_was_shortest <= shortest;
end
always @* if (f_ran) begin
    if (enable) assume (dead == f_was_dead && shortest == f_was_shortest);
    if (f_was_reset || f_was_ending) assume (!enable);
end

// clocks since a side was last on; clocks for which it has been on; whether it was the last one on
reg [9:0] f_since_high, f_since_low, f_for_high, f_for_low;
reg       f_from_high, f_from_low;
always @(posedge clk) begin
    f_since_high <= high ? 10'd0 : &f_since_high ? f_since_high : f_since_high + 10'd1;
    f_since_low  <= low ? 10'd0 : &f_since_low ? f_since_low : f_since_low + 10'd1;
    f_for_high   <= !high ? 10'd0 : &f_for_high ? f_for_high : f_for_high + 10'd1;
    f_for_low    <= !low ? 10'd0 : &f_for_low ? f_for_low : f_for_low + 10'd1;
    f_from_high  <= rst_n && enable && (high || (f_from_high && !low));
    f_from_low   <= rst_n && enable && (low || (f_from_low && !high));
    if (!f_ran) begin
        f_since_high <= 10'h3FF;
        f_since_low  <= 10'h3FF;
        {f_for_high, f_for_low, f_from_high, f_from_low} <= 22'd0;
    end
end
// clocks within which a wish must be obeyed, counted from its last change or from enabling; and clocks that it still takes
reg [10:0]  f_within;
reg         f_wish, f_steady;
wire [10:0] f_left = left == 8'd0 ? 11'd1 : {3'd0, left};
wire [10:0] f_both = {3'd0, f_dead} + {3'd0, f_shortest};
wire [10:0] f_due  = f_steady && wish == f_wish ? f_within : f_both + {3'd0, f_dead};
wire [10:0] f_wait = on ? (side == wish ? 11'd0 : f_left + {3'd0, f_dead}) : side == wish ? f_left : f_left + f_both;
always @(posedge clk) begin
    f_wish   <= wish;
    f_steady <= rst_n && enable;
    f_within <= f_due == 11'd0 ? 11'd0 : f_due - 11'd1;
end

always @* if (f_ran) begin
    // never both; none while not enabled
    assert (!(high && low));
    if (!enable) assert (!high && !low);
    if (f_was_ending) assert (!gate_high && !gate_low);
    // between one side and the other at least the dead time
    if (low) assert (f_since_high >= {2'd0, f_dead});
    if (high) assert (f_since_low >= {2'd0, f_dead});
    // a change of the wish that lasts is obeyed, within this many clocks
    if (enable && f_due == 11'd0) assert (wish ? high : low);
end
reg f_was_high, f_was_low, f_was_wish, f_was_enabled;
always @(posedge clk) begin
    f_was_high    <= high;
    f_was_low     <= low;
    f_was_wish    <= wish;
    f_was_enabled <= enable && rst_n && f_ran;
end
always @* if (f_ran && enable && f_was_enabled) begin
    // no pulse shorter than the shortest
    if (f_was_high && !high) assert (f_for_high >= {2'd0, f_shortest});
    if (f_was_low && !low) assert (f_for_low >= {2'd0, f_shortest});
    // the dead time is not longer than asked
    if (!f_was_low && low && f_from_high) assert (f_since_high == {2'd0, f_dead});
    if (!f_was_high && high && f_from_low) assert (f_since_low == {2'd0, f_dead});
    // a pulse that is long enough ends at once
    if (high && f_for_high > {2'd0, f_shortest}) assert (f_was_wish);
    if (low && f_for_low > {2'd0, f_shortest}) assert (!f_was_wish);
end
// of a driver with an input and an enable: it is told to be off whenever the leg is, and from the first gate on only then; its
// input is the gate that is on, changes when that turns off, and so stays for the dead time and the shortest pulse at least
reg        f_was_active, f_was_side;
reg        f_changed;           // the input has, since the enable rose
reg [10:0] f_same_for;          // clocks for which the enabled driver has had this input, this one left out
wire       f_changes = f_was_active && active && side != f_was_side;
wire [10:0] f_same   = f_changes || !f_was_active ? 11'd0 : f_same_for;
wire [10:0] f_least  = (f_changed ? {3'd0, f_dead} : 11'd0) + {3'd0, f_shortest};
always @(posedge clk) begin
    f_was_active <= active && rst_n && f_ran;
    f_was_side   <= side;
    f_same_for   <= &f_same ? f_same : f_same + 11'd1;
    f_changed    <= active && f_was_active && (f_changed || f_changes);
end
always @* if (f_ran) begin
    if (!enable) assert (!active);
    if (f_was_ending) assert (!leg_active);
    if (high) assert (active && side);
    if (low) assert (active && !side);
    if (active && f_was_enabled && f_was_active && side != f_was_side) assert ((f_was_high || f_was_low) && side == f_was_wish);
    if (enable && f_was_enabled) begin
        if (f_was_active) assert (active);
        if (active && !f_was_active) assert (high || low);
    end
    // a pulse at its input is as long as the shortest, and the dead time before it
    if (f_changes && enable && f_was_enabled) assert (f_same_for >= f_least);
    if (enable && f_was_enabled && f_was_active && active) begin
        if (on) assert (f_same >= (side ? {1'b0, f_for_high} : {1'b0, f_for_low}) + (f_changed ? {3'd0, f_dead} : 11'd0));
        else assert (f_same + f_left >= {3'd0, f_dead} && (f_changed || f_changes));
    end
    if (enable && leg_active && !on) assert (f_from_high || f_from_low);
    if (on) assert (leg_active);
end
// no high side that nobody has wished since the leg was off
reg f_wished;
always @(posedge clk) f_wished <= rst_n && (wish || (enable && f_wished));
always @* if (f_ran && !(f_wished || f_was_reset)) assert (!side && !high);
// what induction needs to know besides
always @* if (f_ran) assert (!(gate_high && !side) && !(gate_low && side));
always @* if (f_ran && enable) begin
    if (!on) begin
        assert (left <= dead);
        assert (!side || {1'b0, f_since_low} + {3'd0, left} >= {3'd0, dead});
        assert (side || {1'b0, f_since_high} + {3'd0, left} >= {3'd0, dead});
        if (f_from_high && !side) assert ({1'b0, f_since_high} + f_left == {3'd0, f_dead});
        if (f_from_low && side) assert ({1'b0, f_since_low} + f_left == {3'd0, f_dead});
        assert (!(f_from_high && side) && !(f_from_low && !side));
    end else begin
        assert (left <= shortest);
        assert (!side || {1'b0, f_for_high} + {3'd0, left} >= {3'd0, shortest});
        assert (side || {1'b0, f_for_low} + {3'd0, left} >= {3'd0, shortest});
        assert (side ? {1'b0, f_for_high} + f_left <= {3'd0, f_shortest} || left <= 8'd1
                     : {1'b0, f_for_low} + f_left <= {3'd0, f_shortest} || left <= 8'd1);
    end
    assert (f_wait <= f_due);
end
