// SPDX-License-Identifier: MIT
// What the arithmetic promises, from the first reset on: results and flags change together, at `finish` only, and are what
// the contract's formulas make of codes and settings, provided that neither changed on the way. The formulas work in plain
// integers from what the inputs were at the start, one formula in the clock in which the block does the same, so that a solver
// need not follow a long chain of arithmetic over many clocks.
reg f_ran = 1'b0;
always @(posedge clk) f_ran <= f_ran || !rst_n;

reg [15:0] f_code_a, f_code_b, f_code_c, f_offset_a, f_offset_b, f_offset_c;
reg [7:0]  f_gain_a, f_gain_b, f_gain_c;
reg [11:0] f_code_v;
reg [2:0]  f_valid;
reg        f_reconstruct;
reg [16:0] f_i_trip, f_sum_trip, f_v_min, f_v_max;
reg        f_steady = 1'b0;         // nothing has changed since the start
wire       f_same = f_steady &&
                    {f_code_a, f_code_b, f_code_c, f_code_v, f_valid, f_reconstruct} ==
                    {code_a, code_b, code_c, code_v, valid_in, reconstruct} &&
                    {f_offset_a, f_offset_b, f_offset_c, f_gain_a, f_gain_b, f_gain_c} ==
                    {offset_a, offset_b, offset_c, gain_a, gain_b, gain_c} &&
                    {f_i_trip, f_sum_trip, f_v_min, f_v_max} == {i_trip, sum_trip, v_min, v_max};
