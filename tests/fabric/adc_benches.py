# SPDX-License-Identifier: MIT
"""Simulations of the ADC block where a proof does not fit, and the faults that they must notice.

adc_benches.py            the converters' frames at nanoseconds, the sinc3 filters against exact arithmetic, the sensor's curve
adc_benches.py --faults   each fault below in a copy of the RTL: the bench named beside it must fail
"""
import os
import shutil
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import adc_curve
from places import RTL, includes

HERE = Path(__file__).resolve().parent
ADC = ("adc", "adc_spi", "adc_valid", "adc_math", "adc_multiply", "adc_modulators", "sinc3", "sinc3_comb", "adc_curve")

# (file, text, other text, bench): no proof covers these lines
FAULTS = (
    ("adc_spi", "sclk  <= !edges_now[0];", "sclk  <= edges_now[0];", "frames"),
    ("adc_spi", "left <= left - 2'd1;", "left <= 2'd0;", "frames"),
    ("adc_spi", "edges_now == LAST_FALL;", "edges_now == LAST_FALL - 6'd2;", "frames"),
    ("adc", "{spi_codes[35:24], 4'd0}", "{spi_codes[47:36], 4'd0}", "frames"),
    ("adc", ".HALF(4), .FALLS(16)", ".HALF(1), .FALLS(16)", "frames"),
    ("adc", ".HALF(4), .FALLS(16)", ".HALF(4), .FALLS(15)", "frames"),
    ("adc", ".start(busy && there)", ".start(busy)", "frames"),
    ("adc", "of_modulators <= modulators && (accept || of_modulators);", "of_modulators <= modulators;", "frames"),
    ("adc", "if (temp_looked_up[2])\n                temp_next <= temp_code;", "temp_next <= temp_code;", "frames"),
    ("adc_multiply", "29'sd1024", "29'sd3072", "frames"),
    ("adc_multiply", "{4{gain[7]}}", "4'b0000", "frames"),
    ("sinc3", "second + first", "second + first + {24'd0, data}", "sinc3"),
    ("sinc3", "integral + second", "integral + first", "sinc3"),
    ("sinc3_comb", "ready <= step == 2'd3", "ready <= step == 2'd2", "sinc3"),
    ("sinc3_comb", "{value, former_2, former_1}", "{former_0, former_2, former_1}", "sinc3"),
    ("adc_modulators", "takes <= 3'd4;", "takes <= 3'd3;", "sinc3"),
    ("adc_modulators", "osr >= 2'd1, 5'b11111", "osr >= 2'd1, 5'b11110", "sinc3"),
    ("adc_modulators", "value[18] ? 16'hFFFF : value[17:2]", "value[17:2]", "sinc3"),
    ("adc_modulators", "warm != 3'd4", "warm != 3'd3", "sinc3"),
    ("adc_modulators", "warm == 3'd4", "warm >= 3'd3", "sinc3"),
    ("adc_modulators", "magnitude > limit", "magnitude < limit", "sinc3"),
    ("adc_modulators", "3'd2:    {code, offset} <= {trip_codes[47:32]", "3'd2:    {code, offset} <= {trip_codes[15:0]",
     "sinc3"),
    ("adc_modulators", "clocks < 5'd5 ? 5'd4", "clocks < 5'd5 ? 5'd3", "sinc3"),
    ("adc_modulators", "strobe <= pin_clock && count == 5'd0;", "strobe <= pin_clock && count == 5'd2;", "sinc3"),
    ("adc_curve", "12'd2314, 8'd192", "12'd2315, 8'd192", "curve"),
    ("adc_curve", "default: {start, rise} = 20'd0", "default: {start, rise} = 20'd256", "curve"),
    ("adc_curve", "{start, rise, code[4:0]};", "{start, rise, code[4:1], 1'b0};", "curve"),
    ("adc_curve", "risen[12:5]}", "risen[11:4]}", "curve"),
    ("adc_curve", "middle, 2'b00}", "middle, 1'b0}", "curve"),
    ("adc_curve", "& {8{way[4]}}", "& {8{way[3]}}", "curve"),
)


def frames(rtl, conversions=2000):
    with tempfile.TemporaryDirectory() as folder:
        binary = Path(folder) / "bench"
        built = subprocess.run(["iverilog", "-g2005", *includes(rtl), f"-Pbench.CONVERSIONS={conversions}", "-o",
                                binary, HERE / "adc_bench.v", *(Path(rtl) / f"{name}.v" for name in ADC)],
                               capture_output=True, text=True)
        if built.returncode:
            return False, "FAIL " + built.stderr
        shown = subprocess.run(["vvp", "-n", binary], capture_output=True, text=True, timeout=300).stdout
        return "PASS" in shown, shown.strip().replace("PASS: ", "PASS: frames: ")


def sinc3(rtl):
    run = subprocess.run([sys.executable, HERE / "adc_sinc3.py"], env={**os.environ, "MSSFOC_RTL": str(rtl)},
                         capture_output=True, text=True, timeout=300)
    return run.returncode == 0, (run.stdout + run.stderr).strip()


BENCHES = {"frames": lambda rtl: frames(rtl, 300), "sinc3": sinc3, "curve": adc_curve.judge}


def noticed(fault):
    name, old, new, bench = fault
    text = (RTL / f"{name}.v").read_text(encoding="utf-8")
    if text.count(old) != 1:
        return None
    with tempfile.TemporaryDirectory() as folder:
        rtl = Path(folder) / "rtl"
        shutil.copytree(RTL, rtl)
        (rtl / f"{name}.v").write_text(text.replace(old, new), encoding="utf-8")
        return not BENCHES[bench](rtl)[0]


def faults():
    with ThreadPoolExecutor(2) as pool:
        found = list(pool.map(noticed, FAULTS))
    for (name, old, new, _), how in zip(FAULTS, found):
        if not how:
            print(f"benches {name}: {'NOT FOUND' if how is None else 'SURVIVES'} {old!r} -> {new!r}")
    print(f"benches: {found.count(True)} of {len(found)} faults noticed")
    return 0 if all(found) else 1


def main():
    if "--faults" in sys.argv:
        return faults()
    good = True
    for passed, line in (frames(RTL), sinc3(RTL), adc_curve.judge(RTL)):
        good = good and passed
        print(line)
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
