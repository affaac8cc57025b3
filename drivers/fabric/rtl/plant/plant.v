// SPDX-License-Identifier: MIT
// A motor, its inverter, sensors and load, to be connected to the pins of one axis (drivers/fabric/rtl/fabric_axis.v), and a
// window of registers for whoever describes the motor, loads it, disturbs it or wants to know the truth (registers.toml here).
// The host writes all words before it lets the plant run; memories of the fabric come up with anything.
`include "plant_regs.vh"
`include "plant_program.vh"
module plant (
    input  wire        clk,
    input  wire        rst_n,
    // APB3
    input  wire        psel,
    input  wire        penable,
    input  wire        pwrite,
    input  wire [9:0]  paddr,
    input  wire [31:0] pwdata,
    output reg  [31:0] prdata,
    output wire        pready,
    output wire        pslverr,
    // the axis' pins
    input  wire [2:0]  gate_high,        // C, B, A
    input  wire [2:0]  gate_low,
    input  wire        chops,
    input  wire        cs_n,
    input  wire        sclk,
    output wire [3:0]  sdata,            // bus voltage, C, B, A
    input  wire        temp_cs_n,
    input  wire        temp_sclk,
    output wire        temp_sdata,
    output wire        pin_a,
    output wire        pin_b,
    output wire        pin_index,
    output wire        pin_lost,
    output wire [2:0]  pin_hall
);
    // ---- registers ----
    wire       ours  = psel && paddr[9:8] == 2'd0 && paddr[1:0] == 2'd0;
    wire       sets  = ours && penable && pwrite;
    wire [5:0] where = paddr[7:2];
    assign     pready = 1'b1, pslverr = 1'b0;

    reg         run, sinks, igbt;
    reg  [1:0]  strength;
    reg  [2:0]  open;
    reg  [3:0]  stuck;
    reg         cut;
    reg  [15:0] delays;
    reg  [6:0]  host_at;
    reg  [17:0] host_high, host_low, index_at, index_reach, hall_at;
    reg  [1:0]  index_quarter;
    reg  [11:0] temperature;
    reg         host_look, host_write;
    wire        host_busy;
    wire [35:0] looked_at;

    always @(posedge clk)
        if (!rst_n) begin
            {run, sinks, igbt, strength, open, stuck, cut} <= 13'd0;
            delays        <= 16'd0;
            host_at       <= 7'd0;
            host_high     <= 18'd0;
            host_low      <= 18'd0;
            index_at      <= 18'd0;
            index_reach   <= 18'd0;
            index_quarter <= 2'd0;
            hall_at       <= 18'd0;
            temperature   <= 12'd0;
            host_look     <= 1'b0;
            host_write    <= 1'b0;
        end else begin
            host_look  <= sets && where == `PLANT_WORD;
            host_write <= sets && where == `PLANT_LOW;
            if (sets)
                case (where)
                    `PLANT_CONTROL: {strength, igbt, sinks, run} <= pwdata[4:0];
                    `PLANT_FAULT:   {stuck, cut, open} <= pwdata[7:0];
                    `PLANT_DELAY:   delays <= pwdata[15:0];
                    `PLANT_WORD:    host_at <= pwdata[6:0];
                    `PLANT_HIGH:    host_high <= pwdata[17:0];
                    `PLANT_LOW:     host_low <= pwdata[17:0];
                    `PLANT_INDEX:   {index_quarter, index_at} <= pwdata[19:0];
                    `PLANT_REACH:   index_reach <= pwdata[17:0];
                    `PLANT_HALL:    hall_at <= pwdata[17:0];
                    `PLANT_TEMP:    temperature <= pwdata[11:0];
                    default:;
                endcase
        end

    always @(posedge clk)
        if (!rst_n || !psel)
            prdata <= 32'd0;
        else if (!penable && !pwrite && ours)
            case (where)
                `PLANT_ID:      prdata <= `PLANT_ID_RESET;
                `PLANT_CONTROL: prdata <= {27'd0, strength, igbt, sinks, run};
                `PLANT_FAULT:   prdata <= {24'd0, stuck, cut, open};
                `PLANT_DELAY:   prdata <= {16'd0, delays};
                `PLANT_WORD:    prdata <= {host_busy || host_look || host_write, 24'd0, host_at};
                `PLANT_HIGH:    prdata <= {14'd0, looked_at[35:18]};
                `PLANT_LOW:     prdata <= {14'd0, looked_at[17:0]};
                `PLANT_INDEX:   prdata <= {12'd0, index_quarter, index_at};
                `PLANT_REACH:   prdata <= {14'd0, index_reach};
                `PLANT_HALL:    prdata <= {14'd0, hall_at};
                `PLANT_TEMP:    prdata <= {20'd0, temperature};
                default:        prdata <= 32'd0;
            endcase

    // ---- bridge and machine ----
    wire               tick, valid, begins;
    wire        [20:0] high_clocks, low_clocks;
    wire        [5:0]  conducts;
    wire        [3:0]  which;
    wire signed [17:0] external;
    wire        [2:0]  off;
    wire        [6:0]  place;
    wire        [35:0] word;

    genvar k;
    generate for (k = 0; k < 3; k = k + 1) begin : leg
        plant_leg bridge (.clk(clk), .rst_n(rst_n), .high(gate_high[k]), .low(gate_low[k]), .on_delay(delays[7:0]),
                          .off_delay(delays[15:8]), .tick(tick), .high_clocks(high_clocks[7*k +: 7]),
                          .low_clocks(low_clocks[7*k +: 7]), .conducts(conducts[2*k +: 2]));
    end endgenerate

    // what the program tells about the present
    reg [2:0]  into;
    reg [17:0] turn, electrical;
    reg [31:0] line, increment;
    always @(posedge clk)
        if (!rst_n) begin
            into       <= 3'd0;
            turn       <= 18'd0;
            electrical <= 18'd0;
            line       <= 32'd0;
            increment  <= 32'd0;
        end else if (valid)
            case (place)
                `WORD_IA:  into[0]    <= word[35];
                `WORD_IB:  into[1]    <= word[35];
                `WORD_IC:  into[2]    <= word[35];
                `WORD_THM: turn       <= word[35:18];
                `WORD_THE: electrical <= word[35:18];
                `WORD_THQ: line       <= word[35:4];
                `WORD_QI:  increment  <= word[35:4];
                default:;
            endcase

    // the phase with the middle one of three EMF, -sin(angle - 0, 1, 2 thirds of a turn): within a twelfth of 0 or a half
    wire [19:0] triple = {2'd0, electrical} + {1'b0, electrical, 1'b0};
    wire [2:0]  sixth  = triple[19:17] + {2'd0, triple[16]};
    reg  [1:0]  middle;
    always @(posedge clk)
        case (sixth)
            3'd0, 3'd3, 3'd6: middle <= 2'd0;
            3'd1, 3'd4:       middle <= 2'd2;
            default:          middle <= 2'd1;
        endcase

    plant_legs legs (.clk(clk), .high_clocks(high_clocks), .low_clocks(low_clocks), .into(into), .open(open), .igbt(igbt),
                     .middle(middle), .off(off), .which(which), .value(external));

    plant_core core (.clk(clk), .rst_n(rst_n), .run(run), .sinks(sinks), .chops(chops), .open(open), .tick(tick), .which(which),
                     .external(external), .off(off), .host_at(host_at), .host_look(host_look), .host_write(host_write),
                     .host_word({host_high, host_low}), .host_busy(host_busy), .looked_at(looked_at), .begins(begins),
                     .valid(valid), .place(place), .word(word));

    // ---- sensors ----
    plant_shaft_sensors shaft (.clk(clk), .rst_n(rst_n), .begins(begins), .line(line), .increment(increment), .turn(turn),
                               .electrical(electrical), .index_at(index_at), .index_reach(index_reach),
                               .index_quarter(index_quarter), .hall_at(hall_at), .cut(cut), .pin_a(pin_a), .pin_b(pin_b),
                               .pin_index(pin_index), .pin_lost(pin_lost), .pin_hall(pin_hall));

    wire [31:0] noise;
    plant_noise shift_register (.clk(clk), .rst_n(rst_n), .strength(strength), .noise(noise));

    wire [3:0]  codes_of = {place == `WORD_CODE_U, place == `WORD_CODE_C, place == `WORD_CODE_B, place == `WORD_CODE_A};
    wire [3:0]  takes = codes_of & {4{valid}};
    wire [47:0] codes;
    generate for (k = 0; k < 4; k = k + 1) begin : channel
        plant_channel #(.AHEAD(k < 3)) analog (.clk(clk), .rst_n(rst_n), .take(takes[k]), .word(word), .stuck(stuck[k]),
                                               .noise(noise[8*k +: 8]), .code(codes[12*k +: 12]));
        plant_converter #(.ZEROS(2)) converter (.clk(clk), .rst_n(rst_n), .cs_n(cs_n), .sclk(sclk), .code(codes[12*k +: 12]),
                                                .sdata(sdata[k]));
    end endgenerate
    plant_converter #(.ZEROS(4)) thermometer (.clk(clk), .rst_n(rst_n), .cs_n(temp_cs_n), .sclk(temp_sclk),
                                              .code(temperature), .sdata(temp_sdata));

    wire        unused = &{1'b0, pwdata[31:20], triple[15:0], conducts};
endmodule
