# SPDX-License-Identifier: MIT
"""`make models`: every motor's model on the test bench, against the points of its data sheet.

build/qemu/modelcheck applies voltages to the very model the twin runs, and measures; here its figures are put beside the
[check] and [[point]] entries of the motor's data file. What a data sheet defines by a formula is worked out from measured
values. Nominal data, every effect on.
"""
import math
import re
import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path

from .data import available
from .drive import RPM, load_drive, twin_items
from .errors import LauncherError
from .measured_flux import flux_table, measured_of
from .paths import MOTORS, build_dir, shown


def _nominal(m, rating):
    """Speed and supply current at rated torque on the straight line between no load and stall."""
    torque = rating["rated_torque_nm"]
    return (m["no_load_speed_six_step"] * (1 - torque / m["stall_torque_six_step_mean"]),
            m["no_load_current_six_step"] + torque / m["torque_constant_six_step"])


def _voltage_at_rating(m, drive):
    """Line-to-line rms at rated current and speed, i_d = 0, from measured flux and resistance."""
    rating = drive.motor["rating"]
    i_q, w = rating["rated_current_a"], rating["rated_speed_rpm"] * RPM * drive.motor["electrical"]["pole_pairs"]
    at = _current_text(0, i_q)
    v_q = w * m[f"map_psi_d@{at}"] + m["resistance_line_line"] / 2 * i_q
    return math.hypot(w * m[f"map_psi_q@{at}"], v_q) * math.sqrt(3 / 2)


def _current_text(i_d_a, i_q_a):
    return f"{i_d_a:g},{i_q_a:g}"


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
    "open_circuit_flux_wb": lambda m, d: m["open_circuit_flux"],
    "magnet_tempco_percent_k": lambda m, d: m["magnet_tempco"],
    "cogging_pp_nm": lambda m, d: m["cogging_peak_to_peak"],
    **{f"emf_{n}_percent": lambda m, d, n=n: m[f"emf_harmonic_{n}"] for n in (5, 7, 11, 13, 17, 19)},
    "nominal_speed_rpm": lambda m, d: _nominal(m, d.motor["rating"])[0],
    "nominal_current_a": lambda m, d: _nominal(m, d.motor["rating"])[1],
}


# the same for keys with a speed in them: drag_nm_1000rpm is drag_torque@1000
AT_SPEED = {"drag_nm": "drag_torque", "iron_w": "iron_power"}
# value of a [[point]] -> figure of the bench
AT_CURRENT = {"l_dd_h": "map_l_dd", "l_qq_h": "map_l_qq", "l_dq_h": "map_l_dq", "torque_nm": "map_torque",
              "ripple_pp_nm": "map_ripple", "ripple_18_nm": "map_ripple_18",
              "psi_d_wb": "map_psi_d", "psi_q_wb": "map_psi_q"}
BLOCK_COMMUTATION = {"no_load_speed_rpm", "no_load_current_a", "torque_constant_nm_a", "speed_constant_rpm_v",
                     "stall_torque_nm", "stall_current_a", "mechanical_tc_s", "nominal_speed_rpm", "nominal_current_a"}
ENERGY_TOLERANCE = 1e-4
BENCH = MOTORS / "bench"  # machines that the firmware cannot drive yet


def shipped():
    """Every motor there is, as load_drive() takes it, those of the bench alone last."""
    return [*available(MOTORS), *(str(BENCH / f"{name}.toml") for name in available(BENCH))]


def check_models(motor, build, out):
    """Checks one motor or all; prints the tables; returns the exit status."""
    program = build_dir(build) / "qemu" / "modelcheck"
    if not program.is_file():
        raise LauncherError(f"{shown(program)} is missing: run make twin first")
    failed, fluxes = 0, {}
    for name in [motor] if motor else shipped():
        drive = load_drive(name)
        figures = _measured(name, drive, program)
        rows = list(_rows(drive, figures))
        _print_table(drive, rows, out)
        failed += sum(not row.within for row in rows)
        if points := measured_of(drive.motor.key):
            fluxes[drive.motor.key] = [figures[f"map_psi_d@{_current_text(i_d_a, 0)}"] for i_d_a in points.i_d_a]
    if fluxes:
        lines, beyond = flux_table(fluxes)
        out("\n".join(lines) + "\n")
        failed += beyond
    out(f"{failed} points are outside their tolerance" if failed else "every point is within its tolerance")
    return 1 if failed else 0


def _measured(name, drive, program):
    """Catalogues extrapolate what they say of block commutation from a linear machine, so these are measured on one."""
    measured = bench(drive, program)
    if drive.motor.saturation() is None or not BLOCK_COMMUTATION & set(drive.motor.checks):
        return measured
    return {**bench(load_drive(name, plant="full,-saturation"), program), **measured}


