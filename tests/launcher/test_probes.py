# SPDX-License-Identifier: MIT
"""DWARF lookups against what the compiler's own tools say."""
import shutil
import subprocess

import pytest

from launcher import LauncherError
from launcher.drive import load_drive
from launcher.paths import build_dir
from launcher.probes import Symbols, make_probes
from mssfoc import dwarf


@pytest.fixture(scope="module")
def symbols(elf):
    return Symbols(elf)


def nm(elf, name):
    text = subprocess.run(["arm-none-eabi-nm", str(elf)], capture_output=True, text=True, check=True).stdout
    return next(int(line.split()[0], 16) for line in text.splitlines() if line.split()[-1] == name)


@pytest.mark.parametrize("name, offset, kind", [
    ("current_loop.i_d_ref_q15", 0, "s32"), ("current_loop.i_q_q15", 12, "s32"), ("current_loop.angle_u16", 20, "u32"),
    ("current_loop.nested[2].small", 32 + 12, "s16"), ("current_loop.nested[1].tiny[3]", 32 + 6 + 2 + 3, "u8"),
    ("current_loop.sign", 50, "s8"),
])
def test_members(symbols, elf, name, offset, kind):
    variable = symbols.find(name)
    assert variable.address == nm(elf, "current_loop") + offset
    assert variable.type == kind


def test_qualifiers_statics_and_declared_first(symbols, elf):
    assert symbols.find("axes[0].faults.cause").address == nm(elf, "axes") + 72
    assert symbols.find("axes[0].faults.cause").type == "u32"
    assert symbols.find("hidden").address == nm(elf, "hidden")


def test_what_is_not_there_or_no_number(symbols):
    for name in ("nothing", "current_loop.nothing", "hidden.member", "current_loop[0]", "axes[0].state.deeper"):
        assert symbols.find(name) is None
    assert symbols.find("current_loop.nested").type == ""
    assert symbols.find("current_loop.real").type == ""


def test_enums(symbols):
    assert symbols.enum("axis_state") == {0: "AXIS_OFF", 4: "AXIS_ON", 5: "AXIS_OPERATION_ENABLED", 6: "AXIS_FAULT"}
    assert symbols.enum("fault") == {0: "FAULT_NONE", 1: "FAULT_BAD_DAY"}
    assert symbols.enum("nothing") == {}


def test_functions(symbols, elf):
    assert symbols.address("function") == nm(elf, "function") & ~1
    listing = subprocess.run(["arm-none-eabi-objdump", "-d", "--disassemble=function", str(elf)], capture_output=True,
                             text=True, check=True).stdout
    first = next(line for line in listing.splitlines() if line.strip().startswith(f"{symbols.address('function'):x}:"))
    assert symbols.code16("function") == int(first.split()[1], 16)
    with pytest.raises(LauncherError, match="no variable or function 'nothing'"):
        symbols.address("nothing")


def test_what_is_known_is_kept_beside_the_elf(elf, tmp_path, monkeypatch):
    image = tmp_path / "mssfoc.elf"
    shutil.copy(elf, image)
    first = dwarf.described(image)
    assert not list(tmp_path.glob("*.symbols?*"))  # no draft is left
    with monkeypatch.context() as patch:
        patch.setattr(dwarf, "_read", lambda path: pytest.fail("read again"))
        assert dwarf.described(image) == first
    (tmp_path / "mssfoc.elf.symbols").write_text("{half of a")
    assert dwarf.described(image) == first


def test_what_is_kept_of_another_elf_does_not_count(elf, tmp_path):
    shutil.copy(elf, tmp_path / "mssfoc.elf")
    Symbols(tmp_path / "mssfoc.elf")
    (tmp_path / "t.c").write_text("int other; void _start(void) { other++; }\n")
    subprocess.run(["arm-none-eabi-gcc", "-mcpu=cortex-m3", "-g", "-nostdlib", "-Wl,--no-warn-rwx-segments", "t.c", "-o",
                    "mssfoc.elf"], cwd=tmp_path, check=True)
    symbols = Symbols(tmp_path / "mssfoc.elf")
    assert symbols.find("other").type == "s32" and symbols.find("axes[0].faults.cause") is None


def test_a_folder_that_keeps_nothing(elf, tmp_path):
    shutil.copy(elf, tmp_path / "mssfoc.elf")
    (tmp_path / "mssfoc.elf.symbols").mkdir()
    assert Symbols(tmp_path / "mssfoc.elf").find("axes[0].faults.cause").type == "u32"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["mssfoc.elf", "mssfoc.elf.symbols"]


def test_probe_scales(symbols):
    drive = load_drive("teknic_m2310p")
    probes, enums = make_probes(symbols, drive)
    by_column = {probe.column: probe for probe in probes}
    assert by_column["i_q_A"].scale * 32768 == pytest.approx(drive.inverter["sensor"]["i_range_a"])
    assert by_column["speed_fw_rpm"].scale == 1 / 16
    assert enums["fault"][1] == "FAULT_BAD_DAY"


def test_columns_of_the_image_are_in_the_units_of_its_drive():
    drive = load_drive("teknic_m2310p")
    by_column = {probe.column: probe for probe in make_probes(Symbols(build_dir() / "mssfoc.elf"), drive)[0]}
    for columns, milli in ((("i_d_A", "i_q_ref_A", "cogging_A"), "i_range_ma"),
                           (("v_d_V", "v_q_V", "vbus_fw_V"), "v_range_mv")):
        for column in columns:
            assert by_column[column].scale * 32768 == pytest.approx(drive.params[milli] / 1000), column


def test_files_that_are_no_image(tmp_path):
    with pytest.raises(LauncherError, match="run make first"):
        Symbols(tmp_path / "mssfoc.elf")
    (tmp_path / "text.elf").write_text("not an ELF file at all")
    with pytest.raises(LauncherError, match="not an ELF file"):
        Symbols(tmp_path / "text.elf")


def test_a_variable_the_trace_needs_is_missing(tmp_path):
    (tmp_path / "t.c").write_text("int other; void _start(void) { other++; }\n")
    subprocess.run(["arm-none-eabi-gcc", "-mcpu=cortex-m3", "-g", "-nostdlib", "-Wl,--no-warn-rwx-segments", "t.c", "-o",
                    "t.elf"], cwd=tmp_path, check=True)
    with pytest.raises(LauncherError, match="no number called 'axes.0..loop.i_d_q15'"):
        make_probes(Symbols(tmp_path / "t.elf"), load_drive("teknic_m2310p"))
