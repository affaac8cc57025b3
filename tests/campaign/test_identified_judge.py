# SPDX-License-Identifier: MIT
"""PART=identified and the map of PART=identify: what is judged right passes, and each way to be wrong fails."""
import re
from types import SimpleNamespace

import numpy as np
import pytest

from launcher import part_identified, part_identify
from launcher.drive import load_drive, twin_items
from launcher.errors import LauncherError
from launcher.figures import Figure
from launcher.part import PartCase
from launcher.parts import plan_part
from launcher.paths import REPO

TOLD = {"resistance_mohm": 1000, "ld_uh": 1000, "lq_uh": 1000}
CONSOLE = """> identify use
3 parameters changed; 'get all' lists them, 'on' takes them
> get resistance_mohm
resistance_mohm = 267 mohm  (1...100000)
> get ld_uh
ld_uh = 4928 uH  (1...1000000)
> get lq_uh
lq_uh = 1000 uH  (1...1000000)
> get cross_pm
cross_pm = -110 0.1 %  (-249...249)
"""


# ---- identified against nominal ----

def figures(share=1.0, **other):
    """All figures of the default scenario that are compared, times a share."""
    values = {name: 10.0 * share for name in part_identified.ALIKE} | other
    return {name: Figure(name, "kind", value, "%", "") for name, value in values.items()}


def test_what_identify_has_changed_is_known_and_what_it_has_refused_stays_nominal():
    assert part_identified.known_of(CONSOLE, TOLD) == {"resistance_mohm": 267, "ld_uh": 4928}
    assert part_identified.known_of(CONSOLE, TOLD | {"cross_pm": 0})["cross_pm"] == -110
    assert part_identified.known_of("> identify use\nerror: identify has not run\n", TOLD) == {}
    twice = CONSOLE + CONSOLE.replace("4928", "5000")
    assert part_identified.known_of(twice, TOLD)["ld_uh"] == 5000, "the last one counts"


@pytest.mark.parametrize("share, passed", ((0.5, True), (1.0, True), (1.04, True), (1.3, False)))
def test_each_figure_is_as_good_or_better(share, passed):
    verdict = part_identified.judge(figures(share), figures(), {"ld_uh": 1})
    assert verdict.passed == passed and verdict.outcome == ("as good" if passed else "worse")
    assert verdict.figures["parameters identified"] == 1


@pytest.mark.parametrize("name", part_identified.ALIKE)
def test_one_that_is_worse_is_named(name):
    share, least = part_identified.ALIKE[name]
    worse = part_identified.judge(figures(**{name: 10 * (1 + share) + least + 0.01}), figures(), {})
    assert not worse.passed and worse.why.startswith(f"{name}: ") and ";" not in worse.why
    assert part_identified.judge(figures(**{name: 10 * (1 + share) + least - 0.01}), figures(), {}).passed


def test_a_speed_that_does_not_recover_is_worse_unless_the_nominal_one_does_not_either():
    name = "recovery to 1 % from the rated load step"
    assert "not reached" in part_identified.judge(figures(**{name: None}), figures(), {}).why
    assert part_identified.judge(figures(**{name: None}), figures(**{name: None}), {}).passed
    assert part_identified.judge(figures(), figures(**{name: None}), {}).passed


def test_a_limit_that_only_the_nominal_run_keeps_is_named():
    broken, kept = figures(), figures()
    broken["faults"] = Figure("faults", "all_faults", "OVERCURRENT", "", "", equal="NONE")
    kept["faults"] = Figure("faults", "all_faults", "NONE", "", "", equal="NONE")
    assert "OVERCURRENT" in part_identified.judge(broken, kept, {}).why
    assert part_identified.judge(broken, broken, {}).passed


def made_up(console=CONSOLE, fault=0):
    trace = {"fault": np.array([0, fault]), "t_s": np.array([0.0, 1.0])}
    return SimpleNamespace(trace=trace, console=console, enums={"fault": {0: "NONE", 7: "OVERCURRENT"}})


def test_two_runs_follow_one_by_what_is_known_and_one_by_what_is_nominal():
    asked = []

    def play(scenario, **arguments):
        asked.append((scenario, arguments))
        return SimpleNamespace(figures=figures())
    verdict = part_identified.follow(made_up(), play, TOLD, {"seed": 3, "spread": 1})
    assert verdict.passed and asked == [
        ("default", {"seed": 3, "spread": 1, "overrides": {"params": {"resistance_mohm": 267, "ld_uh": 4928}}}),
        ("default", {"seed": 3, "spread": 1})]


@pytest.mark.parametrize("run, outcome", ((made_up(console=""), "nothing known"), (made_up(fault=7), "OVERCURRENT")))
def test_nothing_follows_where_nothing_is_known(run, outcome):
    verdict = part_identified.follow(run, None, TOLD, {})
    assert not verdict.passed and verdict.outcome == outcome


def test_the_first_run_is_told_nothing_true_and_asks_for_all_that_it_was_told():
    drive = load_drive("thor_pmsyrm")
    setup = part_identified.setup("seed2", drive)
    told, typed = setup.arguments["overrides"]["params"], [step.get("console") for step in setup.scenario["step"]]
    assert setup.arguments["seed"] == 2 and told["cross_pm"] == 0 and told["ld_uh"] != drive.params["ld_uh"]
    assert all(f"get {name}" in typed for name in told) and typed.index("identify use") < typed.index("get ld_uh")
    assert "cross_pm" not in part_identified.setup("seed2", load_drive("maxon_ec22")).arguments["overrides"]["params"]
    with pytest.raises(LauncherError, match="no case 'seed'"):
        part_identified.setup("seed", drive)
    assert PartCase("identified", "maxon_ec22", "seed8") in plan_part("identified", ["maxon_ec22"], {})


