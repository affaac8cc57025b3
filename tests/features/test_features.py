# SPDX-License-Identifier: MIT
"""A build that leaves a feature out drives the same motor, and refuses what it does not have by the feature's name."""
import re
import subprocess

import pytest
from launcher import simulate

from closed_loop.bus import load_bus
from features.builds import FEATURES, MINIMAL, ROOT, build, image_bytes, without
from rigs.steps import send
from rigs.modbus_line import PARAM_BASE, long, read, write, write_one
from rigs.verdicts import verdicts
from rows import refusals as refusal_rows

FLASH_MOST, RAM_MOST = 103 * 1024, 25_800  # 5 KB of RAM are the sine table: the cache, locked, has no room for it
EXACT = {"plant": "ideal", "spread": 0, "aligned": True}
ASKED = {  # console lines that need it
    "encoder": ("on", "identify", "angle encoder"), "hall": ("set angle_source 2", "set hall_edge_2_cdeg 7000", "angle hall"),
    "sensorless": ("set angle_source 1", "angle observer", "reaction encoder carry"),
    "injection": ("set injection_mv 1000",), "weakening": ("set overmodulation 50",),
    "position": ("pp 100", "hm index", "csp 5", "zero", "set home_turns 3"), "identify": ("identify", "identify show"),
    "learn": ("learn cogging", "learn hall"), "modbus": ("set modbus_address 7",),
    "can": ("set can_node 7",), "scope": ("scope list", "stream 10 921600"),
    "settings": ("save", "load")}

def play(build_folder, lines, out_dir, **more):
    steps = [{"t_s": 0.1 + 0.02 * n, "console": line} for n, line in enumerate(lines)]
    plan = {"title": "what is left out", "preamble_s": 0.05, "end_s": 0.2 + 0.02 * len(lines), "step": steps}
    return simulate(plan, build=build_folder, out_dir=out_dir, **EXACT, **more).console


def refusals(console, name):
    return re.findall(rf"error: this build leaves {name} out", console)


@pytest.mark.parametrize("name", [name for name in FEATURES if name not in ("console", "encoder")])
def test_the_default_scenario_passes_without(name, tmp_path):
    assert not verdicts(simulate(build=build(without(name)), out_dir=tmp_path, **EXACT))


def test_without_an_encoder_the_observer_drives(tmp_path):
    """The noise has its share in the largest error of the angle: of three starts one may be beyond its limit."""
    image = build(without("encoder"))
    results = [simulate("sensorless", build=image, out_dir=tmp_path, seed=seed, **EXACT) for seed in (1, 2, 3)]
    assert sum(bool(verdicts(result)) for result in results) <= 1, [verdicts(result) for result in results]


@pytest.mark.parametrize("name", ASKED)
def test_what_is_left_out_is_refused_by_name(name, tmp_path):
    console = play(build(without(name)), ASKED[name], tmp_path)
    assert len(refusals(console, name)) == len(ASKED[name]), console


def test_a_speed_that_needs_a_weaker_field_is_refused_when_the_tables_are_worked_out(tmp_path):
    lines = ("set overspeed_rpm 7000", "set speed_max_rpm 6000", "set emf_beyond_v_max 1", "on")
    for name, refused in (("weakening", 1), ("modbus", 0)):
        folder = tmp_path / name
        folder.mkdir()
        assert len(refusals(play(build(without(name)), lines, folder), "weakening")) == refused


def test_the_whole_image_refuses_none_of_it_by_name(tmp_path):
    lines = [line for name in sorted(ASKED) for line in ASKED[name]]
    assert "this build leaves" not in play(build(FEATURES), lines, tmp_path)


def test_the_least_build_is_within_its_budget_and_drives(tmp_path):
    flash, ram = image_bytes(MINIMAL)
    assert flash <= FLASH_MOST and ram <= RAM_MOST
    assert not verdicts(simulate(build=build(MINIMAL), out_dir=tmp_path, **EXACT))


KEPT = ("set home_turns 3", "set can_node 7", "set injection_mv 1000", "set overmodulation 50", "reaction encoder carry")


