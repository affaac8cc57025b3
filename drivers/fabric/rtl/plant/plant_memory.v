// SPDX-License-Identifier: MIT
// 128 words with two read ports and one for writing: two RAM64x18 of the fabric, side by side. What is read is there a clock
// later; a word that is written in the clock in which it is read comes as it was.
module plant_memory (
    input  wire        clk,
    input  wire        write,
    input  wire [6:0]  write_at,
    input  wire [17:0] written,
    input  wire [6:0]  at_a,
    input  wire [6:0]  at_b,
    output reg  [17:0] read_a,
    output reg  [17:0] read_b
);
    reg [17:0] word [0:127];

    always @(posedge clk) begin
        read_a <= word[at_a];
        read_b <= word[at_b];
        if (write)
            word[write_at] <= written;
    end
endmodule