def test_the_summary_is_of_ratios():
    outcomes = [{"figures": part_identified.judge(figures(share), figures(), {}).figures} for share in (0.8, 1.0)]
    lines = part_identified.summary(outcomes)
    assert "| peak current, whole run | 0.900 | 1.000 | 2 |" in lines and len(lines) == 2 + len(part_identified.ALIKE)


def test_the_summary_of_identify_is_of_errors_and_intervals():
    lines = part_identify.summary([{"figures": figures} for figures in (
        {"ld, %": -2.0, "ld, of its interval": -1.2, "dead time, ns": 4, "lq, of its interval": 0.1},
        {"ld, %": 1.0, "ld, of its interval": 0.9, "dead time, ns": -7},
        {"ld, %": 3.0, "ld, of its interval": 1, "flux in d there, %": 0.25})])
    assert lines[0].startswith("| quantity |") and lines[2:] == [
        "| dead time | 5.5 ns | 7 ns | 0 of 0 |", "| ld | 2 % | 3 % | 2 of 3 |",
        "| flux in d there | 0.25 % | 0.25 % | 0 of 0 |"]


# ---- the map's truth ----

@pytest.mark.parametrize("motor", ("thor_pmsyrm", "baldor_ecs101m0h7ef4", "estun_emj04apb22"))
def test_the_maps_truth_is_what_others_have_published(motor):
    drive = load_drive(motor)
    plant = dict(twin_items(drive))
    machine, seen = part_identify.machine_of(plant), 0
    for point in drive.motor.points:
        flux, inductance = part_identify.at(plant, machine, point.i_d_a, point.i_q_a)
        right = {"psi_d_wb": flux[0], "psi_q_wb": flux[1], "l_dd_h": inductance[0, 0], "l_qq_h": inductance[1, 1]}
        length = np.hypot(*flux)
        for key, value in right.items():
            if point.values.get(key) is not None:
                scale = length if key.startswith("psi") else value
                assert abs(point.values[key] - value) <= 1.1 * point.tolerance_percent / 100 * scale, (point, key, value)
                seen += 1
    assert seen > 0


def test_without_saturation_the_map_is_constant():
    plant = {"motor.ld_h": 1e-3, "motor.lq_h": 2e-3, "motor.flux_wb": 0.1}
    flux, inductance = part_identify.at(plant, None, -5.0, 3.0)
    assert flux.tolist() == pytest.approx([0.095, 0.006]) and np.diag(inductance).tolist() == [1e-3, 2e-3]


def test_what_a_refusal_is_held_against_is_what_the_firmware_has():
    def number(file, name):
        text = (REPO / "firmware/commission" / f"{file}.c").read_text()
        return int(re.search(rf"#define {name}\s+(\d+)", text)[1])

    assert part_identify.RAMP_SHARE == 1 / number("identify_turn", "INDEX_RELUCTANT_PART")
    assert part_identify.SPEED_SHARE == 1 / number("identify_turn", "SPEED_SHARE")
    assert part_identify.RAMP_S == number("identify_speeds", "RAMPS_TIMEOUT_MS") / 1000
    assert part_identify.LATE_S == number("identify_map", "LATE_MS") / 1000
    assert part_identify.LATE_SHARE == pytest.approx(1 / number("identify_map", "LATE_PART"), rel=0.15)  # drawn
    assert part_identify.SWINGS_HZ == 3 * number("identify_numbers", "TURNING_SPEED_HZ")


def test_lines_of_the_map_are_read():
    found = part_identify.results_of("> identify show\nld at -1/2 in d: 3557.345 +-122.862 uH\n"
                                     "and in q, in mA: 17825, exactly\nldq by lqq there, in thousandths: -109.000 +-6.000\n"
                                     "lq at 1 in q: refused: it is late\n")
    assert (found["ld at -1/2 in d"].value, found["ld at -1/2 in d"].interval) == (3557.345, 122.862)
    assert found["and in q, in mA"].value == 17825 and found["ldq by lqq there, in thousandths"].value == -109
    assert found["lq at 1 in q"].refused == "it is late"


@pytest.mark.parametrize("motor, name, reason, may", (
    ("lot:112", "lq at 1 in q", "turns the rotor too quickly", True),
    ("lot:102", "lq at 1 in q", "turns the rotor too quickly", False),
    ("lot:104", "friction", "a load drives the shaft or holds it back", True), ("lot:102", "friction", "holds it back", False),
    ("lot:104", "inertia", "the speed swings as it grows", True), ("lot:104", "ld", "differ by more than a tenth", False),
    ("lot:131", "flux", "holds it back", True), ("thor_pmsyrm", "flux", "holds it back", False),
    ("thor_pmsyrm", "ld at 1 in d", "reluctance turns", True), ("maxon_ec22", "ld at 1 in d", "reluctance turns", False),
    ("thor_pmsyrm", "flux in d there", "no current in d, or little", False),
    ("maxon_ec22", "flux in d there", "no current in d, or little", True),
    ("maxon_ec22", "flux in d there", "turns the rotor too quickly", False),
    ("maxon_ec22", "ld at 1/3 of rated current in q", "ripple and dead time hide it", True),
    ("maxon_ec22", "lq at 1/3 in q", "ripple and dead time hide it", False),
    ("maxon_ec22", "ld at 1 in d", "ripple and dead time hide it", False)))
def test_a_refusal_that_is_true_of_the_plant(motor, name, reason, may):
    """Of the map, too. 112 is light, 104 hangs on a soft coupling, 131 has friction of 12 % and a fifth of its current to be
    turned with."""
    run = SimpleNamespace(drive=load_drive(motor))
    assert part_identify.may_be_refused(name, reason, None, run) == may
