# SPDX-License-Identifier: MIT
"""The twin's plant against motulator, an independent simulator: the same switch states on both, open loop, no resynchronising.

motulator comes from PyPI into an environment of its own under the build folder, never into the system's Python. Everything that
it has is on: saturation, switching, rectifier with choke and capacitor, two masses, viscous friction, fan, a load step.
"""
import json
import math
import os
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from .drive import RPM, load_drive
from .errors import LauncherError
from .model_check import BENCH
from .paths import MOTORS, build_dir, shown

VERSION = "0.5.0"
PERIOD_S, DURATION_S = 62.5e-6, 0.03  # half a carrier of 8 kHz
RISE_S = 0.02                         # of the speed, to rated, under rated torque
RESONANCE_HZ = 140
CURRENT_SHARE, TORQUE_SHARE, OTHER_SHARE = 1e-3, 1e-3, 1e-3  # of rated current, rated torque, the largest speed or voltage
MAINS = {"capacitance_f": 235e-6, "inductance_h": 2e-3, "hz": 50.0}  # motulator's own example, 2.2 kW
INSTALL_S, PLAY_S = 300, 120


def machines():
    """Those whose saturation is published as a map."""
    return [*(name for name in ("baldor_ecs101m0h7ef4", "thor_pmsyrm") if (MOTORS / f"{name}.toml").is_file()),
            str(BENCH / "synrm_6k7.toml")]


def environment(build=None):
    """(Python of motulator's environment, empty text), or (None, why there is none). Made where it is missing."""
    folder = build_dir(build) / "motulator"
    python, ready = folder / "bin" / "python", folder / f"installed-{VERSION}"
    if ready.is_file():
        return python, ""
    try:
        for command in ([sys.executable, "-m", "venv", "--clear", str(folder)],
                        [str(python), "-m", "pip", "--quiet", "--disable-pip-version-check", "install",
                         f"motulator=={VERSION}"]):
            done = subprocess.run(command, capture_output=True, text=True, timeout=INSTALL_S, check=False,
                                  env={**os.environ, "PIP_RETRIES": "0"})
            if done.returncode != 0:
                said = (done.stderr or done.stdout).strip().splitlines() or [f"status {done.returncode}"]
                return None, f"motulator {VERSION} is left out: {said[-1]}"
    except (OSError, subprocess.TimeoutExpired) as error:
        return None, f"motulator {VERSION} is left out: {error}"
    ready.touch()
    return python, ""


@dataclass
class Difference:
    """The largest, between two simulators, as a share of what is rated."""
    what: str
    rms: float
    largest: float
    allowed: float

    @property
    def within(self):
        return self.largest <= self.allowed


def machine_of(name):
    """What motulator_play.py is told of a motor file."""
    motor = load_drive(name).motor
    rating, electrical = motor["rating"], motor["electrical"]
    rated_a, rated_nm, rated_rad_s = rating["rated_current_a"], rating["rated_torque_nm"], rating["rated_speed_rpm"] * RPM
    inertia = rated_nm * RISE_S / rated_rad_s
    saturation = {key.removeprefix("sat_"): value for key, value in motor.saturation().keys().items()}
    wanted = [[0, 0, 0.1 * rated_a], [2e-3, -0.7 * rated_a, 0.7 * rated_a], [22e-3, -rated_a, -0.4 * rated_a]]
    together = inertia / 3 * 2 / 3  # of masses of 1/3 and 2/3, seen by the spring
    stiffness = (2 * math.pi * RESONANCE_HZ)**2 * together
    return {"pole_pairs": int(electrical["pole_pairs"]), "resistance_ohm": electrical["resistance_ohm"],
            "flux_wb": electrical["flux_wb"], "ld_h": electrical["ld_h"], "lq_h": electrical["lq_h"],
            "saturation": saturation, "commands": wanted, "period_s": PERIOD_S, "duration_s": DURATION_S,
            "shaft": {"motor_kgm2": inertia / 3, "load_kgm2": inertia * 2 / 3, "stiffness_nm_rad": stiffness,
                      "damping_nms": 0.02 * math.sqrt(stiffness * together), "viscous_nms": 0.02 * rated_nm / rated_rad_s,
                      "fan_nms2": 0.2 * rated_nm / rated_rad_s**2},
            "supply": {**MAINS, "mains_v": 400.0}, "load_nm": 0.3 * rated_nm, "load_from_s": 12e-3,
            "rated": {"current_a": rated_a, "torque_nm": rated_nm}}


