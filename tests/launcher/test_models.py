# SPDX-License-Identifier: MIT
"""`make models`: how figures of the bench are put beside the data sheet. The bench itself is qemu/twin/modelcheck.c."""
from pathlib import Path

import pytest

from launcher import LauncherError
from launcher.data import load_motor
from launcher.measured_flux import measured, measured_of, polynomial
from launcher.model_check import check_models, is_known, shipped

# what the maxon motor's ideal model must measure; the test does not ask the twin
MAXON = {
    "back_emf_line_line_peak": 4.430, "back_emf_phase_peak": 0.024426, "resistance_line_line": 0.573,
    "inductance_d": 150.5e-6, "inductance_q": 150.5e-6, "inductance_line_line_mean": 301e-6,
    "torque_constant_peak": 0.036638, "rated_torque": 0.1392, "stall_current": 41.88, "stall_torque_six_step_mean": 1.692,
    "torque_constant_six_step": 0.0404, "no_load_speed_six_step": 5578, "no_load_current_six_step": 0.2695,
    "energy_balance_error": 3e-6,
}


@pytest.fixture
def bench(tmp_path):
    """Makes a modelcheck that prints given figures."""
    def make(figures, status=0):
        program = tmp_path / "qemu" / "modelcheck"
        program.parent.mkdir(exist_ok=True)
        lines = "".join(f"echo '{name} {value} unit'\n" for name, value in figures.items())
        program.write_text(f"#!/bin/sh\n{lines}[ {status} = 0 ] || echo 'mssfoc modelcheck: broken' >&2\nexit {status}\n")
        program.chmod(0o755)
        return tmp_path
    return make


def test_every_check_of_a_shipped_motor_can_be_measured():
    for name in shipped():
        assert all(map(is_known, load_motor(name).checks)), name


def test_the_right_model_passes_and_a_wrong_one_does_not(bench):
    out = []
    assert check_models("maxon_ec45flat", bench(MAXON), out.append) == 0, out
    for name in ("resistance_line_line", "torque_constant_six_step", "stall_torque_six_step_mean",
                 "no_load_speed_six_step", "no_load_current_six_step", "stall_current"):
        wrong = dict(MAXON, **{name: MAXON[name] * 1.15})
        assert check_models("maxon_ec45flat", bench(wrong), lambda line: None) == 1, name


def test_points_and_energy_count(bench):
    """Baldor: flux as a vector, inductances and torque, each wrong by itself; energy that is lost."""
    motor = load_motor("baldor_ecs101m0h7ef4")
    right = {"resistance_line_line": 1.26, "open_circuit_flux": 0.4767, "inductance_d": 1.0, "inductance_q": 5.02,
             "energy_balance_error": 1e-6}
    names = {"psi_d_wb": "map_psi_d", "psi_q_wb": "map_psi_q", "l_dd_h": "map_l_dd", "l_qq_h": "map_l_qq",
             "torque_nm": "map_torque"}
    for point in motor.points:
        right.update({f"{names[key]}@{point.i_d_a:g},{point.i_q_a:g}": value for key, value in point.values.items()})
    out = []
    assert check_models("baldor_ecs101m0h7ef4", bench(right), out.append) == 0, out
    assert any("flux at -6,6 A" in line for line in out) and not any("j" in line for line in out if "flux at" in line)
    for name in ("map_psi_q@-6,6", "map_l_qq@0,12.4", "map_torque@-8,9.5"):
        assert check_models("baldor_ecs101m0h7ef4", bench(dict(right, **{name: right[name] * 1.03})), lambda line: None) == 1
    # 3 % of the smaller component is less than 2 % of the vector
    near = dict(right, **{"map_psi_d@-6,6": right["map_psi_d@-6,6"] * 1.03})
    assert check_models("baldor_ecs101m0h7ef4", bench(near), lambda line: None) == 0
    assert check_models("baldor_ecs101m0h7ef4", bench(dict(right, energy_balance_error=2e-4)), lambda line: None) == 1


@pytest.mark.parametrize("motor", shipped(), ids=lambda name: Path(name).stem)
def test_every_shipped_motor_on_the_bench(motor):
    """The twin's own model, at the published points; needs `make twin`."""
    lines = []
    assert check_models(motor, None, lines.append) == 0, "\n".join(lines)


def test_a_map_that_leaves_the_measured_flux(bench):
    """mj5208 by its figures, and with the flux at the largest current 70 % too large, which linear inductances give."""
    motor, points = load_motor("mjbots_mj5208"), measured_of("mjbots_mj5208")
    right = {"back_emf_line_line_peak": 3.289, "resistance_line_line": 0.094, "inductance_d": 1.0, "inductance_q": 1.762,
             "drag_torque@1000": 0.01534, "energy_balance_error": 1e-6}
    right.update({f"map_torque@0,{point.i_q_a:g}": point.values["torque_nm"] for point in motor.points})
    right.update({f"map_psi_d@{i_d_a:g},0": psi for i_d_a, psi in zip(points.i_d_a, points.psi_d_wb)})
    assert check_models("mjbots_mj5208", bench(right), lambda line: None) == 0
    for i_d_a, share in ((-24.8, 1.7), (-24.8, 1.025), (-12.9, 0.985), (0, 1.011)):
        name = f"map_psi_d@{i_d_a:g},0"
        assert check_models("mjbots_mj5208", bench({**right, name: right[name] * share}), lambda line: None) == 1, name


def test_measured_fluxes_and_the_form_of_the_map():
    """Of what others have measured, the polynomial allows all but points that scatter by more themselves."""
    near = {points.name: polynomial(points)[0] for points in measured()}
    assert len(near) == 7
    assert all(near[name] < 0.012 for name in ("mj5208", "be8108", "custom", "flipsky6374", "mad8318")), near


def test_a_bench_that_fails(bench):
    with pytest.raises(LauncherError, match="mssfoc modelcheck: broken"):
        check_models("maxon_ec45flat", bench(MAXON, status=1), print)
    with pytest.raises(LauncherError, match="did not measure 'no_load_speed_six_step'"):
        check_models("maxon_ec45flat", bench({"resistance_line_line": 0.573}), print)
