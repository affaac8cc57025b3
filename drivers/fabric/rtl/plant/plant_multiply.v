// SPDX-License-Identifier: MIT
// One math block of the fabric, 18 x 18 bits with registers at its output, which Synplify makes of it; yosys counts it as one.
module plant_multiply (
    input  wire               clk,
    input  wire signed [17:0] a,
    input  wire signed [17:0] b,
    output reg  signed [35:0] product
);
    always @(posedge clk)
        product <= a * b;
endmodule
