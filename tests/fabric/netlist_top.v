// SPDX-License-Identifier: MIT
// What of an axis stands between the bus and the gates: PWM and GATE, joined as in fabric_axis.v.
module bridge(
    input  wire        clk, rst_n, sel_pwm, sel_gate, write,
    input  wire [7:2]  addr,
    input  wire [31:0] wdata,
    input  wire        overrun_event, pin_overcurrent, pin_driver_fault, pin_clock_ok,
    input  wire [2:0]  sto,
    output wire [2:0]  pin_high, pin_low,
    output wire        trigger
);
    wire       live;
    wire [2:0] high, low, active;
    pwm carrier_and_legs (.clk(clk), .rst_n(rst_n), .sel(sel_pwm), .write(sel_pwm && write), .addr(addr), .wdata(wdata),
                          .rdata(), .live(live), .sync_in(1'b0), .can_follow(1'b0), .sync_out(), .trigger(trigger), .high(high),
                          .low(low), .active(active), .side());
    gate switch (.clk(clk), .rst_n(rst_n), .sel(sel_gate), .write(sel_gate && write), .addr(addr), .wdata(wdata), .rdata(),
                 .high(high), .low(low), .active(active),
                 .overrun_event(overrun_event), .overrun(1'b0), .limit(1'b0), .encoder_faulty(1'b0),
                 .sample(1'b0),
                 .vbus(15'd0), .valley(1'b0), .commit(1'b0),
                 .pin_overcurrent(pin_overcurrent), .pin_driver_fault(pin_driver_fault),
                 .sto(sto), .pin_clock_ok(pin_clock_ok), .live(live),
                 .pin_high(pin_high), .pin_low(pin_low), .pin_enable(), .pin_chopper(),
                 .pin_watch_reset_n());
endmodule
