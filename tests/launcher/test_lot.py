# SPDX-License-Identifier: MIT
"""Motors by lot: what is drawn follows from the number alone, belongs together, and holds every shipped motor in its spread."""
import collections
import functools
import hashlib
import json
import math

import pytest

from launcher import LauncherError
from launcher.campaign import fingerprint, parse_case, plan
from launcher.config import twin_config
from launcher.consistency import most_torque_nm
from launcher.data import load_inverter, load_motor, motors_named
from launcher.drive import load_drive, preamble
from launcher.lot import lot_files, supplied
from launcher.lot_draw import Draw
from launcher.lot_kinds import KINDS
from launcher.lot_machine import COPPER, COPPER_TEMPCO, EDDY_W, CYCLE_J_KG, STEEL_KG_M3, YOKE_T
from launcher.lot_stage import FULL, SMALL
from launcher.lot_text import text_of
from launcher.params import Range, check_ranges
from launcher.parts import is_part, parse
from launcher.paths import INVERTERS
from launcher.scenario import load_scenario
from rows import param_rows

PERIOD_S = 50e-6
SOME = range(1, 121)
RANGES = {name: Range(low, high) for name, (low, high, _) in param_rows().items()}

# A change of these changes every figure that was ever stated of a lot.
PINNED = {1: "7a86f8bfad56e13c", 7: "e92b96ca2e5498fe", 42: "9bb3a1df2bd03fd0",
          200: "3aebe76f804bd23d", 1000000: "bcab654171ac1c04"}


@functools.lru_cache(maxsize=None)
def drive(number):
    return load_drive(f"lot:{number}")


@functools.lru_cache(maxsize=None)
def drives():
    """[(number, Drive)] of SOME that can be set up."""
    found = []
    for number in SOME:
        try:
            check_ranges(drive(number), RANGES)
            found.append((number, drive(number)))
        except LauncherError:
            pass
    return found


@pytest.mark.parametrize("number", PINNED)
def test_a_lot_never_changes(number):
    text = json.dumps(lot_files(f"lot:{number}"), sort_keys=True)
    assert hashlib.sha256(text.encode()).hexdigest()[:16] == PINNED[number]


def test_draws_are_independent_and_uniform():
    shares = [Draw(n).share("bore") for n in range(1, 2001)]
    assert abs(sum(shares) / 2000 - 0.5) < 0.02 and min(shares) < 0.005 and max(shares) > 0.995
    other = [Draw(n).share("gap") for n in range(1, 2001)]
    assert abs(sum((a - 0.5) * (b - 0.5) for a, b in zip(shares, other)) / 2000 * 12) < 0.07


def test_nearly_all_can_be_set_up():
    """The others for a reason that a user would be told: a value that the firmware does not take, by name."""
    reasons = []
    for number in SOME:
        try:
            check_ranges(drive(number), RANGES)
        except LauncherError as error:
            reasons.append(str(error))
    assert len(reasons) < 0.03 * len(SOME), reasons
    assert all("the firmware takes" in reason for reason in reasons), reasons


def test_what_is_drawn_on_purpose_is_there():
    """Kinds, supplies from 12 to 600 V, sensors, loads, small stages, friction."""
    found = [d for _, d in drives()]
    kinds = collections.Counter(d.motor.name.split(": ")[1].split(",")[0] for d in found)
    assert set(kinds) == set(KINDS) and min(kinds.values()) >= 5, kinds
    volts = [d.inverter["supply"]["vbus_v"] for d in found]
    assert min(volts) == 12 and max(volts) == 600 and sum(d.inverter["supply"]["rectifier_hz"] > 0 for d in found) > 10
    sources = collections.Counter(d.motor["control"]["angle_source"] for d in found)
    assert all(sources[source] > 0.08 * len(found) for source in (0, 1, 2)), sources
    counts = {d.motor["encoder"]["counts_per_rev"] for d in found if d.motor["encoder"]["fitted"]}
    assert min(counts) == 64 and max(counts) == 65536
    ratios = [d.motor["load"]["inertia_ratio"] for d in found]
    assert 0.08 < sum(ratio == 0 for ratio in ratios) / len(found) < 0.3 and max(ratios) > 80
    soft = [d for d in found if d.motor["load"]["stiffness_nm_rad"]]
    assert len(soft) > 0.3 * len(found) and all(19 < resonance_hz(d) < 810 for d in soft)
    assert min(map(resonance_hz, soft)) < 40 and max(map(resonance_hz, soft)) > 500
    friction = [(d.motor["load"]["coulomb_nm"] + d.motor["mechanical"]["friction_coulomb_nm"]) / d.motor["rating"][
        "rated_torque_nm"] for d in found]
    assert max(friction) < 0.151 and max(friction) > 0.13 and min(friction) < 0.004
    assert any(electrical_tau_s(d) < PERIOD_S for d in found)
    overload = [d.motor["control"]["i_max_a"] / d.motor["rating"]["rated_current_a"] for d in found]
    small = [share for share in overload if share < 1.3]
    assert 0.1 < len(small) / len(found) < 0.3
    assert all(SMALL * 0.995 < share < SMALL * 1.04 for share in small)
    assert all(FULL * 0.985 < share <= FULL * (1 + 1e-9) for share in overload if share not in small)


