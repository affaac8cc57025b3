# SPDX-License-Identifier: MIT
"""Lib.h as a stranger's compiler sees it."""
import os
import re
import subprocess
from pathlib import Path

import pytest
from host_build import host_cc

ROOT = Path(__file__).resolve().parents[2]
STRICT = ["-Wall", "-Wextra", "-Wpedantic", "-pedantic-errors", "-Wundef", "-Wstrict-prototypes", "-Werror"]
STRICT_CXX = [flag for flag in STRICT if flag != "-Wstrict-prototypes"] + ["-Wold-style-cast", "-Wuseless-cast"]
USER = """
#include "lib/Lib.h"
#include "lib/Lib.h"
int main(void)
{
    clarkeinput_type three;
    clarkeoutput_type two;
    parkinput_type park;
    parkoutput_type rotor;
    invparkinput_type inverse;
    invparkoutput_type stationary;
    invclarkeinput_type in;
    invclarkeoutput_type out;
    three.ia = 1000;
    three.ib = -500;
    three.ic = -500;
    Clarke_Lib_Do(&three, &two);
    park.ialpha = two.ialpha;
    park.ibeta = two.ibeta;
    park.cos = 32767;
    park.sin = 0;
    Park_Lib_Do(&park, &rotor);
    inverse.vd = rotor.id;
    inverse.vq = rotor.iq;
    inverse.cos = 32767;
    inverse.sin = 0;
    InvPark_Lib_Do(&inverse, &stationary);
    in.valpha = stationary.valpha;
    in.vbeta = stationary.vbeta;
    InvClarke_Lib_Do(&in, &out);
    return out.va == 1000 && out.vb == -500 && out.vc == -500 ? 0 : 1;
}
"""


def run(command, source):
    return subprocess.run([*command, "-I", str(ROOT), "-"], input=source, capture_output=True, text=True, cwd=ROOT)


def compile_only(flags, source=USER, compiler=None):
    return run([compiler or host_cc(), *flags, "-S", "-o", "-"], source)


@pytest.mark.parametrize("standard", ("c99", "c11", "c17"))
def test_c(standard):
    result = compile_only([f"-std={standard}", *STRICT, "-x", "c"])
    assert result.returncode == 0, result.stderr


@pytest.mark.parametrize("standard", ("c++98", "c++11", "c++17"))
def test_cxx(standard):
    result = compile_only([f"-std={standard}", *STRICT_CXX, "-x", "c++"], compiler="c++")
    assert result.returncode == 0, result.stderr


@pytest.mark.parametrize("language,standard", (("c", "c99"), ("c", "c17"), ("c++", "c++98"), ("c++", "c++17")))
def test_for_the_target(language, standard):
    cross = os.environ.get("CROSS", "arm-none-eabi-") + "gcc"
    strict = STRICT if language == "c" else STRICT_CXX
    result = compile_only(["-mcpu=cortex-m3", "-mthumb", "-ffreestanding", f"-std={standard}", *strict, "-x", language],
                          compiler=cross)
    assert result.returncode == 0, result.stderr


@pytest.mark.parametrize("language", ("c", "c++"))
def test_links_and_runs(language, tmp_path):
    """The library itself compiled as C: a C++ program must find the same symbols."""
    unit, program = tmp_path / "Lib.o", tmp_path / "program"
    subprocess.run([host_cc(), "-std=c11", "-I", str(ROOT), "-c", "lib/Lib.c", "-o", str(unit)], cwd=ROOT, check=True)
    result = run([host_cc(), "-o", str(program), str(unit), "-x", language], USER)
    assert result.returncode == 0, result.stderr
    assert subprocess.run([str(program)], check=False).returncode == 0


@pytest.mark.parametrize("frac", ("0", "32", "-1"))
def test_trig_frac_is_checked(frac):
    result = compile_only([f"-DLIB_TRIG_FRAC={frac}", "-x", "c"])
    assert result.returncode != 0 and "LIB_TRIG_FRAC must be 1...31" in result.stderr


@pytest.mark.parametrize("frac", range(1, 32))
def test_every_trig_frac_compiles(frac):
    source = (ROOT / "lib" / "Lib.c").read_text()
    result = compile_only([f"-DLIB_TRIG_FRAC={frac}", *STRICT, "-std=c11", "-x", "c"], source)
    assert result.returncode == 0, result.stderr


def test_includes_stdint_only():
    text = (ROOT / "lib" / "Lib.h").read_text()
    assert re.findall(r"^\s*#\s*include\s+(.*)$", text, re.M) == ["<stdint.h>"]


def test_names_and_order():
    """The API of the library that is replaced."""
    text = re.sub(r"/\*.*?\*/", "", (ROOT / "lib" / "Lib.h").read_text(), flags=re.S)
    types = {name: re.findall(r"int32_t (\w+);", body) for body, name in re.findall(r"typedef struct {(.*?)} (\w+);",
                                                                                 text, re.S)}
    assert types == {
        "clarkeinput_type": ["ia", "ib", "ic"], "clarkeoutput_type": ["ialpha", "ibeta"],
        "invclarkeinput_type": ["valpha", "vbeta"], "invclarkeoutput_type": ["va", "vb", "vc"],
        "parkinput_type": ["ialpha", "ibeta", "cos", "sin"], "parkoutput_type": ["id", "iq"],
        "invparkinput_type": ["vd", "vq", "cos", "sin"], "invparkoutput_type": ["valpha", "vbeta"],
    }
    functions = re.findall(r"void (\w+)\(const (\w+) \*(\w+), (\w+) \*(\w+)\);", text)
    assert functions == [
        ("Clarke_Lib_Do", "clarkeinput_type", "threephasecurrent_ptr", "clarkeoutput_type", "twophaserefcurrent_ptr"),
        ("InvClarke_Lib_Do", "invclarkeinput_type", "invclarkeinput_ptr", "invclarkeoutput_type",
         "invclarkeoutput_ptr"),
        ("Park_Lib_Do", "parkinput_type", "parkinput_ptr", "parkoutput_type", "parkoutput_ptr"),
        ("InvPark_Lib_Do", "invparkinput_type", "invparkinput_ptr", "invparkoutput_type", "invparkoutput_ptr"),
    ]
