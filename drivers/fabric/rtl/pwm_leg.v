// SPDX-License-Identifier: MIT
// One half bridge: the wish for one side becomes two gates. Between one side and the other both are off for `dead` clocks,
// and a side that is on stays on for `shortest` clocks; 0 counts as 1 for both. A wish that comes too early waits: a pulse
// too short is stretched, and no change that lasts is lost. Without `enable` both gates are off at once; after it a dead time
// passes before the first turns on.
module pwm_leg (
    input  wire       clk,
    input  wire       rst_n,
    input  wire       enable,
    input  wire       wish,       // 1: high side
    input  wire [7:0] dead,
    input  wire [7:0] shortest,
    output wire       high,
    output wire       low
);
    reg       side;               // 1: high side
    reg       on;
    reg [7:0] left;               // clocks, this one included, until something may change

    wire due = left[7:1] == 7'd0;

    always @(posedge clk)
        if (!rst_n) begin
            side <= 1'b0;
            on   <= 1'b0;
            left <= 8'hFF;
        end else if (!enable) begin
            side <= wish;
            on   <= 1'b0;
            left <= dead;
        end else if (!due)
            left <= left - 8'd1;
        else if (!on) begin
            on   <= 1'b1;
            left <= shortest;
        end else if (wish != side) begin
            side <= wish;
            on   <= 1'b0;
            left <= dead;
        end

    assign high = enable && on && side;
    assign low  = enable && on && !side;

`ifdef FORMAL
`include "formal/pwm_leg.vh"
`endif
endmodule
