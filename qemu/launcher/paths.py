# SPDX-License-Identifier: MIT
"""Where things are. Everything is found from this file's own place; BUILD moves the products."""
import os
from pathlib import Path

QEMU_DIR = Path(__file__).resolve().parent.parent
REPO = QEMU_DIR.parent
MOTORS = QEMU_DIR / "motors"
INVERTERS = QEMU_DIR / "inverters"
SENSORS = QEMU_DIR / "sensors"
SCENARIOS = QEMU_DIR / "scenarios"


def build_dir(build=None):
    """The build folder: the argument, or $BUILD, or build/ of the repository."""
    chosen = Path(build or os.environ.get("BUILD") or "build")
    return chosen if chosen.is_absolute() else REPO / chosen


def shown(path):
    """A path as the user would type it: relative to where he stands when it lies below."""
    try:
        return str(Path(path).resolve().relative_to(Path.cwd().resolve()))
    except ValueError:
        return str(path)
