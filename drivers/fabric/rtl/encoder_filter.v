// SPDX-License-Identifier: MIT
// Input filter of one line: two flip-flops against metastability, then the level follows the pin once the pin has differed
// from it for `length` ticks and one clock more. A pulse of up to `length` ticks never passes; with a length of 0 the level is
// a third flip-flop. Lines that share `length` and `tick` are delayed alike, so their order is kept.
module encoder_filter (
    input  wire       clk,
    input  wire       rst_n,
    input  wire       tick,   // 1: this clock counts
    input  wire [7:0] length,
    input  wire       pin,    // asynchronous
    output reg        level
);
    reg [1:0] sync;
    reg [7:0] held;                 // ticks for which the pin has differed from the level

    // from `length` on, so that a shorter one takes effect as soon as it is written; `>=` itself would be two carry chains
    wire differs = sync[1] != level;
    wire follow  = differs && {length, 1'b0} < {held, 1'b1};

    always @(posedge clk)
        if (!rst_n) begin
            sync  <= 2'b00;
            held  <= 8'd0;
            level <= 1'b0;
        end else begin
            sync <= {sync[0], pin};
            if (follow)
                level <= sync[1];
            if (!differs || follow)
                held <= 8'd0;
            else if (tick)
                held <= held + 8'd1;
        end

`ifdef FORMAL
`include "formal/encoder_filter.vh"
`endif
endmodule
