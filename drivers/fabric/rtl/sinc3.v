// SPDX-License-Identifier: MIT
// The three integrators of a sinc3 filter for a 1-bit modulator. They wrap, yet sinc3_comb's result is exact as long as it fits
// itself: 25 bits hold all ones at an OSR of 256, which is 256 cubed; a shorter filter needs only the low bits. Each integrator
// takes the one before it as it was at the last bit, which shortens the path and delays the filter by two bits.
module sinc3 (
    input  wire        clk,
    input  wire        rst_n,
    input  wire        strobe,      // `data` is a new bit
    input  wire        data,
    output reg  [24:0] integral
);
    reg [24:0] first, second;

    always @(posedge clk)
        if (!rst_n) begin
            first    <= 25'd0;
            second   <= 25'd0;
            integral <= 25'd0;
        end else if (strobe) begin
            first    <= first + {24'd0, data};
            second   <= second + first;
            integral <= integral + second;
        end
endmodule
