// SPDX-License-Identifier: MIT
// Counts the edges of A and B (x4) modulo top + 1. Up when A leads B, down with `reverse`. When both change in one clock the
// direction is unknown: nothing is counted and `illegal` says so. A lost line counts nothing at all.
module encoder_count (
    input  wire        clk,
    input  wire        rst_n,
    input  wire        enable,
    input  wire        reverse,
    input  wire        lost,
    input  wire        a,             // filtered levels
    input  wire        b,
    input  wire        load,          // take `load_top` and start at 0
    input  wire [15:0] load_top,
    output reg  [15:0] top,           // counts of a revolution less one
    output reg  [15:0] position,      // 0...top
    output wire [15:0] position_next, // as it will be after this clock
    output wire        counted,       // an edge is counted in this clock
    output wire        illegal
);
    reg a_was, b_was;

    wire a_moved = a != a_was;
    wire b_moved = b != b_was;
    wire listens = enable && !lost;

    assign counted = listens && a_moved != b_moved;
    assign illegal = listens && a_moved && b_moved;

    // with A leading, the new A differs from the old B at each of the four edges
    wire up = (a != b_was) != reverse;

    wire [15:0] after_up   = position == top ? 16'd0 : position + 16'd1;
    wire [15:0] after_down = position == 16'd0 ? top : position - 16'd1;

    assign position_next = load ? 16'd0 : counted ? (up ? after_up : after_down) : position;

    always @(posedge clk)
        if (!rst_n) begin
            a_was    <= 1'b0;
            b_was    <= 1'b0;
            top      <= 16'd4095;
            position <= 16'd0;
        end else begin
            a_was    <= a;
            b_was    <= b;
            position <= position_next;
            if (load)
                top <= load_top;
        end

`ifdef FORMAL
`include "formal/encoder_count.vh"
`endif
endmodule
