// SPDX-License-Identifier: MIT
// The carrier counts the distance from the peak (the middle of the high sides' on-time): from PERIOD at the valley down to 0
// and up again, one step a clock, each end once: 2 PERIOD clocks a period. Falling, it passes PERIOD...1; rising,
// 0...PERIOD - 1.
`include "mssfoc_regs.vh"
module pwm_carrier (
    input  wire        clk,
    input  wire        rst_n,
    input  wire        run,
    input  wire        follow,        // wait for `sync` before the first step
    input  wire        sync,          // the axis to follow is at its valley in the next clock
    input  wire [15:0] period,
    input  wire [15:0] start_count,
    input  wire        start_rising,
    output reg         running,
    output wire        running_next,  // in the next clock, but for a reset
    output reg  [15:0] count,
    output reg         rising,
    output wire        to_valley,     // the next clock is the valley
    output wire        turns_down,    // while it runs and rises: the next clock is the valley
    output wire        turns_up       // while it runs and falls: the next clock is the peak
);
    // From PERIOD - 1 on and from 1 down, rather than at these counts only, so that the carrier turns from any start, and with
    // a period of 0. Whether the next clock is the valley is worked out a clock ahead, so that no comparison stands before what
    // the valley causes, in this axis and in those that follow it; PERIOD holds still while the carrier runs.
    reg         turns;
    reg  [16:0] rises_by;       // PERIOD - 2: from this count up the next one is the last before the valley
    wire [15:0] next     = count + {{15{!rising}}, 1'b1};
    wire [17:0] started = {2'd0, start_count} + 18'd1 - {2'd0, period};
    wire [17:0] risen   = {2'd0, count} - {rises_by[16], rises_by};
    wire [16:0] fallen  = {1'b0, count} - {1'b0, period};

    assign turns_down = turns;
    assign turns_up   = count[15:1] == 15'd0;
    assign to_valley  = running && rising && turns_down;
    wire   to_peak    = running && !rising && turns_up;

    always @(posedge clk)
        if (!rst_n)
            rises_by <= 17'd0;
        else
            rises_by <= {1'b0, period} - 17'd2;

    always @(posedge clk)
        if (!rst_n)
            turns <= 1'b1;
        else if (!run || !running)
            turns <= !started[17];
        else if (to_valley)
            turns <= 1'b1;
        else if (to_peak)
            turns <= period[15:1] == 15'd0;
        else
            turns <= rising ? !risen[17] : !fallen[16];

    assign running_next = run && (running || !follow || sync);

    always @(posedge clk)
        if (!rst_n) begin
            running <= 1'b0;
            count   <= `PWM_COUNT_RESET;
            rising  <= 1'b0;
        end else if (!run || !running) begin
            running <= running_next;
            count   <= start_count;
            rising  <= start_rising;
        end else if (to_valley) begin
            count  <= period;
            rising <= 1'b0;
        end else if (to_peak) begin
            count  <= 16'd0;
            rising <= 1'b1;
        end else
            count <= next;

    wire unused = &{1'b0, started[16:0], risen[16:0], fallen[15:0]};

`ifdef FORMAL
`include "formal/pwm_carrier.vh"
`endif
endmodule
