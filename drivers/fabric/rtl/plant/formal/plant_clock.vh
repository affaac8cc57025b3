// SPDX-License-Identifier: MIT
// A step never stops and never takes longer; its legs are counted once, its operations never begin in the middle.
reg began = 1'b0;
reg [6:0] since = 7'd0;                  // clocks since the last tick
always @(posedge clk) begin
    began <= began || !rst_n;
    since <= !rst_n || tick ? 7'd0 : since + 7'd1;
end

always @(posedge clk)
    if (began) begin
        assert (clock < `PLANT_STEP);
        assert (last == (clock == `PLANT_STEP - 7'd1));
        assert (tick == (clock == `PLANT_STEP - 7'd3));
        // at most a step from one tick to the next
        assert (since <= `PLANT_STEP);
        assert (clock >= `PLANT_STEP - 7'd2 ? since == clock - (`PLANT_STEP - 7'd2) : since <= clock + 7'd2);
        if ($past(rst_n) && rst_n)
            assert (clock == ($past(clock) == `PLANT_STEP - 7'd1 ? 7'd0 : $past(clock) + 7'd1));
        if ($past(rst_n) && $past(clock) != `PLANT_STEP - 7'd1)
            assert (active == $past(active) && first == $past(first));
        if ($past(rst_n) && $past(clock) == `PLANT_STEP - 7'd1)
            assert (active == $past(run) && first == !$past(active));
    end
