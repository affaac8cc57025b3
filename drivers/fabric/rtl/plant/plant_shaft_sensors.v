// SPDX-License-Identifier: MIT
// Encoder and Hall switches. Between two steps the lines' angle goes on evenly, so that edges come when they are due, a clock
// of 10 ns exactly, and not with the steps.
module plant_shaft_sensors (
    input  wire        clk,
    input  wire        rst_n,
    input  wire        begins,           // a step, with the angles of this instant
    input  wire [31:0] line,             // of an encoder's line: 2^32, four counts
    input  wire [31:0] increment,        // a clock
    input  wire [17:0] turn,             // of the shaft
    input  wire [17:0] electrical,
    input  wire [17:0] index_at,         // the middle of the count that has the index, in turns
    input  wire [17:0] index_reach,      // half a line
    input  wire [1:0]  index_quarter,    // which of its line's four it is
    input  wire [17:0] hall_at,          // electrical angle at which switch A closes
    input  wire        cut,              // the encoder's cable
    output reg         pin_a,
    output reg         pin_b,
    output reg         pin_index,
    output reg         pin_lost,
    output reg  [2:0]  pin_hall          // C, B, A
);
    reg  [31:0] way;
    wire [1:0]  quarter = way[31:30];
    reg  [17:0] beyond;
    wire [17:0] field   = electrical - hall_at;
    // thirds of a turn
    wire [17:0] of_b = field - 18'd87381, of_c = field - 18'd174763;
    wire        unused = &{1'b0, field[16:0], of_b[16:0], of_c[16:0]};
    reg         near;

    always @(posedge clk)
        if (!rst_n) begin
            way <= 32'd0;
            {pin_a, pin_b, pin_index, pin_lost} <= 4'd0;
            pin_hall <= 3'd0;
            near     <= 1'b0;
            beyond   <= 18'd0;
        end else begin
            beyond    <= turn - index_at + index_reach;
            way       <= begins ? line : way + increment;
            near      <= beyond <= {index_reach[16:0], 1'b0};
            pin_a     <= !cut && quarter[1] != quarter[0];
            pin_b     <= !cut && quarter[1];
            pin_index <= !cut && near && quarter == index_quarter;
            pin_lost  <= cut;
            pin_hall  <= {!of_c[17], !of_b[17], !field[17]};
        end

`ifdef FORMAL
`include "formal/plant_shaft_sensors.vh"
`endif
endmodule
