# SPDX-License-Identifier: MIT
"""README's figures and its table of what the drive drives: from the pages that `make bench` and `make results` have written,
and from the ranges in the sources.

usage: front.py            writes both between the lines that mark them
"""
import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "qemu"), str(ROOT / "tests/tools"), str(ROOT / "firmware/tables"), str(ROOT / "linker/bounds")]

from launcher.data import INVERTERS, MOTORS, available, read_toml  # noqa: E402
from launcher.rules import LARGEST_HZ  # noqa: E402

from pages import replace_block  # noqa: E402
from rows import param_rows  # noqa: E402


def found(pattern, path):
    """The groups of what stands once in a file."""
    match = re.search(pattern, (ROOT / path).read_text(), re.S)
    if not match:
        raise SystemExit(f"mssfoc: {path} has nothing like '{pattern}'")
    return match.groups()


def block(path, name):
    return found(rf"<!-- {name}: .*?-->\n(.*?)<!-- end -->", path)[0]


def nominal_and_worst(row):
    """Of a row of the current loop's table: its largest nominal cycles, and with all that is known as a range at its worst."""
    return found(rf"\n\| `{re.escape(row)}` \|(?: \d+ \|){{3}} (\d+) \| \d+ \| (\d+) \|", "docs/benchmarks.md")


def figures():
    latency, share, hz = found(
        r"\*\*(\d+) cycles from exception entry to the last PWM write, .*?([\d.]+) % of the core at (\d+) kHz\.",
        "docs/benchmarks.md")
    (usual, encoder), (usual_observer, observer), (_, largest) = map(
        nominal_and_worst, ("current_loop.interrupt", "handler.observer_ab", "handler.overmodulating_ab"))
    rows = re.findall(r"^\| [^|]+ \| ([\d.]+) / ([\d.]+) %", block("docs/results.md", "drive"), re.M)
    bandwidth, margin = re.search(r"(\d+) Hz at -90°, phase margin (\d+)°", block("docs/results.md", "quickest")).groups()
    return (f"- **{encoder} cycles** with an encoder, **{observer}** without a sensor: the whole current-loop interrupt, at"
            f" worst ({usual} and\n  {usual_observer} nominal); with an encoder {share} % of a 100 MHz core at {hz} kHz,"
            f" {latency} until the PWM is written; {largest} in\n  overmodulation"
            f" ([benchmarks](docs/benchmarks.md), in the twin's cycle model)\n"
            f"- **{int(bandwidth) / 1000:.1f} kHz** closed current loop at -90°, phase margin {margin}°, with two samples a PWM"
            f" period\n  ([results](docs/results.md#the-current-loop))\n"
            f"- **{max(float(mean) for mean, _ in rows):.3f} %** mean speed error at rated load, the worst of"
            f" {len(rows)} motors ([results](docs/results.md#the-drive), full plant, seed 1)\n")


def span(folder, table, key):
    """Smallest and largest of a key in the files of a folder."""
    values = [read_toml(folder / f"{name}.toml")[table][key]["value"] for name in available(folder)]
    return f"{min(values):g} to {max(values):g}"


def limits():
    param = param_rows()
    slowest, = found(r"CONFIG_PWM_HZ >= (\d+)", "firmware/settings/config.h")
    quickest, = found(r"CONFIG_LOOP_HZ_MAX (\d+)", "firmware/settings/rates.h")
    usual, = found(r"define CONFIG_PWM_HZ (\d+)", "firmware/settings/rates.h")
    rows = [
        ("motors", "one, or two with AXES=2, three-phase, magnets on or in the rotor, reluctance with magnets;"
         f" {param['pole_pairs'][0]} to {param['pole_pairs'][1]} pole pairs", "induction, stepper, brushed, no magnets"),
        ("rotor angle", f"A/B encoder of {param['encoder_counts'][0]} to {param['encoder_counts'][1]} counts, index or not;"
         " three Hall switches; no sensor", "resolver, sin/cos, SSI, BiSS, EnDat"),
        ("current sensors", "three: shunts under the low sides, in line, or isolated modulators", "one shunt in the bus"),
        ("bus voltage", f"simulated {span(INVERTERS, 'supply', 'vbus_v')} V; parameters to {param['v_range_mv'][1] // 1000} V",
         "mains rectifier, power factor"),
        ("phase current", f"simulated {span(MOTORS, 'rating', 'rated_current_a')} A rated (peak of the sine); parameters to"
         f" {param['i_range_ma'][1] // 1000} A", ""),
        ("electrical frequency", f"to {LARGEST_HZ:g} Hz at {int(usual) // 1000} kHz PWM", "beyond"),
        ("PWM", f"{int(slowest) // 1000} to {int(quickest) // 1000} kHz; one sample a period, or two up to"
         f" {int(quickest) // 2000} kHz; weakened field, overmodulation", ""),
        ("buses", f"console on a UART; Modbus RTU to {param['modbus_baud'][1]} baud and CANopen, both with the objects of"
         " CiA 402", "EtherCAT"),
        ("safety", "STO inputs and over-current cut the gates in hardware; supervision, watchdog", "no certificate, no SIL"),
        ("host", "Debian 12 and 13; Ubuntu 24.04 not tried", "Windows, macOS (the library needs a cross compiler only)"),
        ("silicon", "M2S010, M2S025: register facts from public sources", "**not run on silicon yet**"),
    ]
    return "| | it drives | it does not |\n|---|---|---|\n" + "".join(f"| {' | '.join(row)} |\n" for row in rows)


def blocks():
    return {"figures": figures(), "limits": limits()}


def write():
    for name, text in blocks().items():
        replace_block(ROOT / "README.md", name, text)


if __name__ == "__main__":
    write()
