# SPDX-License-Identifier: MIT
"""Builds that leave something out: each feature alone, and the least one. One folder for each, below the one in use.

    builds.py      `make sizes`: what each costs
"""
import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "tests"), str(ROOT / "tests/tools"), str(ROOT / "firmware/tables"), str(ROOT / "linker/bounds")]

from budgets.figures import sizes  # noqa: E402
from rates.builds import OWN_HZ, build_of  # noqa: E402

FEATURES = re.findall(r"^    X\([A-Z]+, ([a-z]+)\)", (ROOT / "firmware/settings/features.h").read_text(), re.MULTILINE)
MINIMAL = ("encoder", "console", "settings")
NEEDED_BY = {"sensorless": ("injection",)}  # what goes with it


def without(name):
    return tuple(feature for feature in FEATURES if feature != name and feature not in NEEDED_BY.get(name, ()))


def build(features):
    """Folder of the image that has these."""
    if tuple(features) == tuple(FEATURES):
        return build_of(OWN_HZ, "mssfoc.elf")
    left_out = [feature for feature in FEATURES if feature not in features]
    folder = f"without-{left_out[0]}" if len(left_out) < 3 else "least"
    return build_of(OWN_HZ, "mssfoc.elf", "mssfoc.hex", folder=folder, FEATURES=" ".join(features))


def image_bytes(features):
    flash, ram = sizes(build(features))
    return flash["sum"], ram["sum"]


def main():
    whole = image_bytes(FEATURES)
    print(f"{'image':26}{'flash':>8}{'RAM':>8}   bytes\n{'with every feature':26}{whole[0]:8}{whole[1]:8}")
    for name in FEATURES:
        flash, ram = image_bytes(without(name))
        more = "".join(f", {other}" for other in NEEDED_BY.get(name, ()))
        print(f"{'without ' + name + more:26}{flash - whole[0]:+8}{ram - whole[1]:+8}", flush=True)
    flash, ram = image_bytes(MINIMAL)
    print(f"{' '.join(MINIMAL):26}{flash:8}{ram:8}")


if __name__ == "__main__":
    try:
        main()
    except (AssertionError, subprocess.CalledProcessError) as error:
        sys.exit(f"mssfoc: {error}")
