// SPDX-License-Identifier: MIT
// The whole fabric: AXES axes (1...15) on one APB3 port of FIC_0, axis k at its base + 0x400 k. The pins of axis k are
// element k, or the k-th group, of their vectors. Axis 0 leads the carriers: the others can start at its valley. IN_EN,
// a bit for each axis: see fabric_axis.v.
module fabric #(parameter AXES = 1, parameter IN_EN = 0) (
    input  wire                clk,         // PCLK, 100 MHz
    input  wire                rst_n,       // low while the MSS is in reset; released with clk
    input  wire                psel,
    input  wire                penable,
    input  wire                pwrite,
    input  wire [27:0]         paddr,
    input  wire [31:0]         pwdata,
    output wire [31:0]         prdata,
    output wire                pready,
    output wire                pslverr,
    output wire [AXES-1:0]     irq,         // to MSS_INT_F2M
    output wire [3*AXES-1:0]   pin_high,    // C, B, A
    output wire [3*AXES-1:0]   pin_low,
    output wire [AXES-1:0]     pin_chopper,
    output wire                pin_watch_reset_n,   // 0: the program hangs; may reset the MSS
    input  wire [AXES-1:0]     pin_overcurrent,
    input  wire [AXES-1:0]     pin_driver_fault,
    input  wire                pin_sto_a_n,
    input  wire                pin_sto_b_n,
    input  wire                pin_clock_ok,
    output wire [AXES-1:0]     pin_cs_n,
    output wire [AXES-1:0]     pin_sclk,
    input  wire [4*AXES-1:0]   pin_sdata,
    output wire [AXES-1:0]     pin_temp_cs_n,
    output wire [AXES-1:0]     pin_temp_sclk,
    input  wire [AXES-1:0]     pin_temp_sdata,
    output wire [AXES-1:0]     pin_mod_clock,
    input  wire [3*AXES-1:0]   pin_mod_data,
    input  wire [AXES-1:0]     pin_a,
    input  wire [AXES-1:0]     pin_b,
    input  wire [AXES-1:0]     pin_index,
    input  wire [AXES-1:0]     pin_lost,
    input  wire [3*AXES-1:0]   pin_hall
);
    wire [32*AXES-1:0] axis_prdata;
    wire [AXES-1:0]    axis_pready, axis_pslverr, valleys, watch_resets_n;

    genvar k;
    generate
        for (k = 0; k < AXES; k = k + 1) begin : axis
            localparam [17:0] HERE = k;
            fabric_axis #(.AXIS(k), .AXES(AXES), .IN_EN((IN_EN >> k) & 1)) one (
                .clk(clk), .rst_n(rst_n), .psel(psel && paddr[27:10] == HERE), .penable(penable), .pwrite(pwrite),
                .paddr(paddr[9:0]), .pwdata(pwdata), .prdata(axis_prdata[32*k +: 32]), .pready(axis_pready[k]),
                .pslverr(axis_pslverr[k]), .irq(irq[k]), .sync_in(valleys[0]), .sync_out(valleys[k]),
                .pin_high(pin_high[3*k +: 3]), .pin_low(pin_low[3*k +: 3]), .pin_chopper(pin_chopper[k]),
                .pin_watch_reset_n(watch_resets_n[k]),
                .pin_overcurrent(pin_overcurrent[k]), .pin_driver_fault(pin_driver_fault[k]), .pin_sto_a_n(pin_sto_a_n),
                .pin_sto_b_n(pin_sto_b_n), .pin_clock_ok(pin_clock_ok), .pin_cs_n(pin_cs_n[k]), .pin_sclk(pin_sclk[k]),
                .pin_sdata(pin_sdata[4*k +: 4]), .pin_temp_cs_n(pin_temp_cs_n[k]), .pin_temp_sclk(pin_temp_sclk[k]),
                .pin_temp_sdata(pin_temp_sdata[k]), .pin_mod_clock(pin_mod_clock[k]), .pin_mod_data(pin_mod_data[3*k +: 3]),
                .pin_a(pin_a[k]), .pin_b(pin_b[k]), .pin_index(pin_index[k]), .pin_lost(pin_lost[k]),
                .pin_hall(pin_hall[3*k +: 3]));
        end
    endgenerate

    // an axis that is not selected says 0, and so does an address without an axis
    reg     [31:0] value;
    integer        i;
    always @* begin
        value = 32'd0;
        for (i = 0; i < AXES; i = i + 1)
            value = value | axis_prdata[32*i +: 32];
    end
    assign prdata  = value;
    assign pin_watch_reset_n = &watch_resets_n;
    assign pready  = &axis_pready;
    assign pslverr = |axis_pslverr;

    wire unused = &{1'b0, valleys};

`ifdef FORMAL
`include "formal/fabric.vh"
`endif
endmodule
