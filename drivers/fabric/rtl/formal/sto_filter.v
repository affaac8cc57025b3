// SPDX-License-Identifier: MIT
// Stands for sto_filter.v in the proof of sto.v: asks a clock behind the pin.
module sto_filter (
    input  wire        clk, rst_n,
    input  wire [16:0] longest,
    input  wire        pin_n,
    output reg         asks,
    output wire        asks_next
);
    assign asks_next = rst_n && !pin_n && longest != 17'd0;
    always @(posedge clk) asks <= asks_next;
endmodule
