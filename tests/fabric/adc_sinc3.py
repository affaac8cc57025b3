# SPDX-License-Identifier: MIT
"""The sinc3 filters of the ADC block against exact arithmetic: the third power of a moving sum, in Python's integers.

Each case plays bits to the block in Icarus and compares every code of both paths with the moving sum of the bits that the
contract names: 3 OSR - 2 bits, from the first after the trigger on; the fast path all the time. The bits are an impulse, a
step, full scale, noise, and constant levels through a second-order modulator.
"""
import os
import random
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
RTL = Path(os.environ.get("MSSFOC_RTL", ROOT / "drivers/fabric/rtl"))
FILES = ("adc_modulators.v", "sinc3.v", "sinc3_comb.v")


def window(osr):
    taps = [1]
    for _ in range(3):
        taps = [sum(taps[max(0, n - osr + 1):n + 1]) for n in range(len(taps) + osr - 1)]
    return taps


def code(total, osr):
    """The sum over OSR cubed in 16 bits; all ones would be one more than fits."""
    return min(65535, total * 65536 // osr ** 3)


def modulated(level, length):
    """A second-order modulator of a level of 0...1."""
    first = second = 0.0
    for _ in range(length):
        bit = second >= 0
        first += level - bit
        second += first - bit + level
        yield int(bit)


def run(binary, bits, osr, trip_osr, clocks, every, limit, ones, folder):
    path = Path(folder) / "bits"
    path.write_text("\n".join(map(str, bits)) + "\n", encoding="ascii")
    plus = dict(osr=osr, trip_osr=trip_osr, clocks=clocks, every=every, limit=limit, length=len(bits) - 4, ones=ones, bits=path)
    shown = subprocess.run(["vvp", "-n", binary, *(f"+{k}={v}" for k, v in plus.items())], capture_output=True, text=True,
                           timeout=300, check=True).stdout
    return [line.split() for line in shown.splitlines() if line.split()[0] in ("start", "code", "trip", "event", "period")]


def lines_of(bits, ones):
    return bits, [1 - bit for bit in bits], [int(n >= ones) for n in range(len(bits))]


def moving(bits, taps, first):
    """Before the first bit the pins are 0."""
    if first < 0:
        return moving([0] * -first + bits, taps, 0)
    return sum(tap * bit for tap, bit in zip(taps, bits[first:first + len(taps)]))


def judge(rows, bits, osr, trip_osr, clocks, limit, ones):
    """(codes checked, trips checked), or AssertionError."""
    taps, trip_taps, lines = window(osr), window(trip_osr), lines_of(bits, ones)
    start, codes, trips, expected_events, events = None, 0, 0, 0, 0
    for what, *numbers in rows:
        numbers = [int(n) for n in numbers]
        if what == "start":
            start = numbers[0]
        elif what == "code":
            assert start is not None, "a code without a start"
            # bits are counted as they appear; the one that the pins show at the start is the first of the window
            wanted = [code(moving(line, taps, start - 1), osr) for line in lines]
            assert numbers[1:] == wanted, f"code {numbers}: wanted {wanted} (started at bit {start})"
            assert start + 3 * osr <= numbers[0] <= start + 3 * osr + 2, f"code at bit {numbers[0]}, started at {start}"
            start, codes = None, codes + 1
        elif what == "trip":
            # where the window lies is not promised to the bit: the integrators delay it by two
            found = [first for first in range(numbers[0] - 3 * trip_osr - 4, numbers[0] - 3 * trip_osr + 4)
                     if first >= -1 and numbers[1:] == [code(moving(line, trip_taps, first), trip_osr) for line in lines]]
            assert found, f"trip path {numbers} is of no window"
            assert trips < 2 or numbers[0] - last == trip_osr, f"trip path after {numbers[0] - last} bits"
            last, trips = numbers[0], trips + 1
            expected_events += any(abs(n - 32768) > limit for n in numbers[1:])
        elif what == "event":
            events += 1
        elif what == "period":
            assert numbers[0] == 10 * max(5, clocks), f"modulators' period of {numbers[0]} ns with {clocks} clocks"
    assert abs(events - expected_events) <= 1, f"{events} trips, wanted {expected_events}"
    assert codes and trips
    return codes, trips


def cases():
    rng = random.Random(3)
    for n, osr in enumerate((32, 64, 128, 256)):
        trip = (8, 16, 32, 32)[n]
        length = 3 * osr * 5 + 40
        impulse = [0] * length
        impulse[3 * osr + 20 + osr] = 1
        yield "impulse", impulse, osr, trip, n, (5, 6, 20, 3)[n], 40000, length
        yield "step", [int(k > 4 * osr + 17) for k in range(length)], osr, trip, n, 5, 20000, 0
        yield "full scale", [1] * length, osr, trip, n, 5, 32766, length
        yield "noise", [rng.getrandbits(1) for _ in range(length)], osr, trip, n, 7, 9000, length // 2
        for level in (0.1, 0.5, 0.77):
            yield f"level {level}", list(modulated(level, length)), osr, trip, n, 5, 15000, length


def settling(binary, folder):
    """A step at the trigger is whole in the first code after it: nothing older than 3 OSR bits counts."""
    length = 64 * 12
    for shift in (-3, -1, 3):      # the first three taps are 1, 3, 6 of OSR cubed: less than a code together before the third
        bits = [int(k >= 64 * 4 + shift) for k in range(length)]
        rows = run(binary, bits, 1, 1, 5, 64 * 4, 40000, length, folder)
        starts = [int(r[1]) for r in rows if r[0] == "start"]
        first = next(r for r in rows if r[0] == "code" and int(r[1]) > starts[0])
        if 64 * 4 + shift <= starts[0] - 1:
            assert int(first[2]) == 65535, f"step {shift} bits from the trigger: {first}"
        else:
            assert int(first[2]) < 65535, f"step {shift} bits from the trigger: {first}"


def main():
    codes = trips = done = 0
    with tempfile.TemporaryDirectory() as folder:
        binary = Path(folder) / "bench"
        subprocess.run(["iverilog", "-g2005", "-o", binary, Path(__file__).with_name("adc_sinc3_bench.v"),
                        *(RTL / f for f in FILES)], check=True)
        for name, bits, osr, trip, n, clocks, limit, ones in cases():
            rows = run(binary, bits, n, n, clocks, 3 * osr + 11, limit, ones, folder)
            try:
                more = judge(rows, bits, osr, trip, clocks, limit, ones)
            except AssertionError as fault:
                sys.exit(f"FAIL sinc3: {name}, OSR {osr}: {fault}")
            codes, trips, done = codes + more[0], trips + more[1], done + 1
        try:
            settling(binary, folder)
        except AssertionError as fault:
            sys.exit(f"FAIL sinc3: settling: {fault}")
    print(f"PASS: sinc3: {done} streams, {3 * codes} results and {3 * trips} values of the fast path exact")


if __name__ == "__main__":
    main()
