# SPDX-License-Identifier: MIT
"""PLANT, SPREAD, DETUNE, the firmware's ranges, saturation's short form, [control] by rule."""
import math
import re

import numpy as np
import pytest

from launcher import LauncherError
from launcher.data import MOTORS, available, load_inverter, load_motor
from launcher.drive import _ALWAYS as ALWAYS
from launcher.drive import load_drive, preamble, twin_items
from launcher.effects import EFFECTS, parse_plant
from launcher.params import Range, check_ranges, coarse_notes, ranges_of
from launcher.paths import REPO
from launcher.probes import Symbols
from launcher.saturation import SHORT, Saturation, from_losses
from launcher.schema import BY_RULE, INVERTER_TABLES, MOTOR_TABLES, SECTIONS
from launcher.spread import share
from rows import param_rows
from tools.saturated import fluxes, jacobian

MOTOR = "teknic_m2310p"


# ---- PLANT -----------------------------------------------------------------------------------------------------------

def neutral(plant, motor=MOTOR):
    """The items of a plant, with what is left out at its default."""
    names = {"counts_per_rev": "encoder_counts"}
    items = {f"{SECTIONS[table]}.{names.get(key, key)}": entry.default for tables in (MOTOR_TABLES, INVERTER_TABLES)
             for table, keys in tables.items() if table in SECTIONS for key, entry in keys.items()}
    return {**items, **dict(twin_items(load_drive(motor, plant=plant)))}


def test_every_effect_names_keys_that_there_are():
    known = set(neutral("full"))
    assert all(set(beyond) | set(kept) <= known and (beyond or kept) for beyond, kept in EFFECTS.values())


@pytest.mark.parametrize("effect", EFFECTS)
def test_each_effect_alone(effect):
    """Taken away, its keys are neutral and nothing else moves; added to ideal, they are the file's again."""
    full, without = neutral("full"), neutral(f"full,-{effect}")
    ideal, added = neutral("ideal"), neutral(f"ideal,+{effect}")
    beyond, kept = EFFECTS[effect]
    own = {**beyond, **kept}
    assert {key: without[key] for key in own} == own
    assert {key for key in full if full[key] != without[key]} <= set(own)
    assert {key for key in ideal if ideal[key] != added[key]} <= set(beyond)
    assert all(added[key] == full[key] for key in own)
    assert all(ideal[key] == value for key, value in beyond.items())
    assert all(ideal[key] == full[key] for key in kept)


def test_some_shipped_motor_has_each_effect():
    for effect in EFFECTS:
        assert any(neutral("full", motor) != neutral(f"full,-{effect}", motor) for motor in available(MOTORS)), effect


def test_the_page_lists_the_effects():
    page = (REPO / "docs" / "plant.md").read_text()
    block = page[page.index("<!-- effects"):page.index("<!-- end -->")]
    assert re.findall(r"(?m)^\| `(\w+)` \|", block) == list(EFFECTS)


@pytest.mark.parametrize("text, complaint", [
    ("ful", "begins with neither 'full' nor 'ideal'"), ("-saturation", "begins with neither"),
    ("full,saturation", "'saturation' is neither [+]effect nor -effect"), ("full,", "'' is neither"),
    ("full,-saturatoin", "no effect 'saturatoin'; there are: saturation, harmonics"),
    ("ideal,+", "no effect ''"),
])
def test_broken_plant(text, complaint):
    with pytest.raises(LauncherError, match=complaint) as raised:
        parse_plant(text)
    assert "\n" not in str(raised.value)


def test_plant_texts():
    assert parse_plant("") == parse_plant("full") and parse_plant(None).has("bus")
    assert not parse_plant("ideal").has("cogging"), "ideal has a part of it"
    assert parse_plant("full, -bus ,+bus").has("bus") and not parse_plant("full,-bus").has("bus")


# ---- SPREAD ----------------------------------------------------------------------------------------------------------

def test_draws_are_uniform_and_depend_on_seed_and_name_only():
    draws = np.array([share(seed, "motor.electrical.resistance_ohm") for seed in range(4000)])
    assert abs(draws.mean()) < 0.03 and abs(np.abs(draws).mean() - 0.5) < 0.02 and np.abs(draws).max() <= 1
    assert share(1, "a") == share(1, "a") != share(2, "a") and share(1, "a") != share(1, "b")
    assert share(1, "a") == pytest.approx(0.7761132920881262), "results of one release must be repeatable with the next"


