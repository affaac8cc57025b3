// SPDX-License-Identifier: MIT
// The ADC block against models of its converters at their pins: serial timing to the nanosecond, results against the
// contract's formulas in integers, real multiplier and curve included. Prints a line a fault; the last line is the verdict.
`timescale 1ns / 100ps

// AD7356: the frame as the data sheet has it (Rev. A, page 18); its times in nanoseconds are unconfirmed (docs/fabric.md).
// Data is unknown from HOLD to ACCESS after each falling edge; both include the way through the FPGA's pins. Times of CS and
// SCLK are the limits that the RTL must keep.
module ad7356 #(parameter real HOLD = 3.5, parameter real ACCESS = 18.0, parameter FALLS = 14, parameter ZEROS = 2,
                parameter real LOW_HIGH = 5.0, parameter real PERIOD = 12.5, parameter real SETUP = 5.0) (
    input wire cs_n, input wire sclk, input wire [11:0] analogue, output reg sdata
);
    reg [15:0] held;
    integer falls, frames, faults;
    reg open;
    real cs_at, fall_at, rise_at;
    initial begin
        open = 0; falls = 0; frames = 0; faults = 0; sdata = 1'bz; cs_at = -1000; fall_at = -1000; rise_at = -1000;
    end
    always @(negedge cs_n) begin
        held = {4'd0, analogue};
        open = 1;
        if ($realtime - cs_at < 50.0) fault("CS was high for less than 50 ns");
        cs_at = $realtime;
        falls = 0;
        if (sclk !== 1'b1) fault("SCLK is not high as CS falls");
        sdata <= #(ACCESS) 1'b0;
    end
    always @(posedge cs_n) begin
        if (open && falls != FALLS) fault("wrong number of clocks in a frame");
        frames = frames + open;
        open = 0;
        cs_at = $realtime;
        sdata <= #(HOLD) 1'bz;
    end
    always @(negedge sclk) if (!cs_n) begin
        if ($realtime - cs_at < SETUP) fault("SCLK too early after CS");
        if (falls > 0 && $realtime - fall_at < PERIOD) fault("SCLK too fast");
        if (falls > 0 && $realtime - rise_at < LOW_HIGH) fault("SCLK high too short");
        fall_at = $realtime;
        falls = falls + 1;
        sdata <= #(HOLD) 1'bx;
        // falling edge n brings bit n + 1 of the frame
        sdata <= #(ACCESS) falls < ZEROS ? 1'b0 : falls < ZEROS + 12 ? held[11 - (falls - ZEROS)] : 1'b0;
    end else fault("SCLK moves while CS is high");
    always @(posedge sclk) if ($realtime > 0) begin
        if (!cs_n && $realtime - fall_at < LOW_HIGH) fault("SCLK low too short");
        rise_at = $realtime;
    end
    task fault(input [8*48-1:0] text); begin
        faults = faults + 1;
        if (faults < 5) $display("%m at %0t: %0s", $time, text);
    end endtask
endmodule

module bench;
    parameter CONVERSIONS = 2000;
    reg clk = 0, rst_n = 0;
    always #5 clk = !clk;

    reg sel = 0, write = 0, trigger = 0;
    reg [7:2] addr = 0;
    reg [31:0] wdata = 0;
    wire [31:0] rdata;
    reg [2:0] low = 0;
    reg [11:0] a_a, a_b, a_c, a_v, a_t;
    wire cs_n, sclk, t_cs_n, t_sclk, irq, overrun_event, overrun, limit, sample, trip, mod_clock, t_data;
    wire [14:0] vbus;
    wire [3:0] sdata;
    adc dut (.clk(clk), .rst_n(rst_n), .sel(sel), .write(write), .addr(addr), .wdata(wdata), .rdata(rdata), .trigger(trigger),
             .low(low), .irq(irq), .overrun_event(overrun_event), .overrun(overrun), .limit(limit), .sample(sample),
             .vbus(vbus), .trip(trip), .pin_cs_n(cs_n), .pin_sclk(sclk), .pin_sdata(sdata), .pin_temp_cs_n(t_cs_n),
             .pin_temp_sclk(t_sclk), .pin_temp_sdata(t_data), .pin_mod_clock(mod_clock), .pin_mod_data(3'b000));
    // the pins' way out: 3 ns of the 20; the way back is in ACCESS
    wire #3 cs_pin = cs_n;
    wire #3 sclk_pin = sclk;
    ad7356 #(.ACCESS(14.0)) first_a (cs_pin, sclk_pin, a_a, sdata[0]), first_b (cs_pin, sclk_pin, a_b, sdata[1]),
                            second_a (cs_pin, sclk_pin, a_c, sdata[2]), second_b (cs_pin, sclk_pin, a_v, sdata[3]);
    // AD7476A (Rev. F, page 7): four zeros, at most 20 MHz, data 40 ns after the edge, 10 ns CS to SCLK
    ad7356 #(.ACCESS(50.0), .HOLD(7.0), .FALLS(16), .ZEROS(4), .PERIOD(50.0), .LOW_HIGH(20.0), .SETUP(10.0)) sensor (
        t_cs_n, t_sclk, a_t, t_data);

    integer faults = 0, n, k, steps, longest = 0;
    task fail(input [8*40-1:0] text, input integer got, input integer wanted); begin
        faults = faults + 1;
        if (faults < 10) $display("conversion %0d: %0s is %0d, not %0d", n, text, got, wanted);
    end endtask
    task put(input [7:0] at, input [31:0] value); begin
        @(negedge clk); sel = 1; write = 1; addr = at[7:2]; wdata = value;
        @(negedge clk); sel = 0; write = 0;
    end endtask
    integer got;
    task get(input [7:0] at); begin
        @(negedge clk); sel = 1; write = 0; addr = at[7:2];
        #1 got = rdata;
        @(negedge clk); sel = 0;
    end endtask
    task same(input [8*40-1:0] text, input [7:0] at, input integer wanted); begin
        get(at);
        if (got !== wanted) fail(text, got, wanted);
    end endtask
    function integer held(input integer x); held = x > 32767 ? 32767 : x < -32767 ? -32767 : x; endfunction
    function integer size(input integer x); size = x < 0 ? -x : x; endfunction
    function integer result(input integer code, input integer offset, input integer gain);
        // rounded to nearest, halves up: floor((d (2048 + g) + 1024) / 2048)
        result = held(((16 * code - offset) * (2048 + gain) + 1024) >>> 11);
    endfunction
    function integer some(input integer most); some = $unsigned($random) % (most + 1); endfunction
    function [11:0] code(input integer kind); code = kind == 0 ? 12'd0 : kind == 1 ? 12'd4095 : some(4095); endfunction

    integer o_a, o_b, o_c, g_a, g_b, g_c, i_trip, s_trip, v_min, v_max, rebuild, settle, valid;
    integer e_a, e_b, e_c, e_s, flags, was_off;
    integer temp, temp_next;
    reg [11:0] curve_in; wire [11:0] curve_out;
    adc_curve curve (.clk(clk), .rst_n(rst_n), .code(curve_in), .temp(curve_out));
    initial begin
        {a_a, a_b, a_c, a_v, a_t} = 0; was_off = 0; temp_next = 0;
        repeat (4) @(negedge clk);
        rst_n = 1;
        for (n = 0; n < CONVERSIONS; n = n + 1) begin
            o_a = some(3) ? 32768 + some(400) - 200 : some(65535); o_b = 32768 + some(400) - 200; o_c = some(65535);
            g_a = some(255) - 128; g_b = some(1) ? 0 : some(255) - 128; g_c = some(255) - 128;
            i_trip = some(40000); s_trip = some(100000); v_min = some(40000); v_max = some(40000);
            rebuild = some(1); settle = some(1) ? 0 : 40;
            put(8'h1C, o_a); put(8'h20, o_b); put(8'h24, o_c); put(8'h40, g_a); put(8'h44, g_b); put(8'h48, g_c);
            put(8'h28, i_trip); put(8'h2C, s_trip); put(8'h30, v_min); put(8'h34, v_max); put(8'h4C, settle);
            put(8'h00, 3 | rebuild << 2);
            a_a = code(some(9)); a_b = code(some(9)); a_c = code(some(9)); a_v = code(some(9)); a_t = some(4095);
            if (some(3) == 0) begin o_a = 16 * a_a; put(8'h1C, o_a); end
            // low sides: on for long enough, or one clock less
            low = 0; valid = 0;
            repeat (2) @(negedge clk);
            k = some(7); low = k; repeat (1) @(negedge clk);
            low = 7; repeat (39) @(negedge clk);
            valid = settle == 0 ? 7 : k;    // 40 clocks for those that came on first
            trigger = 1; @(negedge clk); trigger = 0; low = some(7);
            if (cs_n) fail("CS", cs_n, 0);
            steps = 0;
            while (!irq && steps < 1000) begin
                // the inputs may move once they are held, and a trigger during a conversion is ignored
                if (steps == 3) {a_a, a_b, a_c, a_v} = {$random, $random};
                trigger = steps == 20;
                @(negedge clk); steps = steps + 1;
            end
            if (steps > longest) longest = steps;
            // the models keep what was sampled
            e_a = result(first_a.held, o_a, g_a); e_b = result(first_b.held, o_b, g_b); e_c = result(second_a.held, o_c, g_c);
            if (rebuild && valid == 6) e_a = held(-e_b - e_c);
            if (rebuild && valid == 5) e_b = held(-e_a - e_c);
            if (rebuild && valid == 3) e_c = held(-e_a - e_b);
            e_s = size(e_a + e_b + e_c) > s_trip;
            flags = (size(e_a) > i_trip || size(e_b) > i_trip || size(e_c) > i_trip) << 4 | (e_s && was_off) << 5 |
                    (8 * second_b.held > v_max) << 6 | (8 * second_b.held < v_min) << 7;
            was_off = e_s;
            temp = temp_next;
            same("STATUS", 8'h04, flags | 1); same("IA", 8'h08, e_a); same("IB", 8'h0C, e_b); same("IC", 8'h10, e_c);
            same("VBUS", 8'h14, 8 * second_b.held); same("SEQUENCE", 8'h18, n + 1); same("VALID", 8'h3C, valid);
            same("TEMP", 8'h38, temp);
            if (n % 7 == 3) begin   // without an acknowledgement the next conversion is an overrun
                trigger = 1; @(negedge clk); trigger = 0; repeat (60) @(negedge clk);
                if (!overrun) fail("overrun", overrun, 1);
                same("TEMP while the sensor is read", 8'h38, temp);
                n = n + 1;
                was_off = 0;        // by a sample with the sum within its limit
                put(8'h2C, 131071); put(8'h04, 3);
                trigger = 1; @(negedge clk); trigger = 0;
                repeat (60) @(negedge clk);
                n = n + 1;
                // a conversion of the serial converters under way ends, whatever MODULATORS becomes
                put(8'h04, 3);
                trigger = 1; @(negedge clk); trigger = 0; put(8'h00, 11); repeat (60) @(negedge clk);
                n = n + 1;
                get(8'h04);
                if (got[0] != 1) fail("EOC with MODULATORS set under way", got & 1, 1);
                put(8'h00, 3);
            end
            put(8'h04, 3);
            get(8'h04);
            if ((got & 3) != 0) fail("STATUS acknowledged", got & 3, 0);
            repeat (140) @(negedge clk);
            curve_in = a_t; repeat (3) @(negedge clk); temp_next = curve_out;
        end
        faults = faults + first_a.faults + first_b.faults + second_a.faults + second_b.faults + sensor.faults;
        if (first_a.frames < CONVERSIONS || sensor.frames < CONVERSIONS / 2) fail("frames", first_a.frames, CONVERSIONS);
        $display("%0s: %0d conversions, %0d faults, trigger to interrupt %0d clocks", faults == 0 ? "PASS" : "FAIL",
                 CONVERSIONS, faults, longest);
        $finish;
    end
endmodule
