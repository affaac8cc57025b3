# SPDX-License-Identifier: MIT
"""What is wrong with a board's file, or with BOARD, is said in one line, and nothing is written."""
import copy
import os
import subprocess
import sys

import check
import pytest
from libero import board as boards
from libero import constraints, project, rtl
from libero.wrong import Wrong

BUILD = check.demands.ROOT / os.environ["BUILD"]
CREATIVE = boards.load("creative")


def changed(change, name="creative"):
    board = copy.deepcopy(boards.load(name))
    change(board)
    return board


@pytest.mark.parametrize("change, said", [
    (lambda b: b["wired"].pop("pin_hall[2]"), r"pin_hall\[2\] is neither wired nor tied"),
    (lambda b: b["wired"].update({"pin_hall[3]": "ARD_SCL"}), r"the fabric has no pin pin_hall\[3\]"),
    (lambda b: b["wired"].update({"pin_hall[2]": "ARD_XXX"}), r"pin_hall_2 is wired to ARD_XXX, which \[nets\]"),
    (lambda b: b["wired"].update({"pin_hall[2]": "ARD_IO2"}), "ARD_IO2 has two uses"),
    (lambda b: b["tied"].update({"pin_hall[2]": 0}), r"pin_hall\[2\] has two uses"),
    (lambda b: b["tied"].update({"pin_mod_data": 2}), "pin_mod_data is tied to 2; 0 or 1"),
    (lambda b: b["tied"].update({"pin_mod_clock": 0}), "pin_mod_clock is an output: inputs are tied"),
    (lambda b: b["tied"].update({"pin_clock_ok": 1}), "the fabric has no pin pin_clock_ok"),
    (lambda b: b["nets"].update({"NEW": "A1"}), r"NEW is neither used nor in \[unused\]"),
    (lambda b: b["nets"].update({"NEW": "H16"}), "NEW and CLK_50M are both on pin H16"),
    (lambda b: b["unused"]["nets"].append("NEW"), r"\[unused\] has NEW"),
    (lambda b: b["unused"]["nets"].append("ARD_IO2"), "ARD_IO2 has two uses"),
    (lambda b: b["console"].update(through="usb"), "MMUART_0 through usb: `fabric` or `pins`"),
    (lambda b: b.pop("sampling"), r"\[sampling\] is for boards whose pin_sdata is wired"),
    (lambda b: b.update(bring_up_only="no"), "a board that samples nothing says so"),
    (lambda b: b["sampling"].update(converters="ad7357"), "converters = ad7357; converters.toml has ad7356, ad7476a"),
    (lambda b: b["sampling"].update(wires_ns=[1, 5]), "converters: a bit is there 22 ns after its clock and taken after 20"),
    (lambda b: (b["open"].pop("pin_mod_clock"), b["wired"].update({"pin_mod_clock[0]": "LED1_RED"}),
                b["unused"]["nets"].remove("LED1_RED")), "modulators are wired, and this generator has no times for them"),
])
def test_what_is_wrong_with_a_file_is_said(change, said):
    with pytest.raises(Wrong, match=said):
        project.project(changed(change), BUILD)


def test_a_board_that_samples_nothing_ties_sto():
    with pytest.raises(Wrong, match="no gate may turn on"):
        project.project(changed(lambda b: b["tied"].update(pin_sto_a_n=1), "sk1"), BUILD)


@pytest.mark.parametrize("text, said", [
    ("axes = 5", "5 axes; the bus has room for 1 to 4"),
    ("axes = 1\ncolour = 1", "`colour` means nothing here"),
    ("", "`axes` is missing"),
    ("axes = ", "Invalid value"),
    ('axes = 1\nlegs = "three"', "legs = three; gates, in_en"),
])
def test_a_file_that_cannot_be_read_is_refused(tmp_path, text, said):
    source = (boards.BOARDS / "creative.toml").read_text(encoding="utf-8")
    (tmp_path / "mine.toml").write_text(source.replace("axes = 1\n", text + "\n"), encoding="utf-8")
    with pytest.raises(Wrong, match=said):
        boards.load("mine", tmp_path)


def test_a_board_is_a_file_in_a_folder(tmp_path):
    (tmp_path / "mine.toml").write_text((boards.BOARDS / "creative.toml").read_text(encoding="utf-8"), encoding="utf-8")
    assert boards.load("mine", tmp_path)["name"] == "mine"
    with pytest.raises(Wrong, match="no board is called 'yours': BOARD=mine, or add yours"):
        boards.load("yours", tmp_path)


