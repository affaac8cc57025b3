// SPDX-License-Identifier: MIT
// The brake chopper: it turns on above one bus voltage and off at another or below; one comparator decides at each new sample.
// After 65536 clocks without a sample it turns off, so that a sampler at rest cannot keep the resistor on.
module chopper (
    input  wire        clk,
    input  wire        rst_n,
    input  wire        enable,
    input  wire        sample,      // `vbus` is new in this clock
    input  wire [14:0] vbus,        // Q15 of the voltage range, as the thresholds
    input  wire [14:0] on_above,
    input  wire [14:0] off_at,
    output reg         on
);
    reg [15:0] age;                 // clocks since the last sample, 65535 at most
    wire       old = &age;

    always @(posedge clk)
        if (!rst_n) begin
            on  <= 1'b0;
            age <= 16'hFFFF;
        end else begin
            if (sample)
                age <= 16'd0;
            else if (!old)
                age <= age + 16'd1;
            if (!enable || (old && !sample))
                on <= 1'b0;
            else if (sample)
                on <= vbus > (on ? off_at : on_above);
        end

`ifdef FORMAL
`include "formal/chopper.vh"
`endif
endmodule
