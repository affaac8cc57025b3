// SPDX-License-Identifier: MIT
// One phase's compare: when a new on-time takes effect, and what the phase wishes now. The high side is wished on for
// `compare` clocks before the peak and as many after it: falling while count <= compare, rising while count < compare.
//
// The wish changes at most once in each half period, in one direction. With `once`, a new compare acts at once if its change
// and that of the old one are both still to come; if not, the old one stays until the next end, and `fell_back` says so.
module pwm_compare (
    input  wire        clk,
    input  wire        rst_n,
    input  wire        running,
    input  wire [15:0] count,
    input  wire        rising,
    input  wire        load,       // while running: the next clock is an end at which this mode takes new compares
    input  wire        once,       // mode: at once
    input  wire [15:0] newest,     // as written
    input  wire        commit,     // the set is complete with the next clock
    input  wire        withdraw,   // the next set is being written
    output wire        wish,       // high side
    output reg         waiting,
    output reg         fell_back
);
    reg [15:0] compare;
    reg        fresh;              // the clock after the commit

    // the sign of one difference, which is one carry chain; `<=` would be two
    wire [17:0] room        = {1'b0, compare, 1'b0} - {1'b0, count, rising};
    wire [17:0] room_newest = {1'b0, newest, 1'b0} - {1'b0, count, rising};
    wire        wish_newest = !room_newest[17];
    wire ahead       = wish == rising && wish_newest == rising;
    wire take        = waiting && (!running || load || (once && fresh && ahead));

    assign wish = !room[17];

    always @(posedge clk)
        if (!rst_n) begin
            compare   <= 16'd0;
            fresh     <= 1'b0;
            waiting   <= 1'b0;
            fell_back <= 1'b0;
        end else begin
            fresh <= commit;
            if (take)
                compare <= newest;
            waiting <= commit || (waiting && !take && !withdraw);
            if (fresh)
                fell_back <= once && !take;
        end

    wire unused = &{1'b0, room[16:0], room_newest[16:0]};

`ifdef FORMAL
`include "formal/pwm_compare.vh"
`endif
endmodule
