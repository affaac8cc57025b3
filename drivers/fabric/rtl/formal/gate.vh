// SPDX-License-Identifier: MIT
// What the bridge's switch promises, for any pins, any bus traffic, any wishes of the PWM.
reg f_ran = 1'b0;
always @(posedge clk) f_ran <= 1'b1;
always @* if (!f_ran) assume (!rst_n);

wire f_any  = |pin_high || |pin_low || |pin_enable;
wire f_stop = pin_overcurrent || pin_driver_fault || |sto_now || !pin_clock_ok;

always @* if (f_ran) begin
    // in the same clock: reset, each pin, each latch, both sides of a leg, no ENABLE
    if (!rst_n) assert (!f_any);
    if (pin_overcurrent) assert (!f_any);
    if (pin_driver_fault) assert (!f_any);
    if (|sto_now || |sto_latches) assert (!f_any);
    if (!pin_clock_ok) assert (!f_any);
    if (|(high & low)) assert (!f_any);
    if (|pin_latches || loop_lost || interlock || |program_latches) assert (!f_any);
    if (!enable) assert (!f_any && !live);
    // never both sides of a leg, and nothing that the PWM does not wish
    assert ((pin_high & pin_low) == 3'd0);
    assert ((pin_high & ~high) == 3'd0 && (pin_low & ~low) == 3'd0 && (pin_enable & ~active) == 3'd0);
    // while all is quiet and on, exactly what it wishes
    if (rst_n && enable && !f_stop && !settled && pins_1 == 3'd0)
        assert (pin_high == high && pin_low == low && pin_enable == active);
    // what the processor reads: nothing is on while LIVE is 0, or while a latch shows
    if (sel && addr == `GATE_STATUS) begin
        if (!rdata[`GATE_STATUS_LIVE]) assert (!f_any);
        else assert (enable && !latched);
        if (rdata[`GATE_STATUS_OVERCURRENT] || rdata[`GATE_STATUS_DRIVER_FAULT] || rdata[`GATE_STATUS_LOOP_LOST]
            || rdata[`GATE_STATUS_INTERLOCK] || rdata[`GATE_STATUS_STO_A] || rdata[`GATE_STATUS_STO_B]
            || rdata[`GATE_STATUS_STO_APART] || rdata[`GATE_STATUS_CLOCK_LOST] || rdata[`GATE_STATUS_SLOW_LOST]
            || rdata[`GATE_STATUS_THREAD_LOST])
            assert (!f_any);
        assert (rdata[`GATE_STATUS_ENCODER] == encoder_faulty && rdata[`GATE_STATUS_OVERRUN] == overrun);
        assert (rdata[`GATE_STATUS_LIMIT] == limit);
        // on and well is 1, whatever else is built in
        if (f_any && !encoder_faulty && !overrun && !limit) assert (rdata == 32'd1);
    end
    // the chopper needs its bit, the clock and no reset
    if (!rst_n || !pin_clock_ok || !chopper_enable) assert (!pin_chopper);
end

// A stop that one clock edge has seen leaves nothing on until ENABLE is written after it and all is quiet again.
wire [7:0] f_noisy = {pins, sto | sto_now, |(high & low), (overrun_event && enable) || loop_late};
reg  [7:0] f_noisy_1, f_noisy_2;
reg        f_stopped;
wire       f_calm = !latched && f_noisy == 8'd0 && missed == 2'd0 && f_noisy_1[7:5] == 3'd0 && f_noisy_2[7:5] == 3'd0;
always @(posedge clk)
    if (!rst_n) begin
        f_stopped <= 1'b1;
        f_noisy_1 <= 8'd0;
        f_noisy_2 <= 8'd0;
    end else begin
        f_noisy_1 <= f_noisy;
        f_noisy_2 <= f_noisy_1;
        if (|f_noisy || |missed)
            f_stopped <= 1'b1;
        else if (write && addr == `GATE_CONTROL && wdata[0] && f_calm)
            f_stopped <= 1'b0;
    end
always @* if (f_ran) begin
    if (f_stopped) assert (!f_any);
    if (f_stopped && enable) assert (|pins_1 || |pins_2);
    assert (pins_1 == f_noisy_1[7:5] && pins_2 == f_noisy_2[7:5]);
    assert (pins == {!pin_clock_ok, pin_driver_fault, pin_overcurrent});
    assert ((sto_now & ~sto_latches) == 3'd0);
end

// latches: set by their inputs, cleared by a 1 written while the input is quiet, and by nothing else
wire [7:0] f_latches = {pin_latches, sto_latches, interlock, loop_lost};
wire [7:0] f_ones    = {wdata[`GATE_STATUS_CLOCK_LOST], wdata[`GATE_STATUS_DRIVER_FAULT], wdata[`GATE_STATUS_OVERCURRENT],
                        wdata[`GATE_STATUS_STO_APART], wdata[`GATE_STATUS_STO_B], wdata[`GATE_STATUS_STO_A],
                        wdata[`GATE_STATUS_INTERLOCK], wdata[`GATE_STATUS_LOOP_LOST]};
wire [7:0] f_shown   = {rdata[`GATE_STATUS_CLOCK_LOST], rdata[`GATE_STATUS_DRIVER_FAULT], rdata[`GATE_STATUS_OVERCURRENT],
                        rdata[`GATE_STATUS_STO_APART], rdata[`GATE_STATUS_STO_B], rdata[`GATE_STATUS_STO_A],
                        rdata[`GATE_STATUS_INTERLOCK], rdata[`GATE_STATUS_LOOP_LOST]};
always @* if (f_ran && sel && addr == `GATE_STATUS) begin
    assert (f_shown == f_latches);
    assert ({rdata[`GATE_STATUS_STO_B_NOW], rdata[`GATE_STATUS_STO_A_NOW]} == sto_now[1:0]);
end
genvar f_k;
generate for (f_k = 0; f_k < 8; f_k = f_k + 1) begin : f_latch
    always @(posedge clk) if (f_ran && $past(rst_n)) begin
        if ($past(f_latches[f_k]) && !f_latches[f_k])
            assert ($past(write && addr == `GATE_STATUS && f_ones[f_k] && !f_noisy[f_k]));
        if ($past(f_latches[f_k] && write && addr == `GATE_STATUS && f_ones[f_k] && !f_noisy[f_k])
            && (f_k < 5 || $past(!pins_1[(f_k + 1) % 3] && !pins_2[(f_k + 1) % 3])))
            assert (!f_latches[f_k]);
        if (!$past(f_latches[f_k]) && f_latches[f_k])
            assert (f_k < 5 ? $past(f_noisy[f_k]) : $past(f_noisy_2[f_k]));
    end
    // a fault sets its latch: one clock later from inside, three clocks later from a pin
    always @(posedge clk) if (f_ran && $past(rst_n) && (f_k < 5 ? $past(f_noisy[f_k]) : $past(f_noisy_2[f_k])))
        assert (f_latches[f_k]);
end endgenerate
// ENABLE is set by a write only, cleared by every latch, and otherwise obeys writes
always @(posedge clk) if (f_ran && $past(rst_n)) begin
    if (enable && !$past(enable)) assert ($past(write && addr == `GATE_CONTROL && wdata[0]) && !$past(latched));
    if ($past(write && addr == `GATE_CONTROL && !wdata[0])) assert (!enable);
    if ($past(write && addr == `GATE_CONTROL && wdata[0] && f_calm)) assert (enable);
    if (f_latches != 8'd0 || |program_latches) assert (!enable);
    if ($past(enable && !settled && !stops_now && !write)) assert (enable);
end else if (f_ran)
    assert (!enable && !armed && f_latches == 8'd0 && program_latches == 2'd0 && pin_watch_reset_n && !chopper_enable);

// the watch over the program: armed by what a write to ENABLE came to, whatever has stopped the bridge since; until a write of
// 0, or until one that clears a latch of the watch
always @* if (f_ran && enable) assert (armed);
always @(posedge clk) if (f_ran && $past(rst_n)) begin
    if ($past(write && addr == `GATE_CONTROL)) assert (armed == enable);
    else assert (armed == ($past(armed) && !$past(write && addr == `GATE_STATUS
                           && ((program_latches[1] && wdata[16]) || (program_latches[0] && wdata[15])))));
    if ($past(write && addr == `GATE_WATCH_TIME && !armed)) assert (started && !armed);
    // a latch is set by what is missed, cleared by a 1 written while nothing is, and by nothing else
    assert (program_latches == ($past(missed) | ($past(program_latches) & ~($past(write && addr == `GATE_STATUS)
            ? {$past(wdata[16]), $past(wdata[15])} : 2'd0))));
    // the reset lasts until the program switches off, the latch is cleared, or the fabric is reset
    assert (pin_watch_reset_n == $past(!armed || program_latches == 2'd0));
end

// every register reads back; unused bits and addresses read 0; nothing but its own address changes a register
(* anyconst *) reg [5:0] f_addr;
reg [31:0] f_value;
// ENABLE has its own rules above, the watch in watch.vh
wire        f_own  = f_addr == `GATE_CONTROL || f_addr == `GATE_WATCH_TIME || f_addr == `GATE_PROOF;
wire [31:0] f_mask = f_own ? 32'd0 : `GATE_WRITABLE_AT(f_addr);
always @(posedge clk)
    if (!rst_n)
        f_value <= `GATE_RESET_AT(f_addr) & f_mask;
    else if (write && addr == f_addr)
        f_value <= wdata & f_mask;
wire [31:0] f_stored = f_addr == `GATE_CHOPPER ? {31'd0, chopper_enable} : f_addr == `GATE_CHOPPER_ON ? {17'd0, chopper_on}
    : f_addr == `GATE_CHOPPER_OFF ? {17'd0, chopper_off} : 32'd0;
always @* if (f_ran) begin
    assert (f_stored == f_value);
    if (!sel) assert (rdata == 32'd0);
    assert ((rdata & ~(`GATE_READABLE_AT(addr))) == 32'd0);
    if (sel && addr == f_addr) assert ((rdata & f_mask) == f_value);
    if (sel && addr == `GATE_ID) assert (rdata == `GATE_ID_RESET);
    if (sel && addr == `GATE_AXES) assert (rdata == {23'd0, ENABLES, COUNT, INDEX});
    if (sel && addr == `GATE_CONTROL) assert (rdata == {31'd0, enable});
    if (sel && addr == `GATE_WATCH_TIME) assert (rdata == {started, 11'd0, clocks});
    if (sel && addr == `GATE_WATCH) assert (rdata == {23'd0, thread, number});
    if (sel && addr == `GATE_CHOPPER) assert (rdata[1] == pin_chopper);
end
