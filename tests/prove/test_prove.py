# SPDX-License-Identifier: MIT
"""`make prove` as part of the tests: all kernels proved, mistakes refuted, and what the prover must not accept."""
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).resolve().parent))

import disassembly  # noqa: E402
import on_qemu  # noqa: E402
import proof  # noqa: E402
from kernel import Kernel, Pointer, Value  # noqa: E402
from machine import Machine  # noqa: E402
from prove_interrupt import CODE  # noqa: E402
from specs import KERNELS  # noqa: E402
from terms import Misbehaviour  # noqa: E402

CROSS = os.environ.get("CROSS", "arm-none-eabi-")
SUM = Kernel("sum", (Pointer("out", ("total",), ("total",)), Value("a"), Value("b")),
             lambda o, v: {"total": o.sat32(v.a + v.b)})
QUICK = ("prove_clarke", "prove_park", "prove_invpark", "prove_cossin")
RIGHT = "adds r1, r1, r2\nmov r2, #0\nit vs\nsbcvs r1, r2, #0x80000000\nstr r1, [r0]\nbx lr"


def code(tmp_path, body):
    source, unit = tmp_path / "sum.S", tmp_path / "sum.o"
    source.write_text(f".syntax unified\n.thumb\n.type sum, %function\nsum:\n{body}\n")
    subprocess.run([CROSS + "gcc", "-mcpu=cortex-m3", "-mthumb", "-c", str(source), "-o", str(unit)], check=True)
    return disassembly.functions(unit, {"sum"})["sum"]


def test_kernels_are_proved_and_mistakes_are_refuted():
    """Those that are quickly proved; all others by `make prove` alone."""
    build = Path(os.environ.get("BUILD", "build"))
    subprocess.run(["make", "-s", "prove-objects"], check=True)
    files = [build / "libmssfoc.a", build / "prove" / "kernels.o", build / "prove"]
    command = [sys.executable, "tests/prove/prove.py", *map(str, files), *QUICK]
    result = subprocess.run(command, capture_output=True, text=True, check=False)
    assert result.returncode == 0, result.stdout + result.stderr
    last = result.stdout.splitlines()[-1]
    count, proved, failed = map(int, re.match(r"(\d+) proofs, (\d+) proved, (\d+) failed", last).groups())
    assert proved == count > 0 and failed == 0
    assert result.stdout.count(" refuted by ") >= 4 * len({line.split()[0] for line in result.stdout.splitlines()[:-1]})


def test_right_code_is_proved(tmp_path):
    proof.prove_equal(SUM, code(tmp_path, RIGHT), 15)


@pytest.mark.parametrize("old, new", [("sbcvs", "addvs"), ("it vs\nsbcvs", "it vc\nsbcvc"),
                                      ("adds r1, r1, r2", "adds r1, r1, r1")])
def test_wrong_code_has_a_counter_example(tmp_path, old, new):
    wrong = code(tmp_path, RIGHT.replace(old, new))
    with pytest.raises(proof.Refuted):
        proof.prove_equal(SUM, wrong, 15)
    values = proof.counter_example(SUM, wrong, 15)
    assert proof.is_wrong(SUM, wrong, 15, values)
    assert proof.is_wrong(SUM, code(tmp_path, RIGHT), 15, values) is None


@pytest.mark.parametrize("body, words", [
    (RIGHT.replace("str r1, [r0]", "str r1, [r0, #4]"), "store outside the output"),
    (RIGHT.replace("str r1, [r0]", "str r1, [r0]\nmov r4, r1"), "r4 is not restored"),
    (RIGHT.replace("bx lr", "bx r2"), "branch elsewhere"),
    (RIGHT.replace("bx lr", "nop"), "no return"),
    ("ldr r1, [r0]\n" + RIGHT, "nobody wrote"),
    ("push {r4}\n" + RIGHT, "r13 is not restored"),
])
def test_what_no_kernel_may_do(tmp_path, body, words):
    with pytest.raises(Misbehaviour, match=words):
        proof.prove_equal(SUM, code(tmp_path, body), 15)


@pytest.mark.parametrize("body", ["sdiv r1, r1, r2\n" + RIGHT, "b sum\n" + RIGHT, "lsls r1, r2\n" + RIGHT])
def test_an_unknown_instruction_is_named(tmp_path, body):
    with pytest.raises(disassembly.Unknown, match="sdiv|b|lsls"):
        proof.prove_equal(SUM, code(tmp_path, body), 15)


def test_the_machine_agrees_with_qemu(tmp_path, monkeypatch):
    build = Path(os.environ.get("BUILD", "build"))
    subprocess.run(["make", "-s", "prove-objects"], check=True)
    names = {kernel.symbol for kernel in KERNELS}
    files = [build / "libmssfoc.a", build / "prove" / "kernels.o", *build.glob("prove/*/libmssfoc.a")]
    codes = [body for file in files for body in disassembly.functions(file, names).values()]
    subprocess.run(["make", "-s", "interrupt-objects"], check=True)
    codes += disassembly.functions(build / "mssfoc.elf", set(CODE)).values()
    qemu = os.environ.get("QEMU", "qemu-system-arm")
    count, wrong = on_qemu.differences(codes, tmp_path, CROSS, qemu)
    assert count > 1000 and not wrong, wrong[:5]
    adding_carries = [body for body in codes if any(one.base == "adc" for one in body.instructions)][:1]
    monkeypatch.setattr(Machine, "do_adc", Machine.do_add)
    assert on_qemu.differences(adding_carries, tmp_path, CROSS, qemu)[1]
