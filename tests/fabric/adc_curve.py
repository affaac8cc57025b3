# SPDX-License-Identifier: MIT
"""The curve of the winding's sensor (drivers/fabric/rtl/adc_curve.v), simulated for every code, against the exact one.

R(T) of a PT1000 by IEC 60751: 1000 (1 + A T + B T^2 + C (T - 100) T^3), C only below 0 degC. The sensor hangs below PULL_UP at
the converter's own supply, which is its reference, so that only the ratio counts.
"""
import subprocess
import tempfile
from pathlib import Path

A, B, C = 3.9083e-3, -5.775e-7, -4.183e-12
PULL_UP = 2200.0
PER_KELVIN, AT_0_C, LARGEST = 16, 800, 4095
CHORD = 32


def raw(celsius):
    """The converter's code, with its fraction."""
    ohm = 1000 * (1 + A * celsius + B * celsius ** 2 + (C * (celsius - 100) * celsius ** 3 if celsius < 0 else 0))
    return 4096 * ohm / (ohm + PULL_UP)


def celsius_of(code):
    low, high = -120.0, 400.0
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if raw(middle) < code else (low, middle)
    return low


def exact(code):
    """In codes of TEMP."""
    return AT_0_C + PER_KELVIN * celsius_of(code)


# the whole chords between the smallest TEMP that is not 0 and the largest that fits
FIRST = int(raw((1 - AT_0_C) / PER_KELVIN)) // CHORD + 1
LAST = int(raw((LARGEST - AT_0_C) / PER_KELVIN)) // CHORD - 1


def wanted(code):
    """On the chord between two rounded points of the exact curve, rounded down; 0 outside."""
    n, way = divmod(code, CHORD)
    if not FIRST <= n <= LAST:
        return 0
    start, end = round(exact(n * CHORD)), round(exact((n + 1) * CHORD))
    return start + (end - start) * way // CHORD


def judge(rtl):
    """(whether every code is right, a line that says so)."""
    with tempfile.TemporaryDirectory() as folder:
        binary = Path(folder) / "bench"
        subprocess.run(["iverilog", "-g2005", "-o", binary, Path(__file__).with_name("adc_curve_bench.v"),
                        Path(rtl) / "adc_curve.v"], check=True)
        shown = subprocess.run(["vvp", "-n", binary], capture_output=True, text=True, check=True).stdout.split()
    wrong = [code for code in range(4096) if shown[code:code + 1] != [str(wanted(code))]]
    if wrong:
        return False, f"FAIL curve: {shown[wrong[0]:wrong[0] + 1]} for code {wrong[0]}, not {wanted(wrong[0])}"
    inside = range(FIRST * CHORD, (LAST + 1) * CHORD)
    worst_kelvin = max(abs(int(shown[code]) - exact(code)) for code in inside) / PER_KELVIN
    return True, (f"PASS: curve: all codes; {LAST + 1 - FIRST} chords from {celsius_of(inside[0]):.0f} to "
                  f"{celsius_of(inside[-1] + 1):.0f} degC, at most {worst_kelvin:.2f} K off")
