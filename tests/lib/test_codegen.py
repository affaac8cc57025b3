# SPDX-License-Identifier: MIT
"""What the compiler makes of the kernels: the same instructions for all data, none with data-dependent time."""
import os
import re
import subprocess

import pytest
from host_build import KERNELS as SHIPPED
from host_build import ROOT, build_dir

FLAGS = ["-mcpu=cortex-m3", "-mthumb", "-ffreestanding", "-std=c11", "-O2", "-ffunction-sections",
         "-fno-delete-null-pointer-checks", "-Wall", "-Wextra", "-Werror", "-I", str(ROOT)]
KERNELS = set(re.findall(r"KERNEL\((\w+)\)\(", (ROOT / "tests" / "bench" / "kernels_body.h").read_text()))
API = {"Clarke_Lib_Do", "InvClarke_Lib_Do", "Park_Lib_Do", "InvPark_Lib_Do"}
LONG_OR_DIVISION = re.compile(r"^(smull|umull|smlal|umlal|sdiv|udiv)\b")
CONDITIONS = "eq|ne|cs|hs|cc|lo|mi|pl|vs|vc|hi|ls|ge|lt|gt|le"
BRANCH = re.compile(rf"^(b|bl|blx|b({CONDITIONS})|cbz|cbnz|tbb|tbh)(\.[nw])?$")


def functions(source, *defines):
    """{function: its instructions} of a source compiled for the target."""
    cross = os.environ.get("CROSS", "arm-none-eabi-")
    unit = build_dir() / f"{source.stem}.{os.getpid()}.o"
    subprocess.run([f"{cross}gcc", *FLAGS, *defines, "-c", str(source), "-o", str(unit)], check=True)
    text = subprocess.run([f"{cross}objdump", "-d", "--no-show-raw-insn", str(unit)], capture_output=True, text=True,
                          check=True).stdout
    unit.unlink()
    found = {}
    for line in text.splitlines():
        if match := re.match(r"[0-9a-f]+ <(\w+)>:", line):
            found[match.group(1)] = current = []
        elif (match := re.match(r"\s+[0-9a-f]+:\s+(\S+)(.*)", line)) and not match.group(1).startswith("."):
            current.append(match.group(1) + match.group(2).split("@")[0])
    return found


@pytest.fixture(scope="module")
def kernels():
    return {name.removeprefix("shipped_"): body for name, body in functions(SHIPPED).items()}


def branches(body):
    """Everything that sets the program counter but the one return at the end."""
    return [line for line in body if BRANCH.match(line.split()[0])]


def returns(body):
    return [line for line in body if re.match(r"bx\s+lr|pop.*pc|ldm.*pc|ldr(\.w)?\s+pc", line)]


def test_all_kernels_are_seen(kernels):
    assert set(kernels) == KERNELS and len(KERNELS) > 15


@pytest.mark.parametrize("name", sorted(KERNELS))
def test_hot_path_kernel(kernels, name):
    body = kernels[name]
    assert not [line for line in body if LONG_OR_DIVISION.match(line)]
    assert not branches(body) and len(returns(body)) == 1


@pytest.mark.parametrize("frac", range(1, 32))
def test_api_has_no_branch(frac):
    found = functions(ROOT / "lib" / "Lib_thumb2.S", f"-DLIB_TRIG_FRAC={frac}")
    assert set(found) == API
    for body in found.values():
        assert not branches(body) and len(returns(body)) == 1
        assert [line.split() for line in body if line != "nop"][-1] == ["bx", "lr"]  # behind it the section is filled up
        assert not [line for line in body if re.match(r"[su]div", line)]


def test_each_function_of_the_api_is_built_once():
    """The assembly takes the place of the C, and the C that of the assembly when LIB_PORTABLE switches it off."""
    assert functions(ROOT / "lib" / "Lib.c") == {}
    assert functions(ROOT / "lib" / "Lib_thumb2.S", "-DLIB_PORTABLE") == {}
    assert set(functions(ROOT / "lib" / "Lib.c", "-DLIB_PORTABLE")) == API
    assert set(functions(ROOT / "lib" / "Lib.c", "-mcpu=cortex-m0")) >= API
    assert set(functions(ROOT / "lib" / "Lib_thumb2.S", "-mcpu=cortex-m4")) == API


@pytest.mark.parametrize("frac", (0, 32))
def test_assembly_checks_trig_frac(frac):
    with pytest.raises(subprocess.CalledProcessError):
        functions(ROOT / "lib" / "Lib_thumb2.S", f"-DLIB_TRIG_FRAC={frac}")


@pytest.mark.parametrize("frac", (1, 15, 30, 31))
def test_family_has_no_branch_on_data(frac):
    """One loop, of a fixed number of turns, in Polar_Lib_Do."""
    found = functions(ROOT / "lib" / "LibFoc.c", f"-DLIB_TRIG_FRAC={frac}")
    assert set(found) == {"Clarke3_Lib_Do", "ClarkeBC_Lib_Do", "ClarkeCA_Lib_Do", "SinCos_Lib_Do", "Polar_Lib_Do", "PI_Lib_Do",
                          "SVM_Lib_Do"}
    for name, body in found.items():
        assert len(branches(body)) == (name == "Polar_Lib_Do"), branches(body)
        assert not [line for line in body if re.match(r"[su]div", line)]


def test_the_search_would_find_one():
    """The portable saturation does branch: the checks above are able to fail."""
    found = functions(ROOT / "lib" / "Lib.c", "-DLIB_PORTABLE")
    assert any(branches(body) for body in found.values())
    assert any(LONG_OR_DIVISION.match(line) for body in found.values() for line in body)