def test_magnets_and_reluctance_meet_from_a_third_to_five_times_i_max():
    shares = [m.flux_wb / (m.lq_h - m.ld_h) / FULL / m.current_a for kind in ("interior", "assisted", "traction")
              for m in machines(kind, 60)]
    for low, high in ((0.1, 0.5), (0.5, 1), (1, 2), (2, 5), (5, 13)):
        assert sum(low < share < high for share in shares) >= 4, (low, high)


def electrical_tau_s(drive):
    return drive.motor["electrical"]["lq_h"] / drive.motor["electrical"]["resistance_ohm"]


def resonance_hz(drive):
    rotor, load = drive.motor["mechanical"]["inertia_kgm2"], drive.load_inertia_kgm2
    return math.sqrt(drive.motor["load"]["stiffness_nm_rad"] * (rotor + load) / rotor / load) / 2 / math.pi


# ---- the laws, worked out again --------------------------------------------------------------------------------------

def machines(kind_name, count):
    kind = KINDS[kind_name]
    return [supplied(Draw(n), kind)[1] for n in range(1, count + 1)]


@pytest.mark.parametrize("kind_name", KINDS)
def test_rated_current_is_what_heat_and_iron_allow(kind_name):
    """Copper at its temperature, and iron at rated speed, heat the winding by the rated rise; a kind may be rated lower."""
    for n, m in enumerate(machines(kind_name, 60), 1):
        w = m.speed_rpm * math.pi / 30
        copper_w = 1.5 * m.resistance_ohm * (1 + COPPER_TEMPCO * m.rise_k) * m.current_a**2
        rated = Draw(n).between("rated", *KINDS[kind_name].rated)
        iron_w = m.hysteresis_nm * w + m.eddy_nms * w**2
        heated_k = m.thermal_k_w * (copper_w / rated**2 + iron_w)
        density = m.current_a * m.turns * 6 / math.sqrt(2) / m.shape.copper_m2
        assert heated_k == pytest.approx(m.rise_k, rel=1e-6) or (heated_k < m.rise_k and density == pytest.approx(25e6 * rated))
        assert iron_w * m.thermal_k_w <= 0.5001 * m.rise_k


@pytest.mark.parametrize("kind_name", KINDS)
def test_torque_is_shear_times_volume(kind_name):
    """Of magnets alone: with the loading A of the bore, T = pi / 2 D^2 l sigma, sigma = k_w B A / sqrt(2)."""
    for m in machines(kind_name, 60):
        s = m.shape
        loading = 6 * m.turns * m.current_a / math.sqrt(2) / (math.pi * s.bore)
        shear = s.winding_factor * s.flux_t * loading / math.sqrt(2)
        magnets_nm = 1.5 * s.pole_pairs * m.flux_wb * m.current_a
        assert magnets_nm == pytest.approx(math.pi / 2 * s.bore**2 * s.length * shear, rel=1e-6)
        assert 300 < shear < 60e3  # Pa: from a gimbal in still air to a cooled traction machine
        assert m.torque_nm >= magnets_nm * 0.999


@pytest.mark.parametrize("kind_name", KINDS)
def test_copper_and_iron_are_those_of_the_size(kind_name):
    for n, m in enumerate(machines(kind_name, 60), 1):
        s, draw = m.shape, Draw(n)
        wire_m2 = s.copper_m2 / (6 * m.turns)
        assert m.resistance_ohm == pytest.approx(COPPER * 2 * m.turns * s.turn / wire_m2, rel=1e-6)
        solid = math.pi / 32 * STEEL_KG_M3 * 1.1 * s.length * s.bore**4
        if not KINDS[kind_name].outer:
            assert 0.2 * solid < m.inertia_kgm2 < solid
        hz = m.speed_rpm / 60 * s.pole_pairs
        sheet_mm = draw.pick("sheet", KINDS[kind_name].sheet_mm)
        least_w = 1.2 * s.iron_kg * (CYCLE_J_KG * hz + EDDY_W * YOKE_T**2 * (sheet_mm / 0.5)**2 * hz**2)
        w = m.speed_rpm * math.pi / 30
        share = 0.4 if KINDS[kind_name].slotless else 1
        assert share * least_w <= (m.hysteresis_nm * w + m.eddy_nms * w**2) * 1.001 <= share * least_w * 4 / 1.2 * 1.002


