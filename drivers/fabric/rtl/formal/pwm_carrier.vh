// SPDX-License-Identifier: MIT
// What the carrier promises. Taken for granted, and proved of pwm.v: PERIOD holds still while it runs.
reg f_ran = 1'b0;
always @(posedge clk) f_ran <= 1'b1;
always @* if (!f_ran) assume (!rst_n);
reg        f_running;
reg [15:0] f_was_period;
always @(posedge clk) begin
    f_running    <= f_ran && running && rst_n;
    f_was_period <= period;
end
always @* if (f_ran && (running || f_running)) assume (period == f_was_period);
wire f_steps = f_ran && f_running && running;
// clocks since the last valley, once there was one
reg        f_seen;
reg [17:0] f_clocks;
always @(posedge clk) begin
    f_seen   <= rst_n && run && running && (to_valley || f_seen);
    f_clocks <= to_valley ? 18'd0 : f_clocks + 18'd1;
end

always @(posedge clk) begin
    if (f_steps) begin
        // one step a clock, and a turn at the ends only
        if ($past(to_valley)) assert (count == period && !rising);
        else if ($past(to_peak)) assert (count == 16'd0 && rising);
        else assert (rising == $past(rising) && count == (rising ? $past(count) + 16'd1 : $past(count) - 16'd1));
        // an end is announced if and only if the next clock is one
        assert (($past(to_valley) || $past(to_peak)) == (rising != $past(rising)));
    end
    // it starts where it was told to, and only when it may
    if (f_ran && running && !$past(running))
        assert (count == $past(start_count) && rising == $past(start_rising) && $past(run) && ($past(!follow) || $past(sync)));
    if (f_ran && $past(rst_n && run && !running && (!follow || sync))) assert (running);
    if (f_ran && $past(!run)) assert (!running);
    if (f_ran && !$past(rst_n)) assert (!running && count == 16'd2500 && !rising);
end
always @* if (f_ran) begin
    if (!running) assert (!to_valley && !to_peak);
    // what was worked out a clock ahead holds
    if (running) assert (rises_by == {1'b0, period} - 17'd2);
    if (running) assert (turns_down == (count == 16'hFFFF || count + 16'd1 >= period));
    // both ends come once every 2 PERIOD clocks, and COUNT says how far it is
    if (f_seen && period >= 16'd2) begin
        assert (running && count <= period && (rising || count != 16'd0) && (!rising || count < period));
        assert (f_clocks == (rising ? {2'd0, period} + {2'd0, count} : {2'd0, period} - {2'd0, count}));
        if (to_valley) assert (f_clocks + 18'd1 == {1'b0, period, 1'b0});
        if (to_peak) assert (f_clocks + 18'd1 == {2'd0, period});
    end
end
