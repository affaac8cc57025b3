# SPDX-License-Identifier: MIT
"""Data files: the shipped ones are whole, broken ones get one line that says what is wrong."""
import math
import re
import tempfile

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from launcher import LauncherError
from launcher.cli import main
from launcher.data import INVERTERS, MOTORS, available, load_inverter, load_motor, read_toml
from launcher.drive import HALL_MEAN_S, OBSERVER_LEADS, OBSERVER_PART, OBSERVER_POLES, load_drive, preamble, twin_items
from launcher.expression import evaluate, fill, number
from launcher.paths import REPO
from launcher.scenario import load_scenario
from launcher.schema import MOTOR_TABLES, page_lines

MOTOR = (MOTORS / "teknic_m2310p.toml").read_text()


@pytest.mark.parametrize("name", available(MOTORS))
def test_shipped_motors(name):
    drive = load_drive(name)
    assert all(source for table in drive.motor.sources.values() for source in table.values())
    assert drive.motor.checks, "nothing to check the model with"
    for key, value in drive.params.items():
        may_be_0 = key.endswith(("_apparent_uh", "_rest_uh", "_on_mv", "_off_mv", "pwm_update", "_silent"))
        assert isinstance(value, int) and (value > 0 or may_be_0), key
    assert drive.notes == [], "the console's integers lose what the data say"
    # work_rpm with rated current comes from the bus (i_d = 0, 2 dead times of 1 us at each end)
    electrical, i_q = drive.motor["electrical"], drive.motor["rating"]["rated_current_a"]
    w = drive.names()["work_rpm"] * math.pi / 30 * electrical["pole_pairs"]
    v = math.hypot(w * electrical["flux_wb"] + electrical["resistance_ohm"] * i_q, w * electrical["lq_h"] * i_q)
    assert v < 0.92 * drive.inverter["supply"]["vbus_v"] / math.sqrt(3)


@pytest.mark.parametrize("name, shunts", [("dys_be8108", 1), ("estun_emj04apb22", 0)])
def test_two_samples_a_period_are_told_with_what_they_need(name, shunts):
    one = load_drive(name)
    assert not {"pwm_samples", "low_side_shunts"} & set(one.params)
    for update, current_bw_hz in ((1, 2000), (2, 4000)):
        told = load_drive(name, {"motor": {"control": {"pwm_samples": 2, "pwm_update": update}}}).params
        assert (told["pwm_samples"], told["low_side_shunts"], told["current_bw_hz"]) == (2, shunts, current_bw_hz)


def test_sensors_are_laid_over_the_inverter():
    """What they give takes the place of it, tolerances and sources too; what they do not stays. The drive is told."""
    plain, modulated = load_drive("teknic_m2310p"), load_drive("teknic_m2310p", sensors="amc1306", spread=1, seed=5)
    sensor = modulated.inverter["sensor"]
    assert (sensor["modulators"], sensor["shunt"], sensor["ring_lsb"]) == (1, 0, 0)
    assert sensor["i_range_a"] == plain.inverter["sensor"]["i_range_a"] and plain.inverter["sensor"]["ring_lsb"] > 0
    assert modulated.inverter.spreads["sensor"]["i_gain_a"].relative == 0.007
    assert "amc1306" in modulated.inverter.sources["sensor"]["i_gain_a"]
    told = modulated.params
    assert (told["modulator_osr"], told["low_side_shunts"]) == (64, 0) and "modulator_osr" not in plain.params
    items = dict(twin_items(modulated))
    assert items["sensor.modulators"] == 1 and "sensor.modulator_osr" not in items
    with pytest.raises(LauncherError, match="no sensors 'nothing'; there are: amc1306"):
        load_drive("teknic_m2310p", sensors="nothing")


@pytest.mark.parametrize("name", sorted(set(available(MOTORS)) - {"baldor_ecs101m0h7ef4", "thor_pmsyrm"}))
def test_rated_torque_comes_from_rated_current(name):
    """But of the two whose torque is half reluctance, which i_d = 0 leaves unused."""
    drive = load_drive(name)
    assert drive.motor["rating"]["rated_torque_nm"] / drive.torque_per_ampere == pytest.approx(
        drive.motor["rating"]["rated_current_a"], rel=0.1)


def test_enough_motors_of_every_kind():
    """At least ten; among them published saturation, high speed, many poles, low and high resistance."""
    drives = [load_drive(name) for name in available(MOTORS)]
    tables = [drive.motor["electrical"] for drive in drives]
    assert len(drives) >= 10 and sum(bool(drive.motor.points) for drive in drives) >= 3
    assert max(drive.params["speed_max_rpm"] for drive in drives) > 15000
    assert max(table["pole_pairs"] for table in tables) >= 15 and min(table["pole_pairs"] for table in tables) == 1
    assert min(table["resistance_ohm"] for table in tables) < 0.01 and max(table["resistance_ohm"] for table in tables) > 5


