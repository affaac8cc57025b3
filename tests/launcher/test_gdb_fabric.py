# SPDX-License-Identifier: MIT
"""The debugger's view of the fabric: every register of the description, its fields taken apart."""
import importlib.util
import os
import shutil
import subprocess
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
BUILD = Path(os.environ.get("BUILD", "build")).resolve()
SPEC = importlib.util.spec_from_file_location("fabric_view", ROOT / "qemu/debugger/fabric.py")
view = importlib.util.module_from_spec(SPEC)
SPEC.loader.exec_module(view)


@pytest.fixture(scope="module")
def blocks():
    return view.read_svd(BUILD / "fabric" / "mssfoc.svd")


def test_every_register_of_the_description_is_there(blocks):
    described = tomllib.loads((ROOT / "drivers/fabric/registers.toml").read_text())["block"]
    assert list(blocks) == [block["name"] for block in described]
    assert view.show(blocks, [], None)[0].startswith("PWM        0x50000000  three half bridges")
    for block in described:
        shown = [name for name, *_ in blocks[block["name"]][2]]
        assert len(shown) >= len(block["register"]) and shown[0] == block["register"][0]["name"]


def test_fields_are_taken_apart(blocks):
    read = {0x50000004: 0x12, 0x50000008: 2500}.get
    (line,) = view.show(blocks, ["PWM", "PERIOD"], read)[:1]
    assert line.startswith("0x50000008 PERIOD 0x000009c4: Half a PWM period")
    said = view.show(blocks, ["PWM"], lambda address: read(address) or 0)
    assert "0x50000004 STATUS         0x00000012  RUNNING=0  RISING=1  WAITING=0  FELL_BACK_A=1" in said[1]


@pytest.mark.parametrize("words, says", [(["PWN"], "no block 'PWN'; there are: PWM"),
                                         (["PWM", "STATE"], "PWM has no register 'STATE'; it has: CONTROL, STATUS")])
def test_what_is_not_there_is_said(blocks, words, says):
    with pytest.raises(view.Trouble, match=says):
        view.show(blocks, words, lambda address: 0)


def test_without_the_file_it_says_what_writes_it(tmp_path):
    with pytest.raises(view.Trouble, match="make registers"):
        view.read_svd(tmp_path / "none.svd")


@pytest.mark.skipif(not shutil.which("gdb-multiarch"), reason="gdb-multiarch is not installed")
def test_in_the_debugger():
    result = subprocess.run(["gdb-multiarch", "-batch", "-x", "qemu/debugger/fabric.py", "-ex",
                             f"fabric {BUILD}/fabric/mssfoc.svd", "-ex", "fabric NONE"], cwd=ROOT, capture_output=True,
                            text=True, check=False)
    assert "three half bridges" in result.stdout and "no block 'NONE'" in result.stderr, result.stdout + result.stderr