def config_of(machine):
    """The same as lines for the twin."""
    shaft, supply = machine["shaft"], machine["supply"]
    items = {"motor.pole_pairs": machine["pole_pairs"], "motor.resistance_ohm": machine["resistance_ohm"],
             "motor.ld_h": machine["ld_h"], "motor.lq_h": machine["lq_h"], "motor.flux_wb": machine["flux_wb"],
             "motor.copper_tempco_per_k": 0, "motor.inertia_kgm2": shaft["motor_kgm2"],
             **{f"motor.sat_{key}": value for key, value in machine["saturation"].items()},
             "load.inertia_kgm2": shaft["load_kgm2"], "load.stiffness_nm_rad": shaft["stiffness_nm_rad"],
             "load.damping_nms": shaft["damping_nms"], "load.viscous_nms": shaft["viscous_nms"],
             "load.fan_nms2": shaft["fan_nms2"], "inverter.vbus_v": math.sqrt(2) * supply["mains_v"],
             "inverter.supply_resistance_ohm": 0, "inverter.supply_inductance_h": supply["inductance_h"],
             "inverter.rectifier_hz": supply["hz"], "inverter.bus_capacitance_f": supply["capacitance_f"],
             "inverter.r_on_ohm": 1e-5, "inverter.oc_trip_a": 3 * machine["rated"]["current_a"]}
    return "".join(f"{key} {value:.17g}\n" for key, value in items.items())


def differences(name, python, build=None):
    """[Difference] of a motor file."""
    machine = machine_of(name)
    played = json.loads(_run([python, Path(__file__).with_name("motulator_play.py")], json.dumps(machine)))
    with tempfile.TemporaryDirectory() as folder:
        config = Path(folder) / "motor.cfg"
        config.write_text(config_of(machine))
        lines = "".join(f"{duration:.17g} {high} {load:.17g}\n" for duration, high, load in played["sequence"])
        replayed = _run([build_dir(build) / "qemu" / "replay", config], lines)
    rows = np.array([line.split() for line in replayed.splitlines()], float)
    samples = np.array([sample for sample in played["samples"] if sample[0] < len(rows)])
    ours, theirs = rows[samples[:, 0].astype(int), 1:], samples[:, 2:]
    off, rated = np.abs(ours - theirs), machine["rated"]
    current = np.hypot(off[:, 0], off[:, 1]) / rated["current_a"]
    shares = {"current": (current, CURRENT_SHARE), "torque": (off[:, 2] / rated["torque_nm"], TORQUE_SHARE),
              **{what: (off[:, column] / np.abs(theirs[:, column]).max(), OTHER_SHARE)
                 for column, what in ((3, "speed"), (4, "speed of the load"), (5, "bus voltage"))}}
    return [Difference(what, float(np.sqrt(np.mean(share**2))), float(share.max()), allowed)
            for what, (share, allowed) in shares.items()]


def _run(command, text):
    try:
        done = subprocess.run([str(word) for word in command], input=text, capture_output=True, text=True, timeout=PLAY_S,
                              check=False)
    except (OSError, subprocess.TimeoutExpired) as error:
        raise LauncherError(f"cannot run {shown(command[0])}: {error}") from error
    if done.returncode != 0:
        said = done.stderr.strip().splitlines() or [f"status {done.returncode}"]
        raise LauncherError(f"{shown(command[-1])}: {said[-1]}")
    return done.stdout


def check_motulator(build, out):
    """Prints what differs; returns how many figures differ by too much. Without motulator one line says so."""
    python, why = environment(build)
    if python is None:
        out(why)
        return 0
    found = {name: differences(name, python, build) for name in machines()}
    out(f"Against motulator {VERSION}, largest difference of {DURATION_S * 1e3:g} ms (rms), share of what is rated")
    for name, of_machine in found.items():
        out(f"  {Path(name).stem}")
        for difference in of_machine:
            out(f"    {difference.what:<18}{100 * difference.largest:>9.4f} % ({100 * difference.rms:.4f} %), allowed"
                f" {100 * difference.allowed:g} %  {'PASS' if difference.within else 'FAIL'}")
    return sum(not difference.within for of_machine in found.values() for difference in of_machine)
