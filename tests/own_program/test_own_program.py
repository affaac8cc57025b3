# SPDX-License-Identifier: MIT
"""A program of one's own with the library alone, built as docs/library.md says, in stock QEMU without our plugin."""
import os
import re
import shlex
import subprocess
import time
from pathlib import Path

import pytest

from launcher.qemu import Qemu

BUILD = Path(os.environ.get("BUILD", "build")).resolve()
CROSS = os.environ.get("CROSS", "arm-none-eabi-")
HERE = Path("tests/own_program")
CPU = ["-mcpu=cortex-m3", "-mthumb", "-O2", "-Ilib"]
STRICT = ["-Wall", "-Wextra", "-Werror", "-pedantic"]
CXX = ["-x", "c++", "-std=c++17", "-fno-exceptions"]
WALL_S = 20.0
NOTHING = """
#include "Lib.h"
void Clarke_Lib_Do(const clarkeinput_type *in, clarkeoutput_type *out) { out->ialpha = in->ia; out->ibeta = in->ib; }
void Park_Lib_Do(const parkinput_type *in, parkoutput_type *out) { out->id = in->ialpha; out->iq = in->ibeta; }
void InvPark_Lib_Do(const invparkinput_type *in, invparkoutput_type *out) { out->valpha = in->vd; out->vbeta = in->vq; }
void InvClarke_Lib_Do(const invclarkeinput_type *in, invclarkeoutput_type *out)
{ out->va = in->valpha; out->vb = in->vbeta; out->vc = -in->valpha - in->vbeta; }
"""


def documented(name):
    """The commands of docs/library.md that begin with this program's name, as words; continued lines are one."""
    blocks = re.findall(r"```sh\n(.*?)```", Path("docs/library.md").read_text(), re.S)
    lines = "\n".join(blocks).replace("\\\n", " ").split("\n")
    return [shlex.split(line, comments=True) for line in lines if line.startswith(name)]


def checked(command, **options):
    result = subprocess.run(command, capture_output=True, text=True, check=False, **options)
    assert result.returncode == 0, " ".join(map(str, command)) + "\n" + result.stderr
    return result


def build(compiler, flags, sources, library, target):
    """main.c as the language says, start.c as C, linked with what the documented command links with."""
    objects = [target.with_suffix(f".{n}.o") for n in range(len(sources))]
    checked([CROSS + compiler, *CPU, *STRICT, *flags, "-c", str(sources[0]), "-o", str(objects[0])])
    for source, unit in zip(sources[1:], objects[1:]):
        checked([CROSS + "gcc", *CPU, "-c", str(source), "-o", str(unit)])
    checked([CROSS + "gcc", *CPU[:2], "-nostdlib", "-T", str(HERE / "program.ld"), *map(str, objects), f"-L{library}",
             "-lmssfoc", "-lgcc", "-o", str(target)])
    return target


def said(elf, tmp_path, arguments=("-M", "emcraft-sf2", "-nographic")):
    """What the program prints up to its verdict."""
    qemu, console = Qemu(), tmp_path / "console.txt"
    with open(console, "wb") as stream:
        process = subprocess.Popen([qemu.path, *qemu.data_arguments(), *arguments, "-kernel", str(elf)],
                                   stdin=subprocess.DEVNULL, stdout=stream, stderr=stream, env=qemu.environment())
        limit = time.monotonic() + WALL_S
        try:
            ended = re.compile(rb"own program: .*\n")
            while process.poll() is None and time.monotonic() < limit and not ended.search(console.read_bytes()):
                time.sleep(0.02)
        finally:
            process.kill()
            process.wait()
    return console.read_text(errors="replace").replace("\r", "")


def test_as_documented(tmp_path):
    (compile_and_link,), (start,) = documented("arm-none-eabi-gcc"), documented("qemu-system-arm")
    elf = tmp_path / "own_program.elf"
    words = [{"-Lbuild": f"-L{BUILD}", "build/own_program.elf": str(elf)}.get(word, word) for word in compile_and_link]
    checked([CROSS + "gcc", *words[1:]])
    text = said(elf, tmp_path, start[1:start.index("-kernel")])
    assert "own program: passed" in text, text
    rows = [list(map(int, line.split())) for line in text.splitlines() if re.match(r"^[ \d-]+$", line)]
    assert len(rows) == 12 and rows[0] == [10000, -5000, 10000, 0, 10000, -5000, -5000]


@pytest.mark.parametrize("compiler, flags", [("gcc", ["-std=c99"]), ("gcc", ["-std=c17"]), ("g++", CXX)])
def test_languages(compiler, flags, tmp_path):
    elf = build(compiler, flags, [HERE / "main.c", HERE / "start.c"], BUILD, tmp_path / "own.elf")
    assert "own program: passed" in said(elf, tmp_path)


def test_other_fraction_of_the_trigonometry(tmp_path):
    checked(["make", "-s", "LIB_TRIG_FRAC=16", f"BUILD={tmp_path / 'b'}", str(tmp_path / "b" / "libmssfoc.a")])
    sources = [HERE / "main.c", HERE / "start.c"]
    elf = build("gcc", ["-DLIB_TRIG_FRAC=16"], sources, tmp_path / "b", tmp_path / "same.elf")
    assert "own program: passed" in said(elf, tmp_path)
    with pytest.raises(AssertionError, match="undefined reference to `(Inv)?Park_Lib_Do_LIB_TRIG_FRAC_15'"):
        build("gcc", [], sources, tmp_path / "b", tmp_path / "differs.elf")


def test_every_function_that_the_document_names_is_declared_and_in_the_library():
    named = set(re.findall(r"\b\w+_Lib_Do\b", Path("docs/library.md").read_text()))
    headers = Path("lib/Lib.h").read_text() + Path("lib/LibFoc.h").read_text()
    declared = set(re.findall(r"^void (\w+_Lib_Do)\(", headers, re.M))
    symbols = checked([CROSS + "nm", "--defined-only", str(BUILD / "libmssfoc.a")]).stdout
    archived = set(re.findall(r" T (\w+_Lib_Do)$", symbols, re.M))
    assert len(named) >= 6 and named <= declared and declared == archived


def test_it_can_fail(tmp_path):
    (tmp_path / "nothing.c").write_text(NOTHING)
    elf = build("gcc", [], [HERE / "main.c", HERE / "start.c", tmp_path / "nothing.c"], BUILD, tmp_path / "own.elf")
    assert "own program: failed" in said(elf, tmp_path)
