// SPDX-License-Identifier: MIT
// The differences of a sinc3 filter: at each `take` the third difference of the integral over the last three takes. One
// subtracter does the three in turn, so at least four clocks must lie between takes.
module sinc3_comb #(parameter WIDTH = 25) (
    input  wire             clk,
    input  wire             rst_n,
    input  wire             take,
    input  wire [WIDTH-1:0] integral,
    output reg  [WIDTH-1:0] value,
    output reg              ready   // one clock: `value` is new
);
    reg [1:0]       step;
    reg [WIDTH-1:0] former_0, former_1, former_2;   // of the integral and its differences, in the order of their use

    always @(posedge clk)
        if (!rst_n) begin
            step     <= 2'd0;
            value    <= {WIDTH{1'b0}};
            ready    <= 1'b0;
            former_0 <= {WIDTH{1'b0}};
            former_1 <= {WIDTH{1'b0}};
            former_2 <= {WIDTH{1'b0}};
        end else begin
            ready <= step == 2'd3;
            if (take) begin
                value <= integral;
                step  <= 2'd1;
            end else if (step != 2'd0) begin
                value <= value - former_0;
                {former_2, former_1, former_0} <= {value, former_2, former_1};
                step <= step + 2'd1;
            end
        end
endmodule
