// SPDX-License-Identifier: MIT
// Stands for sinc3.v in the proof of adc_modulators.v: any integral, but that its lowest bit is the bit at its input.
module sinc3 (
    input  wire        clk, rst_n, strobe, data,
    output wire [24:0] integral
);
    (* anyseq *) reg [23:0] any;
    assign integral = {any, data};
endmodule
