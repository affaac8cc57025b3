// SPDX-License-Identifier: MIT
// Slot 0 of an axis, PWM: one carrier, three phases, two triggers, and their registers.
`include "mssfoc_regs.vh"
module pwm (
    input  wire        clk,
    input  wire        rst_n,
    // register port: rdata is 0 unless selected, so that slots can be ORed; `write` is for this slot
    input  wire        sel,
    input  wire        write,
    input  wire [7:2]  addr,
    input  wire [31:0] wdata,
    output wire [31:0] rdata,
    input  wire        live,      // from GATE: the legs may turn on
    input  wire        sync_in,   // axis 0 is at its valley in the next clock; tie low on axis 0
    input  wire        can_follow, // 0 on axis 0
    output wire        sync_out,
    output wire        trigger,   // to ADC and ENC, one clock wide
    output wire [2:0]  high,      // C, B, A
    output wire [2:0]  low,
    output wire [2:0]  active,    // enables and inputs of drivers that have these for each leg
    output wire [2:0]  side
);
    reg        run, brake, follow;
    reg [15:0] period;
    reg [7:0]  dead, min_pulse;
    reg [1:0]  mode;
    reg [16:0] phase;
    reg [17:0] trigger_1, trigger_2;
    reg [15:0] compare_a, compare_b, compare_c;

    wire        running, running_next, rising, to_valley, turns_down, turns_up;
    wire        locked = run || brake || running;
    wire        commit = write && addr == `PWM_COMPARE_C;
    wire        brake_next = write && addr == `PWM_CONTROL ? wdata[1] : brake;
    wire        ends = !running_next && !brake_next;
    wire        withdraw = write && (addr == `PWM_COMPARE_A || addr == `PWM_COMPARE_B);

    // What the legs depend on is locked while they are in use, so that no change of it cuts a pulse.
    always @(posedge clk)
        if (!rst_n) begin
            {follow, brake, run} <= 3'b000;
            period    <= `PWM_PERIOD_RESET;
            dead      <= `PWM_DEAD_RESET;
            min_pulse <= `PWM_MIN_PULSE_RESET;
            mode      <= `PWM_MODE_RESET;
            phase     <= `PWM_PHASE_RESET;
            trigger_1 <= `PWM_TRIGGER_1_RESET;
            trigger_2 <= `PWM_TRIGGER_2_RESET;
            compare_a <= `PWM_COMPARE_A_RESET;
            compare_b <= `PWM_COMPARE_B_RESET;
            compare_c <= `PWM_COMPARE_C_RESET;
        end else if (write) begin
            case (addr)
            `PWM_CONTROL:   {follow, brake, run} <= wdata[2:0];
            `PWM_PERIOD:    if (!locked) period <= wdata[15:0];
            `PWM_DEAD:      if (!locked) dead <= wdata[7:0];
            `PWM_MIN_PULSE: if (!locked) min_pulse <= wdata[7:0];
            `PWM_MODE:      if (!locked) mode <= wdata[1:0];
            `PWM_PHASE:     if (!locked) phase <= wdata[16:0];
            `PWM_TRIGGER_1: trigger_1 <= wdata[17:0];
            `PWM_TRIGGER_2: trigger_2 <= wdata[17:0];
            `PWM_COMPARE_A: compare_a <= wdata[15:0];
            `PWM_COMPARE_B: compare_b <= wdata[15:0];
            `PWM_COMPARE_C: compare_c <= wdata[15:0];
            default: ;
            endcase
        end

    wire [15:0] count;
    wire [2:0]  wish, waiting, fell_back;
    wire        once = mode[1];
    // true at rest, too, where compares are taken anyway: so `running` is not twice in one path
    wire        load = rising ? turns_down : turns_up && mode != 2'd0;

    pwm_carrier carrier (.clk(clk), .rst_n(rst_n), .run(run), .follow(follow && can_follow), .sync(sync_in), .period(period),
                         .start_count(phase[15:0]), .start_rising(phase[16]), .running(running), .running_next(running_next),
                         .count(count), .rising(rising), .to_valley(to_valley), .turns_down(turns_down),
                         .turns_up(turns_up));

    wire [47:0] newest = {compare_c, compare_b, compare_a};
    wire [2:0]  wish_leg = wish & {3{running && !brake}}; // not at rest, or a brake from there would begin with a high side
    genvar k;
    generate
        for (k = 0; k < 3; k = k + 1) begin : leg
            pwm_compare updates (.clk(clk), .rst_n(rst_n), .running(running), .count(count), .rising(rising), .load(load),
                                 .once(once), .newest(newest[16*k +: 16]), .commit(commit), .withdraw(withdraw),
                                 .wish(wish[k]), .waiting(waiting[k]), .fell_back(fell_back[k]));
            pwm_leg half_bridge (.clk(clk), .rst_n(rst_n), .enable(live && (running || brake)), .ends(ends),
                                 .wish(wish_leg[k]), .dead(dead), .shortest(min_pulse), .high(high[k]), .low(low[k]),
                                 .active(active[k]), .side(side[k]));
        end
    endgenerate

    wire [1:0] triggers;
    pwm_trigger first (.clk(clk), .rst_n(rst_n), .running(running), .count(count), .rising(rising), .at(trigger_1[15:0]),
                       .at_falling(trigger_1[16]), .at_rising(trigger_1[17]), .trigger(triggers[0]));
    pwm_trigger second (.clk(clk), .rst_n(rst_n), .running(running), .count(count), .rising(rising), .at(trigger_2[15:0]),
                        .at_falling(trigger_2[16]), .at_rising(trigger_2[17]), .trigger(triggers[1]));

    assign trigger  = |triggers;
    assign sync_out = to_valley;

    reg [31:0] value;
    always @*
        case (addr)
        `PWM_CONTROL:   value = {29'd0, follow, brake, run};
        `PWM_STATUS:    value = {25'd0, fell_back, 1'b0, |waiting, rising, running};
        `PWM_PERIOD:    value = {16'd0, period};
        `PWM_DEAD:      value = {24'd0, dead};
        `PWM_MIN_PULSE: value = {24'd0, min_pulse};
        `PWM_MODE:      value = {30'd0, mode};
        `PWM_PHASE:     value = {15'd0, phase};
        `PWM_TRIGGER_1: value = {14'd0, trigger_1};
        `PWM_TRIGGER_2: value = {14'd0, trigger_2};
        `PWM_COUNT:     value = {16'd0, count};
        `PWM_COMPARE_A: value = {16'd0, compare_a};
        `PWM_COMPARE_B: value = {16'd0, compare_b};
        `PWM_COMPARE_C: value = {16'd0, compare_c};
        default:        value = 32'd0;
        endcase
    assign rdata = sel ? value : 32'd0;

    wire unused = &{1'b0, wdata[31:18]};

`ifdef FORMAL
`include "formal/pwm.vh"
`endif
endmodule
