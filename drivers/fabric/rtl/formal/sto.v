// SPDX-License-Identifier: MIT
// Stands for sto.v in the proof of fabric_axis.v: filters of no length, and inputs that do not agree at any time.
module sto (
    input  wire        clk, rst_n,
    input  wire [16:0] longest,
    input  wire [25:0] patience,
    input  wire        pin_a_n, pin_b_n,
    output wire [2:0]  stops
);
    (* anyseq *) reg any;
    assign stops = {any, !pin_b_n || longest != 17'd100_000, !pin_a_n || patience != 26'd50_000_000};
endmodule
