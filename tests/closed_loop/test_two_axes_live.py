# SPDX-License-Identifier: MIT
"""Two motors by one line: the Python client turns both, each by its own wish, at the console and by both buses."""
import re
import subprocess

import pytest
from rates.builds import OWN_HZ, build_of

from closed_loop.client_venv import installed_in
from closed_loop.live import free_port, live_everything
from rigs.firmware import ROOT

PAGE = (ROOT / "docs/client.md").read_text(encoding="utf-8")
EXAMPLE = re.search(r"gives axis 1, and `axis\(2\)`.*?```python\n(.*?)```", PAGE, re.S)[1]


TURNS = """
first = mssfoc.connect(PLACE)
with first:
    second = first.axis(2)
    first["ramp_rpm_s"], second["ramp_rpm_s"] = 5000, 6000
    assert (first["ramp_rpm_s"], second["ramp_rpm_s"]) == (5000, 6000)
    second.on()
    second.speed(700)
    assert (first.state(), second.state()) == ("switch on disabled", "operation enabled")
    first.on()
    first.speed(-500)
    first.wait(lambda: abs(first.status().speed_rpm + 500) < 10, "-500 rpm")
    assert abs(second.status().speed_rpm - 700) < 20
    second.off()
    assert first.state() == "operation enabled" and second.state() != "operation enabled"
"""


@pytest.fixture(scope="module")
def lines(tmp_path_factory):
    """{kind: how the client connects to it}"""
    build = build_of(OWN_HZ, "mssfoc.elf", "mssfoc.hex", folder="two-axes", AXES=2)
    console, modbus, can = (free_port() for _ in range(3))
    folder = tmp_path_factory.mktemp("live")
    with live_everything(folder, console, modbus, can, "set can_node 5", second="maxon_ec22", build=build):
        yield {"console": f'"socket://127.0.0.1:{console}"', "modbus": f'"modbus:socket://127.0.0.1:{modbus}", parity="N"',
               "can": f'"can:socketcand:can0", host="127.0.0.1", port={can}, node=5'}


@pytest.fixture(scope="module")
def play(tmp_path_factory):
    """Runs a program with the client and what its buses need, which Debian does not have."""
    python, site = installed_in(tmp_path_factory.mktemp("wheel"))

    def run(text):
        said = subprocess.run([python, "-c", text], capture_output=True, text=True, timeout=300, check=False,
                              env={"PYTHONPATH": str(site)})
        assert said.returncode == 0, said.stderr
        return said.stdout
    return run


@pytest.mark.parametrize("kind", ("console", "modbus", "can"))
def test_each_motor_by_its_own_wish(play, lines, kind):
    play("import mssfoc\n" + TURNS.replace("PLACE", lines[kind]))


def test_the_example_of_the_page(play, lines):
    said = play(re.sub(r"connect\([^)]*\)", f"connect({lines['console']})", EXAMPLE))
    assert "speed_rpm=" in said