def test_spread_moves_the_plant_and_not_the_firmware():
    nominal, first, second = (load_drive(MOTOR, spread=spread, seed=seed) for spread, seed in ((0, 5), (1, 5), (1, 6)))
    assert preamble(nominal) == preamble(first) == preamble(second) and nominal.names() == first.names()
    items = [dict(twin_items(drive)) for drive in (nominal, first, second)]
    assert items[0] == dict(twin_items(load_drive(MOTOR, spread=0, seed=9)))
    for key in ("motor.resistance_ohm", "motor.flux_wb", "motor.inertia_kgm2", "load.inertia_kgm2", "motor.sat_a_d0",
                "motor.winding_rise_k", "sensor.i_offset_a_lsb", "sensor.i_gain_b", "inverter.vbus_v",
                "motor.initial_angle_rad"):
        assert len({item[key] for item in items}) == 3, key
    for table, entries in nominal.motor.spreads.items():
        for key, spread in entries.items():
            value = nominal.motor[table][key]
            reach = spread.relative * abs(value) + spread.absolute
            for item in items[1:]:
                assert abs(item.get(f"{SECTIONS[table]}.{key}", value) - value) <= reach * (1 + 1e-12) or table == "load"


def test_the_start_angle_takes_the_whole_turn():
    angles = [dict(twin_items(load_drive(MOTOR, spread=0.5, seed=seed)))["motor.initial_angle_rad"] for seed in range(60)]
    assert 0 <= min(angles) < 0.6 and 2 * math.pi - 0.6 < max(angles) < 2 * math.pi


def test_like_shares_a_draw():
    for seed in range(5):
        items = dict(twin_items(load_drive(MOTOR, spread=1, seed=seed)))
        assert items["motor.ld_h"] == pytest.approx(items["motor.lq_h"]) and items["motor.ld_h"] != 200e-6


def test_what_is_overridden_is_not_drawn():
    change = {"motor": {"electrical": {"resistance_ohm": 0.5}, "start": {"initial_angle_rad": 0.1}}}
    items = dict(twin_items(load_drive(MOTOR, change, spread=1, seed=3)))
    assert items["motor.resistance_ohm"] == 0.5 and items["motor.initial_angle_rad"] == 0.1


@pytest.mark.parametrize("spread, complaint", [("much", "SPREAD 'much' is not a number"), (-1, "outside 0..10"),
                                               ("nan", "outside 0..10"), (11, "outside 0..10")])
def test_broken_spread(spread, complaint):
    with pytest.raises(LauncherError, match=complaint):
        load_drive(MOTOR, spread=spread)


def test_a_draw_beyond_what_is_possible_is_refused():
    for seed in range(20):
        try:
            twin_items(load_drive(MOTOR, spread=10, seed=seed))
        except LauncherError as error:
            assert re.search(r"teknic_m2310p.toml: \[\w+\] \w+: SPREAD 10 draws \S+, which is outside", str(error))
            return
    pytest.fail("ten times the tolerances never left the range")


# ---- DETUNE ----------------------------------------------------------------------------------------------------------

def test_detune_changes_what_the_firmware_is_told_and_nothing_else():
    right = load_drive(MOTOR)
    wrong = load_drive(MOTOR, detune="resistance_mohm*1.3 flux_uwb/2,pole_pairs=5 encoder_counts+96 ld_uh-50")
    assert twin_items(right) == twin_items(wrong)
    changed = {key: value for key, value in wrong.params.items() if value != right.params[key]}
    assert changed == {"resistance_mohm": 468, "flux_uwb": 3198, "pole_pairs": 5, "encoder_counts": 4096, "ld_uh": 150}
    assert "set resistance_mohm 468" in preamble(wrong)


def test_a_step_of_current_that_stays_linear_needs_no_more_voltage_than_there_is():
    drive = load_drive(MOTOR)
    rated_a, resistance = drive.motor["rating"]["rated_current_a"], drive.motor["electrical"]["resistance_ohm"]
    assert drive.linear_step_a == pytest.approx(0.6 * rated_a)
    drive.motor["control"]["current_bw_hz"] = 20000
    volts = 2 * math.pi * 20000 * drive.motor["electrical"]["lq_h"] * drive.linear_step_a + resistance * rated_a
    most_v = 0.8 * drive.inverter["supply"]["vbus_v"] / math.sqrt(3)
    assert drive.linear_step_a < 0.5 * rated_a and volts == pytest.approx(most_v)


