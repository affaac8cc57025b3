// SPDX-License-Identifier: MIT
// Stands for encoder.v in the proof of fabric_axis.v: any outputs at any time; on its register port 0 unless selected.
module encoder (
    input  wire        clk, rst_n, sel, write,
    input  wire [7:2]  addr,
    input  wire [31:0] wdata,
    output wire [31:0] rdata,
    input  wire        trigger, pin_a, pin_b, pin_index, pin_lost,
    input  wire [2:0]  pin_hall,
    output wire        faulty
);
    (* anyseq *) reg [32:0] any;
    assign rdata = sel ? any[31:0] : 32'd0;
    assign faulty = any[32];
endmodule
