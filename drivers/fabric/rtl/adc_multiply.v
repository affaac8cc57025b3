// SPDX-License-Identifier: MIT
// 17 by 8 bits, signed. A module of its own, so that a proof can put an arbitrary function in its place: no solver compares
// two multipliers, but whether the same factors reach one it can tell.
module adc_multiply (
    input  wire signed [16:0] x,
    input  wire signed [7:0]  y,
    output wire signed [24:0] product
);
    assign product = x * y;
endmodule
