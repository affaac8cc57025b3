// SPDX-License-Identifier: MIT
// Reads 12 bit converters of the kind whose CS falling samples the inputs and brings a leading zero, and whose SCLK falling
// brings bit after bit, MSB first. Each is taken at the falling edge after the one that brought it, the last at falling edge
// FALLS. LINES converters share CS and SCLK.
//
// FALLS 14, two AD7356 (dual, simultaneously sampling, 5 MSPS; Analog Devices, data sheet Rev. A, "Serial interface", page 18):
// two leading zeros, twelve bits. SCLK is clk / (2 HALF): 50 MHz at HALF 1 and 100 MHz, where the part takes 80 (unconfirmed:
// docs/fabric.md). A bit is taken in the clock that launches the next falling edge, 20 ns after its own was launched: what
// the part and both ways through the FPGA's pins need must be less. Boards with longer ways, or isolators, set HALF 2 in adc.v.
// From CS to the last bit: 27 half periods, 270 ns.
//
// FALLS 16, AD7476A (single; data sheet Rev. F, timing, page 7): four leading zeros; at most 20 MHz, data 40 ns after the edge.
module adc_spi #(parameter HALF = 1, parameter FALLS = 14, parameter LINES = 4) (   // HALF 1...4
    input  wire                clk,
    input  wire                rst_n,
    input  wire                enable,  // 0 ends a frame at once
    input  wire                start,   // ignored during a frame
    output reg                 cs_n,
    output reg                 sclk,
    input  wire [LINES-1:0]    sdata,
    output reg                 done,    // one clock: the codes are complete; they stay until the next frame
    output wire [12*LINES-1:0] codes    // line 0 lowest
);
    localparam [31:0] EDGES = 2 * FALLS, BEFORE = HALF - 1;
    localparam [5:0]  END = EDGES[5:0], LAST_FALL = END - 6'd1;
    localparam [1:0]  WAIT = BEFORE[1:0];

    reg [5:0] edges;                    // of SCLK since CS fell: odd ones are falling
    reg [1:0] left;                     // clocks until the next of them

    wire       moves     = !cs_n && left == 2'd0;
    wire [5:0] edges_now = edges + 6'd1;
    wire       falls     = moves && edges_now[0];

    always @(posedge clk)
        if (!rst_n || !enable) begin
            cs_n  <= 1'b1;
            sclk  <= 1'b1;
            edges <= 6'd0;
            left  <= WAIT;
            done  <= 1'b0;
        end else begin
            done <= falls && edges_now == LAST_FALL;
            if (cs_n) begin
                cs_n  <= !start;
                edges <= 6'd0;
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

    // the leading zeros leave the registers again at the top
    genvar k;
    generate for (k = 0; k < LINES; k = k + 1) begin : line
        reg [11:0] code;
        always @(posedge clk)
            if (!rst_n)
                code <= 12'd0;
            else if (falls)
                code <= {code[10:0], sdata[k]};
        assign codes[12*k +: 12] = code;
    end endgenerate

`ifdef FORMAL
`include "formal/adc_spi.vh"
`endif
endmodule
