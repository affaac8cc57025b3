// SPDX-License-Identifier: MIT
// Whether the program is alive while it has the bridge on. The current loop shows it by a new set of compares in each period of
// the carrier. Slow loop and thread show it by turns: each writes its key and the number of the round, and only the one whose
// turn it is is believed. The slow loop begins a round, and rounds must not begin further apart than CLOCKS. So neither one
// context alone nor a loop that repeats a write goes on for long.
`include "mssfoc_regs.vh"
module watch (
    input  wire        clk,
    input  wire        rst_n,
    input  wire        starts,       // CLOCKS is written: for good; not while armed
    input  wire        proves,       // a word is written
    input  wire [31:0] wdata,
    input  wire        armed,        // the program's last word is that the bridge be on
    input  wire        tripped,      // and it has missed a proof since
    input  wire        live,         // the bridge is on
    input  wire        valley,       // of the carrier, in the next clock
    input  wire        commit,       // a set of compares is written
    output reg         started,
    output reg  [19:0] clocks,
    output reg         thread,       // whose turn it is; 0: the slow loop's
    output reg  [7:0]  number,
    output wire        loop_late,    // in this clock: a whole period without a set of compares
    output wire [1:0]  missed        // in this clock: thread, slow loop; late, or a word that is not the next
);
    localparam [23:0] KEY = 24'h5A17C3;     // the slow loop's; the thread's is its complement

    wire right    = wdata == {KEY ^ {24{thread}}, number};
    wire accepted = proves && right;
    wire watches  = started && armed && !tripped;

    reg  [20:0] left;                       // clocks; the highest bit: none
    wire        late  = left[20];
    wire        wrong = proves && !right;

    assign missed = {thread, !thread} & {2{watches && (late || wrong)}};

    reg    answered;
    assign loop_late = live && valley && !answered;

    always @(posedge clk)
        if (!rst_n) begin
            started  <= 1'b0;
            clocks   <= 20'd0;
            thread   <= 1'b0;
            number   <= 8'd0;
            left     <= 21'd0;
            answered <= 1'b1;
        end else begin
            if (starts && !started && !armed) begin
                started <= 1'b1;
                clocks  <= wdata[`GATE_WATCH_TIME_CLOCKS];
            end
            if (accepted) begin
                thread <= !thread;
                number <= number + {7'd0, thread};
            end
            if (!watches || (accepted && !thread))
                left <= {1'b0, clocks};
            else if (!late)
                left <= left - 21'd1;
            // a set that comes with the valley is the next period's: it is too late to act there. `started` is asked
            // here rather than in `loop_late`, whose path is a long one
            answered <= !live || !started || commit || (answered && !valley);
        end

`ifdef FORMAL
`include "formal/watch.vh"
`endif
endmodule
