# SPDX-License-Identifier: MIT
"""The motor bench of `make models` on a machine with everything: what it measures is what the configuration says, and
what the configuration cannot say ends it with one line."""
import math
import os
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PROGRAM = ROOT / os.environ.get("BUILD", "build") / "qemu" / "modelcheck"

# THOR of SyR-e, its map fitted; EMF, cogging and iron loss as its finite elements have them
THOR = {
    "pole_pairs": 2, "resistance_ohm": 0.2, "ld_h": 6e-3, "lq_h": 13.9e-3, "flux_wb": 0.1338, "inertia_kgm2": 4.228e-3,
    "sat_a_d0": 28.51, "sat_a_dd": 128.8, "sat_s": 2, "sat_a_q0": 20.64, "sat_a_qq": 5756, "sat_t": 6,
    "sat_a_dq": 4247, "sat_u": 1, "sat_v": 1, "sat_a_b": 7360, "sat_a_bp": 17.69, "sat_w": 2, "sat_k_q": 0.1398,
    "sat_psi_n_wb": 0.2196,
    "emf_5": 0.0125, "emf_7": -0.0042, "emf_11": 0.019, "emf_13": 0.023, "emf_17": 0.009, "emf_19": 0.056,
    "permeance_6": 0.03, "permeance_12": -0.02, "cogging_nm": 0.2275, "cogging_per_rev": 36,
    "iron_hysteresis_nm": 0.0344, "iron_eddy_nms": 6.56e-5, "magnet_tempco_per_k": -1.1e-3, "friction_coulomb_nm": 0.05,
}
LOAD = {"inertia_kgm2": 4.228e-3, "stiffness_nm_rad": 700, "damping_nms": 0.01, "fan_nms2": 1e-5, "coulomb_nm": 0.1,
        "stiction_nm": 0.2, "stribeck_rad_s": 2}


def bench(folder, motor, load=None, *arguments, lines=()):
    config = folder / "motor.cfg"
    config.write_text("".join([*(f"motor.{key} {value}\n" for key, value in motor.items()),
                               *(f"load.{key} {value}\n" for key, value in (load or {}).items()),
                               "inverter.vbus_v 310\n", *(f"{line}\n" for line in lines)]))
    return subprocess.run([PROGRAM, config, "rated_a_rms=15.6", *arguments], capture_output=True, text=True, timeout=60)


@pytest.fixture(scope="module")
def figures(tmp_path_factory):
    answer = bench(tmp_path_factory.mktemp("thor"), THOR, LOAD, "map=0,22", "map=-15,16", "drag_rpm=3000")
    assert answer.returncode == 0, answer.stderr
    return {name: float(value) for name, value, _unit in (line.split() for line in answer.stdout.splitlines())}


def open_circuit(remanence):
    """Flux linkage without current, by the map's equations."""
    low, high = 0.0, 1.0
    for _ in range(60):
        psi = (low + high) / 2
        off = psi - THOR["sat_psi_n_wb"] * remanence
        bridges = THOR["sat_a_b"] * off ** 2 / (1 + THOR["sat_a_bp"] * off ** 2)
        current = psi * (THOR["sat_a_d0"] + THOR["sat_a_dd"] * psi ** THOR["sat_s"]) + bridges * off
        low, high = (psi, high) if current < 0 else (low, psi)
    return low


def test_what_turns_with_the_rotor(figures):
    for order in (5, 7, 11, 13, 17, 19):
        assert figures[f"emf_harmonic_{order}"] == pytest.approx(100 * THOR[f"emf_{order}"], abs=1e-3)
    assert figures["permeance_6"] == pytest.approx(3, abs=0.01) and figures["permeance_12"] == pytest.approx(-2, abs=0.01)
    assert figures["cogging_peak_to_peak"] == pytest.approx(2 * THOR["cogging_nm"], rel=0.01)
    assert figures["torque_ripple_rated"] > 20


def test_flux(figures):
    assert figures["open_circuit_flux"] == pytest.approx(0.1338, rel=1e-3)
    # remanence falls by 0.11 %/K, and the bridges take their part of the flux first
    assert figures["magnet_tempco"] == pytest.approx(100 * (open_circuit(1 - 1.1e-3 * 75) / open_circuit(1) - 1) / 75, abs=1e-4)
    # finite elements, within what the fit leaves
    assert figures["map_psi_d@0,22"] == pytest.approx(0.1643, rel=0.03)
    assert figures["map_psi_q@0,22"] == pytest.approx(0.3848, rel=0.02)
    assert figures["map_torque@-15,16"] == pytest.approx(19, rel=0.03)
    for key, published_h in (("l_dd", 3.6e-3), ("l_dq", 1.36e-3), ("l_qq", 10.0e-3)):
        assert figures[f"map_{key}@-15,16"] == pytest.approx(published_h, abs=0.4e-3)


