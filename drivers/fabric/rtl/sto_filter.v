// SPDX-License-Identifier: MIT
// One input of safe torque off. A safety relay tests its line by pulses, which must not stop the drive: a counter goes up while
// the pin is low and down while it is high, and asks to stop from `longest` clocks and one more on. It counts down rather than
// starting anew, so that a line that chatters, low for more than half of the time, stops in the end. Once it asks, it does so
// until the counter is back at 0.
module sto_filter (
    input  wire        clk,
    input  wire        rst_n,
    input  wire [16:0] longest,     // test pulse in clocks, a constant
    input  wire        pin_n,       // asynchronous; 0 stops
    output reg         asks,
    output wire        asks_next    // what `asks` is in the next clock
);
    reg  [1:0]  low;
    reg  [16:0] count;
    wire        full = count == longest, empty = count == 17'd0;

    assign asks_next = low[1] ? asks || full : asks && !empty;

    always @(posedge clk)
        if (!rst_n) begin
            low   <= 2'b00;
            count <= 17'd0;
            asks  <= 1'b0;
        end else begin
            low  <= {low[0], !pin_n};
            asks <= asks_next;
            if (low[1] && !full)
                count <= count + 17'd1;
            else if (!low[1] && !empty)
                count <= count - 17'd1;
        end

`ifdef FORMAL
`include "formal/sto_filter.vh"
`endif
endmodule
