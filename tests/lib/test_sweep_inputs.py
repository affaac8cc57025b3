# SPDX-License-Identifier: MIT
"""Runs sweep.c, built with the sanitizers, for every special LIB_TRIG_FRAC."""
import os
import subprocess

import pytest
from host_build import HERE, LIBRARY, SANITIZERS, TRIG_FRACS, build_dir, compile_host


@pytest.mark.parametrize("frac", TRIG_FRACS)
def test_sweep_is_clean(frac):
    program = compile_host(build_dir() / f"sweep{frac}", [HERE / "sweep.c", *LIBRARY],
                           ["-O1", "-g", *SANITIZERS, f"-DLIB_TRIG_FRAC={frac}"])
    result = subprocess.run([program], capture_output=True, text=True, timeout=60,
                            env={**os.environ, "UBSAN_OPTIONS": "print_stacktrace=1"})
    assert result.returncode == 0, result.stdout + result.stderr
    assert result.stdout.splitlines() == ["Clarke ok", "InvClarke ok", "Park, InvPark ok", "Q15 ok"]
