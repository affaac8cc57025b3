// SPDX-License-Identifier: MIT
// What the arithmetic promises, from the first reset on: results and flags change together, at `finish` only, and are what
// the contract's formulas make of codes and settings, provided that neither changed on the way.
reg f_ran = 1'b0;
always @(posedge clk) f_ran <= f_ran || !rst_n;

wire [255:0] f_inputs = {code_a, code_b, code_c, code_v, valid_in, reconstruct, offset_a, offset_b, offset_c, gain_a, gain_b,
                         gain_c, i_trip, sum_trip, v_min, v_max};
reg  [255:0] f_inputs_was;
reg          f_steady = 1'b0;       // since the start of this run
always @(posedge clk) begin
    f_inputs_was <= f_inputs;
    f_steady     <= rst_n && (step == 4'd0 || (f_steady && f_inputs == f_inputs_was));
end
wire f_same = f_steady && f_inputs == f_inputs_was;     // up to and with this clock

// the formulas, in plain integers
function signed [31:0] f_held(input signed [31:0] x);
    f_held = x > 32767 ? 32767 : x < -32767 ? -32767 : x;
endfunction
function signed [31:0] f_size(input signed [31:0] x);
    f_size = x < 0 ? -x : x;
endfunction
function signed [31:0] f_less(input [15:0] f_code, input [15:0] f_offset);
    f_less = $signed({16'd0, f_code}) - $signed({16'd0, f_offset});
endfunction
function signed [31:0] f_trimmed(input signed [31:0] x, input signed [24:0] f_product);
    f_trimmed = f_held(x + (($signed({{7{f_product[24]}}, f_product}) + 1024) >>> 11));
endfunction

// the product is any function of the two factors, in the range of the product: what holds for all functions holds for the product
wire signed [31:0] f_la = f_less(code_a, offset_a), f_lb = f_less(code_b, offset_b), f_lc = f_less(code_c, offset_c);
(* anyseq *) reg signed [24:0] f_pa;
(* anyseq *) reg signed [24:0] f_pb;
(* anyseq *) reg signed [24:0] f_pc;
localparam signed [24:0] F_MOST = 65535 * 128;
always @* begin
    assume (f_pa <= F_MOST && f_pa >= -F_MOST);
    assume (f_pb <= F_MOST && f_pb >= -F_MOST);
    assume (f_pc <= F_MOST && f_pc >= -F_MOST);
end
always @(posedge clk) begin
    if (f_inputs == f_inputs_was)
        assume (f_pa == $past(f_pa) && f_pb == $past(f_pb) && f_pc == $past(f_pc));
    if (less_offset == f_la[16:0] && gain == gain_a)
        assume (multiplied == f_pa);
    if (less_offset == f_lb[16:0] && gain == gain_b)
        assume (multiplied == f_pb);
    if (less_offset == f_lc[16:0] && gain == gain_c)
        assume (multiplied == f_pc);
end
wire signed [31:0] f_a0 = f_trimmed(f_la, f_pa), f_b0 = f_trimmed(f_lb, f_pb), f_c0 = f_trimmed(f_lc, f_pc);
wire signed [31:0] f_a = reconstruct && valid_in == 3'b110 ? f_held(-f_b0 - f_c0) : f_a0;
wire signed [31:0] f_b = reconstruct && valid_in == 3'b101 ? f_held(-f_a0 - f_c0) : f_b0;
wire signed [31:0] f_c = reconstruct && valid_in == 3'b011 ? f_held(-f_a0 - f_b0) : f_c0;
wire signed [31:0] f_v = {17'd0, code_v, 3'd0};
wire signed [31:0] f_sum = f_a + f_b + f_c;
wire f_current = f_size(f_a) > $signed({15'd0, i_trip}) || f_size(f_b) > $signed({15'd0, i_trip}) ||
                 f_size(f_c) > $signed({15'd0, i_trip});
wire f_sum_off = f_size(f_sum) > $signed({15'd0, sum_trip});

wire [31:0] f_a_now = {{16{a[15]}}, a}, f_b_now = {{16{b[15]}}, b}, f_c_now = {{16{c[15]}}, c};
always @(posedge clk) if (f_ran) begin
    assert (step <= 4'd10);
    if (f_same) begin
        // where each value stands at each step
        if (step == 4'd2) assert (less_offset == f_la[16:0]);
        if (step == 4'd3) assert (less_offset == f_lb[16:0] && base == f_la[16:0] && product == f_pa);
        if (step == 4'd4) assert (less_offset == f_lc[16:0] && base == f_lb[16:0] && product == f_pb);
        if (step == 4'd5) assert (base == f_lc[16:0] && product == f_pc);
        if (step == 4'd4 || step == 4'd5 || step == 4'd6) assert (f_a_now == f_a0);
        if (step == 4'd5 || step == 4'd6) assert (f_b_now == f_b0);
        if (step == 4'd6) assert (f_c_now == f_c0 && kept == (reconstruct ? valid_in : 3'b111));
        if (step >= 4'd7) assert (f_a_now == f_a && f_b_now == f_b && f_c_now == f_c);
        if (step >= 4'd8) assert (sum == f_sum[17:0]);
        if (step >= 4'd2) assert (high_off == (f_v > $signed({15'd0, v_max})));
        if (step >= 4'd3) assert (low_off == (f_v < $signed({15'd0, v_min})));
        if (step == 4'd8) assert (current_off == (f_size(f_a) > $signed({15'd0, i_trip})));
        if (step == 4'd9) assert (current_off == (f_size(f_a) > $signed({15'd0, i_trip}) || f_size(f_b) > $signed({15'd0, i_trip})));
        if (step == 4'd10) assert (current_off == f_current);
    end
end

// what is seen from outside
always @(posedge clk) if (f_ran) begin
    if (!$past(rst_n)) begin
        assert (step == 4'd0);
        assert ({ia, ib, ic, v, valid, beyond_current, beyond_sum, beyond_v_high, beyond_v_low} == 67'd0);
    end else if (!$past(finish))
        assert ({ia, ib, ic, v, valid, beyond_current, beyond_sum, beyond_v_high, beyond_v_low} ==
                $past({ia, ib, ic, v, valid, beyond_current, beyond_sum, beyond_v_high, beyond_v_low}));
    else begin
        assert (v == $past(code_v) && valid == $past(valid_in));
        if ($past(f_same)) begin
            assert ({{16{ia[15]}}, ia} == $past(f_a));
            assert ({{16{ib[15]}}, ib} == $past(f_b));
            assert ({{16{ic[15]}}, ic} == $past(f_c));
            assert (beyond_current == $past(f_current));
            assert (sum_was_off == $past(f_sum_off));
            assert (beyond_sum == ($past(f_sum_off) && $past(sum_was_off)));
            assert (beyond_v_high == ($past(f_v) > $signed({15'd0, $past(v_max)})));
            assert (beyond_v_low == ($past(f_v) < $signed({15'd0, $past(v_min)})));
        end
    end
    if ($past(rst_n) && !$past(finish))
        assert (sum_was_off == $past(sum_was_off));
    // ten clocks from start to finish, and none without a start
    if ($past(rst_n) && $past(enable))
        assert (step == ($past(step) == 4'd10 ? 4'd0 : $past(step) != 4'd0 || $past(start) ? $past(step) + 4'd1 : 4'd0));
    if ($past(rst_n) && !$past(enable))
        assert (step == 4'd0);
    assert (finish == (enable && step == 4'd10));
end
