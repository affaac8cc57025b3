// SPDX-License-Identifier: MIT
// What the counter promises, from the first reset on. The quadrature is stated as an angle in quarters of a line: up by one
// is A first, and a step of two has no direction.
function [1:0] f_quarter(input f_a, input f_b);
    f_quarter = {f_b, f_a ^ f_b};   // 00, 10, 11, 01 of A, B: 0, 1, 2, 3
endfunction

reg f_ran = 1'b0;
always @(posedge clk) f_ran <= f_ran || !rst_n;

// the levels of the clock before, as seen from outside
reg f_a, f_b;
always @(posedge clk) begin
    f_a <= rst_n && a;
    f_b <= rst_n && b;
end

wire [1:0] f_step   = f_quarter(a, b) - f_quarter(f_a, f_b);
wire       f_counts = enable && !lost && (f_step == 2'd1 || f_step == 2'd3);
wire       f_down   = (f_step == 2'd3) != reverse;

always @(posedge clk) if (f_ran) begin
    assert (f_a == a_was && f_b == b_was);
    assert (position <= top && top >= 16'd3);
    assert (counted == f_counts);
    assert (illegal == (enable && !lost && f_step == 2'd2));
end
always @* assume (load_top >= 16'd3);   // encoder.vh proves it of what feeds it

always @(posedge clk) if (f_ran) begin
    if (!$past(rst_n))
        assert (position == 16'd0 && top == 16'd4095);
    else if ($past(load))
        assert (position == 16'd0 && top == $past(load_top));
    else begin
        assert (top == $past(top));
        if (!$past(f_counts))
            assert (position == $past(position));
        else if ($past(f_down))
            assert ({1'b0, position} + 17'd1 == {1'b0, $past(position)} || (position == top && $past(position) == 16'd0));
        else
            assert ({1'b0, position} == {1'b0, $past(position)} + 17'd1 || (position == 16'd0 && $past(position) == top));
    end
    if ($past(rst_n))
        assert (position == $past(position_next));
end