def bench(drive, program):
    """{figure: value} as modelcheck measures it on the drive's motor, nominal and with every effect."""
    motor = drive.motor
    currents = {_current_text(0, motor["rating"]["rated_current_a"]): None}
    currents.update({_current_text(point.i_d_a, point.i_q_a): None for point in motor.points})
    if points := measured_of(motor.key):
        currents.update({_current_text(i_d_a, 0): None for i_d_a in points.i_d_a})
    speeds = {speed: None for key in motor.checks for _, speed in [_at_speed(key)] if speed}
    options = [f"rated_a_rms={motor['rating']['rated_current_a'] / math.sqrt(2):.9g}"]
    options += [f"map={text}" for text in currents] + [f"drag_rpm={speed}" for speed in speeds]
    with tempfile.TemporaryDirectory() as folder:
        config = Path(folder) / "motor.cfg"
        config.write_text("".join(f"{key} {value:.12g}\n" for key, value in twin_items(drive)
                                  if key.startswith(("motor.", "load.")) or key == "inverter.vbus_v"))
        try:
            answer = subprocess.run([str(program), str(config), *options], capture_output=True, text=True, timeout=300,
                                    check=False)
        except (OSError, subprocess.TimeoutExpired) as error:
            raise LauncherError(f"cannot run {shown(program)}: {error}") from error
    if answer.returncode != 0:
        reason = (answer.stderr.strip().splitlines() or [f"status {answer.returncode}"])[-1]
        raise LauncherError(f"{shown(program)} on {motor.key}: {reason}")
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


@dataclass
class Row:
    """One line of the table."""
    label: str
    model: float
    published: float
    deviation_percent: float
    tolerance_percent: float
    source: str

    @property
    def within(self):
        return abs(self.deviation_percent) <= self.tolerance_percent


def _at_speed(key):
    """("drag_torque", "1000") of drag_nm_1000rpm, or (None, None)."""
    for prefix, figure in AT_SPEED.items():
        match = re.fullmatch(prefix + r"_(\d+)rpm", key)
        if match:
            return figure, match.group(1)
    return None, None


def is_known(key):
    """Whether a [check] key is one that the bench can measure."""
    return key in DERIVED or _at_speed(key)[0] is not None


def _rows(drive, measured):
    """Every [check], every [[point]], and the energy balance."""
    try:
        for key, check in drive.motor.checks.items():
            value = _check_value(drive, key, measured)
            yield Row(key, value, check.value, (value / check.value - 1) * 100, check.tolerance_percent, check.source)
        for point in drive.motor.points:
            yield from _point_rows(point, measured)
        error = measured["energy_balance_error"]
        yield Row("energy balance", error, 0.0, 100 * error, 100 * ENERGY_TOLERANCE, "energy in = out + heat + stored")
    except KeyError as error:
        raise LauncherError(f"modelcheck did not measure {error} of {drive.motor.key}") from error


def _check_value(drive, key, measured):
    if not is_known(key):
        known = sorted([*DERIVED, *(f"{prefix}_<N>rpm" for prefix in AT_SPEED)])
        raise LauncherError(f"{drive.motor.where}: [check] {key} is not one of {', '.join(known)}")
    figure, speed = _at_speed(key)
    return measured[f"{figure}@{speed}"] if figure else DERIVED[key](measured, drive)


def _point_rows(point, measured):
    """The flux as a vector, relative to its length; everything else by itself."""
    at = _current_text(point.i_d_a, point.i_q_a)
    values = dict(point.values)
    if {"psi_d_wb", "psi_q_wb"} <= set(values):
        published = complex(values.pop("psi_d_wb"), values.pop("psi_q_wb"))
        model = complex(measured[f"map_psi_d@{at}"], measured[f"map_psi_q@{at}"])
        yield Row(f"flux at {at} A", abs(model), abs(published), 100 * abs(model - published) / abs(published),
                  point.tolerance_percent, point.source)
    for key, published in values.items():
        model = measured[f"{AT_CURRENT[key]}@{at}"]
        yield Row(f"{key} at {at} A", model, published, (model / published - 1) * 100, point.tolerance_percent, point.source)


def _print_table(drive, rows, out):
    width = max(22, *(len(row.label) for row in rows))
    out(f"{drive.motor.name}")
    out(f"  {'':<{width}}{'model':>12}{'published':>12}{'deviation':>11}{'allowed':>9}")
    for row in rows:
        out(f"  {row.label:<{width}}{row.model:>12.5g}{row.published:>12.5g}{row.deviation_percent:>+10.2f}%"
            f"{row.tolerance_percent:>8g}%  {'PASS' if row.within else 'FAIL'}  {row.source}")
    out("")
