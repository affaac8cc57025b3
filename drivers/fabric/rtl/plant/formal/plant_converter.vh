// SPDX-License-Identifier: MIT
// A frame: zeros first, then the code that was there when CS fell, MSB first; the line changes only a clock after CS or a
// falling SCLK, and is 0 at rest.
reg        began = 1'b0;
reg  [5:0] falls = 6'd0;                 // seen since CS fell
reg [11:0] taken = 12'd0;
reg        in_frame = 1'b0;
always @(posedge clk) begin
    began    <= began || !rst_n;
    in_frame <= rst_n && !cs_n;
    if (!rst_n || cs_n)
        falls <= 6'd0;
    else if (was_cs_n) begin
        falls <= 6'd0;
        taken <= code;
    end else if (was_sclk && !sclk && falls != 6'd63)
        falls <= falls + 6'd1;
end
localparam [5:0] Z = ZEROS;
wire [11:0] ahead = falls <= Z ? taken : falls >= Z + 6'd12 ? 12'd0 : taken << (falls - Z);
always @(posedge clk)
    if (began) begin
        if (!in_frame)
            assert (!sdata);
        assert (in_frame == !was_cs_n);
        if (in_frame) begin
            assert (left == ahead);
            assert (zeros == (falls < Z ? Z[2:0] - falls[2:0] : 3'd0));
            assert (sdata == (falls >= Z && ahead[11]));
        end
        if ($past(rst_n) && rst_n && $past(in_frame) && in_frame && !($past(was_sclk) && !$past(sclk)))
            assert (sdata == $past(sdata));
    end
