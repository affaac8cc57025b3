// SPDX-License-Identifier: MIT
// Input filter of one line: two flip-flops against metastability, then the level follows the pin once the pin has differed
// from it for `length` ticks and one clock more. A pulse of up to `length` ticks never passes; 0 leaves the two flip-flops
// and a third. Lines that share `length` and `tick` are delayed alike, so their order is kept.
module encoder_filter #(parameter WIDTH = 8) (
    input  wire             clk,
    input  wire             rst_n,
    input  wire             tick,   // 1: this clock counts
    input  wire [WIDTH-1:0] length,
    input  wire             pin,    // asynchronous
    output reg              level
);
    reg [1:0]       sync;
    reg [WIDTH-1:0] held;           // ticks for which the pin has differed from the level

    // `>=`, so that a shorter length written meanwhile takes effect at once
    wire differs = sync[1] != level;
    wire follow  = differs && held >= length;

    always @(posedge clk)
        if (!rst_n) begin
            sync  <= 2'b00;
            held  <= {WIDTH{1'b0}};
            level <= 1'b0;
        end else begin
            sync <= {sync[0], pin};
            if (follow)
                level <= sync[1];
            if (!differs || follow)
                held <= {WIDTH{1'b0}};
            else if (tick)
                held <= held + 1'b1;
        end

`ifdef FORMAL
`include "formal/encoder_filter.vh"
`endif
endmodule
