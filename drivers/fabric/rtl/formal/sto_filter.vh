// SPDX-License-Identifier: MIT
// What the filter of a safe-torque-off input promises, for test pulses of any length.
reg f_ran = 1'b0;
always @(posedge clk) f_ran <= 1'b1;
always @* if (!f_ran) assume (!rst_n);
(* anyconst *) reg [16:0] f_constant;
always @* assume (longest == f_constant);

// The pin behind its two flip-flops: for how many clocks it has been low or high, this one left out; how long the last low was.
reg [1:0]  f_low;
reg [17:0] f_low_for, f_high_for, f_pulse;
reg        f_tests;         // all that came since the reset may be a test
wire [17:0] f_longest = {1'b0, longest};
always @(posedge clk)
    if (!rst_n) begin
        f_low      <= 2'b00;
        f_low_for  <= 18'd0;
        f_high_for <= 18'd0;
        f_pulse    <= 18'd0;
        f_tests    <= 1'b1;
    end else begin
        f_low      <= {f_low[0], !pin_n};
        f_low_for  <= !f_low[1] ? 18'd0 : f_low_for + (f_low_for != 18'h3FFFF);
        f_high_for <= f_low[1] ? 18'd0 : f_high_for + (f_high_for != 18'h3FFFF);
        if (f_low[1])
            f_pulse <= f_low_for + (f_low_for != 18'h3FFFF);
        // a test is no longer than `longest`, and what follows it is high for as long as it was low
        if (f_low[1] && (f_low_for >= f_longest || (f_low_for == 18'd0 && f_high_for < f_pulse)))
            f_tests <= 1'b0;
    end

always @* if (f_ran) begin
    assert (low == f_low);
    // tests never ask; what is low for a clock longer does, and goes on until it has been high for as long
    if (f_tests) assert (!asks);
    if (f_low_for > f_longest) assert (asks);
    if (f_high_for > f_longest) assert (!asks);
    // how the counter goes along
    assert (count <= longest);
    if (f_low_for != 18'd0) assert (f_high_for == 18'd0 && f_pulse == f_low_for);
    if (f_low_for != 18'd0) assert ({1'b0, count} >= (f_low_for < f_longest ? f_low_for : f_longest));
    if (f_high_for != 18'd0) assert ({2'b00, count} + f_high_for <= {1'b0, f_longest} || count == 17'd0);
    if (f_tests) begin
        assert (f_low_for <= f_longest && f_pulse <= f_longest);
        if (f_low_for != 18'd0) assert ({1'b0, count} == f_low_for);
        else assert ({1'b0, count} == (f_pulse > f_high_for ? f_pulse - f_high_for : 18'd0));
    end
end
always @(posedge clk) if (f_ran && $past(rst_n) && rst_n) begin
    assert (asks == $past(asks_next));
    // it begins to ask from `longest` on only, and ends at 0 only
    if (asks && !$past(asks)) assert ($past(count == longest && low[1]));
    if (!asks && $past(asks)) assert ($past(count == 17'd0 && !low[1]));
    assert (count == $past(count) + 17'd1 || count == $past(count) - 17'd1 || (count == $past(count)
            && (count == 17'd0 || count == longest)));
end else if (f_ran && !$past(rst_n))
    assert (!asks && count == 17'd0);
