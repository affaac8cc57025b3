// SPDX-License-Identifier: MIT
// Slot 1 of an axis, ADC: takes a sample at each trigger, from serial converters or from 1-bit modulators, and shows results,
// flags and the end of the conversion at one instant. A trigger during a conversion is ignored.
`include "mssfoc_regs.vh"
module adc (
    input  wire        clk,
    input  wire        rst_n,
    // register port: rdata is 0 unless selected, so that slots can be ORed; `write` is for this slot
    input  wire        sel,
    input  wire        write,
    input  wire [7:2]  addr,
    input  wire [31:0] wdata,
    output wire [31:0] rdata,
    // other blocks
    input  wire        trigger,         // one clock wide, the same as the encoder's
    input  wire [2:0]  low,             // the low sides' gates: C, B, A
    output wire        irq,             // level: EOC and IRQ_ENABLE
    output wire        overrun_event,   // an overrun happens in this clock
    output wire        overrun,         // STATUS.OVERRUN
    output wire        limit,           // STATUS has any of CURRENT, SUM, VBUS_HIGH, VBUS_LOW
    output reg         sample,          // one clock: VBUS is new
    output wire [14:0] vbus,
    output wire        trip,            // a modulator's fast path is beyond its limit: an over-current for GATE
    // pins: two AD7356, one AD7476A for the winding's sensor, three modulators
    output wire        pin_cs_n,
    output wire        pin_sclk,
    input  wire [3:0]  pin_sdata,       // bus voltage, C, B, A
    output wire        pin_temp_cs_n,
    output wire        pin_temp_sclk,
    input  wire        pin_temp_sdata,
    output wire        pin_mod_clock,
    input  wire [2:0]  pin_mod_data     // C, B, A
);
    reg         enable, irq_enable, reconstruct, modulators;
    reg  [15:0] offset_a, offset_b, offset_c;
    reg  [7:0]  gain_a, gain_b, gain_c;
    reg  [16:0] i_trip, sum_trip, v_min, v_max, mod_trip;
    reg  [11:0] settle;
    reg  [1:0]  osr, trip_osr;
    reg  [4:0]  mod_clocks;
    localparam [12:0] MODULATOR_RESET = `ADC_MODULATOR_RESET;

    wire clears = write && addr == `ADC_STATUS;

    always @(posedge clk)
        if (!rst_n) begin
            {modulators, reconstruct, irq_enable, enable} <= `ADC_CONTROL_RESET;
            offset_a   <= `ADC_OFFSET_A_RESET;
            offset_b   <= `ADC_OFFSET_B_RESET;
            offset_c   <= `ADC_OFFSET_C_RESET;
            i_trip     <= `ADC_I_TRIP_RESET;
            sum_trip   <= `ADC_SUM_TRIP_RESET;
            v_min      <= `ADC_V_MIN_RESET;
            v_max      <= `ADC_V_MAX_RESET;
            gain_a     <= `ADC_GAIN_A_RESET;
            gain_b     <= `ADC_GAIN_B_RESET;
            gain_c     <= `ADC_GAIN_C_RESET;
            settle     <= `ADC_SETTLE_RESET;
            osr        <= MODULATOR_RESET[`ADC_MODULATOR_OSR];
            trip_osr   <= MODULATOR_RESET[`ADC_MODULATOR_TRIP_OSR];
            mod_clocks <= MODULATOR_RESET[`ADC_MODULATOR_CLOCKS];
            mod_trip   <= `ADC_MODULATOR_TRIP_RESET;
        end else if (write)
            case (addr)
            `ADC_CONTROL:        {modulators, reconstruct, irq_enable, enable} <= wdata[3:0];
            `ADC_OFFSET_A:       offset_a <= wdata[15:0];
            `ADC_OFFSET_B:       offset_b <= wdata[15:0];
            `ADC_OFFSET_C:       offset_c <= wdata[15:0];
            `ADC_I_TRIP:         i_trip <= wdata[16:0];
            `ADC_SUM_TRIP:       sum_trip <= wdata[16:0];
            `ADC_V_MIN:          v_min <= wdata[16:0];
            `ADC_V_MAX:          v_max <= wdata[16:0];
            `ADC_GAIN_A:         gain_a <= wdata[7:0];
            `ADC_GAIN_B:         gain_b <= wdata[7:0];
            `ADC_GAIN_C:         gain_c <= wdata[7:0];
            `ADC_SETTLE:         settle <= wdata[11:0];
            `ADC_MODULATOR:      {mod_clocks, trip_osr, osr} <= {wdata[12:8], wdata[5:4], wdata[1:0]};
            `ADC_MODULATOR_TRIP: mod_trip <= wdata[16:0];
            default: ;
            endcase

    // one conversion: sample, wait for the codes, then the arithmetic
    reg         busy, spi_held, mod_held;
    reg         of_modulators;      // this conversion's currents, as MODULATORS was when it began and still is
    reg  [2:0]  valid_sampled;
    wire        finish, spi_done, mod_done, trip_event;
    wire [47:0] spi_codes, mod_codes;
    wire [2:0]  valid_now, valid;
    wire        accept = trigger && enable && !busy;
    wire        there  = (spi_done || spi_held) && (mod_done || mod_held || !of_modulators);

    always @(posedge clk)
        if (!rst_n || !enable) begin
            busy          <= 1'b0;
            spi_held      <= 1'b0;
            mod_held      <= 1'b0;
            of_modulators <= 1'b0;
            valid_sampled <= 3'b000;
        end else begin
            busy          <= accept || (busy && !finish);
            spi_held      <= busy && !finish && (spi_held || spi_done);
            mod_held      <= busy && !finish && (mod_held || mod_done);
            of_modulators <= modulators && (accept || of_modulators);
            if (accept)
                valid_sampled <= valid_now;
        end

    adc_spi #(.HALF(1), .FALLS(14), .LINES(4)) converters (
        .clk(clk), .rst_n(rst_n), .enable(enable), .start(accept), .cs_n(pin_cs_n), .sclk(pin_sclk), .sdata(pin_sdata),
        .done(spi_done), .codes(spi_codes));

    adc_modulators isolated (
        .clk(clk), .rst_n(rst_n), .enable(modulators), .osr(osr), .trip_osr(trip_osr), .clocks(mod_clocks), .start(accept),
        .pin_clock(pin_mod_clock), .pin_data(pin_mod_data), .done(mod_done), .codes(mod_codes),
        .offsets({offset_c, offset_b, offset_a}), .limit(mod_trip), .trip(trip), .trip_event(trip_event));

    adc_valid shunts (.clk(clk), .rst_n(rst_n), .settle(settle), .low(low), .valid(valid_now));

    wire [15:0] ia, ib, ic;
    wire [11:0] v;
    wire        beyond_current, beyond_sum, beyond_v_high, beyond_v_low;
    adc_math math (
        .clk(clk), .rst_n(rst_n), .enable(enable), .start(busy && there),
        .code_a(of_modulators ? mod_codes[15:0] : {spi_codes[11:0], 4'd0}),
        .code_b(of_modulators ? mod_codes[31:16] : {spi_codes[23:12], 4'd0}),
        .code_c(of_modulators ? mod_codes[47:32] : {spi_codes[35:24], 4'd0}),
        .code_v(spi_codes[47:36]), .valid_in(valid_sampled), .reconstruct(reconstruct), .offset_a(offset_a),
        .offset_b(offset_b), .offset_c(offset_c), .gain_a(gain_a), .gain_b(gain_b), .gain_c(gain_c), .i_trip(i_trip),
        .sum_trip(sum_trip), .v_min(v_min), .v_max(v_max), .finish(finish), .ia(ia), .ib(ib), .ic(ic), .v(v), .valid(valid),
        .beyond_current(beyond_current), .beyond_sum(beyond_sum), .beyond_v_high(beyond_v_high),
        .beyond_v_low(beyond_v_low));

    // the winding's temperature is read after each conversion, and shows with the next one
    wire [11:0] temp_raw, temp_code;
    reg  [11:0] temp_next, temp;
    wire        temp_done;
    reg  [2:0]  temp_looked_up;         // the curve takes three clocks
    adc_spi #(.HALF(4), .FALLS(16), .LINES(1)) thermometer (
        .clk(clk), .rst_n(rst_n), .enable(1'b1), .start(sample), .cs_n(pin_temp_cs_n), .sclk(pin_temp_sclk),
        .sdata(pin_temp_sdata), .done(temp_done), .codes(temp_raw));
    adc_curve curve (.clk(clk), .rst_n(rst_n), .code(temp_raw), .temp(temp_code));

    // the end of a conversion: an acknowledgement in the same clock belongs to the one before
    reg         eoc, overrun_seen, trip_seen;
    reg  [31:0] sequence_count;
    wire        eoc_kept = eoc && !(clears && wdata[`ADC_STATUS_EOC]);

    assign overrun_event = finish && eoc_kept;

    always @(posedge clk)
        if (!rst_n) begin
            eoc            <= 1'b0;
            overrun_seen   <= 1'b0;
            trip_seen      <= 1'b0;
            sequence_count <= 32'd0;
            sample         <= 1'b0;
            temp_looked_up <= 3'd0;
            temp_next      <= 12'd0;
            temp           <= 12'd0;
        end else begin
            eoc          <= finish || eoc_kept;
            overrun_seen <= overrun_event || (overrun_seen && !(clears && wdata[`ADC_STATUS_OVERRUN]));
            trip_seen    <= trip_event || (trip_seen && !(clears && wdata[`ADC_STATUS_TRIP]));
            sample       <= finish;
            temp_looked_up <= {temp_looked_up[1:0], temp_done};
            if (temp_looked_up[2])
                temp_next <= temp_code;
            if (finish) begin
                sequence_count <= sequence_count + 32'd1;
                temp           <= temp_next;
            end
        end

    assign irq     = eoc && irq_enable;
    assign overrun = overrun_seen;
    assign limit   = beyond_current || beyond_sum || beyond_v_high || beyond_v_low;
    assign vbus    = {v, 3'd0};

    reg [31:0] value;
    always @*
        case (addr)
        `ADC_CONTROL:        value = {28'd0, modulators, reconstruct, irq_enable, enable};
        `ADC_STATUS:         value = {23'd0, trip_seen, beyond_v_low, beyond_v_high, beyond_sum, beyond_current, 2'b00,
                                      overrun_seen, eoc};
        `ADC_IA:             value = {{16{ia[15]}}, ia};
        `ADC_IB:             value = {{16{ib[15]}}, ib};
        `ADC_IC:             value = {{16{ic[15]}}, ic};
        `ADC_VBUS:           value = {17'd0, vbus};
        `ADC_SEQUENCE:       value = sequence_count;
        `ADC_OFFSET_A:       value = {16'd0, offset_a};
        `ADC_OFFSET_B:       value = {16'd0, offset_b};
        `ADC_OFFSET_C:       value = {16'd0, offset_c};
        `ADC_I_TRIP:         value = {15'd0, i_trip};
        `ADC_SUM_TRIP:       value = {15'd0, sum_trip};
        `ADC_V_MIN:          value = {15'd0, v_min};
        `ADC_V_MAX:          value = {15'd0, v_max};
        `ADC_TEMP:           value = {20'd0, temp};
        `ADC_VALID:          value = {29'd0, valid};
        `ADC_GAIN_A:         value = {24'd0, gain_a};
        `ADC_GAIN_B:         value = {24'd0, gain_b};
        `ADC_GAIN_C:         value = {24'd0, gain_c};
        `ADC_SETTLE:         value = {20'd0, settle};
        `ADC_MODULATOR:      value = {19'd0, mod_clocks, 2'b00, trip_osr, 2'b00, osr};
        `ADC_MODULATOR_TRIP: value = {15'd0, mod_trip};
        default:             value = 32'd0;
        endcase
    assign rdata = sel ? value : 32'd0;

    wire unused = &{1'b0, wdata[31:17]};

`ifdef FORMAL
`include "formal/adc.vh"
`endif
endmodule
