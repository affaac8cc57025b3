// SPDX-License-Identifier: MIT
// A low-side shunt shows its phase's current only while the low side conducts, and its amplifier takes a while to settle. A
// phase is valid once its low side has been on for `settle` clocks without a break; with 0, always (sensors in the phases).
module adc_valid (
    input  wire        clk,
    input  wire        rst_n,
    input  wire [11:0] settle,
    input  wire [2:0]  low,         // the gates as they leave for the drivers: C, B, A
    output wire [2:0]  valid
);
    genvar k;
    generate for (k = 0; k < 3; k = k + 1) begin : phase
        reg [11:0] on_for;          // clocks, 4095 at most
        always @(posedge clk)
            if (!rst_n || !low[k])
                on_for <= 12'd0;
            else if (on_for != 12'hFFF)
                on_for <= on_for + 12'd1;
        assign valid[k] = {settle, 1'b0} < {on_for, 1'b1};
    end endgenerate

`ifdef FORMAL
`include "formal/adc_valid.vh"
`endif
endmodule
