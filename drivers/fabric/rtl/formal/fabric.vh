// SPDX-License-Identifier: MIT
// What the top promises of the bus: an access reaches the axis of its address and no other; without an axis, it reads 0.
reg f_ran = 1'b0;
always @(posedge clk) f_ran <= 1'b1;
always @* if (!f_ran) assume (!rst_n);
always @(posedge clk) if (f_ran) begin
    if ($past(rst_n && psel && paddr[27:10] < AXES))
        assert (prdata == {$past(paddr[13:10]), 17'd1, $past(pwrite), $past(paddr[9:0])});
    else
        assert (prdata == 32'd0);
end
always @* assert (pready && !pslverr);
