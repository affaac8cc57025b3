// SPDX-License-Identifier: MIT
// Stands for adc_modulators.v in the proof of adc.v: codes, ends and trips at any time; while the clock's pin is low the codes
// are made of what reached it, each input at its own place.
module adc_modulators (
    input  wire        clk, rst_n, enable,
    input  wire [1:0]  osr, trip_osr,
    input  wire [4:0]  clocks,
    input  wire        start,
    output wire        pin_clock,
    input  wire [2:0]  pin_data,
    output wire        done,
    output wire [47:0] codes,
    input  wire [47:0] offsets,
    input  wire [16:0] limit,
    output wire        trip,
    output wire        trip_event
);
    (* anyseq *) reg [51:0] any;
    assign {pin_clock, done, trip, trip_event} = any[51:48];
    assign codes = pin_clock ? any[47:0]
        : offsets ^ {17'd0, limit, osr, trip_osr, clocks, enable, start, pin_data};
endmodule
