// SPDX-License-Identifier: MIT
// One trigger of the ADC: a pulse in the clock after the carrier has a chosen count in a chosen direction.
module pwm_trigger (
    input  wire        clk,
    input  wire        rst_n,
    input  wire        running,
    input  wire [15:0] count,
    input  wire        rising,
    input  wire [15:0] at,
    input  wire        at_falling,
    input  wire        at_rising,
    output reg         trigger
);
    always @(posedge clk)
        if (!rst_n)
            trigger <= 1'b0;
        else
            trigger <= running && count == at && (rising ? at_rising : at_falling);
endmodule
