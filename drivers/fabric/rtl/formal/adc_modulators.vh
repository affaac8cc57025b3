// SPDX-License-Identifier: MIT
// What the modulators' path promises, from the first reset on: which bits a result is made of, whose, and in which place; when
// the fast path trips, and with which offset. That the filters between are exact adc_sinc3.py shows; here formal/sinc3.v lets a
// phase's bit through, and formal/sinc3_comb.v what it took.
reg f_ran = 1'b0;
always @(posedge clk) f_ran <= f_ran || !rst_n;

// the settings hold still
reg [4:0] f_clocks;
reg [1:0] f_osr, f_trip_osr;
always @(posedge clk) {f_clocks, f_osr, f_trip_osr} <= {clocks, osr, trip_osr};
always @* if (f_ran && on) assume (f_clocks == clocks && f_osr == osr && f_trip_osr == trip_osr);

// takes of a result: the first bit after the start, and three more, every OSR bits
reg [9:0] f_bits;       // since the first take of this result
reg       f_begun;
wire [9:0] f_osr_bits = 10'd32 << osr;
always @(posedge clk)
    if (!on || start) begin
        f_begun <= 1'b0;
        f_bits  <= 10'd0;
    end else if (strobe) begin
        f_begun <= f_begun || takes == 3'd4;
        f_bits  <= f_begun && f_bits != 10'd1023 ? f_bits + 10'd1 : f_bits;
    end
wire [9:0] f_next = takes == 3'd3 ? f_osr_bits : takes == 3'd2 ? 10'd2 * f_osr_bits : 10'd3 * f_osr_bits;
wire [9:0] f_nth = f_begun ? f_bits + 10'd1 : 10'd0;        // of a bit that a strobe brings now

// the fast path: bits since its last take, and the newest set
reg [5:0] f_trip_bits;
wire [5:0] f_trip_osr_bits = trip_osr == 2'd0 ? 6'd8 : trip_osr == 2'd1 ? 6'd16 : 6'd32;
always @(posedge clk)
    f_trip_bits <= !on || trip_take ? 6'd0 : f_trip_bits + {5'd0, strobe};

// a code is the value in 16 bits; all ones of OSR bits are one more than fits
function [15:0] f_in_16(input [24:0] x, input [4:0] bits);
    f_in_16 = x >> bits ? 16'hFFFF : bits < 5'd16 ? x << (5'd16 - bits) : x >> (bits - 5'd16);
endfunction
wire [4:0] f_width = 5'd15 + 5'd3 * osr;
wire [4:0] f_trip_width = trip_osr == 2'd0 ? 5'd9 : trip_osr == 2'd1 ? 5'd12 : 5'd15;
function [16:0] f_less(input [15:0] x, input [15:0] zero);
    f_less = {1'b0, x} - {1'b0, zero};
endfunction
function [16:0] f_size(input [15:0] x, input [15:0] zero);
    f_size = x > zero ? f_less(x, zero) : f_less(zero, x);
endfunction
function f_beyond(input [15:0] x, input [15:0] zero, input [16:0] most);
    f_beyond = f_size(x, zero) > most;
