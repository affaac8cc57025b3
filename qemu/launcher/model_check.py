# SPDX-License-Identifier: MIT
"""`make models`: every motor's model on the test bench, against the points of its data sheet.

build/qemu/modelcheck applies voltages to the very model the twin runs, and measures; here its figures are put beside the
[check] entries of the motor's data file. What a data sheet defines by a formula is worked out from measured values.
"""
import math
import subprocess
import tempfile
from pathlib import Path

from .data import available
from .drive import RPM, load_drive, twin_items
from .errors import LauncherError
from .paths import MOTORS, build_dir, shown


def _nominal(m, rating):
    """Speed and supply current at rated torque on the straight line between no load and stall."""
    torque = rating["rated_torque_nm"]
    return (m["no_load_speed_six_step"] * (1 - torque / m["stall_torque_six_step_mean"]),
            m["no_load_current_six_step"] + torque / m["torque_constant_six_step"])


def _voltage_at_rating(m, drive):
    """Line-to-line rms at rated torque and speed, i_d = 0, from measured EMF, resistance and inductance."""
    rating = drive.motor["rating"]
    i_q = rating["rated_torque_nm"] / m["torque_constant_peak"]
    w = rating["rated_speed_rpm"] * RPM
    v_q = m["back_emf_phase_peak"] * w + m["resistance_line_line"] / 2 * i_q
    v_d = w * drive.motor["electrical"]["pole_pairs"] * m["inductance_q"] * i_q
    return math.hypot(v_d, v_q) * math.sqrt(3 / 2)


# [check] key -> its value from the measured figures `m` and the drive
DERIVED = {
    "emf_ll_v_per_krpm": lambda m, d: m["back_emf_line_line_peak"],
    "emf_phase_v_per_hz": lambda m, d: m["back_emf_phase_peak"] * 2 * math.pi / d.motor["electrical"]["pole_pairs"],
    "resistance_ll_ohm": lambda m, d: m["resistance_line_line"],
    "inductance_ll_h": lambda m, d: m["inductance_line_line_mean"],
    "saliency_ratio": lambda m, d: m["inductance_q"] / m["inductance_d"],
    "rated_torque_nm": lambda m, d: m["rated_torque"],
    "rated_voltage_ll_v": _voltage_at_rating,
    "no_load_speed_rpm": lambda m, d: m["no_load_speed_six_step"],
    "no_load_current_a": lambda m, d: m["no_load_current_six_step"],
    "torque_constant_nm_a": lambda m, d: m["torque_constant_six_step"],
    "speed_constant_rpm_v": lambda m, d: m["no_load_speed_six_step"] / (
        d.inverter["supply"]["vbus_v"] - m["no_load_current_six_step"] * m["resistance_line_line"]),
    "stall_torque_nm": lambda m, d: m["stall_torque_six_step_mean"],
    "stall_current_a": lambda m, d: m["stall_current"],
    "mechanical_tc_s": lambda m, d: d.motor["mechanical"]["inertia_kgm2"] * m["resistance_line_line"]
        / m["torque_constant_six_step"] ** 2,
    "nominal_speed_rpm": lambda m, d: _nominal(m, d.motor["rating"])[0],
    "nominal_current_a": lambda m, d: _nominal(m, d.motor["rating"])[1],
}


def check_models(motor, build, out):
    """Checks one motor or all; prints the tables; returns the exit status."""
    program = build_dir(build) / "qemu" / "modelcheck"
    if not program.is_file():
        raise LauncherError(f"{shown(program)} is missing: run make twin first")
    failed = 0
    for name in [motor] if motor else available(MOTORS):
        drive = load_drive(name)
        failed += _print_table(drive, bench(drive, program), out)
    out(f"{failed} points are outside their tolerance" if failed else "every point is within its tolerance")
    return 1 if failed else 0


def bench(drive, program):
    """{figure: value} as modelcheck measures it on the drive's motor."""
    rated_rms = drive.motor["rating"]["rated_current_a"] / math.sqrt(2)
    with tempfile.TemporaryDirectory() as folder:
        config = Path(folder) / "motor.cfg"
        config.write_text("".join(f"{key} {value:.12g}\n" for key, value in twin_items(drive)))
        try:
            answer = subprocess.run([str(program), str(config), f"rated_a_rms={rated_rms:.9g}"], capture_output=True,
                                    text=True, timeout=300, check=False)
        except (OSError, subprocess.TimeoutExpired) as error:
            raise LauncherError(f"cannot run {shown(program)}: {error}") from error
    if answer.returncode != 0:
        reason = (answer.stderr.strip().splitlines() or [f"status {answer.returncode}"])[-1]
        raise LauncherError(f"{shown(program)} on {drive.motor.key}: {reason}")
    return _figures(answer.stdout, program)


def _figures(text, program):
    figures = {}
    for line in text.splitlines():
        try:
            name, value, _unit = line.split()
            figures[name] = float(value)
        except ValueError as error:
            raise LauncherError(f"{shown(program)} printed '{line}', not 'name value unit'") from error
    return figures


def _print_table(drive, measured, out):
    """One table; returns how many points are outside their tolerance."""
    out(f"{drive.motor.name}")
    out(f"  {'':<22}{'model':>12}{'data sheet':>12}{'deviation':>11}{'allowed':>9}")
    failed = 0
    for key, check in drive.motor.checks.items():
        if key not in DERIVED:
            raise LauncherError(f"{shown(drive.motor.path)}: [check] {key} is not one of {', '.join(sorted(DERIVED))}")
        try:
            value = DERIVED[key](measured, drive)
        except KeyError as error:
            raise LauncherError(f"modelcheck did not measure {error}, which {key} needs") from error
        deviation = (value / check.value - 1) * 100
        within = abs(deviation) <= check.tolerance_percent
        failed += not within
        out(f"  {key:<22}{value:>12.5g}{check.value:>12.5g}{deviation:>+10.2f}%{check.tolerance_percent:>8g}%"
            f"  {'PASS' if within else 'FAIL'}  {check.source}")
    out("")
    return failed
