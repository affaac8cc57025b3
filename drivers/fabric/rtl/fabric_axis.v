// SPDX-License-Identifier: MIT
// One axis: the bus side, the four blocks, and the wires between them.
`include "mssfoc_regs.vh"
// IN_EN: the drivers have an input and an enable for each leg, and make the dead time: pin_high leads to the inputs, pin_low to
// the enables. A choice of the design and no register: at six gates it would turn on both sides.
// STO_TEST: the longest test pulse of a safe-torque-off input in clocks; STO_APART: for how long one input may ask alone.
module fabric_axis #(parameter AXIS = 0, parameter AXES = 1, parameter IN_EN = 0, parameter STO_TEST = 100_000,
                     parameter STO_APART = 50_000_000) (
    input  wire        clk,
    input  wire        rst_n,
    // APB3, selected for this axis' window
    input  wire        psel,
    input  wire        penable,
    input  wire        pwrite,
    input  wire [9:0]  paddr,
    input  wire [31:0] pwdata,
    output wire [31:0] prdata,
    output wire        pready,
    output wire        pslverr,
    output wire        irq,               // the end of a conversion, level
    // the carriers of two axes
    input  wire        sync_in,
    output wire        sync_out,
    // the power stage
    output wire [2:0]  pin_high,          // C, B, A; or the legs' inputs
    output wire [2:0]  pin_low,           // or their enables
    output wire        pin_chopper,
    output wire        pin_watch_reset_n, // 0: the program hangs
    input  wire        pin_overcurrent,
    input  wire        pin_driver_fault,
    input  wire        pin_sto_a_n,       // 0 stops
    input  wire        pin_sto_b_n,
    input  wire        pin_clock_ok,      // lock of the clock's PLL
    // converters and modulators
    output wire        pin_cs_n,
    output wire        pin_sclk,
    input  wire [3:0]  pin_sdata,         // bus voltage, C, B, A
    output wire        pin_temp_cs_n,
    output wire        pin_temp_sclk,
    input  wire        pin_temp_sdata,
    output wire        pin_mod_clock,
    input  wire [2:0]  pin_mod_data,      // C, B, A
    // encoder and Hall switches
    input  wire        pin_a,
    input  wire        pin_b,
    input  wire        pin_index,
    input  wire        pin_lost,
    input  wire [2:0]  pin_hall
);
    wire [3:0]   sel;
    wire [3:0]   write;
    wire [7:2]   addr;
    wire [31:0]  wdata;
    wire [127:0] rdata;

    apb_slave bus (.clk(clk), .rst_n(rst_n), .psel(psel), .penable(penable), .pwrite(pwrite), .paddr(paddr), .pwdata(pwdata),
                   .prdata(prdata), .pready(pready), .pslverr(pslverr), .sel(sel), .write(write), .addr(addr), .wdata(wdata),
                   .rdata(rdata));

    wire        live, trigger, overrun_event, overrun, limit, sample, trip, faulty;
    wire [2:0]  high, low, active, side, gate_high, gate_low, gate_enable;
    wire [14:0] vbus;
    localparam  CAN_FOLLOW = AXIS != 0;

    pwm carrier_and_legs (.clk(clk), .rst_n(rst_n), .sel(sel[0]), .write(write[0]), .addr(addr), .wdata(wdata),
                          .rdata(rdata[31:0]), .live(live), .sync_in(sync_in), .can_follow(CAN_FOLLOW), .sync_out(sync_out),
                          .trigger(trigger), .high(high), .low(low), .active(active), .side(side));

    assign pin_high = IN_EN != 0 ? side : gate_high;
    assign pin_low  = IN_EN != 0 ? gate_enable : gate_low;

    adc sampler (.clk(clk), .rst_n(rst_n), .sel(sel[1]), .write(write[1]), .addr(addr), .wdata(wdata), .rdata(rdata[63:32]),
                 .trigger(trigger), .low(gate_low), .irq(irq), .overrun_event(overrun_event), .overrun(overrun), .limit(limit),
                 .sample(sample), .vbus(vbus), .trip(trip), .pin_cs_n(pin_cs_n), .pin_sclk(pin_sclk), .pin_sdata(pin_sdata),
                 .pin_temp_cs_n(pin_temp_cs_n), .pin_temp_sclk(pin_temp_sclk), .pin_temp_sdata(pin_temp_sdata),
                 .pin_mod_clock(pin_mod_clock), .pin_mod_data(pin_mod_data));

    encoder shaft (.clk(clk), .rst_n(rst_n), .sel(sel[2]), .write(write[2]), .addr(addr), .wdata(wdata), .rdata(rdata[95:64]),
                   .trigger(trigger), .pin_a(pin_a), .pin_b(pin_b), .pin_index(pin_index), .pin_lost(pin_lost),
                   .pin_hall(pin_hall), .faulty(faulty));

    localparam [16:0] LONGEST  = STO_TEST[16:0];
    localparam [25:0] PATIENCE = STO_APART[25:0];
    wire [2:0]        sto;
    sto safe_torque_off (.clk(clk), .rst_n(rst_n), .longest(LONGEST), .patience(PATIENCE), .pin_a_n(pin_sto_a_n),
                         .pin_b_n(pin_sto_b_n), .stops(sto));

    wire commit = write[0] && addr == `PWM_COMPARE_C;

    // the modulators' fast path is one more comparator of the power stage
    gate #(.AXIS(AXIS), .AXES(AXES), .IN_EN(IN_EN)) bridge (
        .clk(clk), .rst_n(rst_n), .sel(sel[3]), .write(write[3]), .addr(addr), .wdata(wdata), .rdata(rdata[127:96]),
        .high(high), .low(low), .active(active), .overrun_event(overrun_event), .overrun(overrun),
        .limit(limit), .encoder_faulty(faulty), .valley(sync_out), .commit(commit), .sample(sample), .vbus(vbus),
        .pin_overcurrent(pin_overcurrent || trip), .pin_driver_fault(pin_driver_fault), .pin_clock_ok(pin_clock_ok),
        .sto(sto), .live(live), .pin_high(gate_high), .pin_low(gate_low), .pin_enable(gate_enable),
        .pin_chopper(pin_chopper), .pin_watch_reset_n(pin_watch_reset_n));

`ifdef FORMAL
`include "formal/fabric_axis.vh"
`endif
endmodule