@pytest.mark.parametrize("name", available(INVERTERS))
def test_shipped_inverters(name):
    assert load_inverter(name).documents


@pytest.mark.parametrize("old, new, complaint", [
    ("pole_pairs     = {", "pole_pears = {", "unknown key 'pole_pears'; did you mean pole_pairs?"),
    ("flux_wb        = {", "flux_Wb = {", "[electrical]: unknown key 'flux_Wb'; did you mean flux_wb?"),
    ("flux_wb        = {", "xyzzy = {", "[electrical]: unknown key 'xyzzy'; there are: pole_pairs, "),
    ("flux_wb        = {", "# flux_wb = {", "'flux_wb' is missing"),
    ("[thermal]", "[thermic]", "unknown entry 'thermic'; did you mean thermal?"),
    ("value = 0.36,", "value = -0.36,", "resistance_ohm: -0.36 is outside"),
    ("value = 0.36,", 'value = "0.36",', "is not a number"),
    ("value = 0.36,", "value = nan,", "is not a number"),
    ("value = 0.36,", "value = true,", "is not a number"),
    ("value = 4,", "value = 4.5,", "4.5 is not a whole number"),
    ('source = "MW: 4; TI: 4"', 'source = " "', "the source is empty"),
    ('{ value = 4, source = "MW: 4; TI: 4" }', "4", "write { value"),
    ("value = 10.65,", "value = 16.0,", "[control] i_max_a 16 is above 85 % of i_trip_a 15: at most 12.75 would fit"),
    ('inverter = "lv24_drv8323"', 'inverter = "none"', "no inverter 'none'; there are: hv600_50a, hv600_sic, lv24_drv8316"),
    ('inverter = "lv24_drv8323"', 'inverter = "none.toml"', "no inverter 'none.toml'; there are: "),
    ("spread = 0.07", "spread = 1.07", "resistance_ohm: spread must be 0 or more and below 1"),
    ("spread = 0.07", "spread = true", "resistance_ohm: spread: True is not a number"),
    ('like = "ld_h"', 'like = "l_d"', "like = 'l_d' is no key of [electrical]; did you mean ld_h?"),
    ("value = 4, source", "value = 4, spread = 0.1, source", "pole_pairs: takes no spread"),
    ("value = 7.1, source", "value = 7.1, spread = 0.1, source", "rated_current_a: takes no spread"),
    ("value = 0.08, source", "value = 0.8, source", "[saturation]: loss_d 0.8 at 10.65 A is more than the short form can give"),
    ("value = 0.12, source", "value = 0.9, source", "the short form cannot lose 0.9 of lq_h"),
    ("loss_flux =", "sat_a_dd =", "give either loss_d, loss_q, loss_flux or the coefficients sat_..., not both"),
    ("value = 6000, source", "value = 3000, source", "rated_speed_rpm is above max_speed_rpm"),
    ("value = 7.0, spread", "value = 0.0, spread", "[load] stiffness_nm_rad needs an inertia_ratio behind it"),
    ("value = 4.64, tolerance", "value = 0, tolerance", "[check] emf_ll_v_per_krpm: 0 has no relative tolerance"),
    ("tolerance_percent = 1.0,", 'tolerance_percent = "1",', "tolerance_percent: '1' is not a number"),
    ("tolerance_percent = 1.0, ", "", "write { value = ..., tolerance_percent"),
    ("[check]", "[[point]]", "point 1: unknown key 'emf_ll_v_per_krpm'"),
    ("[check]", "[[check]]", "[check] is not a table"),
    ("[start]", "[[start]]", "[start] is not a table"),
    ('MW = "', "MW = 3 # ", "[documents] holds texts"),
    ("[mechanical]", "", "[iron]: unknown key 'inertia_kgm2'; it belongs into [mechanical]"),
    ("[rating]", "[hall]", "[rating] is missing"),
    ("value = 200e-6, spread = 0.1, like", "value = 50e-6, spread = 0.1, like", "are the axes exchanged?"),
    ("0.36 per phase", "0.36 \x00per phase", "Illegal character"),
    ('inverter = "lv24_drv8323"', "", "'inverter' is missing"),
    ("[electrical]", "[electrical", "line"),
    ("value = 15.0, source", "value = 23.0, source", "does not fit inverter lv24_drv8323"),
])
def test_broken_motor_file(tmp_path, capsys, old, new, complaint):
    assert old in MOTOR
    path = tmp_path / "broken.toml"
    path.write_text(MOTOR.replace(old, new, 1))
    with pytest.raises(LauncherError) as raised:
        load_drive(str(path))
    assert complaint in str(raised.value)
    capsys.readouterr()
    assert main(["run", "--motor", str(path)]) == 2
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 1 and lines[0].startswith("mssfoc: ") and complaint in lines[0]