@pytest.mark.parametrize("text, complaint", [
    ("resistance*2", "no parameter 'resistance'; there are: pole_pairs, encoder_counts"),
    ("resistance_mohm", "is none of name[*]1.3"), ("resistance_mohm**2", "is none of"), ("resistance_mohm*x", "is none of"),
    ("flux_uwb/0", "division by zero"), ("flux_uwb*1e9", "beyond 32 bits"),
    ("flux_uwb=-3e9", "beyond 32 bits"), ("flux_uwb * 2", "is none of"),
])
def test_broken_detune(text, complaint):
    with pytest.raises(LauncherError, match=complaint) as raised:
        load_drive(MOTOR, detune=text)
    assert "\n" not in str(raised.value)


# ---- the firmware's ranges -------------------------------------------------------------------------------------------

def test_ranges_come_from_the_image(elf):
    ranges = ranges_of(Symbols(elf))
    rows = param_rows()
    assert rows and ranges == {name: Range(low, high) for name, (low, high, _) in rows.items()}
    for motor in available(MOTORS):
        check_ranges(load_drive(motor), ranges)


@pytest.mark.parametrize("change, detune, complaint", [
    ({"motor": {"encoder": {"counts_per_rev": 60}}}, "",
     r"teknic_m2310p.toml: \[encoder\] counts_per_rev 60: the firmware takes 64..65536"
     r" \(parameter encoder_counts 64..65536, here 60\)"),
    ({"motor": {"electrical": {"ld_h": 1e-7, "lq_h": 1e-7}}}, "", r"\[electrical\] ld_h 1e-07: the firmware takes 1e-06..1 "),
    ({"motor": {"control": {"speed_bw_hz": 500}}}, "", r"\[control\] speed_bw_hz 500: the firmware takes 1..200"),
    ({"inverter": {"sensor": {"v_range_v": 5000}}}, "",
     r"lv24_drv8323.toml: \[sensor\] v_range_v 5000: the firmware takes "),
    ({"params": {"pole_pairs": 0}}, "", "override: the firmware takes pole_pairs 1..50, not 0"),
    ({}, "flux_uwb*0.001", r"DETUNE flux_uwb\*0.001: the firmware takes flux_uwb 10..10000000, not 6"),
])
def test_what_the_firmware_would_refuse(elf, change, detune, complaint):
    with pytest.raises(LauncherError, match=complaint) as raised:
        check_ranges(load_drive(MOTOR, change, detune=detune), ranges_of(Symbols(elf)))
    assert "\n" not in str(raised.value)


def test_an_image_with_other_parameters(elf):
    drive = load_drive(MOTOR)
    drive.params["new_mv"] = 1
    with pytest.raises(LauncherError, match="the image has no parameter 'new_mv'"):
        check_ranges(drive, ranges_of(Symbols(elf)))


def test_coarse_units_are_noted():
    bare = {"motor": {"mechanical": {"inertia_kgm2": 2.39e-9}, "load": {"inertia_ratio": 0}}}
    assert load_drive(MOTOR, bare).notes == [
        "inertia_gmm2: the firmware takes whole units, 2.39 becomes 2 (-16.3 %)"]
    assert coarse_notes({"a": 100.4, "b": 50.0, "c": 24.5}) == ["c: the firmware takes whole units, 24.5 becomes 24 (-2.0 %)"]


def test_drawn_pulses_are_typed_where_they_are_wanted_and_the_tone_is_not():
    for detune, typed in (("", []), ("injection_silent=1", ["set injection_silent 1"])):
        lines = preamble(load_drive("thor_pmsyrm", detune=detune))
        assert [line for line in lines if "silent" in line] == typed and "set injection_mv 60000" in lines
    assert "set injection_mv" not in " ".join(preamble(load_drive("teknic_m2310p")))


# ---- [control] by rule -----------------------------------------------------------------------------------------------

def by_rule(motor, **changes):
    """[control] of a shipped motor without its own."""
    device = load_motor(motor)
    device.override(changes)
    from launcher.rules import control_by_rule
    return control_by_rule(device, load_inverter(device.inverter))


