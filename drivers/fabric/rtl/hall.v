// SPDX-License-Identifier: MIT
// Three Hall switches: their filtered state now, and the state and the time of its last edge at the last trigger. The filter
// counts in steps of 16 clocks, since Hall edges are slow and noisy.
module hall (
    input  wire        clk,
    input  wire        rst_n,
    input  wire [2:0]  pin,       // C, B, A; asynchronous
    input  wire        tick,      // every 16th clock
    input  wire [7:0]  length,    // of the filter, in ticks
    input  wire [31:0] now,       // the fabric's clock
    input  wire        trigger,
    output wire [2:0]  state,
    output reg  [2:0]  latched,
    output reg  [31:0] edge_time  // of the last edge before the trigger
);
    reg  [2:0]  state_was;
    reg  [31:0] edge_now;

    encoder_filter filter_a (.clk(clk), .rst_n(rst_n), .tick(tick), .length(length), .pin(pin[0]), .level(state[0]));
    encoder_filter filter_b (.clk(clk), .rst_n(rst_n), .tick(tick), .length(length), .pin(pin[1]), .level(state[1]));
    encoder_filter filter_c (.clk(clk), .rst_n(rst_n), .tick(tick), .length(length), .pin(pin[2]), .level(state[2]));

    // `state_was` and `edge_now` change together, so what the trigger latches always belongs together
    always @(posedge clk)
        if (!rst_n) begin
            state_was <= 3'd0;
            edge_now  <= 32'd0;
            latched   <= 3'd0;
            edge_time <= 32'd0;
        end else begin
            state_was <= state;
            if (state != state_was)
                edge_now <= now;
            if (trigger) begin
                latched   <= state_was;
                edge_time <= edge_now;
            end
        end

`ifdef FORMAL
`include "formal/hall.vh"
`endif
endmodule
