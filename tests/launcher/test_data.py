# SPDX-License-Identifier: MIT
"""Data files: the shipped ones are whole, broken ones get one line that says what is wrong."""
import math

import pytest

from launcher import LauncherError
from launcher.data import INVERTERS, MOTORS, available, load_inverter, load_motor
from launcher.drive import console_params, load_drive, preamble
from launcher.expression import evaluate, fill, number
from launcher.scenario import load_scenario

MOTOR = (MOTORS / "teknic_m2310p.toml").read_text()


@pytest.mark.parametrize("name", available(MOTORS))
def test_shipped_motors(name):
    drive = load_drive(name)
    assert all(source for table in drive.motor.sources.values() for source in table.values())
    assert drive.motor.checks, "nothing to check the model with"
    for key, value in drive.params.items():
        assert isinstance(value, int) and value > 0, key
    # the console's integers must not lose what the data say
    electrical = drive.motor["electrical"]
    assert drive.params["resistance_mohm"] == pytest.approx(electrical["resistance_ohm"] * 1e3, rel=0.005)
    assert drive.params["ld_uh"] == pytest.approx(electrical["ld_h"] * 1e6, rel=0.005)
    assert drive.params["flux_uwb"] == pytest.approx(electrical["flux_wb"] * 1e6, rel=0.005)
    assert drive.params["inertia_gcm2"] == pytest.approx(drive.inertia_kgm2 * 1e7, rel=0.005)
    # rated torque comes from rated current, and 1500 rpm with it from the bus (i_d = 0, 2 dead times of 1 us at each end)
    rating = drive.motor["rating"]
    i_q = rating["rated_torque_nm"] / drive.torque_per_ampere
    assert i_q == pytest.approx(rating["rated_current_a"], rel=0.1)
    w = 1500 * math.pi / 30 * electrical["pole_pairs"]
    v = math.hypot(w * electrical["flux_wb"] + electrical["resistance_ohm"] * i_q, w * electrical["lq_h"] * i_q)
    assert v < 0.92 * drive.inverter["supply"]["vbus_v"] / math.sqrt(3)


@pytest.mark.parametrize("name", available(INVERTERS))
def test_shipped_inverters(name):
    assert load_inverter(name).documents


@pytest.mark.parametrize("old, new, complaint", [
    ("pole_pairs     = {", "pole_pears = {", "unknown key 'pole_pears'"),
    ("flux_wb        = {", "# flux_wb = {", "'flux_wb' is missing"),
    ("[thermal]", "[thermic]", "unknown entry 'thermic'"),
    ("value = 0.36,", "value = -0.36,", "resistance_ohm: -0.36 is outside"),
    ("value = 0.36,", 'value = "0.36",', "is not a number"),
    ("value = 0.36,", "value = nan,", "is not a number"),
    ("value = 0.36,", "value = true,", "is not a number"),
    ("value = 4,", "value = 4.5,", "4.5 is not a whole number"),
    ('source = "MW: 4; TI: 4"', 'source = " "', "the source is empty"),
    ('{ value = 4, source = "MW: 4; TI: 4" }', "4", "write { value"),
    ("value = 10.65,", "value = 16.0,", "i_max_a is above i_trip_a"),
    ('inverter = "lv24_drv8323"', 'inverter = "none"', "no inverter 'none'; there are: hv600_sic, lv24_drv8323"),
    ('inverter = "lv24_drv8323"', "", "'inverter' is missing"),
    ("[electrical]", "[electrical", "line"),
    ("value = 15.0, source", "value = 23.0, source", "does not fit inverter lv24_drv8323"),
])
def test_broken_motor_file(tmp_path, old, new, complaint):
    assert old in MOTOR
    path = tmp_path / "broken.toml"
    path.write_text(MOTOR.replace(old, new, 1))
    with pytest.raises(LauncherError) as raised:
        load_drive(str(path))
    assert complaint in str(raised.value) and "\n" not in str(raised.value)


def test_unknown_names_list_what_there_is():
    with pytest.raises(LauncherError, match="no motor 'none'; there are: abb_m2bj100l, maxon_ec45flat, teknic_m2310p"):
        load_motor("none")
    with pytest.raises(LauncherError, match="no motor '../motors/teknic_m2310p'"):
        load_motor("../motors/teknic_m2310p")
    with pytest.raises(LauncherError, match="no scenario 'none'; there are: .*default"):
        load_scenario("none", load_drive("teknic_m2310p"))


def test_overrides():
    drive = load_drive("teknic_m2310p", {"motor": {"electrical": {"resistance_ohm": 0.5}}, "params": {"i_max_ma": 1234}})
    assert drive.motor["electrical"]["resistance_ohm"] == 0.5
    assert "set resistance_mohm 500" in preamble(drive) and "set i_max_ma 1234" in preamble(drive)
    with pytest.raises(LauncherError, match="no parameter electrical.nothing"):
        load_drive("teknic_m2310p", {"motor": {"electrical": {"nothing": 1}}})
    with pytest.raises(LauncherError, match="is outside"):
        load_drive("teknic_m2310p", {"motor": {"electrical": {"resistance_ohm": -1}}})


