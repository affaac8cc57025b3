// SPDX-License-Identifier: MIT
// Never more clocks than a step has, and no switch on whose gate was not on when it turned on.
reg [6:0] since = 7'd0;                  // clocks counted so far
reg       began = 1'b0;
always @(posedge clk) begin
    began <= began || !rst_n;
    since <= !rst_n || tick ? 7'd0 : since + 7'd1;
end
// for how long a gate and its switch have differed
reg [7:0] differs_high = 8'd0, differs_low = 8'd0;
always @(posedge clk) begin
    differs_high <= !rst_n || high == conducts_high ? 8'd0 : differs_high + {7'd0, differs_high != 8'hFF};
    differs_low  <= !rst_n || low == conducts_low ? 8'd0 : differs_low + {7'd0, differs_low != 8'hFF};
end

// plant_clock.vh: there is a tick at least each 100 clocks
always @*
    assume (since < 7'd99 || tick || !rst_n);

always @(posedge clk)
    if (began) begin
        assert (since <= 7'd99);
        assert ({1'b0, count_high} + {1'b0, count_low} <= {1'b0, since});
        assert ({1'b0, high_clocks} + {1'b0, low_clocks} <= 8'd100);
        if ($past(rst_n) && conducts_high && !$past(conducts_high))
            assert ($past(high));
        if ($past(rst_n) && conducts_low && !$past(conducts_low))
            assert ($past(low));
        // it has waited no less than its delay
        assert (waited_high <= differs_high && waited_low <= differs_low);
        if ($past(rst_n) && conducts_high != $past(conducts_high))
            assert ($past(differs_high) >= $past(high ? on_delay : off_delay));
        if ($past(rst_n) && conducts_low != $past(conducts_low))
            assert ($past(differs_low) >= $past(low ? on_delay : off_delay));
        // both at once count as none
        if ($past(rst_n && conducts == 2'b11 && !tick))
            assert (count_high == $past(count_high) && count_low == $past(count_low));
        if (!$past(rst_n))
            assert (!conducts_high && !conducts_low);
    end
