// SPDX-License-Identifier: MIT
// Reads two AD7356 (dual, simultaneously sampling, 12 bit, 5 MSPS; Analog Devices, data sheet Rev. A, "Serial interface", page
// 18) that share CS and SCLK: A and B of the first, C and bus voltage of the second. CS falling samples all four inputs. A
// conversion takes 14 clocks: CS falling brings a leading zero, the first falling edge of SCLK a second one, falling edges 2 to
// 13 the twelve bits, MSB first; each bit is taken at the falling edge after the one that brought it, the last at the 14th.
//
// SCLK is clk / (2 HALF): 50 MHz of the part's 80 at HALF 1 and 100 MHz. A bit is taken in the clock that launches the next
// falling edge, 20 ns after the last one was launched: what the part and both ways through the FPGA's pins need must be less.
// Boards with longer ways, or isolators, take HALF 2. Sampling to the last bit: 27 half periods, 270 ns.
module adc_spi #(parameter HALF = 1) (   // 1...4
    input  wire        clk,
    input  wire        rst_n,
    input  wire        enable,           // 0 ends a frame at once
    input  wire        start,            // ignored during a frame
    output reg         cs_n,
    output reg         sclk,
    input  wire [3:0]  sdata,            // bus voltage, C, B, A
    output reg         done,             // one clock: the codes are complete; they stay until the next frame
    output reg  [11:0] code_a,
    output reg  [11:0] code_b,
    output reg  [11:0] code_c,
    output reg  [11:0] code_v
);
    localparam [4:0] LAST_FALL = 5'd27, END = 5'd28;
    localparam [1:0] WAIT = HALF - 1;

    reg [4:0] edges;                     // of SCLK since CS fell: odd ones are falling
    reg [1:0] left;                      // clocks until the next of them

    wire       moves     = !cs_n && left == 2'd0;
    wire [4:0] edges_now = edges + 5'd1;
    wire       falls     = moves && edges_now[0];

    always @(posedge clk)
        if (!rst_n || !enable) begin
            cs_n  <= 1'b1;
            sclk  <= 1'b1;
            edges <= 5'd0;
            left  <= WAIT;
            done  <= 1'b0;
        end else begin
            done <= falls && edges_now == LAST_FALL;
            if (cs_n) begin
                cs_n  <= !start;
                edges <= 5'd0;
                left  <= WAIT;
            end else if (!moves)
                left <= left - 2'd1;
            else begin
                left  <= WAIT;
                edges <= edges_now;
                sclk  <= !edges_now[0];
                cs_n  <= edges_now == END;
            end
        end

    // the two leading zeros leave the registers again at the top
    always @(posedge clk)
        if (!rst_n) begin
            code_a <= 12'd0;
            code_b <= 12'd0;
            code_c <= 12'd0;
            code_v <= 12'd0;
        end else if (falls) begin
            code_a <= {code_a[10:0], sdata[0]};
            code_b <= {code_b[10:0], sdata[1]};
            code_c <= {code_c[10:0], sdata[2]};
            code_v <= {code_v[10:0], sdata[3]};
        end

`ifdef FORMAL
`include "formal/adc_spi.vh"
`endif
endmodule
