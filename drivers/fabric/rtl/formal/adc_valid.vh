// SPDX-License-Identifier: MIT
// A phase is valid exactly if its low side has conducted for the last `settle` clocks; here for a length chosen once.
reg f_ran = 1'b0;
always @(posedge clk) f_ran <= f_ran || !rst_n;
reg [11:0] f_on [0:2];
integer f_k;
always @(posedge clk)
    for (f_k = 0; f_k < 3; f_k = f_k + 1)
        f_on[f_k] <= !rst_n || !low[f_k] ? 12'd0 : f_on[f_k] == 12'd4095 ? 12'd4095 : f_on[f_k] + 12'd1;
always @(posedge clk) if (f_ran) begin
    assert (f_on[0] == phase[0].on_for && f_on[1] == phase[1].on_for && f_on[2] == phase[2].on_for);
    assert (valid == {f_on[2] >= settle, f_on[1] >= settle, f_on[0] >= settle});
    if (settle == 12'd0)
        assert (valid == 3'b111);
    if (settle != 12'd0)
        assert ((valid & ~$past(low)) == 3'b000);
end
