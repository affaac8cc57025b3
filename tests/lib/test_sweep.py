# SPDX-License-Identifier: MIT
"""Runs sweep.c, built with the sanitizers, for every special LIB_TRIG_FRAC: no finding, and the checksum that the optimized
build comes to."""
import re
import subprocess

import pytest
from host_build import HERE, KERNELS, LIBRARY, SANITIZERS, TRIG_FRACS, build_dir, compile_host


@pytest.mark.parametrize("frac", TRIG_FRACS)
def test_sweep_is_clean(frac):
    said = []
    for name, flags in (("checked", ["-O1", "-g", *SANITIZERS]), ("optimized", ["-O2"])):
        program = compile_host(build_dir() / f"sweep_{name}{frac}", [HERE / "sweep.c", KERNELS, *LIBRARY],
                               [*flags, f"-DLIB_TRIG_FRAC={frac}"])
        result = subprocess.run([program], capture_output=True, text=True, timeout=60)
        assert result.returncode == 0 and re.fullmatch(r"[0-9A-F]{8}\n", result.stdout), result.stdout + result.stderr
        said.append(result.stdout)
    assert said[0] == said[1]
