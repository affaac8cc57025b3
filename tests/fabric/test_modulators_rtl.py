# SPDX-License-Identifier: MIT
"""The modulators at the RTL's pins, on the twin's bench, without QEMU."""
import subprocess

import pytest

from places import REGISTERS
from twin.test_twin_models import CLOSING, HERE, ROOT, TWIN, compile_host, models  # noqa: F401  (a fixture)

PARTS = ("lines", "fabric_rtl", "rtl_clock", "rtl_ahead")


def test_results_and_trips(models, tmp_path):  # noqa: F811
    _, objects = models
    sources = [ROOT / "tests/fabric/rtl_modulators.c", *(TWIN / f"{part}.c" for part in PARTS)]
    compile_host(tmp_path, *sources, *objects, "-o", tmp_path / "program", "-lm", "-ldl")
    library = REGISTERS / "axis.so"
    result = subprocess.run([tmp_path / "program", library], capture_output=True, text=True, timeout=300)
    *checks, closing = result.stdout.splitlines() or [""]
    print(result.stdout)
    assert not [line for line in checks if not line.startswith("ok ")], result.stderr
    assert result.returncode == 0 and CLOSING.fullmatch(closing), closing + "\n" + result.stderr
