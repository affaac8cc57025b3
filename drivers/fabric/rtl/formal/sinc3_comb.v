// SPDX-License-Identifier: MIT
// Stands for sinc3_comb.v in the proof of adc_modulators.v: a value, which is the integral at the take, four clocks after it.
module sinc3_comb #(parameter WIDTH = 25) (
    input  wire             clk, rst_n, take,
    input  wire [WIDTH-1:0] integral,
    output reg  [WIDTH-1:0] value,
    output reg              ready
);
    reg [2:0] on_the_way;
    always @(posedge clk) begin
        {ready, on_the_way} <= rst_n ? {on_the_way, take} : 4'd0;
        if (!rst_n)
            value <= {WIDTH{1'b0}};
        else if (take)
            value <= integral;
    end
endmodule
