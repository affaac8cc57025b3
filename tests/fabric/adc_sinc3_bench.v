// SPDX-License-Identifier: MIT
// Plays bits from a file to the modulators' inputs at the modulators' own clock and prints what comes out; adc_sinc3.py writes
// the bits and judges. B gets the bits of A inverted; C gets zeros up to bit ONES and ones from there on.
`timescale 1ns / 100ps
module bench;
    reg clk = 0, rst_n = 0, enable = 0, start = 0;
    always #5 clk = !clk;
    reg  [1:0] osr, trip_osr;
    reg  [4:0] clocks;
    reg        bits [0:65535];
    integer    at = 0, length, ones, every, last_rise = 0, period = 0;
    reg  [2:0] data = 0;
    wire       mod_clock, done, trip, trip_event;
    wire [47:0] codes;
    reg  [16:0] limit;
    adc_modulators dut (.clk(clk), .rst_n(rst_n), .enable(enable), .osr(osr), .trip_osr(trip_osr), .clocks(clocks),
                        .start(start), .pin_clock(mod_clock), .pin_data(data), .done(done), .codes(codes),
                        .offsets({3{16'd32768}}), .limit(limit), .trip(trip), .trip_event(trip_event));
    // a modulator brings its next bit 12 ns after the rising edge
    always @(posedge mod_clock) begin
        if (last_rise != 0) period = $time - last_rise;
        last_rise = $time;
        #12 data = {at >= ones, !bits[at], bits[at]};
        at = at + 1;
    end
    // `at` counts the bits that the modulators have brought
    reg [15:0] trip_codes [0:2];
    always @(posedge clk) begin
        if (done) $display("code %0d %0d %0d %0d", at, codes[15:0], codes[31:16], codes[47:32]);
        if (dut.step == 3'd1)
            $display("trip %0d %0d %0d %0d", at, dut.trip_codes[15:0], dut.trip_codes[31:16], dut.trip_codes[47:32]);
        if (trip_event) $display("event %0d", at);
    end
    integer n = 0, next;
    reg [8*64:1] name;
    integer ignored;
    initial begin
        ignored = $value$plusargs("osr=%d", osr);
        ignored = $value$plusargs("trip_osr=%d", trip_osr);
        ignored = $value$plusargs("clocks=%d", clocks);
        ignored = $value$plusargs("limit=%d", limit);
        ignored = $value$plusargs("length=%d", length);
        ignored = $value$plusargs("ones=%d", ones);
        ignored = $value$plusargs("every=%d", every);
        ignored = $value$plusargs("bits=%s", name);
        $readmemb(name, bits);
        repeat (4) @(negedge clk); rst_n = 1;
        repeat (4) @(negedge clk); enable = 1;
        next = every;
        while (at < length) begin
            @(negedge clk);
            // starts at each clock of the modulators' period in turn
            n = at >= next ? n + 1 : 0;
            start = n > (next / every * 3) % clocks;
            if (start) begin
                n = 0;
                $display("start %0d", at);
                next = next + every;
            end
        end
        $display("period %0d", period);
        $finish;
    end
endmodule
