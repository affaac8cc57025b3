# SPDX-License-Identifier: MIT
"""Lib.h and LibFoc.h as a stranger's compiler sees them."""
import os
import re
import subprocess
from pathlib import Path

import pytest
from host_build import host_cc

ROOT = Path(__file__).resolve().parents[2]
STRICT = ["-Wall", "-Wextra", "-Wpedantic", "-pedantic-errors", "-Wundef", "-Wstrict-prototypes", "-Werror"]
STRICT_CXX = [flag for flag in STRICT if flag != "-Wstrict-prototypes"] + ["-Wold-style-cast", "-Wuseless-cast"]
STRICT_FOC = [flag for flag in STRICT if flag != "-Wstrict-prototypes"]
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
USER_FOC = """
#include "%s"
int main(void)
{
    sincosoutput_type angle;
    clarkeinput_type three;
    clarkeoutput_type two;
    parkinput_type park;
    parkoutput_type rotor;
    polarinput_type vector;
    polaroutput_type polar;
    piinput_type sample = {1000, 400, 500};
    pistate_type controller = {512, 32, 0};
    pioutput_type asked;
    svminput_type phases = {300, -100, -200};
    svmoutput_type centred;
    three.ia = 2100;
    three.ib = 600;
    three.ic = 600;
    Clarke3_Lib_Do(&three, &two);
    SinCos_Lib_Do(0, &angle);
    park.ialpha = two.ialpha;
    park.ibeta = two.ibeta;
    park.cos = angle.cos;
    park.sin = angle.sin;
    Park_Lib_Do(&park, &rotor);
    vector.x = 0;
    vector.y = -rotor.id;
    Polar_Lib_Do(&vector, &polar);
    three.ib = -1000;
    three.ic = 400;
    ClarkeBC_Lib_Do(&three, &two);
    if (two.ialpha != 600) {
        return 1;
    }
    PI_Lib_Do(&sample, &controller, &asked);
    SVM_Lib_Do(&phases, &centred);
    if (asked.output != 500 || controller.integral_q9 != 0 || centred.va != 250 || centred.vb != -150) {
        return 2;
    }
    ClarkeCA_Lib_Do(&three, &two);
    return two.ialpha == 2100 && polar.magnitude == 1000 && polar.angle_q32 == 3221225472u ? 0 : 1;
}
"""


def run(command, source):
    return subprocess.run([*command, "-I", str(ROOT), "-"], input=source, capture_output=True, text=True, cwd=ROOT)


def compile_only(flags, source=USER, compiler=None):
    return run([compiler or host_cc(), *flags, "-S", "-o", "-"], source)


@pytest.mark.parametrize("standard", ("c99", "c11", "c17", "c++98", "c++11", "c++17"))
def test_here(standard):
    language, compiler, strict = ("c++", "c++", STRICT_CXX) if "++" in standard else ("c", None, STRICT)
    result = compile_only([f"-std={standard}", *strict, "-x", language], compiler=compiler)
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


@pytest.mark.parametrize("header, includes", (("Lib.h", ["<stdint.h>"]), ("LibFoc.h", ["<stdint.h>", '"Lib.h"'])))
def test_includes_stdint_only(header, includes):
    text = (ROOT / "lib" / header).read_text()
    assert re.findall(r"^\s*#\s*include\s+(.*)$", text, re.M) == includes


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


@pytest.mark.parametrize("include, name", ((ROOT, "lib/LibFoc.h"), (ROOT / "lib", "LibFoc.h")))
@pytest.mark.parametrize("compiler, language, standard", (
    (None, "c", "c99"), (None, "c", "c17"), ("c++", "c++", "c++11"), ("c++", "c++", "c++17")))
def test_the_family_compiles_and_runs_by_either_name(include, name, compiler, language, standard, tmp_path):
    objects = []
    for source in ("Lib", "LibFoc", "trig", "polar"):
        objects.append(str(tmp_path / f"{source}.o"))
        subprocess.run([host_cc(), "-std=c11", "-I", str(ROOT), "-c", f"lib/{source}.c", "-o", objects[-1]], cwd=ROOT,
                       check=True)
    program = tmp_path / "program"
    result = subprocess.run([compiler or host_cc(), f"-std={standard}", *STRICT_FOC, "-I", str(include), "-o", str(program),
                             "-x", language, "-", "-x", "none", *objects],
                            input=USER_FOC % name, capture_output=True, text=True)
    assert result.returncode == 0, result.stderr
    assert subprocess.run([str(program)], check=False).returncode == 0