def test_console_parameters_are_those_of_the_firmware():
    """The names stand in firmware/params.c; one that is missing there would be refused, one missing here not be set."""
    import re
    from launcher.paths import REPO
    table = re.findall(r"^\s+PARAM\((\w+), (\d+), (\d+), (\d+)\)", (REPO / "firmware/params.c").read_text(), re.MULTILINE)
    assert table
    for motor in available(MOTORS):
        params = console_params(load_drive(motor))
        assert set(params) == {name for name, *_ in table}
        for name, low, high, _ in table:
            assert int(low) <= params[name] <= int(high), (motor, name)


@pytest.mark.parametrize("change, complaint", [
    ({"end_s": "none"}, "unknown name 'none'"),
    ({"end_s": -1}, "outside 0..3600"),
    ({"end": 1}, "unknown entry 'end'"),
    ({"step": [{"t_s": 2.0, "console": "on"}]}, "a step at 2 s is outside 0..1 s"),
    ({"step": [{"t_s": 0.1}]}, "give either 'console' or 'event'"),
    ({"step": [{"t_s": 0.1, "console": "on", "event": "lock"}]}, "give either"),
    ({"step": [{"t_s": 0.1, "console": "a\nb"}]}, "one printable line"),
    ({"step": [{"t_s": 0.1, "console": "speed {1 +}"}]}, "not an expression"),
    ({"step": [{"t_s": 0.1, "console": "on", "when": 1}]}, "unknown key 'when'"),
    ({"step": [{"t_s": 0.1, "event": "explode"}]}, "unknown event 'explode'"),
    ({"step": [{"t_s": 0.1, "event": "lock", "args": []}]}, "takes 1 argument"),
    ({"step": [{"t_s": 0.1, "event": "lock", "args": ["2"]}]}, "'2' is not a flag"),
    ({"step": [{"t_s": 0.1, "event": "short", "args": ["AC", "1"]}]}, "'AC' is not a pair"),
    ({"step": [{"t_s": 0.1, "event": "sensor_stuck", "args": ["A", "on"]}]}, "unknown name 'on'"),
    ({"base": ["common/nothing"]}, "cannot read"),
    ({"step": 3}, "write \\[\\[step\\]\\]"),
])
def test_broken_scenario(change, complaint):
    with pytest.raises(LauncherError, match=complaint):
        load_scenario({"end_s": 1.0, **change}, load_drive("teknic_m2310p"))


def test_steps_are_resolved_and_sorted():
    drive = load_drive("teknic_m2310p")
    scenario = load_scenario({"end_s": 1, "step": [
        {"t_s": 0.5, "event": "load_nm", "args": ["-0.5 * rated_torque_Nm"]},
        {"t_s": 0.2, "console": "torque {0.1 * rated_current_A:.3f}"},
        {"t_s": 0.6, "event": "sensor_stuck", "args": ["B", "off"]}]}, drive)
    assert [step.text or step.args for step in scenario.steps] == ["torque 0.710", ["-0.1362"], ["B", "off"]]


def test_expressions():
    names = {"a": 2.0, "b": 3.0}
    assert number("a * b - 1 / 4", names) == 5.75
    assert number("-max(a, abs(-b))", names) == -3.0
    assert fill("x {a:.1f} {b} y", names) == "x 2.0 3 y"
    assert bool(evaluate("(a < b) and (a > 1)", names))
    for bad in ("__import__('os')", "a.real", "a[0]", "'text'", "c", "a if b else a", "lambda: 1", "a ** 9", "True"):
        with pytest.raises(LauncherError):
            number(bad, names)


@pytest.mark.parametrize("motor", available(MOTORS))
def test_names_follow_from_ratings_and_inertia(motor):
    drive = load_drive(motor)
    names, control = drive.names(), drive.motor["control"]
    assert names["work_rpm"] == round(0.375 * control["speed_max_rpm"]) and names["slow_rpm"] >= 1
    assert names["ramp_time_s"] * control["ramp_rpm_s"] == pytest.approx(names["work_rpm"])
    # rated torque turns the inertia from rest to rated speed in t_mech_s
    reached = names["rated_torque_Nm"] / names["inertia_kgm2"] * names["t_mech_s"] / names["rad_s_per_rpm"]
    assert reached == pytest.approx(names["rated_speed_rpm"])
    assert names["accel_torque_Nm"] * names["ramp_time_s"] == pytest.approx(
        names["inertia_kgm2"] * names["work_rpm"] * math.pi / 30)