@pytest.mark.parametrize("motor", available(MOTORS))
def test_rules_keep_to_the_sensors_and_to_the_bus(motor):
    drive = load_drive(motor)
    rule, electrical, rating = by_rule(motor), drive.motor["electrical"], drive.motor["rating"]
    sensor, bridge = drive.inverter["sensor"], drive.inverter["bridge"]
    assert rule["i_max_a"] <= 0.85 * rule["i_trip_a"]
    assert rule["i_trip_a"] <= 0.9501 * min(sensor["i_range_a"], bridge["oc_trip_a"])
    assert rule["i_align_a"] < rule["i_max_a"] and rule["speed_max_rpm"] < rule["overspeed_rpm"]
    # the voltage at rated torque and the largest speed, worked out anew
    i_q = rating["rated_torque_nm"] / (1.5 * electrical["pole_pairs"] * electrical["flux_wb"])
    w = rule["speed_max_rpm"] * 2 * math.pi / 60 * electrical["pole_pairs"]
    volts = abs(complex(w * electrical["flux_wb"] + 1.31 * electrical["resistance_ohm"] * i_q, w * electrical["lq_h"] * i_q))
    assert volts <= 0.85 * drive.inverter["supply"]["vbus_v"] / math.sqrt(3) * (1 + 1e-9)
    # ramp: no more than half of rated torque
    assert rule["ramp_rpm_s"] * math.pi / 30 * drive.inertia_kgm2 <= 0.5 * rating["rated_torque_nm"] * (1 + 1e-9)


def test_a_salient_motor_is_aligned_gently():
    salient = by_rule("qs138_3kw", electrical={"lq_h": 800e-6})
    assert salient["i_align_a"] == pytest.approx(0.5 * 19.01e-3 / (800e-6 - 31e-6), rel=0.01)


def test_a_bus_that_is_too_low(tmp_path):
    text = (MOTORS / "mjbots_mj5208.toml").read_text().split("[check]")[0].replace("value = 0.047,", "value = 1.0,")
    text = re.sub("(?m)^thermal_resistance_k_w.*$", "", text)
    (tmp_path / "weak.toml").write_text(text)
    with pytest.raises(LauncherError, match="the bus of lv36_drv8323 cannot even drive rated current"):
        load_drive(str(tmp_path / "weak.toml"), {"inverter": {"supply": {"vbus_v": 20}}})


# ---- saturation ------------------------------------------------------------------------------------------------------

@pytest.mark.parametrize("ld_h, lq_h, flux_wb, at_a, losses", [
    (200e-6, 200e-6, 6.4e-3, 10.65, (0.08, 0.12, 0.03)), (36e-3, 51e-3, 0.545, 9.12, (0.12, 0.25, 0.05)),
    (26e-6, 45.8e-6, 2.591e-3, 60.0, (0.2, 0.35, 0.24)), (520e-6, 656e-6, 20.19e-3, 13.3, (0.1, 0.25, 0.08)),
    (200e-6, 300e-6, 6.4e-3, 10.0, (0.0, 0.2, 0.0)),
])
def test_short_form_has_the_losses_that_it_states(ld_h, lq_h, flux_wb, at_a, losses):
    m = from_losses({"ld_h": ld_h, "lq_h": lq_h, "flux_wb": flux_wb}, *losses, at_a, "here")
    start = (flux_wb, 0.0)
    np.testing.assert_allclose(fluxes(m, 0, 0, start), start, atol=1e-6 * flux_wb)
    np.testing.assert_allclose(np.linalg.inv(jacobian(m, start)), np.diag([ld_h, lq_h]), rtol=1e-5, atol=1e-9 * ld_h)
    along_d = fluxes(m, at_a, 0, (flux_wb + ld_h * at_a, 0.0))
    along_q = fluxes(m, 0, at_a, ((1 - losses[2]) * flux_wb, 0.8 * lq_h * at_a))
    assert 1 - np.linalg.inv(jacobian(m, along_d))[0, 0] / ld_h == pytest.approx(losses[0], abs=1e-4)
    assert 1 - np.linalg.inv(jacobian(m, along_q))[1, 1] / lq_h == pytest.approx(losses[1], abs=1e-4)
    assert 1 - along_q[0] / flux_wb == pytest.approx(losses[2], abs=1e-4)
    g = jacobian(m, along_q)
    assert g[0, 1] == pytest.approx(g[1, 0], rel=1e-6, abs=1e-6 * g[0, 0]), "not reciprocal"


