// SPDX-License-Identifier: MIT
// The netlist of netlist_top.v beside its RTL, under the same bus and pins: counts what a power stage would see of its
// delays. Stops come in the middle of a clock and last two, so that no pulse is rightly shorter than half a clock.
`timescale 1ps / 1ps
module bench;
    localparam  CLOCK = 10000, PERIOD = 60;
    integer     seed, draw, state, random, leg, k;
    reg         clk = 0, rst_n = 0, sel_pwm = 0, sel_gate = 0, write = 0, overrun = 0;
    reg  [4:0]  stops = 0;
    reg  [7:0]  offset = 0;
    reg  [31:0] wdata = 0;
    wire [5:0]  gates, gates_rtl;

`define PINS .clk(clk), .rst_n(rst_n), .sel_pwm(sel_pwm), .sel_gate(sel_gate), .write(write), .addr(offset[7:2]), \
    .wdata(wdata), .overrun_event(overrun), .pin_overcurrent(stops[0]), .pin_driver_fault(stops[1]), \
    .sto({1'b0, stops[3:2]}), .pin_clock_ok(!stops[4])
    netlist cells (`PINS, .pin_low(gates[5:3]), .pin_high(gates[2:0]));
    bridge  rtl   (`PINS, .pin_low(gates_rtl[5:3]), .pin_high(gates_rtl[2:0]));

    initial forever #(CLOCK / 2) clk = !clk;

    integer turn_offs = 0, short_on = 0, short_off = 0, both = 0, differences = 0;
    time    changed [0:5];
    reg     begun = 0;
    genvar  g;
    generate for (g = 0; g < 6; g = g + 1) begin : gate
        always @(gates[g]) if (begun) begin
            if ($time - changed[g] < CLOCK * 2 / 5) begin
                if (gates[g]) short_off = short_off + 1;
                else short_on = short_on + 1;
            end else if (!gates[g])
                turn_offs = turn_offs + 1;
            changed[g] = $time;
        end
    end endgenerate
    always @(gates) if (begun && |(gates[5:3] & gates[2:0])) both = both + 1;
    always @(posedge clk) if (begun && gates !== gates_rtl) differences = differences + 1;

    task put(input of_gate, input [7:0] to, input [31:0] value);    // the bus needs two clocks for each
        begin
            @(posedge clk) #1 {sel_gate, sel_pwm, write, offset, wdata} = {of_gate, !of_gate, 1'b1, to, value};
            @(posedge clk) #1 {sel_gate, sel_pwm, write} = 3'b000;
        end
    endtask
    task pwm_put(input [7:0] to, input [31:0] value); put(0, to, value); endtask
    task control(input [31:0] value);
        begin
            pwm_put('h00, value);
            repeat (20) @(negedge clk);
        end
    endtask
    task run_on;    // acknowledge, and on again
        begin
            repeat (6) @(negedge clk);
            put(1, 'h04, 'hFFFF);
            put(1, 'h00, 1);
        end
    endtask
    task periods(input integer count);  // with compares anywhere, never and always among them, and pulses too short
        repeat (count) begin
            for (leg = 0; leg < 3; leg = leg + 1) begin
                random = {$random(state)} / 8;
                pwm_put('h28 + 4 * leg, random % 8 == 0 ? 0 : random % 8 == 1 ? PERIOD : random / 8 % (PERIOD + 1));
            end
            repeat (2 * PERIOD - 7) @(negedge clk);
        end
    endtask
    task report(input [8*12-1:0] what);
        begin
            $display("%0s: %0d turn-offs, %0d short on, %0d short off, %0d both, %0d differences", what, turn_offs, short_on,
                     short_off, both, differences);
            {turn_offs, short_on, short_off, both, differences} = 0;
        end
    endtask

    // anything on its way through the ADC's logic, behind each edge
    always @(posedge clk) begin #600 overrun = begun && !overrun; #300 overrun = !overrun && begun; #700 overrun = lost; end
    reg lost = 0;

    initial begin
        if (!$value$plusargs("seed=%d", seed)) seed = 0;
        draw  = seed;
        state = 1;
        for (k = 0; k < 6; k = k + 1) changed[k] = 0;
        repeat (4) @(negedge clk);
        rst_n = 1;
        repeat (4) @(negedge clk);
        begun = 1;
        pwm_put('h08, PERIOD);
        pwm_put('h0C, 4);                               // DEAD
        pwm_put('h10, 3);                               // MIN_PULSE
        pwm_put('h18, PERIOD);                          // PHASE
        pwm_put('h1C, 'h10000 + PERIOD);                // TRIGGER_1
        for (k = 0; k < 3; k = k + 1) begin             // each mode of updates
            pwm_put('h14, k);
            put(1, 'h00, 1);
            control(1);
            periods(8);
            control(0);
        end
        report("commutations");
        repeat (5) begin                                // brake from rest and from running, and back
            control(2);
            control(1); periods(1);
            control(3);
            control(2);
            control(0);
            control(1); periods(1);
            control(0);
        end
        report("brake");
        control(1);
        repeat (8) begin
            for (k = 0; k < 5; k = k + 1) begin
                periods(1);
                if (k == 2 || k == 3) @(gates_rtl) @(negedge clk);  // a latch of its own: not where a gate turns on
                stops[k] = 1; repeat (2) @(negedge clk); stops[k] = 0;
                run_on;
            end
            periods(1);
            put(1, 'h00, 0);
            run_on;
            periods(1);
            @(negedge clk) lost = 1; @(negedge clk) lost = 0;
            run_on;
        end
        report("stops");
        $finish;
    end
endmodule
