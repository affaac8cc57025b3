# SPDX-License-Identifier: MIT
"""The firmware's own checks (firmware/settings/tuning.c, built for this machine) take the parameters of every shipped motor."""
import ctypes
import os
import re
import subprocess

import pytest

from launcher.data import MOTORS, available
from launcher.drive import console_params, load_drive
from launcher.params import SOURCES
from launcher.paths import REPO


class Outcome(ctypes.Structure):
    """struct outcome of firmware/settings/error.h."""
    _fields_ = [("error", ctypes.c_int), ("value", ctypes.c_int32)]


@pytest.fixture(scope="module")
def tuning(tmp_path_factory):
    """tuning_compute from {parameter: value} to the name of its complaint, or None. struct params has the order of SOURCES."""
    library = tmp_path_factory.mktemp("tuning") / "tuning.so"
    subprocess.run([os.environ.get("HOSTCC") or "cc", "-shared", "-fPIC", "-O1", "-I.", "firmware/settings/tuning.c",
                    "lib/polar.c",
                    "-o", str(library)], cwd=REPO, check=True)
    compute = ctypes.CDLL(str(library)).tuning_compute
    compute.restype = Outcome
    names = re.findall(r"^    (ERROR_\w+),", (REPO / "firmware/settings/error.h").read_text(), re.MULTILINE)

    def call(params):
        values = (ctypes.c_int32 * len(SOURCES))(*(params[name] for name in SOURCES))
        error = compute(values, ctypes.create_string_buffer(4096)).error
        return names[error] if error else None
    return call


@pytest.mark.parametrize("motor", available(MOTORS))
def test_shipped_motors(tuning, motor):
    assert tuning(console_params(load_drive(motor))) is None


def test_it_can_complain(tuning):
    params = console_params(load_drive("teknic_m2310p"))
    assert "ERROR_I_TRIP_BEYOND_RANGE" == tuning({**params, "i_trip_ma": params["i_range_ma"]})
    assert "ERROR_SPEED_BEYOND_OBSERVER" == tuning({**params, "pole_pairs": 20})
    assert "ERROR_SPEED_GAIN" == tuning({**params, "inertia_gmm2": 2100000000, "flux_uwb": 10})