endfunction
reg f_a, f_b, f_c;
reg [3:0] f_step;       // clocks since the values of a warm set came
reg [47:0] f_offsets, f_codes;
reg [16:0] f_limit;
reg        f_steady;
always @(posedge clk) begin
    f_step <= !on ? 4'd0 : trip_readies[0] && warm == 3'd4 ? 4'd1 : f_step == 4'd0 || f_step == 4'd6 ? 4'd0 : f_step + 4'd1;
    if (f_step == 4'd0)
        {f_offsets, f_codes, f_limit} <= {offsets, trip_codes, limit};
    f_steady <= f_step == 4'd0 || (f_steady && {f_offsets, f_codes, f_limit} == {offsets, trip_codes, limit});
    f_a <= f_beyond(f_codes[15:0], f_offsets[15:0], f_limit);
    f_b <= f_beyond(f_codes[31:16], f_offsets[31:16], f_limit);
    f_c <= f_beyond(f_codes[47:32], f_offsets[47:32], f_limit);
end
// a set comes after five clocks at the earliest
always @* if (f_ran && f_step != 4'd0) assume (!trip_readies[0]);

genvar f_k;
generate for (f_k = 0; f_k < 3; f_k = f_k + 1) begin : f_phase
    reg  [1:0] f_pin;       // as it was two clocks ago
    always @(posedge clk) f_pin <= on ? {f_pin[0], pin_data[f_k]} : 2'b00;
    reg f_bit, f_trip_bit;  // at the takes
    always @(posedge clk) begin
        f_bit      <= on && (take ? f_pin[1] : f_bit);
        f_trip_bit <= on && (trip_take ? f_pin[1] : f_trip_bit);
    end
    always @(posedge clk) if (f_ran) begin
        assert (f_pin == phase[f_k].sync);
        assert (phase[f_k].value[0] == f_bit && phase[f_k].trip_value[0] == f_trip_bit);
        if (phase[f_k].value <= 25'd1 << f_width)
            assert (codes[16*f_k +: 16] == f_in_16(phase[f_k].value, f_width));
        if ({9'd0, phase[f_k].trip_value} <= 25'd1 << f_trip_width)
            assert (trip_codes[16*f_k +: 16] == f_in_16({9'd0, phase[f_k].trip_value}, f_trip_width));
    end
end endgenerate

always @(posedge clk) if (f_ran) begin
    if (on) begin
        // helpers
        assert (takes <= 3'd4 && warm <= 3'd4 && (takes != 3'd4 || bits == 8'd0));
        // a take at the bits 0, OSR, 2 OSR and 3 OSR after the start, and no other
        assert (take == (strobe && takes != 3'd0 && (f_nth == 10'd0 || f_nth == f_osr_bits || f_nth == 10'd2 * f_osr_bits ||
                                                     f_nth == 10'd3 * f_osr_bits)));
        assert ((f_begun == (takes != 3'd4) || takes == 3'd0) && (f_begun || f_bits == 10'd0));
        if (takes != 3'd0 && f_begun)
            assert ({2'd0, bits} + f_bits + 10'd1 == f_next && f_bits < f_next && {2'd0, bits} < f_osr_bits);
        // the fast path takes every TRIP_OSR bits
        if (trip_bits != 5'd0)
            assert (warm == 3'd0 || {1'b0, trip_bits} + f_trip_bits + 6'd1 == f_trip_osr_bits);
    end else if ($past(!on))
        assert (!pin_clock && !strobe && takes == 3'd0 && !trip && !trip_event && step == 3'd0);
    // it trips by a set of which any phase is beyond the limit, and says so once
    assert (f_step == {1'b0, step} || f_step == 4'd6);
    if ($past(on) && trip_event)
        assert (f_step == 4'd6);
    if (f_step >= 4'd2)
        assert ({f_a, f_b, f_c} == {f_beyond(f_codes[15:0], f_offsets[15:0], f_limit),
                f_beyond(f_codes[31:16], f_offsets[31:16], f_limit), f_beyond(f_codes[47:32], f_offsets[47:32], f_limit)});
    if (on && f_steady) begin   // helpers: where each phase stands
        if (f_step == 4'd1) assert ({code, offset} == {f_codes[15:0], f_offsets[15:0]} && !any);
        if (f_step == 4'd2) assert ({code, offset} == {f_codes[31:16], f_offsets[31:16]} && !any);
        if (f_step == 4'd3) assert ({code, offset} == {f_codes[47:32], f_offsets[47:32]} && !any);
        if (f_step == 4'd2) assert (less_offset == f_less(f_codes[15:0], f_offsets[15:0]));
        if (f_step == 4'd3) assert (less_offset == f_less(f_codes[31:16], f_offsets[31:16]));
        if (f_step == 4'd4) assert (less_offset == f_less(f_codes[47:32], f_offsets[47:32]));
        if (f_step == 4'd3) assert (magnitude == f_size(f_codes[15:0], f_offsets[15:0]));
        if (f_step == 4'd4) assert (magnitude == f_size(f_codes[31:16], f_offsets[31:16]));
        if (f_step == 4'd5) assert (magnitude == f_size(f_codes[47:32], f_offsets[47:32]));
        if (f_step == 4'd4) assert (any == f_a);
        if (f_step == 4'd5) assert (any == (f_a || f_b));
    end
    if ($past(on) && f_step == 4'd6 && f_steady)
        assert (trip == (f_a || f_b || f_c) && trip_event == (f_a || f_b || f_c));
    if ($past(on) && f_step != 4'd6)
        assert (trip == $past(trip));
end