always @(posedge clk) begin
    f_steady <= rst_n && (step == 4'd0 || f_same);
    if (step == 4'd0) begin
        {f_code_a, f_code_b, f_code_c, f_code_v, f_valid, f_reconstruct} <=
            {code_a, code_b, code_c, code_v, valid_in, reconstruct};
        {f_offset_a, f_offset_b, f_offset_c, f_gain_a, f_gain_b, f_gain_c, f_i_trip, f_sum_trip, f_v_min, f_v_max} <=
            {offset_a, offset_b, offset_c, gain_a, gain_b, gain_c, i_trip, sum_trip, v_min, v_max};
    end
end

// the formulas, in plain integers
function signed [31:0] f_held(input signed [31:0] x);
    f_held = x > 32767 ? 32767 : x < -32767 ? -32767 : x;
endfunction
function signed [31:0] f_size(input signed [31:0] x);
    f_size = x < 0 ? -x : x;
endfunction
function f_beyond(input signed [31:0] x);
    f_beyond = f_size(x) > $signed({15'd0, f_i_trip});
endfunction
function signed [31:0] f_less(input [15:0] f_code, input [15:0] f_offset);
    f_less = $signed({16'd0, f_code}) - $signed({16'd0, f_offset});
endfunction
function signed [31:0] f_trimmed(input signed [28:0] f_product);
    f_trimmed = f_held($signed({{3{f_product[28]}}, f_product}) >>> 11);
endfunction

// the product, a clock after its factors, is any function of the two, in its range: what holds for all functions holds for the
// one
(* anyseq *) reg signed [28:0] f_any_a;
(* anyseq *) reg signed [28:0] f_any_b;
(* anyseq *) reg signed [28:0] f_any_c;
reg signed [28:0] f_pa, f_pb, f_pc;
reg [16:0] f_x;
reg [7:0]  f_y;
localparam signed [28:0] F_MOST = 65535 * (2048 + 127) + 1024;
always @(posedge clk) begin
    assume (f_any_a <= F_MOST && f_any_a >= -F_MOST);
    assume (f_any_b <= F_MOST && f_any_b >= -F_MOST);
    assume (f_any_c <= F_MOST && f_any_c >= -F_MOST);
    {f_x, f_y} <= {less_offset, gain_now};
    if (step == 4'd1)
        {f_pa, f_pb, f_pc} <= {f_any_a, f_any_b, f_any_c};
    if (step >= 4'd3) begin
        if (f_x == f_la[16:0] && f_y == f_gain_a)
            assume (product == f_pa);
        if (f_x == f_lb[16:0] && f_y == f_gain_b)
            assume (product == f_pb);
        if (f_x == f_lc[16:0] && f_y == f_gain_c)
            assume (product == f_pc);
    end
end

reg signed [31:0] f_la, f_lb, f_lc, f_a, f_b, f_c, f_sum;
reg               f_high, f_low, f_off_1, f_off_2, f_off_3;
// the three currents in the order of their comparison: the one that may be replaced is the last
wire              f_single = f_reconstruct && (f_valid == 3'b110 || f_valid == 3'b101 || f_valid == 3'b011);
wire [2:0]        f_kept = f_single ? f_valid : 3'b111;
wire [1:0]        f_at_1 = f_kept[0] ? 2'd0 : 2'd1;
wire [1:0]        f_at_2 = f_kept[2] ? 2'd2 : 2'd1;
wire [1:0]        f_at_3 = 2'd3 - f_at_1 - f_at_2;
wire signed [31:0] f_1 = f_at_1 == 2'd0 ? f_a : f_b;
wire signed [31:0] f_2 = f_at_2 == 2'd2 ? f_c : f_b;
wire signed [31:0] f_3 = f_at_3 == 2'd0 ? f_a : f_at_3 == 2'd1 ? f_b : f_c;
always @* assert (f_at_1 != f_at_2 && f_at_3 != f_at_1 && f_at_3 != f_at_2 && f_at_3 != 2'd3);
wire signed [31:0] f_v = $signed({17'd0, f_code_v, 3'd0});
always @(posedge clk)
    case (step)
    4'd1: begin
        f_la   <= f_less(f_code_a, f_offset_a);
        f_lb   <= f_less(f_code_b, f_offset_b);
        f_lc   <= f_less(f_code_c, f_offset_c);
    end
    4'd2: f_high <= f_v > $signed({15'd0, f_v_max});
    4'd3: begin
        f_low <= f_v < $signed({15'd0, f_v_min});
        f_a   <= f_trimmed(f_pa);
    end
    4'd4: f_b <= f_trimmed(f_pb);
    4'd5: f_c <= f_trimmed(f_pc);
    4'd7:
        if (f_reconstruct)
            case (f_valid)
            3'b110: f_a <= f_held(-f_b - f_c);
            3'b101: f_b <= f_held(-f_a - f_c);
            3'b011: f_c <= f_held(-f_a - f_b);
            default: ;
            endcase
    4'd8: begin
        f_sum   <= f_a + f_b + f_c;
        f_off_1 <= f_beyond(f_1);
    end
    4'd9: f_off_2 <= f_beyond(f_2);
    4'd10: f_off_3 <= f_beyond(f_3);
    default: ;
    endcase
wire f_sum_off = f_size(f_sum) > $signed({15'd0, f_sum_trip});

// where each value stands at each step
function signed [31:0] f_wide(input [15:0] x);
    f_wide = {{16{x[15]}}, x};
endfunction
function signed [31:0] f_wider(input [17:0] x);
    f_wider = {{14{x[17]}}, x};
endfunction
function f_fits(input signed [31:0] x, input signed [31:0] f_most);
    f_fits = x <= f_most && x >= -f_most;
endfunction
always @(posedge clk) if (f_ran) begin
    assert (step <= 4'd11);
    if (f_same) begin
        if (step >= 4'd2) begin
            assert (f_fits(f_la, 65535) && f_fits(f_lb, 65535) && f_fits(f_lc, 65535));
            assert (f_fits(f_pa, F_MOST) && f_fits(f_pb, F_MOST) && f_fits(f_pc, F_MOST));
            assert (f_lb == f_less(f_code_b, f_offset_b) && f_lc == f_less(f_code_c, f_offset_c));
        end
        if (step == 4'd1) assert ({code, offset, gain} == {f_code_a, f_offset_a, f_gain_a});
        if (step == 4'd2) assert ({code, offset, gain} == {f_code_b, f_offset_b, f_gain_b});
        if (step == 4'd3) assert ({code, offset, gain} == {f_code_c, f_offset_c, f_gain_c});
        if (step == 4'd2) assert (less_offset == f_la[16:0] && gain_now == f_gain_a);
        if (step == 4'd3) assert (less_offset == f_lb[16:0] && gain_now == f_gain_b && f_x == f_la[16:0] && f_y == f_gain_a);
        if (step == 4'd4) assert (less_offset == f_lc[16:0] && gain_now == f_gain_c && f_x == f_lb[16:0] && f_y == f_gain_b);
        if (step == 4'd5) assert (f_x == f_lc[16:0] && f_y == f_gain_c);
        if (step == 4'd2) assert (f_wider(value) == f_v && limit == f_v_max);
        if (step == 4'd3) assert (f_wider(value) == -f_v - 1 && limit == f_v_min);
        if (step >= 4'd3) assert (high_off == f_high);
        if (step >= 4'd4) assert (low_off == f_low);
        if (step == 4'd8) assert (f_wider(value) == f_1 && limit == f_i_trip);
        if (step == 4'd9) assert (f_wider(value) == f_2 && limit == f_i_trip);
        if (step == 4'd10) assert (f_wider(value) == f_3 && limit == f_i_trip);
        if (step == 4'd11) assert (f_wider(value) == f_sum && limit == f_sum_trip);
        if (step >= 4'd4) assert (f_wide(a) == f_a && f_fits(f_a, 32767));
        if (step >= 4'd5) assert (f_wide(b) == f_b && f_fits(f_b, 32767));
        if (step >= 4'd6) assert (f_wide(c) == f_c && f_fits(f_c, 32767));
        if (step >= 4'd6) assert (kept == f_kept);
        if (step == 4'd7) assert (f_wider({others[16], others}) == f_1 + f_2);
        if (step >= 4'd9) assert (f_sum == {{14{sum[17]}}, sum} && f_fits(f_sum, 98301));
        if (step == 4'd9) assert (current_off == f_off_1);
        if (step == 4'd10) assert (current_off == (f_off_1 || f_off_2));
        if (step == 4'd11) assert (current_off == (f_off_1 || f_off_2 || f_off_3));
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
            assert (f_wide(ia) == $past(f_a) && f_wide(ib) == $past(f_b) && f_wide(ic) == $past(f_c));
            assert (beyond_current == ($past(f_off_1) || $past(f_off_2) || $past(f_off_3)));
            assert (sum_was_off == $past(f_sum_off));
            assert (beyond_sum == ($past(f_sum_off) && $past(sum_was_off)));
            assert (beyond_v_high == $past(f_high) && beyond_v_low == $past(f_low));
        end
    end
    if ($past(rst_n) && !$past(finish))
        assert (sum_was_off == $past(sum_was_off));
    // eleven clocks from start to finish, and none without a start
    if ($past(rst_n) && $past(enable))
        assert (step == ($past(step) == 4'd11 ? 4'd0 : $past(step) != 4'd0 || $past(start) ? $past(step) + 4'd1 : 4'd0));
    if ($past(rst_n) && !$past(enable))
        assert (step == 4'd0);
    assert (finish == (enable && step == 4'd11));
end
