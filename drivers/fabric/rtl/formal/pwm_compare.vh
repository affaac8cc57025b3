// SPDX-License-Identifier: MIT
// What one phase's compare promises. Taken for granted, and proved of pwm_carrier.v and pwm.v: the carrier goes one step a
// clock and turns at ends only; `load` comes at ends only, while it runs; the mode holds still while it runs.
reg f_ran = 1'b0;
always @(posedge clk) f_ran <= 1'b1;
always @* if (!f_ran) assume (!rst_n);

reg f_running, f_rising;
always @(posedge clk) begin
    f_running <= f_ran && running && rst_n;
    f_rising  <= rising;
end
wire f_half = f_ran && running && f_running && rising == f_rising;  // this clock and the last are of one half period
always @(posedge clk) if (f_ran) begin
    if (f_half) assume (count == (rising ? $past(count) + 16'd1 : $past(count) - 16'd1) && (!rising || count != 16'd0));
    if (f_half) assume (rising || $past(count) != 16'd0);
    if (running && $past(running && load) && $past(rst_n)) assume (rising != $past(rising));
    if (running) assume (once == $past(once));
end

always @(posedge clk) if (f_half) begin
    // at most one change of the wish in a half period, in its direction, and exactly where the compare says
    if (rising) assert (!wish || $past(wish));
    else assert (wish || !$past(wish));
    if (wish != $past(wish)) assert (count == compare);
end
always @* if (f_ran && running) begin
    // on for `compare` clocks on either side of the peak
    assert (wish == (rising ? count < compare : count <= compare));
end
always @(posedge clk) if (f_ran && $past(rst_n)) begin
    // a set that waits is taken at the load, or at once where both changes are to come, or while nothing runs
    if ($past(waiting && load) || $past(waiting && !running)) assert (compare == $past(newest));
    if ($past(once && fresh && running && !rising && count > compare && count > newest)) assert (compare == $past(newest));
    if ($past(once && fresh && running && rising && count < compare && count < newest)) assert (compare == $past(newest));
    // nothing else changes it
    if (compare != $past(compare)) begin
        assert ($past(waiting) && compare == $past(newest));
        assert ($past(load) || $past(!running) || $past(once && fresh));
    end
    // it waits until it is taken or withdrawn, and says so
    if ($past(commit)) assert (waiting && fresh);
    else if ($past(withdraw)) assert (!waiting);
    else if ($past(waiting)) assert (waiting || compare == $past(newest));
    else assert (!waiting);
    // what could not act at once is told, and nothing else is
    if ($past(fresh)) assert (fell_back == ($past(once) && $past(running) && $past(!load)
        && !($past(!rising && count > compare && count > newest) || $past(rising && count < compare && count < newest))));
    else assert (fell_back == $past(fell_back));
    // told so, it waits for the next end
    if ($past(fresh) && fell_back && !$past(withdraw)) assert (waiting || $past(commit));
end else if (f_ran) begin
    assert (compare == 16'd0 && !waiting && !fell_back);
end
always @* if (f_ran && fresh) assert (waiting);
