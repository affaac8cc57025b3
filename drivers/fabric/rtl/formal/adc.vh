// SPDX-License-Identifier: MIT
// What slot 1 promises, from the first reset on; arithmetic, serial frames and valid phases are proved beside their modules.
reg f_ran = 1'b0;
always @(posedge clk) f_ran <= f_ran || !rst_n;

// registers as the contract has them, from the bus alone
reg [3:0]  f_control;
reg [15:0] f_offset_a, f_offset_b, f_offset_c;
reg [16:0] f_i_trip, f_sum_trip, f_v_min, f_v_max, f_mod_trip;
reg [7:0]  f_gain_a, f_gain_b, f_gain_c;
reg [11:0] f_settle;
reg [12:0] f_modulator;
always @(posedge clk)
    if (!rst_n) begin
        f_control  <= 4'd0;
        f_offset_a <= 16'd32768;
        f_offset_b <= 16'd32768;
        f_offset_c <= 16'd32768;
        f_i_trip   <= 17'h1FFFF;
        f_sum_trip <= 17'h1FFFF;
        f_v_min    <= 17'd0;
        f_v_max    <= 17'h1FFFF;
        f_gain_a   <= 8'd0;
        f_gain_b   <= 8'd0;
        f_gain_c   <= 8'd0;
        f_settle   <= 12'd0;
        f_modulator <= 13'h0511;
        f_mod_trip <= 17'h1FFFF;
    end else if (write)
        case ({addr, 2'b00})
        8'h00: f_control  <= wdata[3:0];
        8'h1C: f_offset_a <= wdata[15:0];
        8'h20: f_offset_b <= wdata[15:0];
        8'h24: f_offset_c <= wdata[15:0];
        8'h28: f_i_trip   <= wdata[16:0];
        8'h2C: f_sum_trip <= wdata[16:0];
        8'h30: f_v_min    <= wdata[16:0];
        8'h34: f_v_max    <= wdata[16:0];
        8'h40: f_gain_a   <= wdata[7:0];
        8'h44: f_gain_b   <= wdata[7:0];
        8'h48: f_gain_c   <= wdata[7:0];
        8'h4C: f_settle   <= wdata[11:0];
        8'h50: f_modulator <= wdata[12:0] & 13'h1F33;
        8'h54: f_mod_trip <= wdata[16:0];
        default: ;
        endcase

always @(posedge clk) if (f_ran) begin
    assert (f_control == {modulators, reconstruct, irq_enable, enable});
    assert ({f_offset_a, f_offset_b, f_offset_c} == {offset_a, offset_b, offset_c});
    assert ({f_i_trip, f_sum_trip, f_v_min, f_v_max, f_mod_trip} == {i_trip, sum_trip, v_min, v_max, mod_trip});
    assert ({f_gain_a, f_gain_b, f_gain_c, f_settle} == {gain_a, gain_b, gain_c, settle});
    assert (f_modulator == {mod_clocks, 2'b00, trip_osr, 2'b00, osr});
    if (sel)
        case ({addr, 2'b00})
        8'h00: assert (rdata == {28'd0, f_control});
        8'h04: assert (rdata == {23'd0, trip_seen, beyond_v_low, beyond_v_high, beyond_sum, beyond_current, 2'd0, overrun,
                                 eoc});
        8'h08: assert (rdata == {{16{ia[15]}}, ia});
        8'h0C: assert (rdata == {{16{ib[15]}}, ib});
        8'h10: assert (rdata == {{16{ic[15]}}, ic});
        8'h14: assert (rdata == {17'd0, v, 3'd0});
        8'h18: assert (rdata == sequence_count);
        8'h1C: assert (rdata == {16'd0, f_offset_a});
        8'h20: assert (rdata == {16'd0, f_offset_b});
        8'h24: assert (rdata == {16'd0, f_offset_c});
        8'h28: assert (rdata == {15'd0, f_i_trip});
        8'h2C: assert (rdata == {15'd0, f_sum_trip});
        8'h30: assert (rdata == {15'd0, f_v_min});
        8'h34: assert (rdata == {15'd0, f_v_max});
        8'h38: assert (rdata == {20'd0, temp});
        8'h3C: assert (rdata == {29'd0, valid});
        8'h40: assert (rdata == {24'd0, f_gain_a});
        8'h44: assert (rdata == {24'd0, f_gain_b});
        8'h48: assert (rdata == {24'd0, f_gain_c});
        8'h4C: assert (rdata == {20'd0, f_settle});
        8'h50: assert (rdata == {19'd0, f_modulator});
        8'h54: assert (rdata == {15'd0, f_mod_trip});
        default: assert (rdata == 32'd0);
        endcase
    else
        assert (rdata == 32'd0);
    assert (irq == (eoc && f_control[1]));
    assert (limit == (beyond_current || beyond_sum || beyond_v_high || beyond_v_low));
    assert (vbus == {v, 3'd0});
end

// the arithmetic ends eleven clocks after its start: adc_math.vh proves it
reg [3:0] f_step;
always @(posedge clk)
    if (!rst_n || !enable || finish)
        f_step <= 4'd0;
    else if (f_step != 4'd0 || (busy && there))
        f_step <= f_step + 4'd1;
always @* assume (finish == (enable && f_step == 4'd11));

wire [98:0] f_shown = {ia, ib, ic, v, valid, beyond_current, beyond_sum, beyond_v_high, beyond_v_low, sequence_count};
wire        f_clear = write && {addr, 2'b00} == 8'h04;
wire        f_acknowledged = f_clear && wdata[0];
reg  [2:0]  f_valid;       // at the sample
always @(posedge clk)
    if (trigger && enable && !busy)
        f_valid <= valid_now;

always @(posedge clk) if (f_ran) begin
    if (!$past(rst_n))
        assert ({f_shown, temp, eoc, overrun, trip_seen} == 114'd0 && !busy && !irq);
    else begin
        // everything new comes at one instant, with EOC and the next SEQUENCE
        if (f_shown != $past(f_shown) || temp != $past(temp))
            assert ($past(finish));
        assert (sequence_count == $past(sequence_count) + ($past(finish) ? 32'd1 : 32'd0));
        assert (eoc == ($past(finish) || ($past(eoc) && !$past(f_acknowledged))));
        assert (sample == $past(finish));
        // an overrun: the conversion before was not acknowledged, up to the very clock
        assert (overrun == (($past(finish) && $past(eoc) && !$past(f_acknowledged)) ||
                            ($past(overrun) && !($past(f_clear) && $past(wdata[1])))));
        assert ($past(overrun_event) == ($past(finish) && $past(eoc) && !$past(f_acknowledged)));
        assert (trip_seen == ($past(trip_event) || ($past(trip_seen) && !($past(f_clear) && $past(wdata[8])))));
        // a conversion begins with a trigger, lasts until its end, and is dropped without ENABLE
        assert (busy == ($past(enable) && (($past(trigger) && !$past(busy)) || ($past(busy) && !$past(finish)))));
        if (busy && enable)
            assert (valid_sampled == f_valid);
        if ($past(finish))
            assert (valid == $past(f_valid));
    end
    assert (f_step <= 4'd11);
    if (finish)
        assert (busy);
    if (f_step != 4'd0 && enable)
        assert (busy);
    // the codes are those of this sample: the frame is over when the arithmetic runs
    if (f_step != 4'd0 && busy && enable)
        assert (spi_held || f_step == 4'd1);
    if (spi_held)
        assert (busy);
end

// every setting, line and code goes to its own place: the stand-ins say what reached them
function [15:0] f_mixed(input [15:0] code, input [15:0] offset, input [7:0] gain);
    f_mixed = code ^ {offset[0], offset[15:1]} ^ {8'd0, gain};
endfunction
wire [47:0] f_codes = of_modulators ? mod_codes
    : {spi_codes[35:24], 4'd0, spi_codes[23:12], 4'd0, spi_codes[11:0], 4'd0};
always @(posedge clk) if (f_ran && !pin_mod_clock)
    assert (mod_codes == ({f_offset_c, f_offset_b, f_offset_a} ^ {17'd0, f_mod_trip, f_modulator[1:0], f_modulator[5:4],
                          f_modulator[12:8], f_control[3], trigger && f_control[0] && !busy, pin_mod_data}));
wire [47:0] f_made = {f_mixed(f_codes[47:32], f_offset_c, f_gain_c), f_mixed(f_codes[31:16], f_offset_b, f_gain_b),
                      f_mixed(f_codes[15:0], f_offset_a, f_gain_a)};
wire [3:0]  f_flags = {^f_i_trip ^ f_control[2], ^f_sum_trip, ^f_v_max, ^f_v_min};
always @(posedge clk) if (f_ran && $past(rst_n && finish)) begin
    assert ({ic, ib, ia} == $past(f_made) && v == $past(spi_codes[47:36]));
    assert ({beyond_current, beyond_sum, beyond_v_high, beyond_v_low} == $past(f_flags));
end
