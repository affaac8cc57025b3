# SPDX-License-Identifier: MIT
"""Writes drivers/fabric/rtl/adc_curve.v, or with --check says whether it is stale: codes of TEMP out of a PT1000's.

R(T) of IEC 60751: 1000 (1 + A T + B T^2 + C (T - 100) T^3), C only below 0 degC. The sensor hangs below PULL_UP at the
converter's own supply, which is its reference, so that only the ratio counts.
"""
import sys
from pathlib import Path

TARGET = Path(__file__).resolve().parents[2] / "drivers/fabric/rtl/adc_curve.v"
A, B, C = 3.9083e-3, -5.775e-7, -4.183e-12
PULL_UP = 2200.0
PER_KELVIN, AT_0_C, LARGEST = 16, 800, 4095
CHORD = 32


def raw(celsius):
    ohm = 1000 * (1 + A * celsius + B * celsius ** 2 + (C * (celsius - 100) * celsius ** 3 if celsius < 0 else 0))
    return 4096 * ohm / (ohm + PULL_UP)


def celsius_of(code):
    low, high = -120.0, 400.0
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if raw(middle) < code else (low, middle)
    return low


def exact(code):
    return AT_0_C + PER_KELVIN * celsius_of(code)


FIRST = int(raw(-50 + 1 / PER_KELVIN)) // CHORD + 1
LAST = int(raw((LARGEST - AT_0_C) / PER_KELVIN)) // CHORD - 1
CHORDS = {n: (round(exact(n * CHORD)), round(exact((n + 1) * CHORD)) - round(exact(n * CHORD)))
          for n in range(FIRST, LAST + 1)}


def curve(code):
    """What the hardware computes."""
    if code // CHORD not in CHORDS:
        return 0
    start, rise = CHORDS[code // CHORD]
    return start + (rise * (code % CHORD) // CHORD)


def text():
    rows = "\n".join(f"        7'd{n}: {{start, rise}} = {{12'd{start}, 8'd{rise}}};"
                     for n, (start, rise) in CHORDS.items())
    below, above = celsius_of(FIRST * CHORD), celsius_of((LAST + 1) * CHORD)
    return f"""// SPDX-License-Identifier: MIT
// Written by tests/fabric/adc_curve.py: change it there. From the code of a PT1000 below {PULL_UP:.0f} ohms, measured against
// its supply, to TEMP: 16 codes a kelvin, 800 at 0 degC. Chords of {CHORD} codes. Outside
// {below:.0f} ... {above:.0f} degC it is taken for broken or missing: 0.
module adc_curve (
    input  wire        clk,
    input  wire        rst_n,
    input  wire [11:0] code,
    output wire [11:0] temp         // a clock after the code
);
    reg [11:0] start, start_now;
    reg [7:0]  rise, rise_now;
    reg [4:0]  way;                 // along the chord
    always @*
        case (code[11:5])
{rows}
        default: {{start, rise}} = 20'd0;
        endcase

    always @(posedge clk)
        if (!rst_n)
            {{start_now, rise_now, way}} <= 25'd0;
        else
            {{start_now, rise_now, way}} <= {{start, rise, code[4:0]}};

    wire [12:0] risen = {{5'd0, rise_now}} * {{8'd0, way}};
    assign temp = start_now + {{4'd0, risen[12:5]}};

    wire unused = &{{1'b0, risen[4:0]}};
endmodule
"""


def worst_kelvin():
    return max(abs(curve(code) - exact(code)) for code in range(FIRST * CHORD, (LAST + 1) * CHORD)) / PER_KELVIN


if __name__ == "__main__":
    if "--check" in sys.argv:
        if TARGET.read_text(encoding="utf-8") != text():
            sys.exit("drivers/fabric/rtl/adc_curve.v is stale: run tests/fabric/adc_curve.py")
    else:
        TARGET.write_text(text(), encoding="utf-8")
    print(f"curve of the winding's sensor: {len(CHORDS)} chords, at most {worst_kelvin():.2f} K off")
