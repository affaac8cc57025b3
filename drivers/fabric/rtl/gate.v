// SPDX-License-Identifier: MIT
// Slot 3 of an axis, GATE: the bridge's switch. A pin that says stop cuts all six outputs in the same clock, by logic
// alone; behind two flip-flops it sets its latch, which clears ENABLE. Pin, flip-flops and latch cut one after the other
// without a gap, so that a pulse on a pin that one clock edge has seen is never followed by outputs. An overrun cuts by its
// latch: its logic changes with every clock, and would show at the gates. So do a program that hangs (watch.v) and safe torque
// off (sto.v), which has its own flip-flops.
`include "mssfoc_regs.vh"
module gate #(parameter AXIS = 0, parameter AXES = 1, parameter IN_EN = 0) (
    input  wire        clk,
    input  wire        rst_n,
    // register port: rdata is 0 unless selected, so that slots can be ORed; `write` is for this slot
    input  wire        sel,
    input  wire        write,
    input  wire [7:2]  addr,
    input  wire [31:0] wdata,
    output wire [31:0] rdata,
    // from the other blocks
    input  wire [2:0]  high,              // what PWM wishes: C, B, A
    input  wire [2:0]  low,
    input  wire [2:0]  active,            // and enables of drivers that have an input and an enable for each leg
    input  wire        overrun_event,     // an ADC overrun happens in this clock
    input  wire        overrun,           // ADC.STATUS has OVERRUN
    input  wire        limit,             // ADC.STATUS has a flag of its limits
    input  wire        encoder_faulty,
    input  wire        valley,            // of the carrier, in the next clock
    input  wire        commit,            // a set of compares is written in this clock
    input  wire        sample,            // `vbus` is new in this clock
    input  wire [14:0] vbus,
    // pins, asynchronous
    input  wire        pin_overcurrent,
    input  wire        pin_driver_fault,
    input  wire        pin_clock_ok,      // lock of the clock's PLL
    // safe torque off, in the next clock: its inputs do not agree, B, A
    input  wire [2:0]  sto,
    output wire        live,              // to PWM
    output wire [2:0]  pin_high,
    output wire [2:0]  pin_low,
    output wire [2:0]  pin_enable,
    output wire        pin_chopper,
    output reg         pin_watch_reset_n  // for a design that lets a program that hangs be reset
);
    // order of the pins and their latches: clock, driver, over-current
    wire [2:0] pins = {!pin_clock_ok, pin_driver_fault, pin_overcurrent};
    reg  [2:0] pins_1, pins_2, pin_latches;
    wire [2:0] asked = pins | pins_1 | pins_2;
    reg  [2:0] sto_now, sto_latches;

    reg        enable, loop_lost, interlock;
    reg        armed;                     // ENABLE as the program wrote it: what stops the bridge does not clear it
    reg  [1:0] program_latches;           // thread, slow loop
    reg        chopper_enable;
    reg [14:0] chopper_on, chopper_off;

    wire clears = write && addr == `GATE_STATUS;

    wire        started, thread, loop_late;
    wire [1:0]  missed;
    wire [19:0] clocks;
    wire [7:0]  number;
    watch program_watch (.clk(clk), .rst_n(rst_n), .starts(write && addr == `GATE_WATCH_TIME),
                         .proves(write && addr == `GATE_PROOF), .wdata(wdata), .armed(armed), .tripped(|program_latches),
                         .live(enable), .valley(valley), .commit(commit), .started(started), .clocks(clocks),
                         .thread(thread), .number(number), .loop_late(loop_late), .missed(missed));

    wire both      = |(high & low);
    wire lost_now  = (overrun_event && enable) || loop_late;
    wire stops_now = lost_now || |missed || |sto;
    wire latched   = |pin_latches || |sto_latches || loop_lost || interlock || |program_latches;
    wire settled   = |pins_2 || both || latched;    // safe for flip-flops: pins only behind two of them
    wire cut       = settled || |asked;
    wire follows   = enable && !cut && rst_n;

    assign pin_high   = high & {3{follows}};
    assign pin_low    = low & {3{follows}};
    assign pin_enable = active & {3{follows}};
    assign live       = enable;

    // a latch clears only by a 1 written while its input is quiet
    wire [2:0] clear_pins = {wdata[`GATE_STATUS_CLOCK_LOST], wdata[`GATE_STATUS_DRIVER_FAULT],
                             wdata[`GATE_STATUS_OVERCURRENT]} & {3{clears}};
    wire [2:0] clear_sto  = {wdata[`GATE_STATUS_STO_APART], wdata[`GATE_STATUS_STO_B], wdata[`GATE_STATUS_STO_A]} & {3{clears}};
    wire [1:0] clear_program = {wdata[`GATE_STATUS_THREAD_LOST], wdata[`GATE_STATUS_SLOW_LOST]} & {2{clears}};
    wire       forgiven    = |(program_latches & clear_program);
    wire       enable_next = wdata[`GATE_CONTROL_ENABLE] && !settled && !stops_now;

    always @(posedge clk)
        if (!rst_n) begin
            pins_1         <= 3'd0;
            pins_2         <= 3'd0;
            pin_latches    <= 3'd0;
            sto_now        <= 3'd0;
            sto_latches    <= 3'd0;
            loop_lost      <= 1'b0;
            interlock      <= 1'b0;
            enable         <= 1'b0;
            armed          <= 1'b0;
            program_latches   <= 2'd0;
            pin_watch_reset_n <= 1'b1;
            chopper_enable <= 1'b0;
            chopper_on     <= `GATE_CHOPPER_ON_RESET;
            chopper_off    <= `GATE_CHOPPER_OFF_RESET;
        end else begin
            pins_1      <= pins;
            pins_2      <= pins_1;
            pin_latches <= pins_2 | (pin_latches & ~(clear_pins & ~asked));
            sto_now     <= sto;
            sto_latches <= sto | (sto_latches & ~(clear_sto & ~sto_now));
            loop_lost   <= lost_now || (loop_lost && !(clears && wdata[`GATE_STATUS_LOOP_LOST]));
            interlock   <= both || (interlock && !(clears && wdata[`GATE_STATUS_INTERLOCK]));
            program_latches   <= missed | (program_latches & ~clear_program);
            pin_watch_reset_n <= !(armed && |program_latches);
            if (write && addr == `GATE_CONTROL) begin
                enable <= enable_next;
                armed  <= enable_next;
            end else begin
                if (settled || stops_now)
                    enable <= 1'b0;
                if (forgiven)
                    armed <= 1'b0;
            end
            if (write && addr == `GATE_CHOPPER)
                chopper_enable <= wdata[`GATE_CHOPPER_ENABLE];
            if (write && addr == `GATE_CHOPPER_ON)
                chopper_on <= wdata[`GATE_CHOPPER_ON_VALUE];
            if (write && addr == `GATE_CHOPPER_OFF)
                chopper_off <= wdata[`GATE_CHOPPER_OFF_VALUE];
        end

    wire chopping;
    chopper brake_chopper (.clk(clk), .rst_n(rst_n), .enable(chopper_enable), .sample(sample), .vbus(vbus),
                           .on_above(chopper_on), .off_at(chopper_off), .on(chopping));
    assign pin_chopper = chopping && chopper_enable && pin_clock_ok && rst_n;

    localparam [3:0] INDEX = AXIS[3:0], COUNT = AXES[3:0];
    localparam       ENABLES = IN_EN != 0;
    reg [31:0] value;
    always @*
        case (addr)
        `GATE_CONTROL:     value = {31'd0, enable};
        `GATE_STATUS:      value = {14'd0, sto_latches[2], program_latches, sto_now[1:0], pin_latches[2], sto_latches[1:0],
                                    pins_2[1:0], limit, overrun, encoder_faulty, interlock, loop_lost,
                                    pin_latches[1:0], enable && !settled};
        `GATE_ID:          value = `GATE_ID_RESET;
        `GATE_CHOPPER:     value = {30'd0, pin_chopper, chopper_enable};
        `GATE_CHOPPER_ON:  value = {17'd0, chopper_on};
        `GATE_CHOPPER_OFF: value = {17'd0, chopper_off};
        `GATE_AXES:        value = {23'd0, ENABLES, COUNT, INDEX};
        `GATE_WATCH_TIME:  value = {started, 11'd0, clocks};
        `GATE_WATCH:       value = {23'd0, thread, number};
        default:           value = 32'd0;
        endcase
    assign rdata = sel ? value : 32'd0;

`ifdef FORMAL
`include "formal/gate.vh"
`endif
endmodule
