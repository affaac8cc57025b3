# SPDX-License-Identifier: MIT
"""Every product term of the Park kernels over every pair of 16-bit values: none is off by even a part of an LSB."""
import subprocess

import pytest

from host_build import HERE, build_dir, compile_host

TERMS = ["park_alpha_cos", "park_beta_sin", "park_beta_cos", "park_alpha_sin",
         "invpark_d_cos", "invpark_q_sin", "invpark_q_cos", "invpark_d_sin"]


def run(name, flags=()):
    program = compile_host(build_dir() / name, [HERE / "every_pair.c"], ["-O3", *flags])
    said = subprocess.run([program], capture_output=True, text=True, check=True, timeout=300).stdout
    return dict(line.split() for line in said.splitlines())


def test_every_pair_is_the_nearest():
    assert run("every_pair") == {term: "0" for term in TERMS}


def test_a_kernel_that_rounds_down_is_found():
    """The same sweep with a wrong kernel: without its half, half of all results are off."""
    counts = run("every_pair_down", ["-DROUND_DOWN"])
    assert set(counts) == set(TERMS) and all(int(count) > 2**31 - 2**27 for count in counts.values())
