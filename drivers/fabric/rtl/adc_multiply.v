// SPDX-License-Identifier: MIT
// 17 by 8 bits, signed. It is a module of its own so that a proof can put an arbitrary function in its place: no solver can
// compare two multipliers, but it can tell whether they get the same factors.
module adc_multiply (
    input  wire signed [16:0] x,
    input  wire signed [7:0]  y,
    output wire signed [24:0] product
);
    assign product = x * y;
endmodule
