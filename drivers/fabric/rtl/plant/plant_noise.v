// SPDX-License-Identifier: MIT
// Noise for four channels, in sixteenths of a code: sums of four pieces of one shift register, all but Gaussian, each channel's
// own. The register is x^63 + x^62 + 1, moved on by eight bits a clock. Strength 0 is none, 3 is 1.2 codes rms, 2 and 1 a half
// and a quarter of it.
module plant_noise (
    input  wire        clk,
    input  wire        rst_n,
    input  wire [1:0]  strength,
    output wire [31:0] noise             // bus voltage, C, B, A
);
    reg  [62:0] bits;
    wire [7:0]  next = bits[62:55] ^ bits[61:54];
    always @(posedge clk)
        bits <= rst_n ? {bits[54:0], next} : 63'd1;

    genvar k;
    generate for (k = 0; k < 4; k = k + 1) begin : channel
        reg  [5:0]        two, other;
        reg  [6:0]        sum;
        reg  signed [7:0] one;
        wire signed [7:0] around = {1'b0, sum} - 8'd62;
        always @(posedge clk) begin
            two   <= {1'b0, bits[15*k +: 5]} + {1'b0, bits[15*k + 5 +: 5]};
            other <= {1'b0, bits[15*k + 10 +: 5]} + {1'b0, bits[(15*k + 31) % 58 +: 5]};
            sum   <= {1'b0, two} + {1'b0, other};
            one   <= !rst_n || strength == 2'd0 ? 8'sd0 : around >>> (2'd3 - strength);
        end
        assign noise[8*k +: 8] = one;
    end endgenerate
endmodule
