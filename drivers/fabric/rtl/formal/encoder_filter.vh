// SPDX-License-Identifier: MIT
// What the input filter promises, from the first reset on.
reg       f_ran = 1'b0;
reg [8:0] f_run;            // ticks for which the synchronised pin has had its present value
always @(posedge clk) begin
    f_ran <= f_ran || !rst_n;
    if (!rst_n || sync[0] != sync[1])
        f_run <= 9'd0;
    else if (tick && f_run != 9'd511)
        f_run <= f_run + 9'd1;
end

always @(posedge clk) if (f_ran && rst_n && $past(rst_n)) begin
    // nothing shorter than `length` ticks passes
    if (level != $past(level)) begin
        assert (level == $past(sync[1]));
        assert ($past(f_run) >= $past(length));
    end
    // what lasts a clock longer passes
    if ($past(f_run) >= $past(length))
        assert (level == $past(sync[1]));
end
always @(posedge clk) if (f_ran && sync[1] != level)
    assert (held == f_run);
