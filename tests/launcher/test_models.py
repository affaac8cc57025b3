# SPDX-License-Identifier: MIT
"""`make models`: how figures of the bench are put beside the data sheet. The bench itself is qemu/twin/modelcheck.c."""
import pytest

from launcher import LauncherError
from launcher.data import MOTORS, available, load_motor
from launcher.model_check import check_models, is_known

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
    for name in available(MOTORS):
        assert all(map(is_known, load_motor(name).checks)), name


def test_the_right_model_passes_and_a_wrong_one_does_not(bench):
    out = []
    assert check_models("maxon_ec45flat", bench(MAXON), out.append) == 0, out
    for name in ("resistance_line_line", "torque_constant_six_step", "stall_torque_six_step_mean",
                 "no_load_speed_six_step", "no_load_current_six_step", "stall_current"):
        wrong = dict(MAXON, **{name: MAXON[name] * 1.15})
        assert check_models("maxon_ec45flat", bench(wrong), lambda line: None) == 1, name


def test_a_bench_that_fails(bench):
    with pytest.raises(LauncherError, match="mssfoc modelcheck: broken"):
        check_models("maxon_ec45flat", bench(MAXON, status=1), print)
    with pytest.raises(LauncherError, match="did not measure 'no_load_speed_six_step'"):
        check_models("maxon_ec45flat", bench({"resistance_line_line": 0.573}), print)
