// SPDX-License-Identifier: MIT
// What the top promises: an access reaches the axis of its address and no other, and without an axis reads 0; every pin goes to
// or comes from its own axis and place. formal/fabric_axis.v answers with what reached it.
reg f_ran = 1'b0;
always @(posedge clk) f_ran <= 1'b1;
always @* if (!f_ran) assume (!rst_n);

wire [3:0]  f_n    = paddr[13:10];
wire [41:0] f_free = {paddr[9:0], pwdata};      // 14 bits each of axis 0, 1, 2
wire [31:0] f_pins = {11'd0, f_free[13], pin_overcurrent[f_n], pin_driver_fault[f_n], pin_sto_a_n, pin_sto_b_n, pin_clock_ok,
                      pin_sdata[4*f_n +: 4], pin_temp_sdata[f_n], pin_mod_data[3*f_n +: 3], pin_a[f_n], pin_b[f_n],
                      pin_index[f_n], pin_lost[f_n], pin_hall[3*f_n +: 3]};
localparam [3:0] F_AXES = AXES;
wire [31:0] f_call = {f_n, F_AXES, 11'd1, f_n < AXES && IN_EN[f_n], penable, pwrite, paddr[9:0]};
reg  [31:0] f_answer;
always @(posedge clk)
    f_answer <= !rst_n || !psel || paddr[27:10] >= AXES ? 32'd0
        : paddr[3:2] == 2'd1 ? f_pins : paddr[3:2] == 2'd2 ? pwdata : f_call;
always @* if (f_ran) assert (prdata == f_answer);
always @* assert (pready && !pslverr);
always @* assert (pin_watch_reset_n == &pwdata[AXES-1:0]);  // any axis whose program hangs

genvar f_k;
generate for (f_k = 0; f_k < AXES; f_k = f_k + 1) begin : f_axis
    always @* assert ({irq[f_k], pin_high[3*f_k +: 3], pin_low[3*f_k +: 3], pin_chopper[f_k], pin_cs_n[f_k], pin_sclk[f_k],
                       pin_temp_cs_n[f_k], pin_temp_sclk[f_k], pin_mod_clock[f_k]} == f_free[14*f_k +: 13]);
end endgenerate