@settings(max_examples=300, deadline=None)
@given(st.integers(0, len(MOTOR)), st.integers(0, 60), st.text(max_size=8))
def test_any_damage_is_refused_in_one_line_or_harmless(at, length, text):
    with tempfile.NamedTemporaryFile("w", suffix=".toml", encoding="utf-8", errors="surrogateescape") as file:
        file.write(MOTOR[:at] + text.encode("utf-8", "ignore").decode() + MOTOR[at + length:])
        file.flush()
        try:
            drive = load_drive(file.name, spread=1)
            told = twin_items(drive), preamble(drive)
        except LauncherError as error:
            assert "\n" not in str(error) and str(error)
        else:
            assert all(told)


# What docs/motors.md calls the smallest file.
SMALLEST = re.search(r"```toml\n(name = .*?)```", (REPO / "docs" / "motors.md").read_text(), re.S).group(1)


def test_the_smallest_file_anywhere_on_the_disk(tmp_path):
    (tmp_path / "mine.toml").write_text(SMALLEST)
    drive = load_drive(str(tmp_path / "mine.toml"))
    assert drive.motor["control"]["i_max_a"] > drive.motor["rating"]["rated_current_a"]
    assert set(dict(twin_items(drive))) >= {"motor.pole_pairs", "sensor.encoder_counts", "load.inertia_kgm2"}
    required = {key for table in MOTOR_TABLES.values() for key, entry in table.items() if entry.required}
    assert set(re.findall(r"(?m)^(\w+) = \{", SMALLEST)) == required, "the smallest file is not the smallest"
    for key in required:
        (tmp_path / "mine.toml").write_text(re.sub(rf"(?m)^{key} = .*$", "", SMALLEST))
        with pytest.raises(LauncherError, match=f"'{key}' is missing"):
            load_drive(str(tmp_path / "mine.toml"))


def test_an_inverter_beside_the_motor(tmp_path):
    (tmp_path / "mine.toml").write_text(SMALLEST.replace('inverter = "lv24_drv8323"', 'inverter = "stage.toml"'))
    with pytest.raises(LauncherError, match="no inverter 'stage.toml'"):
        load_drive(str(tmp_path / "mine.toml"))
    stage = (INVERTERS / "lv24_drv8323.toml").read_text()
    (tmp_path / "stage.toml").write_text(stage.replace("value = 24.0", "value = 25.0"))
    assert load_drive(str(tmp_path / "mine.toml")).inverter["supply"]["vbus_v"] == 25


@pytest.mark.parametrize("old, new, complaint", [
    ("value = 24.0", "value = 60.0", "v_min_v < vbus_v < v_max_v < v_range_v does not hold"),
    ("[bridge]", "[bridge]\nchopper_ohm = 3", "unknown key 'chopper_ohm'"),
    ("supply_sinks ", 'chopper_ohm = { value = 3, source = "x" }\nsupply_sinks ', "vbus_v < chopper_off_v < chopper_on_v"),
    ("[bridge]", "[brigde]", "unknown entry 'brigde'"),
    ("supply_sinks ", 'supply_c2_f = { value = 3, source = "x" }\nsupply_sinks ', "supply_r2_ohm and supply_c2_f go together"),
    ("value = 1, source", "value = 0.5, source", "0.5 is not a whole number"),
])
def test_broken_inverter_file(tmp_path, old, new, complaint):
    text = (INVERTERS / "lv24_drv8323.toml").read_text()
    assert old in text
    (tmp_path / "stage.toml").write_text(text.replace(old, new, 1))
    with pytest.raises(LauncherError) as raised:
        load_inverter(str(tmp_path / "stage.toml"))
    assert complaint in str(raised.value) and "\n" not in str(raised.value)


@pytest.mark.parametrize("content", [b"", b"\xff\xfe\x00", b"\x7fELF\x01\x01", b"[[" * 400, None])
def test_files_that_are_none(tmp_path, content):
    path = tmp_path / "odd.toml"
    path.mkdir() if content is None else path.write_bytes(content)
    with pytest.raises(LauncherError) as raised:
        load_drive(str(path))
    assert "\n" not in str(raised.value) and "odd.toml" in str(raised.value)


