// SPDX-License-Identifier: MIT
// The APB3 side of one axis: four slots of 256 bytes. A read is taken in the setup phase into a register, which keeps the
// wide multiplexer off the bus' way back; reading has no side effect, so the clock between does no harm. A write acts in the
// access phase, on the slot of the setup phase before it. Never waits, never errs; an address that is no word or that no block
// knows reads 0 and ignores writes.
module apb_slave (
    input  wire         clk,
    input  wire         rst_n,
    input  wire         psel,
    input  wire         penable,
    input  wire         pwrite,
    input  wire [9:0]   paddr,
    input  wire [31:0]  pwdata,
    output reg  [31:0]  prdata,   // 0 unless selected, so that axes can be ORed
    output wire         pready,
    output wire         pslverr,
    // register ports of the slots
    output wire [3:0]   sel,
    output wire [3:0]   write,    // to a slot
    output wire [7:2]   addr,
    output wire [31:0]  wdata,
    input  wire [127:0] rdata     // slot 0 in the lowest word; each 0 unless selected
);
    wire word = paddr[1:0] == 2'b00;

    assign sel     = psel && word ? 4'b0001 << paddr[9:8] : 4'b0000;
    assign addr    = paddr[7:2];
    assign wdata   = pwdata;
    assign pready  = 1'b1;
    assign pslverr = 1'b0;

    // decoded in the setup phase, so that the address is not in the path of a write
    reg [3:0] slot;
    always @(posedge clk)
        slot <= rst_n && !penable ? sel : 4'b0000;
    assign write = slot & {4{psel && penable && pwrite}};

    always @(posedge clk)
        if (!rst_n || !psel)
            prdata <= 32'd0;
        else if (!penable)
            prdata <= pwrite ? 32'd0 : rdata[31:0] | rdata[63:32] | rdata[95:64] | rdata[127:96];

`ifdef FORMAL
`include "formal/apb_slave.vh"
`endif
endmodule
