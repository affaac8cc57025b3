# SPDX-License-Identifier: MIT
"""The drive measures its own loops as it runs, and finds what an analyser finds that it knows nothing of: the twin's sweep adds
a sine to what the sensors see and looks at the true currents."""
import re

import pytest

from launcher import simulate
from launcher.data import read_toml
from launcher.paths import SCENARIOS

from rigs.steps import typed

LASTS_S = 3.0  # a sweep of the currents, at most
READ = {"bandwidth": r"closed loop, -3 dB: ([\d.]+) Hz", "lag": r"closed loop, -90 degrees: ([\d.]+) Hz",
        "margin": r"phase margin: ([\d.]+) degrees"}

SEEN = {"bandwidth": "bandwidth of i_{}, -3 dB", "lag": "bandwidth of i_{}, -90 degrees", "margin": "phase margin of i_{}"}


def plan_of(amplitude_a):
    """The analyser's sweep of both axes, then the drive's own, with the rotor held at the same place and the same current."""
    plan = {"key": "sweep", **read_toml(SCENARIOS / "current_sweep.toml")}
    for step in plan["step"]:
        if step.get("label") == "off":
            step["t_s"] = f"d_end + {2 * LASTS_S + 0.1}"
    for n, axis in enumerate("qd"):
        begins = f"d_end + {0.02 + n * LASTS_S}"
        plan["step"] += [typed(begins, f"sweep {axis} {amplitude_a:.3f}"), typed(f"{begins} + {LASTS_S - 0.1}", "sweep read")]
    return plan


def read(said):
    """{axis: {what: value}}"""
    parts = re.split(r"sweep: done, loop: (\w), .*\n", said)
    return {axis: {what: float(re.search(form, part)[1]) for what, form in READ.items()}
            for axis, part in zip(parts[1::2], parts[2::2])}


@pytest.mark.parametrize("motor, amplitude_a", [
    ("teknic_m2310p", 0.5), ("estun_emj04apb22", 0.3),
    ("maxon_ec45flat", 0.3), ("hoverboard_350w", 1.0)])
def test_the_drive_finds_what_an_analyser_finds(tmp_path, motor, amplitude_a):
    result = simulate(plan_of(amplitude_a), motor=motor, out_dir=tmp_path, aligned=True)
    found = read(result.console)
    assert result.console.count("done: sweep; 'sweep read' has the result") == 2
    for axis, own in found.items():
        for what, name in SEEN.items():
            twins = result.figures[name.format(axis)].value
            near = {"abs": 2.0} if what == "margin" else {"rel": 0.03}
            assert own[what] == pytest.approx(twins, **near), (axis, what)
    assert set(found) == {"q", "d"}