def test_shaft(figures):
    drag_nm = THOR["iron_hysteresis_nm"] + THOR["iron_eddy_nms"] * 100 * math.pi
    # harmonics of the magnets' flux add their own squares
    assert figures["iron_power@3000"] == pytest.approx(drag_nm * 100 * math.pi, rel=1e-3)
    assert figures["drag_torque@3000"] == pytest.approx(drag_nm + 0.05, rel=1e-3)
    assert figures["two_mass_resonance"] == pytest.approx(math.sqrt(700 * 2 / 4.228e-3) / (2 * math.pi), rel=1e-3)
    assert figures["two_mass_antiresonance"] == pytest.approx(math.sqrt(700 / 4.228e-3) / (2 * math.pi), rel=1e-3)


def test_energy(figures):
    assert figures["energy_balance_error"] < 1e-4


def test_block_commutation_is_for_machines_it_suits(figures, tmp_path):
    assert "no_load_speed_six_step" not in figures
    linear = {key: value for key, value in THOR.items() if not key.startswith("sat_")}
    assert "no_load_speed_six_step" in bench(tmp_path, linear).stdout


@pytest.mark.parametrize("change, complaint", [
    ({"sat_s": 2.5}, "sat_u and sat_v are whole numbers"), ({"sat_w": 3}, "motor.sat_w is 2 or 4"),
    ({"sat_a_q0": 0}, "needs motor.sat_a_q0"), ({"sat_t": 9}, "outside 0...8"), ({"sat_a_d0": "many"}, "not a number"),
    ({"emf_5": 0.7}, "outside -0.5...0.5"), ({"emf_3": 0.1}, "unknown key 'motor.emf_3'"),
    ({"cogging2_per_rev": 7.5}, "are whole numbers"), ({"magnet_tempco_per_k": 0.1}, "outside -0.01...0")])
def test_a_machine_that_cannot_be(tmp_path, change, complaint):
    answer = bench(tmp_path, {**THOR, **change})
    assert answer.returncode == 1 and complaint in answer.stderr and len(answer.stderr.splitlines()) == 1


def test_a_map_that_bends_back(tmp_path):
    answer = bench(tmp_path, {**THOR, "sat_a_dq": 1e6}, lines=["inverter.oc_trip_a 60"])
    assert answer.returncode == 1 and "an inductance turns negative" in answer.stderr
    assert bench(tmp_path, THOR, lines=["inverter.oc_trip_a 60"]).returncode == 0


def test_a_spring_without_a_mass(tmp_path):
    answer = bench(tmp_path, THOR, {"stiffness_nm_rad": 700})
    assert answer.returncode == 1 and "needs load.inertia_kgm2" in answer.stderr


@pytest.mark.parametrize("event, right", [
    ("winding_short A 0.1 0.05", True), ("winding_short C 0.1 off", True), ("winding_short A 1.5 0.05", False),
    ("winding_short A 0 0.05", False), ("winding_short A 0.1", False), ("load_fan 1e-5", True), ("load_fan -1", False),
    ("load_coulomb 0.1", True), ("load_hoist -0.5", True), ("load_hoist", False)])
def test_events_of_the_machine(tmp_path, event, right):
    answer = bench(tmp_path, THOR, None, "map=x", lines=[f"event 0.1 {event}"])
    complaint = "wrong arguments" if not right else "two currents ID,IQ"
    assert answer.returncode == 1 and complaint in answer.stderr


@pytest.mark.parametrize("line, complaint", [
    ("after state=4,2 0.1 end", "two currents ID,IQ"), ("after stat=4 0.1 end", "there is no probe 'stat' yet"),
    ("after state 0.1 end", "expected: after PROBE=VALUE"), ("after state=4,x 0.1 end", "'x' is not a number"),
    ("after state=1,2,3,4,5 0.1 end", "at most 4 values"), ("after state=4 -1 end", "is 0...1e6 s"),
    ("after state=4 0.1 lock 2", "wrong arguments, expected: lock 0|1"), ("after state=4 0.1 end now", "wrong arguments"),
    ("after state=4 0.1 console on", "needs 'console CHARDEV_ID'")])
def test_events_that_wait(tmp_path, line, complaint):
    answer = bench(tmp_path, THOR, None, "map=x", lines=["probe state 0x20000000 u32 1", line])
    assert answer.returncode == 1 and complaint in answer.stderr


@pytest.mark.parametrize("argument, status", [("map=1", 1), ("map=1,2,3", 1), ("drag_rpm=0", 1), ("speed=3", 2)])
def test_wrong_arguments(tmp_path, argument, status):
    answer = bench(tmp_path, THOR, None, argument)
    assert answer.returncode == status and answer.stderr.startswith("mssfoc modelcheck: ")
