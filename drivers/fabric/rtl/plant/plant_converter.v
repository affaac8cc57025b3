// SPDX-License-Identifier: MIT
// A serial converter at its pins, as drivers/fabric/rtl/adc_spi.v reads it: CS falling samples, ZEROS leading zeros, the first
// with CS and one more with each falling SCLK, then twelve bits, MSB first, then zeros.
module plant_converter #(parameter ZEROS = 2) (
    input  wire        clk,
    input  wire        rst_n,
    input  wire        cs_n,
    input  wire        sclk,
    input  wire [11:0] code,
    output wire        sdata
);
    reg        was_cs_n, was_sclk;
    reg [11:0] left;
    reg [2:0]  zeros;                    // still to come behind the present one

    always @(posedge clk)
        if (!rst_n) begin
            was_cs_n <= 1'b1;
            was_sclk <= 1'b1;
            left     <= 12'd0;
            zeros    <= 3'd0;
        end else begin
            was_cs_n <= cs_n;
            was_sclk <= sclk;
            if (cs_n)
                left <= 12'd0;
            else if (was_cs_n) begin
                left  <= code;
                zeros <= ZEROS[2:0];
            end else if (was_sclk && !sclk) begin
                if (zeros != 3'd0)
                    zeros <= zeros - 3'd1;
                else
                    left <= {left[10:0], 1'b0};
            end
        end
    assign sdata = zeros == 3'd0 && left[11];

`ifdef FORMAL
`include "formal/plant_converter.vh"
`endif
endmodule
