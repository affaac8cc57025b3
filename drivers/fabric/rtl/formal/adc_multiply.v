// SPDX-License-Identifier: MIT
// Stands for adc_multiply.v in the proof of adc_math.v: any value at all. That equal factors make equal products is assumed
// there.
module adc_multiply (
    input  wire signed [16:0] x,
    input  wire signed [7:0]  y,
    output wire signed [24:0] product
);
    (* anyseq *) reg [24:0] anything;
    assign product = anything;
endmodule
