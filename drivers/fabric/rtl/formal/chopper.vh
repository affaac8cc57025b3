// SPDX-License-Identifier: MIT
// What the brake chopper promises, for any samples and thresholds.
reg f_ran = 1'b0;
always @(posedge clk) f_ran <= 1'b1;
always @* if (!f_ran) assume (!rst_n);

reg [16:0] f_since;            // clocks since the last sample, held at 65536
always @(posedge clk) f_since <= !rst_n ? 17'd65535 : sample ? 17'd0 : f_since == 17'd65536 ? f_since : f_since + 17'd1;

always @(posedge clk) if (f_ran && $past(rst_n)) begin
    // on by a sample above its threshold, off by one at or below the other, as soon as it is there
    if (on && !$past(on)) assert ($past(enable && sample && vbus > on_above));
    if (!on && $past(on)) assert ($past(!enable || (sample && vbus <= off_at)) || $past(f_since) >= 17'd65535);
    if ($past(enable && sample && !on && vbus > on_above)) assert (on);
    if ($past(enable && sample && on && vbus <= off_at)) assert (!on);
    if ($past(!enable)) assert (!on);
end else if (f_ran)
    assert (!on);
// no sample for 65536 clocks: off
always @* if (f_ran) begin
    if (f_since == 17'd65536) assert (!on);
    assert (f_since <= 17'd65536);
    assert (age == (f_since == 17'd65536 ? 16'hFFFF : f_since[15:0]));
end
