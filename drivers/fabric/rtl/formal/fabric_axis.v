// SPDX-License-Identifier: MIT
// Stands for fabric_axis.v in the proof of fabric.v: any outputs, and 0 on the bus unless selected, as apb_slave.vh proves.
module fabric_axis #(parameter AXIS = 0, parameter AXES = 1) (
    input  wire        clk, rst_n, psel, penable, pwrite,
    input  wire [9:0]  paddr,
    input  wire [31:0] pwdata,
    output reg  [31:0] prdata,
    output wire        pready, pslverr, irq,
    input  wire        sync_in,
    output wire        sync_out,
    output wire [2:0]  pin_high, pin_low,
    output wire        pin_chopper,
    input  wire        pin_overcurrent, pin_driver_fault, pin_sto_a_n, pin_sto_b_n, pin_clock_ok,
    output wire        pin_cs_n, pin_sclk,
    input  wire [3:0]  pin_sdata,
    output wire        pin_temp_cs_n, pin_temp_sclk,
    input  wire        pin_temp_sdata,
    output wire        pin_mod_clock,
    input  wire [2:0]  pin_mod_data,
    input  wire        pin_a, pin_b, pin_index, pin_lost,
    input  wire [2:0]  pin_hall
);
    // each axis answers with what tells it from the others
    always @(posedge clk)
        prdata <= rst_n && psel ? {AXIS[3:0], 17'd1, pwrite, paddr} : 32'd0;
    assign pready = 1'b1, pslverr = 1'b0, irq = 1'b0, sync_out = 1'b0, pin_high = 3'd0, pin_low = 3'd0, pin_chopper = 1'b0;
    assign pin_cs_n = 1'b1, pin_sclk = 1'b0, pin_temp_cs_n = 1'b1, pin_temp_sclk = 1'b0, pin_mod_clock = 1'b0;
endmodule
