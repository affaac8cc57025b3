// SPDX-License-Identifier: MIT
// What the pair of inputs promises, for any patience, with filters of no length (formal/sto_filter.v).
reg f_ran = 1'b0;
always @(posedge clk) f_ran <= 1'b1;
always @* if (!f_ran) assume (!rst_n);
always @* assume (longest != 17'd0);
(* anyconst *) reg [25:0] f_constant;
always @* assume (patience == f_constant);

reg        f_a, f_b;            // as they ask
reg [26:0] f_apart_for;         // clocks in a row in which one alone did
reg        f_latched;           // that for longer than `patience`; since then never both
always @(posedge clk)
    if (!rst_n) begin
        f_a         <= 1'b0;
        f_b         <= 1'b0;
        f_apart_for <= 27'd0;
        f_latched   <= 1'b0;
    end else begin
        f_a         <= !pin_a_n;
        f_b         <= !pin_b_n;
        f_apart_for <= f_a == f_b ? 27'd0 : f_apart_for + (f_apart_for != 27'h7FFFFFF);
        f_latched   <= f_a != f_b ? f_latched || f_apart_for >= {1'b0, patience} : f_latched && !f_a;
    end

always @* if (f_ran && rst_n) begin
    assert (stops[0] == !pin_a_n && stops[1] == !pin_b_n);
    assert (stops[2] == (f_a != f_b ? f_latched || f_apart_for >= {1'b0, patience} : f_latched && !f_a));
    assert (asks_a == f_a && asks_b == f_b && apart == f_latched);
    assert ({1'b0, apart_for} == (f_apart_for < {1'b0, patience} ? f_apart_for : {1'b0, patience}));
end
always @(posedge clk) if (f_ran && $past(rst_n) && rst_n) begin
    assert (apart == $past(stops[2]));
    if (!$past(apart) && apart) assert ($past(asks_a != asks_b && f_apart_for >= {1'b0, patience}));
    if ($past(apart) && !apart) assert ($past(asks_a && asks_b));
    if ($past(f_ran && f_apart_for >= {1'b0, patience} && asks_a != asks_b)) assert (apart);
end else if (f_ran && !$past(rst_n))
    assert (!apart && apart_for == 26'd0);
