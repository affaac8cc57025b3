// SPDX-License-Identifier: MIT
// x times the gain, rounded when bits 28...11 are taken: x (2048 + gain) + 1024, a clock later. One math block of the fabric
// (18 x 18 bits, an adder, registers), which Synplify makes of it; yosys counts it as one. 2048 + gain needs no adder. It is a
// module of its own so that a proof can put an arbitrary function in its place: no solver can compare two multipliers, but it
// can tell whether they get the same factors.
module adc_multiply (
    input  wire               clk,
    input  wire               rst_n,
    input  wire signed [16:0] x,
    input  wire        [7:0]  gain,      // signed
    output reg  signed [28:0] product
);
    wire signed [12:0] factor = {1'b0, !gain[7], {4{gain[7]}}, gain[6:0]};

    always @(posedge clk)
        if (!rst_n)
            product <= 29'sd0;
        else
            product <= x * factor + 29'sd1024;
endmodule
