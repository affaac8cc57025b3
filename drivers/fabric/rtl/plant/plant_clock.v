// SPDX-License-Identifier: MIT
// The clock of the step, 0 to PLANT_STEP - 1, whatever the host does.
`include "plant_program.vh"
module plant_clock (
    input  wire       clk,
    input  wire       rst_n,
    input  wire       run,
    output reg  [6:0] clock,
    output reg        active,   // this step is played
    output reg        first,    // and the one before it was not
    output reg        tick      // the legs' clocks are taken
);
    reg last;
    always @(posedge clk)
        if (!rst_n) begin
            clock  <= 7'd0;
            last   <= 1'b0;
            active <= 1'b0;
            first  <= 1'b1;
            tick   <= 1'b0;
        end else begin
            tick <= clock == `PLANT_STEP - 7'd4;
            last <= clock == `PLANT_STEP - 7'd2;
            if (last) begin
                clock  <= 7'd0;
                active <= run;
                first  <= !active;
            end else
                clock <= clock + 7'd1;
        end

`ifdef FORMAL
`include "formal/plant_clock.vh"
`endif
endmodule
