// SPDX-License-Identifier: MIT
// From the clocks in which switches conducted to what the program takes in place of A. Where no switch conducts, the current
// looks for a diode: out of the leg through the lower one, into it through the upper. A leg that is off for a whole step stands
// as if its upper diode conducted; the program takes away what its terminal is lower. Clocks over 128 are numbers of per unit,
// of diodes and switches those over 256.
`include "plant_program.vh"
module plant_legs (
    input  wire               clk,
    input  wire [20:0]        high_clocks,   // C, B, A
    input  wire [20:0]        low_clocks,
    input  wire [2:0]         into,          // the leg's current is negative
    input  wire [2:0]         open,          // wires
    input  wire               igbt,          // a switch carries nothing back
    input  wire [1:0]         middle,        // the phase whose EMF is the middle one
    output reg  [2:0]         off,           // no switch for the whole step
    input  wire [3:0]         which,         // microcode.py: EXTERNAL
    output reg  signed [17:0] value          // a clock later
);
    localparam [7:0] STEP = {1'b0, `PLANT_STEP};

    // of each leg: clocks at the upper rail; of a diode's drop, and of a switch's, negative from the current that flows in;
    // those in which its current comes from the bus
    reg  [9:0] upper_a, upper_b, upper_c, diode_a, diode_b, diode_c, drop_a, drop_b, drop_c;
    reg  [6:0] feeds_a, feeds_b, feeds_c;
    wire [9:0] upper [0:2], diode [0:2], drop [0:2];
    wire [6:0] feeds [0:2];
    wire [2:0] rests;

    genvar k;
    generate for (k = 0; k < 3; k = k + 1) begin : leg
        wire [7:0] highs = {1'b0, high_clocks[7*k +: 7]}, lows = {1'b0, low_clocks[7*k +: 7]};
        reg  [7:0] none;
        always @(posedge clk)
            none <= STEP - highs - lows;
        wire [7:0] back  = igbt ? (into[k] ? highs : lows) : 8'd0;
        wire [7:0] ahead = igbt ? (into[k] ? lows : highs) : 8'd0;
        wire [7:0] drops = none + back;
        wire [7:0] from_bus = into[k] ? highs + none : highs;
        assign rests[k] = open[k] || none == STEP;
        assign feeds[k] = from_bus[6:0];
        assign upper[k] = {2'b00, rests[k] ? STEP : from_bus};
        assign diode[k] = rests[k] ? 10'd0 - {2'b00, STEP} : into[k] ? 10'd0 - {2'b00, drops} : {2'b00, drops};
        assign drop[k]  = rests[k] ? 10'd0 : into[k] ? 10'd0 - {2'b00, ahead} : {2'b00, ahead};
    end endgenerate
    always @(posedge clk) begin
        off <= rests;
        {upper_a, upper_b, upper_c} <= {upper[0], upper[1], upper[2]};
        {diode_a, diode_b, diode_c} <= {diode[0], diode[1], diode[2]};
        {drop_a, drop_b, drop_c}    <= {drop[0], drop[1], drop[2]};
        {feeds_a, feeds_b, feeds_c} <= {feeds[0], feeds[1], feeds[2]};
    end

    // of two axes: twice the first less the others, the second less the third
    reg  [9:0] high_alpha, high_beta, diode_alpha, diode_beta, switch_alpha, switch_beta;
    always @(posedge clk) begin
        high_alpha   <= {upper_a[8:0], 1'b0} - upper_b - upper_c;
        high_beta    <= upper_b - upper_c;
        diode_alpha  <= {diode_a[8:0], 1'b0} - diode_b - diode_c;
        diode_beta   <= diode_b - diode_c;
        switch_alpha <= {drop_a[8:0], 1'b0} - drop_b - drop_c;
        switch_beta  <= drop_b - drop_c;
    end
    wire       unused       = &{1'b0, high_alpha[9], high_beta[9], upper_a[9], diode_a[9], drop_a[9]};

    // twice the mean of the legs that are driven, and what each EMF weighs in it; half the bus where none is
    wire [2:0]  driven = ~off;
    wire [1:0]  count  = {1'b0, driven[0]} + {1'b0, driven[1]} + {1'b0, driven[2]};
    wire [8:0]  of_a = driven[0] ? upper_a[8:0] : 9'd0, of_b = driven[1] ? upper_b[8:0] : 9'd0;
    wire [8:0]  of_c = driven[2] ? upper_c[8:0] : 9'd0;
    wire [8:0]  all  = of_a + of_b + of_c;          // of two at most
    wire [17:0] one  = count == 2'd1 ? 18'h10000 : 18'h08000;
    reg  [8:0]  neutral;
    reg  [17:0] weight_a, weight_b, weight_c;
    always @(posedge clk)
        if (count == 2'd0) begin
            neutral  <= {1'b0, STEP};
            weight_a <= middle == 2'd0 ? 18'h38000 : 18'd0;
            weight_b <= middle == 2'd1 ? 18'h38000 : 18'd0;
            weight_c <= middle == 2'd2 ? 18'h38000 : 18'd0;
        end else begin
            neutral  <= count == 2'd1 ? {all[7:0], 1'b0} : all;
            weight_a <= driven[0] ? one : 18'd0;
            weight_b <= driven[1] ? one : 18'd0;
            weight_c <= driven[2] ? one : 18'd0;
        end

    always @(posedge clk)
        case (which)
            4'd0:    value <= {high_alpha[8:0], 9'd0};
            4'd1:    value <= {high_beta[8:0], 9'd0};
            4'd2:    value <= {diode_alpha, 8'd0};
            4'd3:    value <= {diode_beta, 8'd0};
            4'd4:    value <= {switch_alpha, 8'd0};
            4'd5:    value <= {switch_beta, 8'd0};
            4'd6:    value <= {neutral, 9'd0};
            4'd7:    value <= weight_a;
            4'd8:    value <= weight_b;
            4'd9:    value <= weight_c;
            4'd10:   value <= {2'd0, feeds_a, 9'd0};
            4'd11:   value <= {2'd0, feeds_b, 9'd0};
            4'd12:   value <= {2'd0, feeds_c, 9'd0};
            default: value <= 18'd0;
        endcase
endmodule
