# SPDX-License-Identifier: MIT
"""python `canopen` at the CAN bus of a running drive (canopen_client.py), and what checkers say of its EDS."""
import subprocess
from pathlib import Path

import pytest
from eds import eds

from closed_loop.client_venv import environment
from closed_loop.live import live_can

CLIENT = Path(__file__).with_name("canopen_client.py")
CASES = ("management", "dictionary", "data_sheet", "layer_setting", "store", "profile", "home_then_csp",
         "process_data", "master_lost")


@pytest.fixture(scope="module")
def programs():
    folder = environment()
    if folder is None:
        pytest.skip("canopen cannot be had from PyPI: no network?")
    return folder


@pytest.fixture(scope="module")
def sheet(tmp_path_factory):
    path = tmp_path_factory.mktemp("eds") / "mssfoc.eds"
    path.write_text(eds(), encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def drive(tmp_path_factory):
    with live_can(tmp_path_factory.mktemp("can"), "set can_heartbeat_ms 100", "set can_node 5") as (port, files):
        yield port, files


@pytest.mark.parametrize("axes", (1, 2))
def test_the_eds_is_valid(programs, tmp_path, axes):
    sheet = tmp_path / "mssfoc.eds"
    sheet.write_text(eds(axes), encoding="utf-8")
    said = subprocess.run([programs / "eds-validate", sheet], capture_output=True, text=True, check=False)
    assert said.returncode == 0 and "AUTO-FIXED" not in said.stdout and "rror" not in said.stdout, said.stdout + said.stderr


@pytest.mark.parametrize("case", CASES)
def test_a_master_by_canopen(case, programs, sheet, drive):
    port, files = drive
    said = subprocess.run([programs / "python", CLIENT, case, str(port), sheet], capture_output=True, text=True, timeout=1800,
                          check=False)
    assert said.stdout.strip() == "done", said.stderr[-2000:] + files["can_log"].read_text()[-1500:]
