// SPDX-License-Identifier: MIT
// A current or voltage on its way to a converter. The program's word is that of the step before; what it moved since the last
// one goes on half as far again, so that what is sampled within the next step is on average no older than the sample. Then the
// noise, within 0...4095.
module plant_channel #(parameter AHEAD = 1) (
    input  wire               clk,
    input  wire               rst_n,
    input  wire               take,
    input  wire        [35:0] word,      // 2^34 is the end of the range
    input  wire               stuck,
    input  wire signed [7:0]  noise,     // in sixteenths of a code
    output reg         [11:0] code
);
    // 0...65535, a sixteenth of a code each
    wire [15:0] within = word[35] ? 16'd0 : word[34] ? 16'hFFFF : word[33:18];
    reg  [15:0] now, before;
    reg  [18:0] ahead, noisy;
    wire        unused = &{1'b0, word[17:0], noisy[3:0]};
    wire [16:0] moved = {1'b0, now} - {1'b0, before};
    always @(posedge clk)
        if (!rst_n) begin
            now    <= 16'd0;
            before <= 16'd0;
            ahead  <= 19'd0;
            noisy  <= 19'd0;
            code   <= 12'd0;
        end else begin
            if (take) begin
                now    <= within;
                before <= now;
            end
            ahead <= AHEAD != 0 ? {3'd0, now} + {{2{moved[16]}}, moved} + {{3{moved[16]}}, moved[16:1]} : {3'd0, now};
            noisy <= ahead + {{11{noise[7]}}, noise};
            if (!stuck)
                code <= noisy[18] ? 12'd0 : |noisy[17:16] ? 12'hFFF : noisy[15:4];
        end
endmodule
