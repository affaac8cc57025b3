// SPDX-License-Identifier: MIT
// Whatever the words: what does not fit ends at the nearest word, an angle wraps, nothing else is ever lost. The sum is
// compared with one of 64 bits.
reg [2:0] age = 3'd0;
always @(posedge clk)
    age <= age == 3'd7 ? 3'd7 : age + 3'd1;

// no two words of 18 bits give more
always @*
    assume (product <= 36'sd17179869184 && product >= -36'sd17179738112);

wire signed [63:0] wide_product = $signed({{18{product[35]}}, product, 10'd0}) >>> exponent;
wire signed [63:0] wide_c = {{28{c[35]}}, c};
reg  signed [63:0] exact_1, exact_2;
always @(posedge clk) begin
    exact_1 <= (minus_c ? -wide_c : wide_c) + (minus ? -wide_product : wide_product);
    exact_2 <= exact_1;
end
localparam signed [63:0] MOST = 64'sd34359738367, LEAST = -64'sd34359738368;

always @(posedge clk) begin
    if (age >= 3'd2)
        assert ({{17{sum[46]}}, sum} == exact_2);
    if (age >= 3'd3) begin
        assert (is_negative == ($past(exact_2) < 64'sd0));
        if ($past(zero) || $past(relu) && $past(exact_2) < 64'sd0)
            assert (result == 36'sd0);
        else if ($past(wrap) && !$past(fold))
            assert (result == $past(exact_2[35:0]));
        else if (!$past(wrap) && !$past(fold))
            assert (result == ($past(exact_2) > MOST ? MOST[35:0] : $past(exact_2) < LEAST ? LEAST[35:0]
                                                                                         : $past(exact_2[35:0])));
        else if ($past(wrap)) begin
            // within a quarter turn, and the sine's: as it was, or as far from a half turn
            assert (result[35] == result[34]);
            assert (result == $past(sum[35:0]) || result == ~{~$past(sum[35]), $past(sum[34:0])});
        end
    end
end
