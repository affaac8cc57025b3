// SPDX-License-Identifier: MIT
// The three integrators of a sinc3 filter for a 1-bit modulator. They wrap: what sinc3_comb makes of them is exact as long as
// the result itself fits. 25 bits hold an OSR of 256 (256 cubed, all ones); a shorter filter takes as many of the low bits.
// Each integrator takes the former one's value of the clock before, which shortens the path and delays the filter by two bits.
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
