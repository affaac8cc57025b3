# SPDX-License-Identifier: MIT
"""Figures that depend on the compiler for the target: GCC 12's stand in the file itself, those of another version beside it.

    tests/budgets.toml, tests/budgets-gcc14.toml
"""
import os
import re
import subprocess
from functools import cache

REFERENCE = 12


@cache
def version():
    """The major version of the compiler for the target."""
    compiler = os.environ.get("CROSS", "arm-none-eabi-") + "gcc"
    return int(subprocess.run([compiler, "-dumpversion"], capture_output=True, text=True, check=True).stdout.split(".")[0])


def file_of(path, which):
    return path if which == REFERENCE else path.with_stem(f"{path.stem}-gcc{which}")


def versions_of(path):
    """All versions that have a file, the reference first."""
    found = (re.fullmatch(rf"{path.stem}-gcc(\d+)", other.stem) for other in path.parent.glob(f"{path.stem}-gcc*{path.suffix}"))
    return [REFERENCE, *sorted(int(match.group(1)) for match in found if match)]


def nearest(path):
    """The file of the present compiler, or of the next older one that has any."""
    return file_of(path, max((known for known in versions_of(path) if known <= version()), default=REFERENCE))
