// SPDX-License-Identifier: MIT
// What the Hall inputs promise, from the first reset on.
reg        f_ran = 1'b0;
reg [2:0]  f_state;     // the state of the clock before, and when it last changed
reg [31:0] f_changed;
always @(posedge clk) begin
    f_ran <= f_ran || !rst_n;
    if (!rst_n) begin
        f_state   <= 3'd0;
        f_changed <= 32'd0;
    end else begin
        f_state <= state;
        if (state != f_state)
            f_changed <= now;
    end
end

always @(posedge clk) if (f_ran) begin
    assert (state_was == f_state && edge_now == f_changed);
    if (!$past(rst_n))
        assert (latched == 3'd0 && edge_time == 32'd0);
    else if ($past(trigger))
        assert (latched == $past(f_state) && edge_time == $past(f_changed));
    else
        assert (latched == $past(latched) && edge_time == $past(edge_time));
end
