// SPDX-License-Identifier: MIT
// Safe torque off: two inputs, each of which stops by itself, and whether they agree. One that asks for longer than `patience`
// while the other does not shows a broken line or switch; that, too, stops, until both have been seen to ask.
module sto (
    input  wire        clk,
    input  wire        rst_n,
    input  wire [16:0] longest,         // test pulse in clocks
    input  wire [25:0] patience,        // clocks
    input  wire        pin_a_n,         // 0 stops
    input  wire        pin_b_n,
    output wire [2:0]  stops            // in the next clock: they do not agree, B, A
);
    wire asks_a, asks_b;
    sto_filter filter_a (.clk(clk), .rst_n(rst_n), .longest(longest), .pin_n(pin_a_n), .asks(asks_a), .asks_next(stops[0]));
    sto_filter filter_b (.clk(clk), .rst_n(rst_n), .longest(longest), .pin_n(pin_b_n), .asks(asks_b), .asks_next(stops[1]));

    reg [25:0] apart_for;
    reg        apart;
    wire       differ = asks_a != asks_b;

    assign stops[2] = differ ? apart || apart_for == patience : apart && !asks_a;

    always @(posedge clk)
        if (!rst_n) begin
            apart_for <= 26'd0;
            apart     <= 1'b0;
        end else begin
            apart <= stops[2];
            if (!differ)
                apart_for <= 26'd0;
            else if (apart_for != patience)
                apart_for <= apart_for + 26'd1;
        end

`ifdef FORMAL
`include "formal/sto.vh"
`endif
endmodule
