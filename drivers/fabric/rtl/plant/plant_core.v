// SPDX-License-Identifier: MIT
// Plays the program (microcode.py) once a step: an operation a clock through memory, multiplier and plant_alu. Six clocks after
// its issue, another may read its result; the program is made so. In clocks without an operation the host may look at a word,
// and writes one where no result is written.
`include "plant_program.vh"
module plant_core (
    input  wire               clk,
    input  wire               rst_n,
    input  wire               run,         // stands at the end of a step
    input  wire               sinks,       // the source takes current back
    input  wire               chops,
    input  wire        [2:0]  open,
    output wire               tick,        // the legs' clocks are taken; a few clocks later a step begins
    // in place of A
    output wire        [3:0]  which,
    input  wire signed [17:0] external,
    input  wire        [2:0]  off,
    // the host's word
    input  wire        [6:0]  host_at,
    input  wire               host_look,   // once
    input  wire               host_write,  // once
    input  wire        [35:0] host_word,
    output reg                host_busy,
    output reg         [35:0] looked_at,
    output wire               begins,      // a step
    // results
    output wire               valid,
    output reg         [6:0]  place,
    output wire        [35:0] word
);
    wire [6:0] clock;
    wire       active, first;              // the step after a rest has no operations of the one before
    assign     begins = clock == 7'd0;
    plant_clock of_the_step (.clk(clk), .rst_n(rst_n), .run(run), .clock(clock), .active(active), .first(first), .tick(tick));

    // 1: the operation
    reg [`PLANT_CODE_BITS-1:0] code, op;
    reg  plays, begun;                     // of the clock whose operation `code` is
    always @(posedge clk) begin
        plays <= active;
        begun <= !first;
        case (clock)
        `PLANT_PROGRAM
        endcase
    end
    reg  looks, wants_look;
    wire goes = plays && code[`OP_VALID] && (begun || !code[`OP_LATE]);
    always @(posedge clk)
        if (!rst_n) begin
            op    <= {`PLANT_CODE_BITS{1'b0}};
            looks <= 1'b0;
        end else begin
            op <= goes ? code : {`PLANT_CODE_BITS{1'b0}};
            if (!goes)
                op[`OP_C] <= host_at;
            looks         <= !goes && wants_look && !looks;
        end
    assign which = op[17:14];              // OP_A

    // 2: the operands
    wire signed [17:0] a_high, b_high;
    wire        [17:0] c_high, c_high_again, b_low, c_low;
    reg         wants_write, to_place;
    wire        written_now;
    wire signed [35:0] result;
    wire        writes   = written_now || wants_write && !to_place;
    wire [6:0]  write_at = to_place ? place : host_at;
    wire [35:0] written  = to_place ? result : host_word;
    plant_memory high_ab (.clk(clk), .write(writes), .write_at(write_at), .written(written[35:18]), .at_a(op[`OP_A]),
                          .at_b(op[`OP_B]), .read_a(a_high), .read_b(b_high));
    plant_memory high_c (.clk(clk), .write(writes), .write_at(write_at), .written(written[35:18]), .at_a(op[`OP_C]),
                         .at_b(op[`OP_C]), .read_a(c_high), .read_b(c_high_again));
    plant_memory low_bc (.clk(clk), .write(writes), .write_at(write_at), .written(written[17:0]), .at_a(op[`OP_B]),
                         .at_b(op[`OP_C]), .read_a(b_low), .read_b(c_low));
    reg [`PLANT_CODE_BITS-1:0] op2, op3, op4, op5;
    reg                        looks2, looks3, looks4, looks5, looks6;

    // 3: the product
    wire signed [17:0] factor = op2[`OP_EXTERNAL] ? external : a_high;
    wire signed [35:0] product;
    plant_multiply math (.clk(clk), .a(factor), .b(b_high), .product(product));
    reg signed [35:0] addend;
    reg        [4:0]  exponent;
    always @(posedge clk) begin
        addend   <= {op2[`OP_LOW] ? 18'd0 : c_high, c_low};
        exponent <= op2[`OP_STATE] ? 5'd8 : b_low[4:0];
    end

    // 4, 5, 6: shifted, added, fitted
    reg  folded, slows;                    // of the last angle that was folded; of the speed
    wire folds, is_negative;
    wire turned = op3[`OP_UNFOLD] && folded;
    reg  relu, zero;
    always @(posedge clk) begin
        case (op4[`OP_RELU])
            3'd1:    relu <= 1'b1;
            3'd2:    relu <= !sinks;
            3'd4:    relu <= !open[0];
            3'd5:    relu <= !open[1];
            3'd6:    relu <= !open[2];
            default: relu <= 1'b0;
        endcase
        case (op4[`OP_UNLESS])
            3'd1:    zero <= !chops;
            3'd4:    zero <= !off[0];
            3'd5:    zero <= !off[1];
            3'd6:    zero <= !off[2];
            default: zero <= 1'b0;
        endcase
    end
    plant_alu alu (.clk(clk), .product(product), .exponent(exponent), .c(addend),
                   .minus(op3[`OP_MINUS] ^ turned ^ (op3[`OP_SPEED] && slows)), .minus_c(op3[`OP_MINUS_C] ^ turned),
                   .relu(relu), .zero(zero), .wrap(op5[`OP_WRAP]), .fold(op5[`OP_FOLD]), .result(result),
                   .is_negative(is_negative), .folds(folds));

    reg only_negative;
    always @(posedge clk)
        if (!rst_n) begin
            {op2, op3, op4, op5} <= {4 * `PLANT_CODE_BITS{1'b0}};
            {looks2, looks3, looks4, looks5, looks6} <= 5'd0;
            to_place <= 1'b0;
            folded   <= 1'b0;
        end else begin
            {op2, op3, op4, op5} <= {op, op2, op3, op4};
            {looks2, looks3, looks4, looks5, looks6} <= {looks, looks2, looks3, looks4, looks5};
            to_place <= op5[`OP_VALID];
            if (op5[`OP_VALID] && op5[`OP_FOLD])
                folded <= folds;
        end
    always @(posedge clk) begin
        only_negative <= op5[`OP_NEGATIVE];
        place         <= op5[`OP_W];
        if (to_place && place == `WORD_W && written_now)
            slows <= is_negative;
    end

    // 7: written
    assign written_now = to_place && (!only_negative || is_negative);
    assign word = result;
    assign valid = written_now;
    always @(posedge clk)
        if (!rst_n) begin
            wants_look  <= 1'b0;
            wants_write <= 1'b0;
            host_busy   <= 1'b0;
            looked_at   <= 36'd0;
        end else begin
            wants_look  <= host_look || wants_look && !looks;
            wants_write <= host_write || wants_write && to_place;
            if (looks6)
                looked_at <= result;
            host_busy <= host_look || host_write || host_busy && !(looks6 || wants_write && !to_place);
        end

    wire unused = &{1'b0, b_low[17:5], c_high_again, op5};
endmodule
