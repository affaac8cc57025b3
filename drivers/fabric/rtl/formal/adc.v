// SPDX-License-Identifier: MIT
// Stands for adc.v in the proof of fabric_axis.v: any outputs at any time; on its register port 0 unless selected.
module adc (
    input  wire        clk, rst_n, sel, write,
    input  wire [7:2]  addr,
    input  wire [31:0] wdata,
    output wire [31:0] rdata,
    input  wire        trigger,
    input  wire [2:0]  low,
    output wire        irq, overrun_event, overrun, limit, sample,
    output wire [14:0] vbus,
    output wire        trip,
    output wire        pin_cs_n, pin_sclk,
    input  wire [3:0]  pin_sdata,
    output wire        pin_temp_cs_n, pin_temp_sclk,
    input  wire        pin_temp_sdata,
    output wire        pin_mod_clock,
    input  wire [2:0]  pin_mod_data
);
    (* anyseq *) reg [57:0] any;
    assign rdata = sel ? any[31:0] : 32'd0;
    assign {irq, overrun_event, overrun, limit, sample, vbus, trip} = any[52:32];
    assign {pin_cs_n, pin_sclk, pin_temp_cs_n, pin_temp_sclk, pin_mod_clock} = any[57:53];
endmodule
