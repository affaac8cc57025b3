// SPDX-License-Identifier: MIT
// What the serial front end promises at its pins, from the first reset on.
reg f_ran = 1'b0;
always @(posedge clk) f_ran <= f_ran || !rst_n;

reg [5:0] f_falls;      // falling edges of SCLK in this frame
reg [2:0] f_still;      // clocks since CS fell or SCLK moved, held at its most
always @(posedge clk) begin
    if (cs_n)
        f_falls <= 6'd0;
    else if (moves && sclk)
        f_falls <= f_falls + 6'd1;
    f_still <= cs_n || moves ? 3'd0 : f_still == 3'd7 ? f_still : f_still + 3'd1;
end

always @(posedge clk) if (f_ran) begin
    // helpers of the induction
    assert (left <= WAIT && edges <= END);
    if (!cs_n) begin
        assert (sclk == !edges[0] && f_falls == ({1'b0, edges[5:1]} + {5'd0, edges[0]}));
        assert (edges < END && f_still == {1'b0, WAIT - left});
    end else
        assert (sclk && left == WAIT);

    if (!$past(rst_n) || !$past(enable))
        assert (cs_n && sclk && !done);
    else begin
        // SCLK rests while CS is high, and moves HALF clocks after CS or its last edge
        if (sclk != $past(sclk))
            assert (!$past(cs_n) && $past(f_still) == {1'b0, WAIT});
        // a frame begins with `start` and ends HALF clocks after FALLS falling edges
        if (!cs_n && $past(cs_n))
            assert ($past(start));
        if ($past(cs_n) && $past(start))
            assert (!cs_n);
        if (cs_n && !$past(cs_n))
            assert ($past(f_falls) == FALLS && $past(f_still) == {1'b0, WAIT});
        if ($past(f_falls) == FALLS && $past(f_still) == {1'b0, WAIT} && !$past(cs_n))
            assert (cs_n);
        // complete with the last falling edge and no other
        assert (done == (!$past(cs_n) && $past(sclk) && !sclk && $past(f_falls) == FALLS - 1));
    end
    // a bit is what the line is at a falling edge, and nothing else changes a code
    if ($past(rst_n)) begin
        if (!$past(cs_n) && $past(moves) && $past(sclk))
            assert (line[0].code == {$past(line[0].code[10:0]), $past(sdata[0])} &&
                    line[LINES-1].code == {$past(line[LINES-1].code[10:0]), $past(sdata[LINES-1])});
        else
            assert (codes == $past(codes));
    end
end