def test_the_page_of_keys_is_up_to_date():
    """docs/motors.md has what `qemu/run.py keys` prints."""
    page = (REPO / "docs" / "motors.md").read_text()
    assert "\n".join(page_lines()) in page, "put the output of 'qemu/run.py keys' into docs/motors.md"


def test_a_motor_without_a_load_gets_one_that_it_starts_in_a_tenth_of_a_second(tmp_path):
    text = re.search(r"```toml\n(.*?)```", (REPO / "docs" / "motors.md").read_text(), re.DOTALL)[1]
    (tmp_path / "mine.toml").write_text(text)
    motor = load_motor(tmp_path / "mine.toml")
    total = motor["mechanical"]["inertia_kgm2"] * (1 + motor["load"]["inertia_ratio"])
    rad_s, torque_nm = motor["rating"]["rated_speed_rpm"] * math.pi / 30, motor["rating"]["rated_torque_nm"]
    assert total * rad_s / torque_nm == pytest.approx(0.1, rel=0.01)
    (tmp_path / "mine.toml").write_text(text + "[load]\ninertia_ratio = { value = 0, source = \"bare\" }\n")
    assert load_motor(tmp_path / "mine.toml")["load"]["inertia_ratio"] == 0


def test_unknown_names_list_what_there_is():
    with pytest.raises(LauncherError, match="no motor 'none'; there are: abb_m2bj100l, .*, teknic_m2310p"):
        load_motor("none")
    with pytest.raises(LauncherError, match="no motor '../motors/teknic_m2310p'"):
        load_motor("../motors/teknic_m2310p")
    with pytest.raises(LauncherError, match="no scenario 'none'; there are: .*default"):
        load_scenario("none", load_drive("teknic_m2310p"))


@pytest.mark.parametrize("share, fits", ((0.51, True), (0.49, False)))
def test_q_has_at_least_half_of_the_inductance_of_d(tmp_path, share, fits):
    """Less is an exchange of the axes."""
    text = re.sub("(?m)^inductance_ll_h.*$", "", MOTOR)
    (tmp_path / "mine.toml").write_text(re.sub("(?m)^lq_h( *= { value =) 200e-6", rf"lq_h\1 {share * 200e-6}", text))
    if fits:
        assert load_drive(str(tmp_path / "mine.toml")).motor["electrical"]["lq_h"] == pytest.approx(share * 200e-6)
    else:
        with pytest.raises(LauncherError, match="are the axes exchanged"):
            load_drive(str(tmp_path / "mine.toml"))


def test_overrides():
    drive = load_drive("teknic_m2310p", {"motor": {"electrical": {"resistance_ohm": 0.5}}, "params": {"i_max_ma": 1234}})
    assert drive.motor["electrical"]["resistance_ohm"] == 0.5
    assert "set resistance_mohm 500" in preamble(drive) and "set i_max_ma 1234" in preamble(drive)
    with pytest.raises(LauncherError, match="no parameter electrical.nothing"):
        load_drive("teknic_m2310p", {"motor": {"electrical": {"nothing": 1}}})
    with pytest.raises(LauncherError, match="is outside"):
        load_drive("teknic_m2310p", {"motor": {"electrical": {"resistance_ohm": -1}}})


