# SPDX-License-Identifier: MIT
"""The firmware's own checks (firmware/settings/tuning.c, built for this machine) take the parameters of every shipped motor."""
import ctypes
import os
import subprocess

import pytest

from launcher.data import MOTORS, available
from launcher.drive import console_params, load_drive
from launcher.params import SOURCES
from launcher.paths import REPO


@pytest.fixture(scope="module")
def tuning(tmp_path_factory):
    """tuning_compute from {parameter: value} to its complaint, or None. struct params has the order of SOURCES."""
    library = tmp_path_factory.mktemp("tuning") / "tuning.so"
    subprocess.run([os.environ.get("HOSTCC") or "cc", "-shared", "-fPIC", "-O1", "-I.", "firmware/settings/tuning.c",
                    "lib/polar.c",
                    "-o", str(library)], cwd=REPO, check=True)
    compute = ctypes.CDLL(str(library)).tuning_compute
    compute.restype = ctypes.c_char_p

    def call(params):
        values = (ctypes.c_int32 * len(SOURCES))(*(params[name] for name in SOURCES))
        complaint = compute(values, ctypes.create_string_buffer(1024))
        return complaint and complaint.decode()
    return call


@pytest.mark.parametrize("motor", available(MOTORS))
def test_shipped_motors(tuning, motor):
    assert tuning(console_params(load_drive(motor))) is None


def test_it_can_complain(tuning):
    params = console_params(load_drive("teknic_m2310p"))
    assert "95 %" in tuning({**params, "i_trip_ma": params["i_range_ma"]})
    assert "1187 Hz" in tuning({**params, "pole_pairs": 20})
    assert "speed gain" in tuning({**params, "inertia_gcm2": 50000000, "flux_uwb": 10})
