// SPDX-License-Identifier: MIT
// Cells of SmartFusion2 as synth_sf2 maps to them, with the time that a signal takes to each input. Time is in ps. Every
// change passes, however short: nothing here swallows a pulse, as a real cell might.
`timescale 1ps / 1ps

// The way to an input: 300 ps with seed 0, else 100...500 ps by the seed.
module route(input wire in, output reg out);
    integer delay;
    initial begin
        delay = 300;
        #1 if (bench.seed != 0) delay = 100 + {$random(bench.draw)} % 401;
        #1 out <= in;   // a constant never changes
    end
    always @(in) out <= #(delay) in;
endmodule

module CFG1 #(parameter [1:0] INIT = 0) (output wire Y, input wire A);
    wire a;
    route to_a(A, a);
    assign Y = INIT >> a;
endmodule

module CFG2 #(parameter [3:0] INIT = 0) (output wire Y, input wire A, B);
    wire a, b;
    route to_a(A, a), to_b(B, b);
    assign Y = INIT >> {b, a};
endmodule

module CFG3 #(parameter [7:0] INIT = 0) (output wire Y, input wire A, B, C);
    wire a, b, c;
    route to_a(A, a), to_b(B, b), to_c(C, c);
    assign Y = INIT >> {c, b, a};
endmodule

module CFG4 #(parameter [15:0] INIT = 0) (output wire Y, input wire A, B, C, D);
    wire a, b, c, d;
    route to_a(A, a), to_b(B, b), to_c(C, c), to_d(D, d);
    assign Y = INIT >> {d, c, b, a};
endmodule

// a bit of a carry chain, which is fast
module ARI1 #(parameter [19:0] INIT = 0) (output wire Y, S, FCO, input wire A, B, C, D, FCI);
    wire a, b, c, d, carry;
    route to_a(A, a), to_b(B, b), to_c(C, c), to_d(D, d);
    assign #20 carry = FCI;
    wire f0 = INIT[{d, c, b}], f1 = INIT[8 + {d, c, b}];
    assign Y   = a ? f1 : f0;
    assign S   = carry ^ Y;
    assign FCO = INIT[19] || (INIT[18] && Y) ? carry : INIT[16] ? (INIT[17] ? f1 : f0) : INIT[17];
endmodule

// a flip-flop; this RTL uses neither latches nor asynchronous resets
module SLE(output reg Q, input wire ADn, ALn, CLK, D, LAT, SD, EN, SLn);
    wire d, sd, enable, load;
    route to_d(D, d), to_sd(SD, sd), to_enable(EN, enable), to_load(SLn, load);
    initial begin
        Q = 0;
        #1 if (LAT || !ALn) $display("a latch or an asynchronous reset");
    end
    always @(posedge CLK) if (enable) Q <= load ? d : sd;
endmodule
