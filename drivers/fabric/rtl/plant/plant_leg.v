// SPDX-License-Identifier: MIT
// One half bridge as its switches see it: a switch follows its gate after a delay, and not at all if the gate returns before.
// Counts in how many clocks of a step each conducts; both at once counts as none, the legs' inductance being what it is.
module plant_leg (
    input  wire       clk,
    input  wire       rst_n,
    input  wire       high,        // gates
    input  wire       low,
    input  wire [7:0] on_delay,    // clocks
    input  wire [7:0] off_delay,
    input  wire       tick,        // the last clock of a step
    output reg  [6:0] high_clocks, // of the step before
    output reg  [6:0] low_clocks,
    output wire [1:0] conducts     // low, high
);
    reg [7:0] waited_high, waited_low;
    reg       conducts_high, conducts_low;
    assign    conducts = {conducts_low, conducts_high};

    always @(posedge clk)
        if (!rst_n) begin
            conducts_high <= 1'b0;
            waited_high   <= 8'd0;
        end else if (high == conducts_high)
            waited_high <= 8'd0;
        else if (waited_high >= (high ? on_delay : off_delay)) begin
            conducts_high <= high;
            waited_high   <= 8'd0;
        end else
            waited_high <= waited_high + 8'd1;

    always @(posedge clk)
        if (!rst_n) begin
            conducts_low <= 1'b0;
            waited_low   <= 8'd0;
        end else if (low == conducts_low)
            waited_low <= 8'd0;
        else if (waited_low >= (low ? on_delay : off_delay)) begin
            conducts_low <= low;
            waited_low   <= 8'd0;
        end else
            waited_low <= waited_low + 8'd1;

    reg  [6:0] count_high, count_low;
    wire [6:0] high_now = count_high + {6'd0, conducts_high && !conducts_low};
    wire [6:0] low_now  = count_low + {6'd0, conducts_low && !conducts_high};
    always @(posedge clk)
        if (!rst_n) begin
            count_high  <= 7'd0;
            count_low   <= 7'd0;
            high_clocks <= 7'd0;
            low_clocks  <= 7'd0;
        end else if (tick) begin
            count_high  <= 7'd0;
            count_low   <= 7'd0;
            high_clocks <= high_now;
            low_clocks  <= low_now;
        end else begin
            count_high <= high_now;
            count_low  <= low_now;
        end

`ifdef FORMAL
`include "formal/plant_leg.vh"
`endif
endmodule
