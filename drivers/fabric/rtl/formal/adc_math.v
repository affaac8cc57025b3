// SPDX-License-Identifier: MIT
// Stands for adc_math.v in the proof of adc.v: any results, which change at `finish` only; adc_math.vh proves that of it.
module adc_math (
    input  wire        clk, rst_n, enable, start,
    input  wire [15:0] code_a, code_b, code_c,
    input  wire [11:0] code_v,
    input  wire [2:0]  valid_in,
    input  wire        reconstruct,
    input  wire [15:0] offset_a, offset_b, offset_c,
    input  wire [7:0]  gain_a, gain_b, gain_c,
    input  wire [16:0] i_trip, sum_trip, v_min, v_max,
    output wire        finish,
    output reg  [15:0] ia, ib, ic,
    output reg  [11:0] v,
    output reg  [2:0]  valid,
    output reg         beyond_current, beyond_sum, beyond_v_high, beyond_v_low
);
    (* anyseq *) reg [64:0] any;
    assign finish = any[64];            // adc.vh says when
    always @(posedge clk)
        if (!rst_n)
            {ia, ib, ic, v, valid, beyond_current, beyond_sum, beyond_v_high, beyond_v_low} <= 67'd0;
        else if (finish)
            {ia, ib, ic, beyond_current, beyond_sum, beyond_v_high, beyond_v_low, v, valid} <= {any[63:0], valid_in};
endmodule
