// SPDX-License-Identifier: MIT
// What an axis promises from pin to pin, with any ADC and any encoder: that the blocks are wired to each other and to the pins
// as they should be.
`include "mssfoc_regs.vh"
reg f_ran = 1'b0;
always @(posedge clk) f_ran <= 1'b1;
always @* if (!f_ran) assume (!rst_n);

wire f_any = |gate_high || |gate_low || |gate_enable;
reg  f_lost;        // a sample was lost while live, a clock ago
always @(posedge clk) f_lost <= rst_n && overrun_event && live;
reg  f_sto;         // safe torque off, with filters of no length (formal/sto.v), a clock ago
always @(posedge clk) f_sto <= rst_n && (!pin_sto_a_n || !pin_sto_b_n || sto[2]);
reg  f_slot_0;      // a setup phase for PWM's slot, a clock ago
always @(posedge clk) f_slot_0 <= rst_n && psel && !penable && paddr[9:8] == 2'd0 && paddr[1:0] == 2'd0;
always @* if (f_ran) begin
    // in the same clock
    if (!rst_n || !pin_clock_ok || pin_overcurrent || pin_driver_fault) assert (!f_any);
    if (trip || f_lost || f_sto) assert (!f_any);
    assert (commit == (f_slot_0 && psel && penable && pwrite && paddr[7:2] == `PWM_COMPARE_C));
    if (!live) assert (!f_any);
    assert ((gate_high & gate_low) == 3'd0);
    assert ((high & low) == 3'd0);
    // six gates; or an input and an enable for each leg, of which none is on unless it may be
    if (IN_EN == 0) assert (pin_high == gate_high && pin_low == gate_low);
    else assert (pin_high == side && pin_low == gate_enable && (pin_low & ~active) == 3'd0);
    assert (((gate_high | gate_low) & ~gate_enable) == 3'd0);
    assert ((gate_high & ~side) == 3'd0 && (gate_low & side) == 3'd0);
    if (|gate_high || |gate_low) assert (gate_enable == active);
    // every pin is that of its own phase and side
    assert ((gate_high & ~high) == 3'd0 && (gate_low & ~low) == 3'd0);
    assert (CAN_FOLLOW == (AXIS != 0));
end
// a quiet line stops nothing: 1 ms and 500 ms are at their places
always @* if (f_ran) assert (sto[1:0] == {!pin_sto_b_n, !pin_sto_a_n});
// over the bus: identity, the number of this axis, and the bits that GATE shows of the other blocks
reg [9:0] f_at;
reg       f_read, f_faulty, f_overrun, f_limit;
always @(posedge clk) begin
    f_read    <= rst_n && psel && !penable && !pwrite;
    f_at      <= paddr;
    f_faulty  <= faulty;
    f_overrun <= overrun;
    f_limit   <= limit;
end
always @* if (f_ran && f_read) begin
    if (f_at == 10'h308) assert (prdata == `GATE_ID_RESET);
    if (f_at == {2'd3, `GATE_AXES, 2'd0})
        assert (prdata[3:0] == AXIS && prdata[7:4] == AXES && prdata[31:8] == {23'd0, IN_EN != 0});
    if (f_at == {2'd3, `GATE_STATUS, 2'd0}) begin
        assert (prdata[`GATE_STATUS_ENCODER] == f_faulty && prdata[`GATE_STATUS_OVERRUN] == f_overrun);
        assert (prdata[`GATE_STATUS_LIMIT] == f_limit);
    end
    if (f_at[9:8] == 2'd0 && f_at[7:2] > `PWM_COMPARE_C) assert (prdata == 32'd0);
    if (f_at[1:0] != 2'd0) assert (prdata == 32'd0);
end
