# SPDX-License-Identifier: MIT
"""Hall switches on the hoverboard's wheel, the encoder's lines cut: switches out of place, their hysteresis, wires exchanged,
inverted and broken. The angle is judged by the plant."""
import re

import numpy as np
import pytest
from launcher.simulate import simulate

from rigs.steps import rpm

MOTOR = "hoverboard_350w"
LEARNS_S, IDEAL = 10.5, "513264"


def play(tmp_path, steps, end_s, before=(), **more):
    """Steps after `on`; console lines and events before it."""
    first = [{"t_s": 0.1, "event": "encoder_cut", "args": ["1"]}, {"t_s": 0.11, "console": "set angle_source 2"}]
    first += [{"t_s": 0.12 + 0.001 * n, **step} for n, step in enumerate(before)]
    plan = {"title": "Hall switches", "preamble_s": 0.05, "end_s": end_s, "step": [*first, *steps],
            "figure": [{"name": "faults", "kind": "all_faults"}]}
    return simulate(plan, MOTOR, out_dir=tmp_path, **more)


def event(name, *args):
    return {"event": name, "args": list(args)}


def window(result, begin, end):
    names, t = result.scenario.names, result.trace["t_s"]
    seen = (t >= names[begin[0]] + begin[1]) & (t < names[end[0]] + end[1])
    return {name: column[seen] for name, column in result.trace.items()}


def angle_deg(seen):
    off = seen["angle_fw_rad"] - 15 * seen["theta_mech_rad"]
    return np.degrees((off + np.pi) % (2 * np.pi) - np.pi)


def test_wires_exchanged_and_inverted_are_learned_and_load_and_reversal_are_borne(tmp_path):
    """From `learn hall` on: full load by step, and a reversal through zero under it. Edges within 2 degrees, and the angle
    within what is left of the hysteresis and them."""
    steps = [{"t_s": 0.2, "label": "learn", "console": "learn hall"},
             *({"t_s": f"learn + {LEARNS_S + 0.01 * n}", "console": f"get hall_{name}"}
               for n, name in enumerate(("states", *(f"edge_{k}_cdeg" for k in range(1, 7))))),
             {"t_s": f"learn + {LEARNS_S + 0.1}", "label": "on", "console": "on"},
             {"t_s": "on + 0.5", "label": "started", "hold_for": "OPERATION_ENABLED"},
             {"t_s": "started + 0.02", "label": "up", "console": "speed 200"},
             {"t_s": "up + 0.7", "label": "load", "event": "load_nm", "args": ["4"]},
             {"t_s": "load + 0.6", "label": "back", "console": "speed -200"},
             {"t_s": "back + 1.6", "label": "stop", "console": "status"}]
    result = play(tmp_path, steps, "stop + 0.02", [event("hall_swap", "BC"), event("hall_invert", "A", "1")], seed=3)
    assert result.figures["faults"].value == "NONE" and "state: operation enabled" in result.console
    found = {name: value for name, value in re.findall(r"hall_(\w+) = (\d+)", result.console)}
    ring = [sum(((int(s) >> k) & 1) << wire for wire, k in enumerate((0, 2, 1))) ^ 1 for s in IDEAL]
    learned = [int(digit) for digit in f"{int(found['states']):06d}"]
    turn = learned.index(ring[0])
    assert learned[turn:] + learned[:turn] == ring
    plant = [59.03, 123.36, 176.67, 239.03, 303.35, 356.68]  # seed 3, middle of both ways; the first begins ring[1]
    edges = [int(found[f"edge_{n + 1}_cdeg"]) / 100 for n in range(6)]
    edges = edges[turn:] + edges[:turn]
    assert max(abs((edges[(n + 1) % 6] - plant[n] + 180) % 360 - 180) for n in range(6)) < 2
    for begin, end in ((("up", 0.4), ("load", 0)), (("load", 0.3), ("back", 0)), (("back", 1.0), ("stop", 0))):
        off = angle_deg(window(result, begin, end))
        assert np.sqrt((off**2).mean()) < 3 and np.abs(off).max() < 6
    whole = angle_deg(window(result, ("up", 0.1), ("stop", 0)))
    assert np.sqrt((whole**2).mean()) < 8 and np.abs(whole).max() < 60, "through zero, too"
    assert rpm(window(result, ("load", 0), ("back", 0))).min() > 150
    assert rpm(window(result, ("back", 1.4), ("stop", 0))).mean() == pytest.approx(-200, abs=4)


def operation(happens, speed_rpm=200):
    return [{"t_s": 0.2, "label": "on", "console": "on"},
            {"t_s": "on + 1.0", "label": "started", "hold_for": "OPERATION_ENABLED"},
            {"t_s": "started + 0.02", "label": "up", "console": f"speed {speed_rpm}"}, *happens]


@pytest.mark.parametrize("start_angle", (10, 130, 275))
def test_it_starts_from_any_angle_under_half_the_load(start_angle, tmp_path):
    """No alignment: the shaft turns at once, the right way, and no further back than a load takes it before it shows."""
    steps = operation([{"t_s": "up + 1.0", "label": "end", "console": "status"}], 100)
    result = play(tmp_path, steps, "end + 0.02", [event("load_coulomb", "2")], start_angle=start_angle, seed=2)
    assert result.figures["faults"].value == "NONE"
    turned = window(result, ("up", 0), ("end", 0))["theta_mech_rad"]
    assert (turned - turned[0]).min() * 15 > -np.radians(30)
    assert rpm(window(result, ("up", 0.8), ("end", 0))).mean() == pytest.approx(100, rel=0.05)


def test_a_wire_that_breaks_is_found_within_a_turn_and_the_drive_comes_back(tmp_path):
    """Half an electrical turn at 200 rpm are 10 ms; then the bridge is off. With the wire whole again a retry goes on."""
    happens = [{"t_s": "up + 0.6", "label": "broken", **event("hall_open", "B", "1")},
               {"t_s": "broken + 0.03", **event("hall_open", "B", "0")},
               {"t_s": "broken + 0.9", "label": "end", "console": "status"}]
    result = play(tmp_path, operation(happens), "end + 0.02",
                  [{"console": "set retry_count 1"}, {"console": "set retry_delay_ms 50"}], seed=1)
    assert "Hall state" in result.console and result.figures["faults"].value == "HALL_INVALID"
    broken = window(result, ("broken", 0), ("broken", 0.05))
    off_s = broken["t_s"][broken["gate_live"] < 0.5][0] - result.scenario.names["broken"]
    assert off_s < 0.022 and not (broken["gate_live"][broken["t_s"] > broken["t_s"][0] + 0.022] > 0.5).any()
    assert rpm(window(result, ("end", -0.1), ("end", 0))).mean() == pytest.approx(200, rel=0.05), "caught while it turned"


def test_two_wires_exchanged_end_with_the_bridge_off(tmp_path):
    result = play(tmp_path, operation([{"t_s": "up + 0.8", "label": "end", "console": "status"}]), "end + 0.02",
                  [event("hall_swap", "AB")], seed=1)
    assert result.figures["faults"].value in ("HALL_SEQUENCE", "SPEED_DEVIATION", "STALL", "OVERSPEED")
    assert result.trace["gate_live"][-1] < 0.5 and np.abs(rpm(window(result, ("up", 0), ("end", 0)))).max() < 200
