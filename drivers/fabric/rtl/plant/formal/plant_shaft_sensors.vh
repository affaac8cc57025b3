// SPDX-License-Identifier: MIT
// A and B never change in the same clock, as long as the shaft moves less than half a count in one; a cable that is cut
// says so.
reg began = 1'b0;
always @(posedge clk)
    began <= began || !rst_n;
wire [31:0] moves = (begins ? line : way + increment) - way;
always @*
    assume (moves < 32'h2000_0000 || moves > 32'hE000_0000);
reg [2:0] alive = 3'd0;
always @(posedge clk)
    alive <= rst_n && !cut ? {alive[1:0], 1'b1} : 3'd0;
always @(posedge clk)
    if (began) begin
        if (alive[1])
            assert (!(pin_a != $past(pin_a) && pin_b != $past(pin_b)));
        if ($past(rst_n) && $past(cut))
            assert (pin_lost && !pin_a && !pin_b && !pin_index);
        if ($past(rst_n) && !$past(cut))
            assert (!pin_lost && pin_b == $past(way[31]) && pin_a == $past(way[31] ^ way[30]));
        if (!$past(rst_n))
            assert (!pin_a && !pin_b && !pin_index && !pin_lost);
    end
