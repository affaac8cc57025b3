// SPDX-License-Identifier: MIT
// The whole fabric of two axes over its bus, as firmware would use it. Prints what it measures at the pins, one line each;
// test_rtl.py knows what it must be.
`timescale 1ns / 1ps
module bench;
    reg         clk = 0, rst_n = 0, psel = 0, penable = 0, pwrite = 0;
    reg  [27:0] paddr = 0;
    reg  [31:0] pwdata = 0;
    wire [31:0] prdata;
    wire [5:0]  high, low;
    wire [1:0]  cs_n;
    reg         sto_a_n = 1, overcurrent = 0;

    fabric #(.AXES(2)) dut (
        .clk(clk), .rst_n(rst_n), .psel(psel), .penable(penable), .pwrite(pwrite), .paddr(paddr), .pwdata(pwdata),
        .prdata(prdata), .pready(), .pslverr(), .irq(), .pin_high(high), .pin_low(low), .pin_chopper(),
        .pin_overcurrent({1'b0, overcurrent}), .pin_driver_fault(2'b00), .pin_sto_a_n(sto_a_n), .pin_sto_b_n(1'b1),
        .pin_clock_ok(1'b1), .pin_cs_n(cs_n), .pin_sclk(), .pin_sdata(8'd0), .pin_temp_cs_n(), .pin_temp_sclk(),
        .pin_temp_sdata(2'b00), .pin_mod_clock(), .pin_mod_data(6'd0), .pin_a(2'b00), .pin_b(2'b00), .pin_index(2'b00),
        .pin_lost(2'b00), .pin_hall(6'd0));

    always #5 clk = !clk;

    task put(input [27:0] address, input [31:0] value);
        begin
            @(negedge clk) psel = 1; penable = 0; pwrite = 1; paddr = address; pwdata = value;
            @(negedge clk) penable = 1;
            @(negedge clk) psel = 0; penable = 0;
        end
    endtask
    task get(input [27:0] address, output [31:0] value);
        begin
            @(negedge clk) psel = 1; penable = 0; pwrite = 0; paddr = address;
            @(negedge clk) penable = 1;
            #1 value = prdata;
            @(negedge clk) psel = 0; penable = 0;
        end
    endtask

    // clocks of each gate, and pulses of phase A, since the last clearing
    integer on_high [0:5], on_low [0:5], pulses, triggers, both, k;
    reg     was_high, was_cs;
    always @(negedge clk) begin
        for (k = 0; k < 6; k = k + 1) begin
            on_high[k] = on_high[k] + high[k];
            on_low[k]  = on_low[k] + low[k];
            both       = both + (high[k] & low[k]);
        end
        pulses   = pulses + (high[0] && !was_high);
        triggers = triggers + (!cs_n[0] && was_cs);
        was_high = high[0];
        was_cs   = cs_n[0];
    end
    task periods(input integer count);  // clears what was counted, then counts for so many periods of 2000 clocks
        begin
            for (k = 0; k < 6; k = k + 1) begin on_high[k] = 0; on_low[k] = 0; end
            pulses = 0; triggers = 0;
            repeat (2000 * count) @(negedge clk);
        end
    endtask

    reg [31:0] value;
    integer    axis;
    initial begin
        both = 0; was_high = 0; was_cs = 1;
        repeat (4) @(negedge clk);
        rst_n = 1;
        get(28'h308, value); $display("id0 %0h", value);
        get(28'h708, value); $display("id1 %0h", value);
        get(28'h718, value); $display("axes1 %0h", value);
        get(28'hB08, value); $display("id2 %0h", value);
        for (axis = 1; axis >= 0; axis = axis - 1) begin
            put(axis * 'h400 + 'h08, 1000);             // PERIOD
            put(axis * 'h400 + 'h0C, 50);               // DEAD
            put(axis * 'h400 + 'h10, 20);               // MIN_PULSE
            put(axis * 'h400 + 'h18, axis ? 500 : 1000); // PHASE
            put(axis * 'h400 + 'h1C, 'h103E8);          // TRIGGER_1: valley
            put(axis * 'h400 + 'h28, 300);
            put(axis * 'h400 + 'h2C, 500);
            put(axis * 'h400 + 'h30, 700);
            put(axis * 'h400 + 'h300, 1);               // ENABLE
            put(axis * 'h400 + 'h00, axis ? 5 : 1);     // RUN, the second following the first
        end
        repeat (4000) @(negedge clk);
        periods(2);
        $display("high %0d %0d %0d low %0d %0d %0d pulses %0d", on_high[0], on_high[1], on_high[2], on_low[0],
                 on_low[1], on_low[2], pulses);
        get(28'h024, value); $display("count0 %0d", value);
        get(28'h424, value); $display("count1 %0d", value);
        get(28'h404, value); $display("status1 %0h", value);
        put('h28, 2); put('h30, 700);                   // on-time far below the dead time: stretched to MIN_PULSE
        repeat (2500) @(negedge clk);
        periods(2);
        $display("short high %0d pulses %0d", on_high[0], pulses);
        put('h28, 0); put('h2C, 1000); put('h30, 700);  // never, always
        repeat (2500) @(negedge clk);
        periods(2);
        $display("ends high %0d %0d low %0d %0d", on_high[0], on_high[1], on_low[0], on_low[1]);
        put('h00, 3);                                   // brake
        repeat (2500) @(negedge clk);
        periods(1);
        $display("brake high %0d low %0d", on_high[1], on_low[1]);
        put('h00, 1);
        @(negedge clk) sto_a_n = 0;
        #1 $display("sto high %0d low %0d", high, low);
        @(negedge clk) sto_a_n = 1;
        repeat (8) @(negedge clk);
        get(28'h304, value); $display("latched %0h", value);
        put('h300, 1);
        get(28'h300, value); $display("refused %0h", value);
        put('h304, 'h400);
        put('h300, 1);
        get(28'h304, value); $display("cleared %0h", value);
        put('h100, 1);                                  // nobody acknowledges the samples: the second is an overrun
        periods(3);
        get(28'h304, value); $display("lost %0h triggers %0d", value, triggers);
        $display("both %0d", both);
        $finish;
    end
endmodule