def test_an_unknown_port_of_the_rtl_is_refused(monkeypatch):
    fabric = rtl.read(1, BUILD / "fabric")
    more = rtl.Fabric([*fabric.ports, rtl.Port("mss_reset_n", "output", 1)], fabric.half)
    monkeypatch.setattr(rtl, "read", lambda axes, includes: more)
    with pytest.raises(Wrong, match="fabric.v has a port mss_reset_n; system.toml"):
        project.project(CREATIVE, BUILD)


def test_half_is_the_rtls():
    """The clocks of a bit are what adc.v gives its readers, not a second list."""
    fabric = rtl.read(1, BUILD / "fabric")
    use = boards.Use(CREATIVE, fabric)
    slower = rtl.Fabric(fabric.ports, {name: 2 * half for name, half in fabric.half.items()})
    parts, system = project.toml("converters.toml"), project.toml("system.toml")
    for told in (fabric, slower):
        text = constraints.sdc(CREATIVE, system, told, use, parts)
        for name, port in (("converters", "pin_sdata_0"), ("thermometer", "pin_temp_sdata_0")):
            assert f"-setup_only {2 * told.half[name]} -from [ get_ports {{ {port} " in text


@pytest.mark.parametrize("first, said", [(b"\0\0", None), (b"\x60\0", "begins at 0x60000000: Libero's client counts from")])
def test_the_image_counts_from_the_start_of_the_envm(tmp_path, first, said):
    def line(kind, data):
        raw = bytes([len(data), 0, 0, kind]) + data
        return ":" + (raw + bytes([-sum(raw) & 0xFF])).hex().upper()
    path = tmp_path / "mssfoc.hex"
    path.write_text("\n".join((line(4, first), line(0, bytes(16)), line(1, b""))) + "\n", encoding="ascii")
    if said:
        with pytest.raises(Wrong, match=said):
            project.image_words(path)
    else:
        assert project.image_words(path) == 16
    with pytest.raises(Wrong, match="none.hex is missing: run make"):
        project.image_words(tmp_path / "none.hex")
    with pytest.raises(Wrong, match="mssfoc_regs.vh is missing: run make registers"):
        rtl.read(1, tmp_path)


@pytest.mark.parametrize("arguments", [["nowhere"], ["", "build"], ["../creative", "build"]])
def test_a_wrong_board_is_one_line(tmp_path, arguments):
    done = subprocess.run([sys.executable, "-m", "libero", *arguments], cwd=tmp_path, capture_output=True, text=True,
                          env=os.environ | {"PYTHONPATH": str(check.demands.ROOT / "drivers/fabric")})
    assert done.returncode == 1 and done.stdout == "" and len(done.stderr.splitlines()) == 1
    assert "BOARD=creative|sk1" in done.stderr
    assert list(tmp_path.iterdir()) == []


def test_the_project_takes_the_bring_up_image(tmp_path):
    for name in ("bringup.hex", "fabric/mssfoc_regs.vh"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).symlink_to(BUILD / name)
    assert subprocess.run([sys.executable, "-m", "libero", "creative", tmp_path, "bringup"], cwd=check.demands.ROOT,
                          env=os.environ | {"PYTHONPATH": "drivers/fabric"}, check=False).returncode == 0
    folder = tmp_path / "libero/creative"
    assert check.findings(CREATIVE, folder) == [] and (folder / "bringup.hex").is_file()
    assert "{$here/bringup.hex}" in (folder / "mss.tcl").read_text() and not (folder / "mssfoc.hex").exists()


def test_the_checker_prints_what_is_not_confirmed_and_what_is_wrong(tmp_path):
    def run(command):
        return subprocess.run([sys.executable, *command], capture_output=True, text=True, cwd=check.demands.ROOT,
                              env=os.environ | {"PYTHONPATH": "drivers/fabric"})
    for name in ("mssfoc.hex", "fabric/mssfoc_regs.vh"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).symlink_to(BUILD / name)
    assert run(["-m", "libero", "creative", tmp_path]).returncode == 0
    folder = tmp_path / "libero/creative"
    good = run(["tests/libero/check.py", "creative", folder])
    assert good.returncode == 0 and "  MSS CCC MPLL_LOCK_LOST_EN: public designs have only false" in good.stdout
    assert not (folder / "envm.cfg").exists()  # it played a copy
    (folder / "io.pdc").write_text("")
    bad = run(["tests/libero/check.py", "creative", folder])
    assert bad.returncode == 1 and "creative: pin_high_0 has 0 pins instead of one" in bad.stderr
