// SPDX-License-Identifier: MIT
// Stands for fabric_axis.v in the proof of fabric.v: 0 on the bus unless selected, as apb_slave.vh proves. Answers with what
// reached it, and has outputs that follow bits of the bus that no other pin of up to three axes follows.
module fabric_axis #(parameter AXIS = 0, parameter AXES = 1, parameter IN_EN = 0) (
    input  wire        clk, rst_n, psel, penable, pwrite,
    input  wire [9:0]  paddr,
    input  wire [31:0] pwdata,
    output reg  [31:0] prdata,
    output wire        pready, pslverr, irq,
    input  wire        sync_in,
    output wire        sync_out,
    output wire [2:0]  pin_high, pin_low,
    output wire        pin_chopper, pin_watch_reset_n,
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
    wire [41:0] free = {paddr, pwdata};
    localparam [3:0] INDEX = AXIS, COUNT = AXES;
    always @(posedge clk)
        prdata <= !rst_n || !psel ? 32'd0
            : paddr[3:2] == 2'd1 ? {11'd0, sync_in, pin_overcurrent, pin_driver_fault, pin_sto_a_n, pin_sto_b_n, pin_clock_ok,
                                    pin_sdata, pin_temp_sdata, pin_mod_data, pin_a, pin_b, pin_index, pin_lost, pin_hall}
            : paddr[3:2] == 2'd2 ? pwdata : {INDEX, COUNT, 11'd1, IN_EN != 0, penable, pwrite, paddr};
    assign pready = 1'b1, pslverr = 1'b0, pin_watch_reset_n = pwdata[AXIS];
    assign {sync_out, irq, pin_high, pin_low, pin_chopper, pin_cs_n, pin_sclk, pin_temp_cs_n, pin_temp_sclk, pin_mod_clock}
        = free[14*AXIS +: 14];
endmodule
