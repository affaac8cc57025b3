// SPDX-License-Identifier: MIT
// Three 1-bit modulators that this block clocks. Each bit is taken at the rising edge after the one that brought it, behind two
// flip-flops. The same integrators feed two paths. The results consist only of bits that came after the trigger, so they
// belong to the instant 1.5 OSR bits after it. The fast path runs all the time and trips. A modulator without supply gives all
// zeros or ones, which is full scale, so that any trip below full scale sees it.
module adc_modulators (
    input  wire        clk,
    input  wire        rst_n,
    input  wire        enable,
    input  wire [1:0]  osr,           // 32 << osr
    input  wire [1:0]  trip_osr,      // 8 << trip_osr, at most 32
    input  wire [4:0]  clocks,        // of a period of the modulators' clock; at least 5
    input  wire        start,
    output reg         pin_clock,
    input  wire [2:0]  pin_data,      // C, B, A
    output wire        done,          // one clock: the codes are new
    output wire [47:0] codes,         // 16 bits each, A lowest: all ones 65535, half of them 32768
    // the fast path
    input  wire [47:0] offsets,
    input  wire [16:0] limit,
    output reg         trip,          // of the newest set, beyond the limit
    output reg         trip_event     // one clock: such a set has come
);
    wire on = rst_n && enable;

    // the modulators' clock, and a strobe per bit
    reg  [4:0] count;
    reg        strobe;
    reg  [4:0] last;
    wire       ends = {last, 1'b0} < {count, 1'b1};
    always @(posedge clk)
        if (!on) begin
            count     <= 5'd0;
            pin_clock <= 1'b0;
            strobe    <= 1'b0;
            last      <= 5'd4;
        end else begin
            last   <= clocks < 5'd5 ? 5'd4 : clocks - 5'd1;
            count  <= ends ? 5'd0 : count + 5'd1;
            strobe <= pin_clock && count == 5'd0;   // when sync[1] is what the pin was at the edge
            if (ends)
                pin_clock <= 1'b1;
            else if (count == last >> 1)
                pin_clock <= 1'b0;
        end

    // a result takes the integral four times: at the first bit after the start, and every OSR bits from then on
    reg  [2:0] takes;                 // still to come
    reg  [7:0] bits;                  // until the next
    wire [7:0] spacing = {osr == 2'd3, osr >= 2'd2, osr >= 2'd1, 5'b11111};
    wire       take    = strobe && takes != 3'd0 && bits == 8'd0;
    always @(posedge clk)
        if (!on) begin
            takes <= 3'd0;
            bits  <= 8'd0;
        end else if (start) begin
            takes <= 3'd4;
            bits  <= 8'd0;
        end else if (take) begin
            takes <= takes - 3'd1;
            bits  <= spacing;
        end else if (strobe && bits != 8'd0)
            bits <= bits - 8'd1;

    // the fast path takes it every TRIP_OSR bits; the first three values reach back before the first bit
    reg  [4:0] trip_bits;
    reg  [2:0] warm;
    wire [4:0] trip_spacing = {trip_osr >= 2'd2, trip_osr >= 2'd1, 3'b111};
    wire       trip_take    = strobe && trip_bits == 5'd0;
    always @(posedge clk)
        if (!on) begin
            trip_bits <= 5'd0;
            warm      <= 3'd0;
        end else if (trip_take) begin
            trip_bits <= trip_spacing;
            if (warm != 3'd4)
                warm <= warm + 3'd1;
        end else if (strobe)
            trip_bits <= trip_bits - 5'd1;

    wire [2:0]  readies, trip_readies;
    wire [47:0] trip_codes;
    genvar k;
    generate for (k = 0; k < 3; k = k + 1) begin : phase
        reg  [1:0]  sync;
        wire [24:0] integral, value;
        wire [15:0] trip_value;
        always @(posedge clk)
            sync <= on ? {sync[0], pin_data[k]} : 2'b00;

        sinc3 integrators (.clk(clk), .rst_n(on), .strobe(strobe), .data(sync[1]), .integral(integral));
        sinc3_comb #(.WIDTH(25)) comb (.clk(clk), .rst_n(on), .take(take), .integral(integral), .value(value),
                                       .ready(readies[k]));
        sinc3_comb #(.WIDTH(16)) trip_comb (.clk(clk), .rst_n(on), .take(trip_take), .integral(integral[15:0]),
                                            .value(trip_value), .ready(trip_readies[k]));
        // all ones is OSR cubed, which is one more than fits
        assign codes[16*k +: 16] = osr == 2'd0 ? (value[15] ? 16'hFFFF : {value[14:0], 1'b0})
                                 : osr == 2'd1 ? (value[18] ? 16'hFFFF : value[17:2])
                                 : osr == 2'd2 ? (value[21] ? 16'hFFFF : value[20:5])
                                               : (value[24] ? 16'hFFFF : value[23:8]);
        assign trip_codes[16*k +: 16] = trip_osr == 2'd0 ? (trip_value[9] ? 16'hFFFF : {trip_value[8:0], 7'd0})
                                      : trip_osr == 2'd1 ? (trip_value[12] ? 16'hFFFF : {trip_value[11:0], 4'd0})
                                                         : (trip_value[15] ? 16'hFFFF : {trip_value[14:0], 1'b0});
    end endgenerate

    assign done = readies[0] && takes == 3'd0;

    // the fast path against its limit, one phase a clock: chosen in steps 0 to 2 (the values come in the clock before step 1),
    // subtracted a step later, compared two steps after that
    reg  [2:0]  step;
    reg         any;
    reg  [16:0] less_offset, magnitude;
    wire        beyond = magnitude > limit;
    reg  [15:0] code, offset;
    always @(posedge clk)
        if (!on)
            {code, offset} <= 32'd0;
        else
            case (step)
            3'd1:    {code, offset} <= {trip_codes[31:16], offsets[31:16]};
            3'd2:    {code, offset} <= {trip_codes[47:32], offsets[47:32]};
            default: {code, offset} <= {trip_codes[15:0], offsets[15:0]};
            endcase
    always @(posedge clk)
        if (!on) begin
            step        <= 3'd0;
            any         <= 1'b0;
            less_offset <= 17'd0;
            magnitude   <= 17'd0;
            trip        <= 1'b0;
            trip_event  <= 1'b0;
        end else begin
            less_offset <= {1'b0, code} - {1'b0, offset};
            magnitude   <= less_offset[16] ? 17'd0 - less_offset : less_offset;
            trip_event  <= step == 3'd5 && (any || beyond);
            if (trip_readies[0] && warm == 3'd4)
                step <= 3'd1;
            else if (step != 3'd0)
                step <= step == 3'd5 ? 3'd0 : step + 3'd1;
            any <= step >= 3'd3 && (any || beyond);
            if (step == 3'd5)
                trip <= any || beyond;
        end

    wire unused = &{1'b0, readies[2:1], trip_readies[2:1]};

`ifdef FORMAL
`include "formal/adc_modulators.vh"
`endif
endmodule
