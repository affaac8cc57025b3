// SPDX-License-Identifier: MIT
// One half bridge: the wish for one side becomes two gates. Between one side and the other both are off for `dead` clocks,
// and a side that is on stays on for `shortest` clocks; 0 counts as 1 for both. A wish that comes too early waits: a pulse
// too short is stretched, and no change that lasts is lost. Without `enable` both gates are off at once; after it a dead time
// passes before the first turns on. Each gate has its own flip-flop, behind which nothing but gates that cut may stand: decoded
// from two that change in the same clock, it would see a pulse of the time between them.
//
// For a driver that has an input and an enable for each leg, and makes the dead time itself: `active` is its enable, from when
// the first gate turns on until there is no `enable` any more, through every dead time; `side` is its input.
module pwm_leg (
    input  wire       clk,
    input  wire       rst_n,
    input  wire       enable,
    input  wire       ends,       // not enabled in the next clock, so that the flip-flops of the gates turn off with it
    input  wire       wish,       // 1: high side
    input  wire [7:0] dead,
    input  wire [7:0] shortest,
    output wire       high,
    output wire       low,
    output wire       active,
    output reg        side        // which is on, or turns on next; 1: high side
);
    reg       leg_active;
    reg       gate_high, gate_low;
    reg [7:0] left;               // clocks, this one included, until something may change

    wire due = left[7:1] == 7'd0;
    wire on  = gate_high || gate_low;

    always @(posedge clk)
        if (!rst_n) begin
            side                  <= 1'b0;
            {gate_high, gate_low} <= 2'b00;
            leg_active            <= 1'b0;
            left                  <= 8'hFF;
        end else if (!enable || ends) begin
            side                  <= wish;
            {gate_high, gate_low} <= 2'b00;
            leg_active            <= 1'b0;
            left                  <= dead;
        end else if (!due)
            left <= left - 8'd1;
        else if (!on) begin
            {gate_high, gate_low} <= {side, !side};
            leg_active            <= 1'b1;
            left                  <= shortest;
        end else if (wish != side) begin
            side                  <= wish;
            {gate_high, gate_low} <= 2'b00;
            left                  <= dead;
        end

    assign high   = enable && gate_high;
    assign low    = enable && gate_low;
    assign active = enable && leg_active;

`ifdef FORMAL
`include "formal/pwm_leg.vh"
`endif
endmodule
