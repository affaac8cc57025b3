// SPDX-License-Identifier: MIT
// What the PWM promises as a whole, with what its parts take for granted.
reg f_ran = 1'b0;
always @(posedge clk) f_ran <= 1'b1;
always @* if (!f_ran) assume (!rst_n);

// every register reads back; unused bits and addresses read 0; nothing but its own address changes a register
(* anyconst *) reg [5:0] f_addr;
reg [31:0] f_value;
wire       f_open = !(run || brake || running);
always @(posedge clk)
    if (!rst_n)
        f_value <= `PWM_RESET_AT(f_addr) & `PWM_WRITABLE_AT(f_addr);
    else if (write && addr == f_addr && (f_open || `PWM_LOCKED_AT(f_addr) == 32'd0))
        f_value <= wdata & `PWM_WRITABLE_AT(f_addr);
always @* if (f_ran) begin
    if (!sel) assert (rdata == 32'd0);
    assert ((rdata & ~(`PWM_READABLE_AT(addr))) == 32'd0);
    if (sel && addr == f_addr) assert ((rdata & `PWM_WRITABLE_AT(f_addr)) == f_value);
    if (sel && addr == `PWM_COUNT) assert (rdata == {16'd0, count});
    if (sel && addr == `PWM_STATUS) assert (rdata[2:0] == {|waiting, rising, running} && rdata[6:4] == fell_back);
end
// the same value stands in its register, whether it is read or not
wire [31:0] f_stored = f_addr == `PWM_CONTROL ? {29'd0, follow, brake, run} : f_addr == `PWM_PERIOD ? {16'd0, period}
    : f_addr == `PWM_DEAD ? {24'd0, dead} : f_addr == `PWM_MIN_PULSE ? {24'd0, min_pulse} : f_addr == `PWM_MODE ? {30'd0, mode}
    : f_addr == `PWM_PHASE ? {15'd0, phase} : f_addr == `PWM_TRIGGER_1 ? {14'd0, trigger_1}
    : f_addr == `PWM_TRIGGER_2 ? {14'd0, trigger_2} : f_addr == `PWM_COMPARE_A ? {16'd0, compare_a}
    : f_addr == `PWM_COMPARE_B ? {16'd0, compare_b} : f_addr == `PWM_COMPARE_C ? {16'd0, compare_c} : 32'd0;
always @* if (f_ran) assert (f_stored == f_value);

always @* if (f_ran) begin
    // no leg has both sides on, and none is on while the bridge or the PWM is off
    assert ((high & low) == 3'd0);
    if (!live || !(running || brake)) assert (high == 3'd0 && low == 3'd0 && active == 3'd0);
    // what drivers with an input and an enable are told is what the gates do
    assert (((high | low) & ~active) == 3'd0 && (high & ~side) == 3'd0 && (low & side) == 3'd0);
end
// what legs, carrier and compares take for granted
always @(posedge clk) if (f_ran) begin
    if (running || brake || $past(running)) assert (!$past(rst_n) || (period == $past(period) && mode == $past(mode)));
    if (running || brake) assert (dead == $past(dead) && min_pulse == $past(min_pulse) && once == $past(once));
    if (!$past(rst_n)) assert (!running && !brake);
    // the legs are told a clock before
    if ($past(ends)) assert (!running && !brake);
    // brake and running need their bits
    if (running) assert ($past(run));
end
// the three phases of a set act together in the modes that wait for an end
always @* if (f_ran && !once && running) assert (waiting == 3'b000 || waiting == 3'b111);
// a write to COMPARE_C commits the three, and nothing else does
always @(posedge clk) if (f_ran && $past(rst_n)) begin
    if ($past(write && addr == `PWM_COMPARE_C)) assert (waiting == 3'b111);
    else assert ((waiting & ~$past(waiting)) == 3'b000);
    if ($past(write && (addr == `PWM_COMPARE_A || addr == `PWM_COMPARE_B))) assert (waiting == 3'b000);
end
// which ends a mode takes: the valley, or both
always @(posedge clk) if (f_ran && running && $past(rst_n && running)) begin
    if (rising == $past(rising)) assert ($past(!load));
    else assert ($past(load) == (!rising || mode != 2'd0));
    assert ($past(sync_out) == (!rising && $past(rising)));
end
// triggers: one clock after their count in their direction, and no others
wire f_first  = count == trigger_1[15:0] && (rising ? trigger_1[17] : trigger_1[16]);
wire f_second = count == trigger_2[15:0] && (rising ? trigger_2[17] : trigger_2[16]);
always @(posedge clk) if (f_ran && $past(rst_n)) assert (trigger == $past(running && (f_first || f_second)));
// at rest and while braking the wish is all low sides, else what the compares say: so a brake from rest turns no high side on
// (pwm_leg.vh)
always @* if (f_ran) assert (wish_leg == (brake || !running ? 3'd0 : wish));