@pytest.mark.parametrize("change, complaint", [
    ({"end_s": "none"}, "unknown name 'none'"),
    ({"end_s": -1}, "outside 0..3600"),
    ({"end": 1}, "unknown entry 'end'; did you mean end_s"),
    ({"step": [{"t_s": 2.0, "console": "on"}]}, "a step at 2 s is outside 0..1 s"),
    ({"step": [{"t_s": 0.1}]}, "give either 'console' or 'event'"),
    ({"step": [{"t_s": 0.1, "console": "on", "event": "lock"}]}, "give either"),
    ({"step": [{"t_s": 0.1, "console": "a\nb"}]}, "one printable line"),
    ({"step": [{"t_s": 0.1, "console": "speed {1 +}"}]}, "not an expression"),
    ({"step": [{"t_s": 0.1, "console": "on", "when": 1}]}, "unknown key 'when'; there are: t_s, "),
    ({"step": [{"ts": 0.1, "console": "on"}]}, "unknown key 'ts'; did you mean t_s"),
    ({"step": [{"t_s": 0.1, "console": "speed {work_rpn}"}]}, "unknown name 'work_rpn'; did you mean work_rpm"),
    ({"step": [{"t_s": 0.1, "event": "load"}]}, "unknown event 'load'; did you mean load_nm"),
    ({"step": [{"t_s": 0.1, "event": "explode"}]}, "unknown event 'explode'"),
    ({"step": [{"t_s": 0.1, "event": "lock", "args": []}]}, "takes 1 argument"),
    ({"step": [{"t_s": 0.1, "event": "lock", "args": ["2"]}]}, "'2' is not a flag"),
    ({"step": [{"t_s": 0.1, "event": "short", "args": ["AC", "1"]}]}, "'AC' is not a pair"),
    ({"step": [{"t_s": 0.1, "event": "sensor_stuck", "args": ["A", "on"]}]}, "unknown name 'on'"),
    ({"base": ["common/nothing"]}, "cannot read"),
    ({"step": 3}, "write \\[\\[step\\]\\]"),
    ({"watchdog_s": 0}, "watchdog_s 0 is outside 0.005..85 s"),
    ({"watchdog_s": 86}, "watchdog_s 86 is outside 0.005..85 s"),
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


@pytest.mark.parametrize("line, hint", [
    ("a = 0,36", "line 1: 0,36 is no number: write 0.36"), ("a = { value = -1,5 }", "line 1: -1,5 is no number: write -1.5"),
    ("a = [1,2", "Unclosed array"), ("a = { b = 1, c = 2 ", "Unclosed inline table"), ("a = b", "Invalid value")])
def test_a_decimal_comma_is_named(tmp_path, line, hint):
    (tmp_path / "my.toml").write_text(line + "\n")
    with pytest.raises(LauncherError, match=re.escape(f"my.toml: {hint}")):
        read_toml(tmp_path / "my.toml")


@pytest.mark.parametrize("source, electrical_turns", ((0, 1.5 * 4 / 2400), (1, 4 / 3 / (2 * math.pi)), (2, 1 / 12 + 1 / 2)))
def test_what_a_loop_can_be_held_to_knows_how_late_its_sensor_is(source, electrical_turns):
    """A double pole at p is 2 / p late, a mean over a turn half of the turn, as long as that is 20 ms at most."""
    drive = load_drive("teknic_m2310p", {"motor": {"control": {"angle_source": source}, "encoder": {"counts_per_rev": 2400}}})
    assert drive.motor["electrical"]["pole_pairs"] == 4
    assert drive.names()["heard_s"] == pytest.approx(electrical_turns * 60 / 1500 / 4)
    assert drive.names()["work_rpm"] == 1500
    assert drive.heard_s(0.04) == pytest.approx(electrical_turns * 0.01)
    led_s = math.sqrt(drive.inertia_kgm2 / 4 / drive.torque_per_ampere / drive.names()["i_max_A"])
    assert drive.heard_s(4) == pytest.approx({0: electrical_turns, 1: led_s, 2: 1 / 12 + 0.01}[source])
    assert drive.is_led_by_field(4) == (source == 1) and not drive.is_led_by_field(0.04)


def test_a_soft_coupling_has_the_time_that_it_needs():
    """0.7 Hz are left to a load of 90 times the rotor on 20 Hz: half of that forgets 99.5 % of a step in 30 time constants."""
    rigid, soft = (load_drive("teknic_m2310p", {"motor": {"load": {
        "inertia_ratio": 90.0, "stiffness_nm_rad": stiffness, "damping_nms": 1e-3 if stiffness else 0.0}}}).names()
        for stiffness in (0.0, 0.25))
    assert rigid["left_tau_s"] == rigid["speed_tau_s"] == soft["speed_tau_s"]
    assert soft["left_tau_s"] > 20 * soft["speed_tau_s"] and soft["settle_s"] == pytest.approx(30 * soft["left_tau_s"])
    assert soft["settle_s"] > rigid["settle_s"]


def test_how_a_source_lags_is_what_the_firmware_has():
    observer, hall = ((REPO / f"firmware/control/{name}.c").read_text() for name in ("observer", "hall"))
    of = {name: int(re.search(rf"#define {name}\s+(\d+)", observer)[1]) / 256
          for name in ("TRACK_LEAST_Q8", "TRACK_LARGEST_Q8", "TRACK_BY_MARGIN")}
    assert tuple(of.values()) == pytest.approx((*OBSERVER_POLES, 1 / OBSERVER_PART), rel=0.01)
    leads = re.search(r"#define OBSERVER_LEADS_Q8 \((\d+) \* 256 / 10\)", (REPO / "firmware/control/observer.h").read_text())
    assert int(leads[1]) / 10 == OBSERVER_LEADS
    assert int(re.search(r"#define MEAN_CLOCKS\s+\((\d+)u \* \(BOARD_FABRIC_HZ / 1000u\)\)", hall)[1]) == HALL_MEAN_S * 1000
