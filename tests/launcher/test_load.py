# SPDX-License-Identifier: MIT
"""CPU load: what a log of interrupts with known contents adds up to, in the report and in report.json."""
import json

import numpy as np
import pytest

from launcher import LauncherError, simulate
from launcher.load import COLUMNS, cpu_load, load_irqlog, load_lines
from launcher.report import print_report, write_json


def log(rows):
    """rows: (t_s, exception, cycles, latency)."""
    empty = {name: np.zeros(len(rows)) for name in COLUMNS}
    for index, name in enumerate(("t_s", "exception", "cycles", "latency_cycles")):
        empty[name] = np.array([row[index] for row in rows], float)
    return empty


def test_shares_add_up():
    rows = [(n * 50e-6, 50, 600 + 100 * (n % 2), 500 + n % 3) for n in range(101)]
    rows += [(n * 1e-3 + 1e-6, 30, 2000, 0) for n in range(5)] + [(2e-3, 26, 5000, 0), (9.0, 26, 99999, 0)]
    load = cpu_load(log(rows), 50e-6)
    # 100 whole periods of 5000 cycles; the last interrupt ends the window, and what comes after it does not count
    assert load.current_loop.percent == pytest.approx(100 * 650 / 5000)
    assert load.slow_loop.percent == pytest.approx(100 * 5 * 2000 / 500000)
    assert load.other_interrupts.percent == pytest.approx(1.0) and load.other_interrupts.max_cycles == 5000
    assert load.rest_percent == pytest.approx(100 - 13 - 2 - 1)
    assert load.current_loop.max_cycles == 700 and load.latency_max_cycles == 502
    assert load.highest_pwm_hz == pytest.approx(100e6 / 1400)


def test_without_the_current_loop():
    assert cpu_load(log([(0.1, 26, 70, 0)]), 50e-6) is None
    assert load_lines(None) == ["CPU load: the current loop did not run"]


def test_in_the_report(build, fake_qemu):
    result = simulate({"key": "load", "end_s": 0.1}, build=build, qemu=fake_qemu())
    lines = []
    print_report(result, lines.append)
    text = "\n".join(lines)
    assert "CPU load at 20 kHz PWM" in text and "up to 71.4 kHz PWM" in text and "rest" in text
    write_json(result, build / "report.json")
    values = json.loads((build / "report.json").read_text())["cpu_load"]
    assert values["current_loop"]["percent"] == pytest.approx(13.5, abs=0.01)
    assert values["slow_loop"]["percent"] == pytest.approx(0.4, abs=0.01)


@pytest.mark.parametrize("names, numbers, complaint", [
    (("t_s", "exception"), 2, "has other columns"),
    (COLUMNS, 2 * len(COLUMNS) - 1, "is damaged"),
])
def test_a_log_that_is_none(tmp_path, names, numbers, complaint):
    (tmp_path / "irq.bin").write_bytes(",".join(names).encode() + b"\n" + np.ones(numbers).tobytes())
    with pytest.raises(LauncherError, match=complaint):
        load_irqlog(tmp_path / "irq.bin")
    with pytest.raises(LauncherError, match="cannot read"):
        load_irqlog(tmp_path / "none.bin")
