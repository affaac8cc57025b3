// SPDX-License-Identifier: MIT
// From codes to results: offset, gain, clamp, reconstruction of a phase that was not valid, limits. One subtracter, one
// multiplier and one comparator serve all values in turn, a register behind each of them; results and flags change together in
// the last step.
//
// Each setting is used in one step only, so a setting written during the steps acts on some of the values and not on others.
module adc_math (
    input  wire        clk,
    input  wire        rst_n,
    input  wire        enable,          // 0 drops what is under way
    input  wire        start,           // the inputs are there and stay until `finish`
    input  wire [15:0] code_a,          // 16 times a 12 bit code, or 16 bits of a modulator
    input  wire [15:0] code_b,
    input  wire [15:0] code_c,
    input  wire [11:0] code_v,
    input  wire [2:0]  valid_in,        // C, B, A
    // settings
    input  wire        reconstruct,
    input  wire [15:0] offset_a,
    input  wire [15:0] offset_b,
    input  wire [15:0] offset_c,
    input  wire [7:0]  gain_a,          // signed: the gain less 1, in 1/2048
    input  wire [7:0]  gain_b,
    input  wire [7:0]  gain_c,
    input  wire [16:0] i_trip,
    input  wire [16:0] sum_trip,
    input  wire [16:0] v_min,
    input  wire [16:0] v_max,
    // results
    output wire        finish,          // they change with the end of this clock
    output reg  [15:0] ia,              // signed, -32767...+32767
    output reg  [15:0] ib,
    output reg  [15:0] ic,
    output reg  [11:0] v,               // VBUS / 8
    output reg  [2:0]  valid,
    output reg         beyond_current,
    output reg         beyond_sum,
    output reg         beyond_v_high,
    output reg         beyond_v_low
);
    reg [3:0] step;                     // 0: idle

    // -32767...+32767 of more bits, signed; `none`: the lowest 15 are 0, as may be known earlier
    function [15:0] clamp(input [17:0] x, input none);
        clamp = x[17] ? (x[16:15] != 2'b11 || none ? 16'h8001 : x[15:0])
                      : (x[16:15] != 2'b00 ? 16'h7FFF : x[15:0]);
    endfunction

    // offset and gain: phase k, from 0, is chosen in step k, subtracted in step k + 1, multiplied in step k + 2, clamped in
    // step k + 3. The codes are there with `start`, so that the first phase is chosen in the clock before step 1.
    reg  [15:0] code, offset;
    reg  [7:0]  gain, gain_now;         // gain_now belongs to the phase in less_offset
    always @(posedge clk)
        if (!rst_n)
            {code, offset, gain} <= 40'd0;
        else
            case (step)
            4'd1:    {code, offset, gain} <= {code_b, offset_b, gain_b};
            4'd2:    {code, offset, gain} <= {code_c, offset_c, gain_c};
            default: {code, offset, gain} <= {code_a, offset_a, gain_a};
            endcase
    reg  [16:0] less_offset;            // signed
    wire [28:0] product;                // of less_offset and the gain, and half of what is cut off, signed
    adc_multiply multiply (.clk(clk), .rst_n(rst_n), .x(less_offset), .gain(gain_now), .product(product));

    wire [15:0] current = clamp(product[28:11], product[25:11] == 15'd0);

    // a single phase that is not valid becomes minus the sum of the other two; the third is that phase, or B if there is none
    reg  [15:0] a, b, c;
    reg  [2:0]  kept;                   // valid_in, or all unless a single one is to be replaced
    wire        single  = valid_in == 3'b110 || valid_in == 3'b101 || valid_in == 3'b011;
    wire [15:0] other_1 = kept[0] ? a : b;
    wire [15:0] other_2 = kept[2] ? c : b;
    wire [15:0] third   = !kept[0] ? a : !kept[2] ? c : b;
    reg  [16:0] others;
    wire [17:0] missing = 18'd0 - {others[16], others};
    wire [15:0] rebuilt = clamp(missing, others[14:0] == 15'd0);

    // a comparison in each of the last steps, of the value and the limit chosen in the step before: the signs of a difference
    // and a sum, because the magnitude would be one more adder in the same path
    reg  [17:0] sum, value;             // signed
    reg  [16:0] limit;
    wire [18:0] above = {2'b00, limit} - {value[17], value};
    wire [18:0] below = {2'b00, limit} + {value[17], value};
    wire        greater = above[18] || below[18];

    reg current_off, high_off, low_off, sum_was_off;

    assign finish = enable && step == 4'd11;

    always @(posedge clk)
        if (!rst_n) begin
            step           <= 4'd0;
            less_offset    <= 17'd0;
            gain_now       <= 8'd0;
            value          <= 18'd0;
            limit          <= 17'd0;
            others         <= 17'd0;
            kept           <= 3'd0;
            a              <= 16'd0;
            b              <= 16'd0;
            c              <= 16'd0;
            sum            <= 18'd0;
            current_off    <= 1'b0;
            high_off       <= 1'b0;
            low_off        <= 1'b0;
            sum_was_off    <= 1'b0;
            ia             <= 16'd0;
            ib             <= 16'd0;
            ic             <= 16'd0;
            v              <= 12'd0;
            valid          <= 3'd0;
            beyond_current <= 1'b0;
            beyond_sum     <= 1'b0;
            beyond_v_high  <= 1'b0;
            beyond_v_low   <= 1'b0;
        end else begin
            if (!enable || finish)
                step <= 4'd0;
            else if (start || step != 4'd0)
                step <= step + 4'd1;

            less_offset <= {1'b0, code} - {1'b0, offset};
            gain_now    <= gain;
            others      <= {other_1[15], other_1} + {other_2[15], other_2};
            sum         <= {{2{a[15]}}, a} + {{2{b[15]}}, b} + {{2{c[15]}}, c};

            case (step)
            4'd1: begin
                value <= {3'd0, code_v, 3'd0};
                limit <= v_max;
            end
            4'd2: begin
                value    <= ~{3'd0, code_v, 3'd0};      // less than 0 with a limit that is not above VBUS
                limit    <= v_min;
                high_off <= above[18];
            end
            4'd3: begin
                low_off <= !below[18];
                a       <= current;
            end
            4'd4: b <= current;
            4'd5: begin
                c    <= current;
                kept <= reconstruct && single ? valid_in : 3'b111;
            end
            4'd7: begin                 // the third is in its place in the next step
                if (!kept[0])
                    a <= rebuilt;
                if (!kept[1])
                    b <= rebuilt;
                if (!kept[2])
                    c <= rebuilt;
                value <= {{2{other_1[15]}}, other_1};
                limit <= i_trip;
            end
            4'd8: begin
                value       <= {{2{other_2[15]}}, other_2};
                current_off <= greater;
            end
            4'd9: begin
                value       <= {{2{third[15]}}, third};
                current_off <= current_off || greater;
            end
            4'd10: begin
                value       <= sum;
                limit       <= sum_trip;
                current_off <= current_off || greater;
            end
            default: ;
            endcase

            if (finish) begin
                {ia, ib, ic, v} <= {a, b, c, code_v};
                valid           <= valid_in;
                beyond_current  <= current_off;
                beyond_sum      <= greater && sum_was_off;
                sum_was_off     <= greater;
                beyond_v_high   <= high_off;
                beyond_v_low    <= low_off;
            end
        end

    wire unused = &{1'b0, product[10:0], above[17:0], below[17:0]};

`ifdef FORMAL
`include "formal/adc_math.vh"
`endif
endmodule
