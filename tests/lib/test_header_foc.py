# SPDX-License-Identifier: MIT
"""LibFoc.h as a stranger's compiler sees it, reached by its folder or from the root."""
import re
import subprocess
from pathlib import Path

import pytest
from host_build import host_cc

ROOT = Path(__file__).resolve().parents[2]
STRICT = ["-Wall", "-Wextra", "-Wpedantic", "-pedantic-errors", "-Wundef", "-Werror"]
USER = """
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


@pytest.mark.parametrize("include, name", ((ROOT, "lib/LibFoc.h"), (ROOT / "lib", "LibFoc.h")))
@pytest.mark.parametrize("compiler, language, standard", (
    (None, "c", "c99"), (None, "c", "c17"), ("c++", "c++", "c++11"), ("c++", "c++", "c++17")))
def test_compiles_and_runs(include, name, compiler, language, standard, tmp_path):
    objects = []
    for source in ("Lib", "LibFoc", "trig", "polar"):
        objects.append(str(tmp_path / f"{source}.o"))
        subprocess.run([host_cc(), "-std=c11", "-I", str(ROOT), "-c", f"lib/{source}.c", "-o", objects[-1]], cwd=ROOT,
                       check=True)
    program = tmp_path / "program"
    result = subprocess.run([compiler or host_cc(), f"-std={standard}", *STRICT, "-I", str(include), "-o", str(program),
                             "-x", language, "-", "-x", "none", *objects],
                            input=USER % name, capture_output=True, text=True)
    assert result.returncode == 0, result.stderr
    assert subprocess.run([str(program)], check=False).returncode == 0


def test_includes_stdint_and_lib_only():
    text = (ROOT / "lib" / "LibFoc.h").read_text()
    assert re.findall(r"^\s*#\s*include\s+(.*)$", text, re.M) == ["<stdint.h>", '"Lib.h"']