def test_settings_of_the_whole_image_outlive_the_least_one_and_back(tmp_path):
    """`save` there too, twice. What somebody chooses there counts."""
    def live(features, *lines):
        steps = [{"t_s": 0.02 + 0.03 * n, "console": line} for n, line in enumerate(lines)]
        plan = {"title": "kept", "end_s": 0.1 + 0.03 * len(lines) + 0.15 * lines.count("save"), "step": steps}
        return simulate(plan, build=build(features), out_dir=tmp_path / "run", envm=tmp_path / "envm", **EXACT).console

    live(FEATURES, "set low_side_shunts 0", *KEPT, "set ramp_rpm_s 1234", "save")
    for n in range(2):
        console = live(MINIMAL, f"set stop_max_ms {3000 + n}", "save")
        assert f"{len(KEPT)} stored records are unknown to this firmware" in console and "ok\nslot" in console
    changed = live(FEATURES, "get --changed", "reaction")
    assert all(f"\n{line}\n" in changed for line in (*KEPT[:-1], "set ramp_rpm_s 1234", "set stop_max_ms 3001")), changed
    assert "encoder: carry" in changed and "unknown to this firmware" not in changed


ERRORS = ["ERROR_NONE", *(f"ERROR_{name}" for name in refusal_rows())]
REFUSAL, STORE, MODE, REACTIONS, ERROR_OF_ENCODER, CARRY = 0x2B, 0xC0, 1, 0x400, 7, 3
PROFILE_POSITION = 1
ON_THE_BUS = {  # what needs it, by requests
    "settings": (write(STORE, long(0x65766173)),),
    "position": (write_one(MODE, PROFILE_POSITION), *(write_one(0, word) for word in (6, 7, 0xF)), None, write_one(0, 0x1F)),
    "hall": (write(PARAM_BASE + 2 * 63, long(123456)),),
    "sensorless": (write_one(REACTIONS + ERROR_OF_ENCODER, CARRY),)}


def over_the_bus(requests, begin_s):
    """A request each 20 ms at 19200 baud; None: time for a start."""
    steps, at_s = [], begin_s
    for request in requests:
        steps += [] if request is None else [send(at_s, request)]
        at_s += 0.6 if request is None else 0.02
    return steps, at_s


def test_without_a_console_the_bus_drives(tmp_path):
    steps, at_s = over_the_bus([write(2, long(1000)), *(write_one(0, word) for word in (6, 7, 0xF)), None], 0.2)
    plan = {"title": "bus alone", "preamble_s": 0.05, "end_s": at_s + 0.6, "step": steps}
    result = simulate(plan, build=build(without("console")), out_dir=tmp_path, **EXACT)
    assert result.console == "" and not result.trace["fault"].any()
    assert result.trace["speed_rad_s"][-100:].mean() * 60 / 6.2832 == pytest.approx(1000, rel=0.01)


@pytest.mark.parametrize("name", ON_THE_BUS)
def test_the_bus_refuses_it_by_number(name, tmp_path):
    """The refusal's number, and which feature: as `fault` and `refusal` of the register list have it."""
    steps, at_s = over_the_bus([*ON_THE_BUS[name], read(REFUSAL, 3)], 0.2)
    plan = {"title": "what is left out", "preamble_s": 0.05, "end_s": at_s + 0.05, "step": steps}
    simulate(plan, build=build(without(name)), out_dir=tmp_path, **EXACT)
    said = load_bus(tmp_path / "bus.txt").exchanges[-1].reply
    assert int.from_bytes(said[3:5], "big") == ERRORS.index("ERROR_NOT_IN_BUILD")
    assert FEATURES[int.from_bytes(said[5:9], "big")] == name


def test_a_build_without_a_feature_knows_the_names_of_its_commands():
    """All of them: a name that is not in the list would be an unknown command, and nobody would know why."""
    operate = ROOT / "firmware/operate"
    table = (operate / "commands_table.c").read_text()
    rows = "".join(path.read_text() for path in sorted(operate.glob("commands_*.c")))
    named = {tuple(pair) for pair in re.findall(r'\{"(\w+)", FEATURE_(\w+)\}', table)}
    has = set()
    for feature, group in re.findall(r"GROUP_OF\(([A-Z]+), (\w+)\)", table):
        body = re.search(rf"{group}\[\] = \{{\n(.*?)\n\}};", rows, re.DOTALL)[1]
        has |= {(name, feature) for name in re.findall(r'^    \{"(\w+)", ', body, re.MULTILINE)}
    assert has and named == has


@pytest.mark.parametrize("features, complaint", [
    ("encoder consol", "no 'consol'; there are encoder"), ("console position", "no source of the angle"),
    ("encoder", "nothing to operate the drive with"), ("encoder console injection", "injection needs sensorless")])
def test_make_refuses_what_does_not_go_together(features, complaint):
    done = subprocess.run(["make", "-n", f"FEATURES={features}"], capture_output=True, text=True, check=False)
    assert done.returncode != 0 and complaint in done.stderr
