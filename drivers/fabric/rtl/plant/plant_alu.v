// SPDX-License-Identifier: MIT
// What follows the multiplier: +-C +- A B 2^(10 - e), three clocks. The product has 36 bits, shifted 46; with C the sum has 47,
// so that nothing is lost before it saturates or, for angles, wraps. What the shift drops is rounded down.
module plant_alu (
    input  wire               clk,
    input  wire signed [35:0] product,
    input  wire        [4:0]  exponent,
    input  wire signed [35:0] c,            // with the product
    input  wire               minus,        // the product
    input  wire               minus_c,
    // a clock after the product's
    input  wire               relu,         // what is negative becomes 0, two clocks after
    input  wire               zero,
    input  wire               wrap,
    input  wire               fold,
    output reg  signed [35:0] result,       // of the product three clocks before
    output reg                is_negative,  // the sum, before anything else
    output wire               folds         // a clock before the result
);
    reg signed [45:0] shifted;
    reg signed [35:0] addend;
    reg               subtracts, negates;
    always @(posedge clk) begin
        shifted   <= $signed({product, 10'd0}) >>> exponent;
        addend    <= c;
        subtracts <= minus;
        negates   <= minus_c;
    end

    reg signed [46:0] sum;
    wire signed [46:0] term = {{11{addend[35]}}, addend}, factor = {shifted[45], shifted};
    always @(posedge clk)
        sum <= (negates ? ~term : term) + (subtracts ? ~factor : factor) + {45'd0, negates && subtracts, negates ^ subtracts};

    // within 36 bits all upper ones are alike
    wire fits = &sum[46:35] || !(|sum[46:35]);
    assign folds = fold && sum[35] != sum[34];
    always @(posedge clk) begin
        is_negative <= sum[46];
        if (zero || relu && sum[46])
            result <= 36'sd0;
        else if (folds)
            result <= {~sum[34], ~sum[34:0]};
        else if (wrap || fits)
            result <= sum[35:0];
        else
            result <= {sum[46], {35{!sum[46]}}};
    end

`ifdef FORMAL
`include "formal/plant_alu.vh"
`endif
endmodule