@pytest.mark.parametrize("name", [name for name in available(MOTORS) if load_motor(name).saturation()])
def test_shipped_maps_belong_to_their_linear_values(name):
    """The flux at no current is flux_wb; with the short form the inductances are ld_h and lq_h."""
    motor = load_motor(name)
    m, electrical = motor.saturation(), motor["electrical"]
    psi = fluxes(m, 0, 0, (electrical["flux_wb"], 0.0))
    np.testing.assert_allclose(psi, (electrical["flux_wb"], 0.0), rtol=2e-3, atol=1e-9)
    if not motor["saturation"]["sat_a_d0"]:
        np.testing.assert_allclose(np.diag(np.linalg.inv(jacobian(m, psi))), (electrical["ld_h"], electrical["lq_h"]),
                                   rtol=1e-4)


@pytest.mark.parametrize("name", ["baldor_ecs101m0h7ef4", "thor_pmsyrm"])
def test_published_fluxes_follow_from_the_coefficients(name):
    """By the published equations, without the twin: within 2 % of measurement and of finite elements."""
    motor = load_motor(name)
    m, checked = motor.saturation(), 0
    for point in motor.points:
        if "psi_d_wb" in point.values:
            published = np.array([point.values["psi_d_wb"], point.values["psi_q_wb"]])
            psi = fluxes(m, point.i_d_a, point.i_q_a, published)
            assert np.hypot(*(psi - published)) < 0.02 * np.hypot(*published), point
            checked += 1
    assert checked >= 4


def test_tolerances_stretch_the_map_and_keep_it_reciprocal():
    m = load_motor("baldor_ecs101m0h7ef4").saturation()
    s = m.scaled(1.1, 0.9, 1.0)
    for psi in ((0.4, 0.5), (0.2, -1.0), (0.6, 0.1)):
        g, scaled = jacobian(m, psi), jacobian(s, (psi[0] * 1.1**0.5, psi[1] * 0.9**0.5))
        stretch = np.diag([1.1**-0.5, 0.9**-0.5])
        # the magnet is not stretched with the axis: with its own flux scaled alike, the maps are the same
        alike = jacobian(m.scaled(1.1, 0.9, 1.1**0.5), (psi[0] * 1.1**0.5, psi[1] * 0.9**0.5))
        np.testing.assert_allclose(alike, stretch @ g @ stretch, rtol=1e-5)
        assert scaled[0, 1] == pytest.approx(scaled[1, 0], rel=1e-5)
    assert isinstance(s, Saturation)


# ---- the twin --------------------------------------------------------------------------------------------------------

def twin_keys():
    """{section.key: (low, high, default)} of the tables in the twin's sources."""
    words = {"CODES": 2048.0, "CONFIG_REQUIRED": math.nan, "REFERENCE_C": 25.0}
    keys = {}
    for path in sorted((REPO / "qemu" / "twin").glob("*.c")):
        for struct, body in re.findall(r"offsetof\(struct (motor|load|inverter|sensor)_params, field\)(.*?)CONFIG_KEYS_END",
                                       path.read_text(), re.S):
            for name, *numbers in re.findall(r"KEY\((\w+), ([^,()]+), ([^,()]+), ([^,()]+)\)", body):
                keys[f"{struct}.{name}"] = tuple(
                    math.copysign(words[n.strip("-")], -1 if n[0] == "-" else 1) if n.strip("-") in words else float(n)
                    for n in numbers)
    return keys


def test_the_twin_takes_whatever_a_file_may_hold():
    """Same names, no narrower range, and the same default where the launcher leaves a key out."""
    twin, names = twin_keys(), {"counts_per_rev": "encoder_counts"}
    assert len(twin) > 100
    for tables in (MOTOR_TABLES, INVERTER_TABLES):
        for table, keys in tables.items():
            for key, entry in keys.items():
                item = f"{SECTIONS.get(table)}.{names.get(key, key)}"
                if table not in SECTIONS or key in (*SHORT, "inertia_ratio", "modulator_osr", "fitted"):
                    continue
                assert item in twin, f"the twin has no {item}"
                low, high, default = twin[item]
                assert low <= entry.low and entry.high <= high, f"{item}: {entry.low}..{entry.high}, the twin {low}..{high}"
                if not entry.required and entry.default is not BY_RULE and item not in ALWAYS and not key.endswith("_per_rev"):
                    assert default == entry.default, f"{item}: default {entry.default}, the twin's {default}"
