// SPDX-License-Identifier: MIT
// Stands for adc_math.v in the proof of adc.v: results change at `finish` only, as adc_math.vh proves of it, and are made of
// what reached it, each input at its own place.
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
    (* anyseq *) reg any;
    assign finish = any;                // adc.vh says when
    function [15:0] mixed(input [15:0] code, input [15:0] offset, input [7:0] gain);
        mixed = code ^ {offset[0], offset[15:1]} ^ {8'd0, gain};
    endfunction
    always @(posedge clk)
        if (!rst_n)
            {ia, ib, ic, v, valid, beyond_current, beyond_sum, beyond_v_high, beyond_v_low} <= 67'd0;
        else if (finish) begin
            {ia, ib}       <= {mixed(code_a, offset_a, gain_a), mixed(code_b, offset_b, gain_b)};
            {ic, v, valid} <= {mixed(code_c, offset_c, gain_c), code_v, valid_in};
            beyond_current <= ^i_trip ^ reconstruct;
            {beyond_sum, beyond_v_high, beyond_v_low} <= {^sum_trip, ^v_max, ^v_min};
        end
endmodule
