// SPDX-License-Identifier: MIT
// What the bus side promises, for any signals on the bus.
reg f_ran = 1'b0;
always @(posedge clk) f_ran <= 1'b1;
always @* if (!f_ran) assume (!rst_n);

wire [31:0] f_slot = rdata[32 * paddr[9:8] +: 32];
reg  [3:0]  f_setup;    // the slot of a setup phase a clock ago
always @(posedge clk) f_setup <= rst_n && psel && !penable && paddr[1:0] == 2'b00 ? 4'b0001 << paddr[9:8] : 4'd0;
always @* begin
    // at most one slot, the addressed one, and none for an address that is no word
    assert (sel == (psel && paddr[1:0] == 2'b00 ? 4'b0001 << paddr[9:8] : 4'd0));
    assert (addr == paddr[7:2] && wdata == pwdata);
    // a write acts in the access phase only, on the slot of the setup phase; no access waits or errs
    if (f_ran) assert (write == (psel && penable && pwrite ? f_setup : 4'd0));
    assert (pready && !pslverr);
    // what blocks promise: 0 unless selected
    if (!sel[0]) assume (rdata[31:0] == 32'd0);
    if (!sel[1]) assume (rdata[63:32] == 32'd0);
    if (!sel[2]) assume (rdata[95:64] == 32'd0);
    if (!sel[3]) assume (rdata[127:96] == 32'd0);
end
always @(posedge clk) if (f_ran) begin
    // a read gives in the access phase what its slot had in the setup phase, 0 for no word
    if ($past(rst_n && psel && !penable && !pwrite))
        assert (prdata == ($past(paddr[1:0]) == 2'b00 ? $past(f_slot) : 32'd0));
    // it holds as long as the access lasts, and an axis that is not selected says nothing
    if ($past(rst_n && psel && penable)) assert (prdata == $past(prdata));
    if ($past(!rst_n || !psel)) assert (prdata == 32'd0);
    if ($past(psel && !penable && pwrite)) assert (prdata == 32'd0);
end