def test_inertia_and_flux_and_inductance_scale_with_size():
    """Over the servos: torque as the cube and more, inertia by torque as 1 to 2 powers of the bore, L/R as about its square."""
    def power(value):
        small, large = ([value(m) for m in machines("servo", 600) if low < m.shape.bore < high]
                        for low, high in ((0.018, 0.03), (0.07, 0.11)))
        return math.log(median(large) / median(small)) / math.log(0.088 / 0.0235)
    assert 2.7 < power(lambda m: m.torque_nm) < 4
    assert 0.5 < power(lambda m: m.inertia_kgm2 / m.torque_nm) < 2
    assert 1 < power(lambda m: m.lq_h / m.resistance_ohm) < 2.6


def median(values):
    return sorted(values)[len(values) // 2]


@pytest.mark.parametrize("number", SOME[:60])
def test_the_bus_gives_the_rated_point(number):
    """The voltage of rated torque and speed is 45 to 115 % of what the drive makes of the bus: turns are whole."""
    motor, inverter = (load_motor(f"lot:{number}"), load_inverter(f"lot:{number}"))
    e, r = motor["electrical"], motor["rating"]
    lq_h = motor["control"]["lq_rest_h"] or e["lq_h"]
    current_a, saliency_h = r["rated_current_a"], lq_h - e["ld_h"]
    i_d = 0.0
    if saliency_h:
        i_d = (e["flux_wb"] - math.hypot(e["flux_wb"], math.sqrt(8) * saliency_h * current_a)) / (4 * saliency_h)
    i_q, w = math.sqrt(current_a**2 - i_d**2), r["rated_speed_rpm"] * math.pi / 30 * e["pole_pairs"]
    volts = math.hypot(1.31 * e["resistance_ohm"] * i_d - w * lq_h * i_q,
                       1.31 * e["resistance_ohm"] * i_q + w * (e["flux_wb"] + e["ld_h"] * i_d))
    assert 0.45 < volts / (0.85 * inverter["supply"]["vbus_v"] / math.sqrt(3)) < 1.15
    assert r["rated_torque_nm"] == pytest.approx(most_torque_nm(e["pole_pairs"], e["flux_wb"], saliency_h, current_a), rel=0.35)
    assert r["rated_speed_rpm"] <= r["max_speed_rpm"]


# ---- the shipped motors ------------------------------------------------------------------------------------------------

KIND_OF = {"teknic_m2310p": "servo", "estun_emj04apb22": "servo", "abb_m2bj100l": "interior", "thor_pmsyrm": "assisted",
           "baldor_ecs101m0h7ef4": "assisted", "maxon_ec22": "slotless", "maxon_ec45flat": "outrunner",
           "mjbots_mj5208": "outrunner", "dys_be8108": "outrunner", "rctimer_gbm5208": "gimbal", "hoverboard_350w": "hub",
           "qs138_3kw": "traction"}
BENCH_INERTIA = {"baldor_ecs101m0h7ef4"}  # its 0.05 kg m^2 are the whole bench


def figures(pole_pairs, resistance_ohm, ld_h, lq_h, flux_wb, current_a, torque_nm, rpm, inertia_kgm2, thermal_k_w, iron_nm):
    """What does not depend on turns."""
    return {"torque^2 / copper loss": torque_nm**2 / (1.5 * resistance_ohm * current_a**2),
            "inertia / torque": inertia_kgm2 / torque_nm, "Lq / R": lq_h / resistance_ohm,
            "psi / (Ld I)": flux_wb / ld_h / current_a, "Lq / Ld": lq_h / ld_h, "rated frequency": rpm * pole_pairs / 60,
            "copper's rise": 1.5 * resistance_ohm * current_a**2 * thermal_k_w, "rated power": torque_nm * rpm,
            "iron / torque": iron_nm / torque_nm}


def of_shipped(motor):
    e, r, iron = motor["electrical"], motor["rating"], motor["iron"]
    w = r["rated_speed_rpm"] * math.pi / 30
    found = figures(e["pole_pairs"], e["resistance_ohm"], e["ld_h"], motor["control"]["lq_rest_h"] or e["lq_h"], e["flux_wb"],
                    r["rated_current_a"], r["rated_torque_nm"], r["rated_speed_rpm"], motor["mechanical"]["inertia_kgm2"],
                    motor["thermal"]["thermal_resistance_k_w"], iron["iron_hysteresis_nm"] + iron["iron_eddy_nms"] * w)
    if not motor.sources["iron"]:
        found.pop("iron / torque")
    if motor.key in BENCH_INERTIA:
        found.pop("inertia / torque")
    return found


def of_lot(m):
    w = m.speed_rpm * math.pi / 30
    return figures(m.shape.pole_pairs, m.resistance_ohm, m.ld_h, m.lq_h, m.flux_wb, m.current_a, m.torque_nm, m.speed_rpm,
                   m.inertia_kgm2, m.thermal_k_w, m.hysteresis_nm + m.eddy_nms * w)


@pytest.mark.parametrize("name", KIND_OF)
def test_each_shipped_motor_could_have_been_drawn(name):
    """Each figure lies within those of its kind's lots of half to twice its torque."""
    motor = load_motor(name)
    torque_nm = motor["rating"]["rated_torque_nm"]
    pool = [of_lot(m) for m in machines(KIND_OF[name], 1500) if 0.5 < m.torque_nm / torque_nm < 2]
    assert len(pool) > 100
    for figure, value in of_shipped(motor).items():
        lots = [lot[figure] for lot in pool]
        assert min(lots) <= value <= max(lots), (figure, value, min(lots), median(lots), max(lots))


def test_every_shipped_motor_has_a_kind():
    from launcher.data import MOTORS, available
    assert set(KIND_OF) == set(available(MOTORS))


# ---- as a motor is used ----------------------------------------------------------------------------------------------

def test_a_shown_lot_is_the_lot(tmp_path):
    """Both files, read again, are the same plant and the same parameters."""
    (tmp_path / "stage.toml").write_text(text_of("lot:9", inverter=True))
    text = text_of("lot:9").replace('inverter = "lot:9"', 'inverter = "stage.toml"')
    assert "stage.toml" in text
    (tmp_path / "mine.toml").write_text(text)
    mine, lot = load_drive(str(tmp_path / "mine.toml")), drive(9)
    assert (mine.motor.values, mine.inverter.values, mine.params) == (lot.motor.values, lot.inverter.values, lot.params)
    assert mine.motor.spreads == lot.motor.spreads and mine.motor.name == lot.motor.name


def test_a_shipped_motor_is_shown_as_it_is():
    assert text_of("maxon_ec22", inverter=True) == (INVERTERS / "lv24_drv8316.toml").read_text()


def test_what_tells_the_angle_is_told():
    """Without an encoder its inputs are open, and the drive is told which source there is."""
    for source in (0, 1, 2):
        d = next(d for _, d in drives() if d.motor["control"]["angle_source"] == source)
        assert (f"set angle_source {source}" in preamble(d)) == (source != 0)
        still = {"title": "still", "end_s": 0.1, "preamble_s": 0.05}
        lines = twin_config(d, load_scenario(still, d), 1, [], {}).splitlines()
        assert ("event 0 encoder_cut 1" in lines) == (source != 0)
        assert not any("fitted" in line or "angle_source" in line for line in lines if "console" not in line)


@pytest.mark.parametrize("name", ["lot:0", "lot:", "lot:x", "lot:1000001", "lot:-3", "lot:01"])
def test_a_lot_that_is_none(name):
    with pytest.raises(LauncherError, match="is not lot:N"):
        load_motor(name)


def test_ranges_and_files_in_a_campaign(tmp_path):
    assert motors_named(["lot:3-5", "teknic_m2310p"]) == ["lot:3", "lot:4", "lot:5", "teknic_m2310p"]
    with pytest.raises(LauncherError, match="is not lot:A-B"):
        motors_named(["lot:5-3"])
    file = tmp_path / "a b.toml"
    file.write_text(text_of("lot:9"))
    case, = plan([str(file)], ["default"], seeds=1, detunes=["flux_uwb/2"])
    assert parse_case(case.key) == case and case.motor == str(file)
    assert parse_case("lot:7/default/3") == plan(["lot:7"], ["default"], seeds=3)[2]


def test_a_lot_is_no_part():
    assert not is_part("lot:7/default/1") and is_part("start:lot:7/free/45")
    case = parse("start:lot:7/free/45")
    assert (case.part, case.motor, case.what) == ("start", "lot:7", "free/45")
    assert parse("start:/a/b.toml/free/45").motor == "/a/b.toml"


def test_results_of_a_changed_file_are_not_taken_for_the_new_ones(tmp_path):
    (tmp_path / "qemu").mkdir()
    (tmp_path / "mssfoc.hex").write_text("")
    (tmp_path / "qemu" / "twin.so").write_text("")
    file, stage = tmp_path / "mine.toml", tmp_path / "stage.toml"
    file.write_text(text_of("lot:9").replace('inverter = "lot:9"', 'inverter = "stage.toml"'))
    stage.write_text(text_of("lot:9", inverter=True))
    seen = {fingerprint(tmp_path, [str(file)])}
    for changed in (file, stage):
        changed.write_text(changed.read_text() + "# another\n")
        seen.add(fingerprint(tmp_path, [str(file)]))
    assert len(seen) == 3
