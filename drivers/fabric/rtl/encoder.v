// SPDX-License-Identifier: MIT
// Slot 2 of an axis, ENC: incremental encoder and Hall switches behind registers. The ADC's trigger latches what belongs to
// one instant: the position, the Hall state, the time of the last edge of each, and the time itself.
`include "mssfoc_regs.vh"
module encoder (
    input  wire        clk,
    input  wire        rst_n,
    // register port: rdata is 0 unless selected, so that slots can be ORed; `write` is for this slot
    input  wire        sel,
    input  wire        write,
    input  wire [7:2]  addr,
    input  wire [31:0] wdata,
    output wire [31:0] rdata,
    // one clock wide, the same as the ADC's
    input  wire        trigger,
    // pins, asynchronous
    input  wire        pin_a,
    input  wire        pin_b,
    input  wire        pin_index,
    input  wire        pin_lost,    // the receiver sees an undriven pair; tie low without detection
    input  wire [2:0]  pin_hall,
    output wire        faulty       // to GATE.STATUS: ILLEGAL or SIGNAL_LOST
);
    reg [1:0]  control;                 // REVERSE, ENABLE
    reg [7:0]  filter_encoder, filter_hall;
    reg        index_seen, illegal_seen, signal_lost;
    reg [15:0] latched, index;
    reg [31:0] now, edge_now, edge_time, latch_time;
    reg [1:0]  lost_sync;
    reg [16:0] counts;                  // COUNTS, to be read without an adder behind `top`
    reg        z_was;

    wire        a, b, z, counted, illegal;
    wire [15:0] top, position, position_next;
    wire [2:0]  hall_state, hall_latched;
    wire [31:0] hall_time;
    wire        lost    = lost_sync[1];
    wire        listens = control[0] && !lost;
    wire        clears  = write && addr == `ENC_STATUS;
    wire        loads   = write && addr == `ENC_COUNTS;
    wire        tick    = now[3:0] == 4'd0;

    encoder_filter filter_a (.clk(clk), .rst_n(rst_n), .tick(1'b1), .length(filter_encoder), .pin(pin_a), .level(a));
    encoder_filter filter_b (.clk(clk), .rst_n(rst_n), .tick(1'b1), .length(filter_encoder), .pin(pin_b), .level(b));
    encoder_filter filter_z (.clk(clk), .rst_n(rst_n), .tick(1'b1), .length(filter_encoder), .pin(pin_index), .level(z));

    // COUNTS is held to 4...65536
    wire        few      = wdata[31:2] == 30'd0;
    wire        many     = wdata[31:16] != 16'd0;
    wire [15:0] load_top = few ? 16'd3 : many ? 16'hFFFF : wdata[15:0] - 16'd1;

    encoder_count count (.clk(clk), .rst_n(rst_n), .enable(control[0]), .reverse(control[1]), .lost(lost), .a(a), .b(b),
                         .load(loads), .load_top(load_top), .top(top), .position(position), .position_next(position_next),
                         .counted(counted), .illegal(illegal));

    hall switches (.clk(clk), .rst_n(rst_n), .pin(pin_hall), .tick(tick), .length(filter_hall), .now(now), .trigger(trigger),
                   .state(hall_state), .latched(hall_latched), .edge_time(hall_time));

    wire indexed = listens && z && !z_was;

    always @(posedge clk)
        if (!rst_n) begin
            control        <= `ENC_CONTROL_RESET;
            filter_encoder <= 8'd0;
            filter_hall    <= 8'd0;
            index_seen     <= 1'b0;
            illegal_seen   <= 1'b0;
            signal_lost    <= 1'b0;
            latched        <= 16'd0;
            index          <= 16'd0;
            now            <= 32'd0;
            edge_now       <= 32'd0;
            edge_time      <= 32'd0;
            latch_time     <= 32'd0;
            lost_sync      <= 2'b00;
            counts         <= `ENC_COUNTS_RESET;
            z_was          <= 1'b0;
        end else begin
            now       <= now + 32'd1;
            lost_sync <= {lost_sync[0], pin_lost};
            z_was     <= z;
            if (write && addr == `ENC_CONTROL)
                control <= {wdata[`ENC_CONTROL_REVERSE], wdata[`ENC_CONTROL_ENABLE]};
            if (write && addr == `ENC_FILTER) begin
                filter_encoder <= wdata[`ENC_FILTER_ENCODER];
                filter_hall    <= wdata[`ENC_FILTER_HALL];
            end
            if (loads)
                counts <= few ? 17'd4 : many ? 17'd65536 : wdata[16:0];
            if (counted)
                edge_now <= now;
            if (indexed)
                index <= position_next;     // a count in the same clock comes before the index
            if (trigger) begin
                latched    <= position;
                edge_time  <= edge_now;
                latch_time <= now;
            end
            // what comes up in the clock of its clearing stays
            index_seen   <= indexed || (index_seen && !(clears && wdata[0]));
            illegal_seen <= illegal || (illegal_seen && !(clears && wdata[1]));
            signal_lost  <= lost || (signal_lost && !(clears && wdata[2]));
        end

    wire unused = &{1'b0, top};         // which formal/encoder.vh compares

    assign faulty = illegal_seen || signal_lost;

    reg [31:0] value;
    always @* begin
        case (addr)
        `ENC_CONTROL:    value = {30'd0, control};
        `ENC_COUNTS:     value = {15'd0, counts};
        `ENC_POSITION:   value = {16'd0, position};
        `ENC_LATCHED:    value = {16'd0, latched};
        `ENC_INDEX:      value = {16'd0, index};
        `ENC_STATUS:     value = {29'd0, signal_lost, illegal_seen, index_seen};
        `ENC_EDGE_TIME:  value = edge_time;
        `ENC_LATCH_TIME: value = latch_time;
        `ENC_FILTER:     value = {16'd0, filter_hall, filter_encoder};
        `ENC_HALL:       value = {25'd0, hall_state, 1'b0, hall_latched};
        `ENC_HALL_TIME:  value = hall_time;
        default:         value = 32'd0;
        endcase
    end
    assign rdata = sel ? value : 32'd0;

`ifdef FORMAL
`include "formal/encoder.vh"
`endif
endmodule
