# SPDX-License-Identifier: MIT
"""A part of `make explore` to its end; and that it would find what it looks for: each invariant is broken once on purpose."""
import os
import subprocess

import pytest

from rigs.firmware import HERE, ROOT, built

# (file, what stands there, what is put in its place, setup, what is found)
MUTANTS = {
    "off forgets no restart": ("drive/retry.c", "r->wanted = false;\n    r->waiting = false;\n    r->due = false;", "",
                               "measuring", "it starts without a wish"),
    "a fault leaves the gates open": ("fault/latch.c", "gate_disable(&a->fabric->gate);", ";", "measuring",
                                      "a latched fault and open gates"),
    "the last cause stays": ("fault/latch.c", "if (first) {", "if (true) {", "encoder", "the first cause did not stay"),
    "off is not asked for": ("drive/requests.c", "a->request = AXIS_REQUEST_OFF;", ";", "measuring",
                             "'off' does not lead to rest"),
    "no limit": ("drive/mode_speed.c", "mode_within(rpm, a->params.speed_max_rpm,",
                 "mode_within(rpm, 2 * a->params.speed_max_rpm,", "set-points", "a set-point beyond its limit is accepted"),
    "a set-point outlives off": ("drive/states.c", "a->set_point.waits = false; /* of an earlier operation */", "",
                                 "encoder-kind", "operation begins with a set-point from before"),
    "another word for a fault's reaction": ("operate/cia402.c", "[AXIS_FAULT_REACTION] = 0x0F",
                                            "[AXIS_FAULT_REACTION] = 0x07", "measuring", "status word: from"),
    "a look and a store apart": ("control/bridge.c", "const uint32_t mask = cpu_irq_save();", "const uint32_t mask = 0;",
                                 "learn-hall", "the gates open while a fault is latched, by"),
}
FLAGS = ["-std=gnu11", "-O1", "-Wall", "-Wextra", "-Werror", "-Wno-int-to-pointer-cast", f"-I{HERE / 'host'}", f"-I{ROOT}"]


def run(program, *arguments):
    return subprocess.run([program, *arguments], cwd=ROOT, capture_output=True, text=True, timeout=600)


def program_with(mutant, folder):
    """The explorer, with another version of a file of the firmware: its functions come before the library's."""
    built("firmware.so")
    path, before, after, *_ = mutant
    text = (ROOT / "firmware" / path).read_text()
    assert before in text, f"firmware/{path} has no longer what this breaks"
    (folder / "mutant.c").write_text(text.replace(before, after))
    compiler, library = os.environ.get("HOSTCC") or "cc", ROOT / os.environ["BUILD"] / "tests/unit/firmware.so"
    whole = [*map(str, sorted((ROOT / "tests/explore").glob("*.c"))), str(library), "-ldl", "-Wl,-z,muldefs"]
    for command in ([*FLAGS, "-fPIC", "-fsanitize-coverage=trace-pc", "-c", "mutant.c", "-o", "mutant.o"],
                    [*FLAGS, "mutant.o", *whole, "-o", "explore"]):
        result = subprocess.run([compiler, *command], cwd=folder, capture_output=True, text=True)
        assert result.returncode == 0, result.stderr
    return folder / "explore"


@pytest.fixture(scope="module")
def program():
    result = subprocess.run(["make", "-s", "NO_INSTALL=1", "explore-program"], cwd=ROOT, capture_output=True, text=True)
    assert result.returncode == 0, result.stderr
    return ROOT / os.environ["BUILD"] / "explore/explore"


def test_nothing_is_violated_in_any_state_of_the_sample(program):
    result = run(program, "sample")
    assert result.returncode == 0 and "VIOLATION" not in result.stdout, result.stdout
    assert result.stdout.count("nothing new appears") == 3, result.stdout


@pytest.mark.parametrize("mutant", MUTANTS.values(), ids=MUTANTS)
def test_what_is_broken_on_purpose_is_found(mutant, tmp_path):
    result = run(program_with(mutant, tmp_path), mutant[3], "8000")
    assert result.returncode == 1 and f"VIOLATION: {mutant[4]}" in result.stdout, result.stdout


@pytest.mark.parametrize("arguments, said", ((["nothing"], "no setup 'nothing'; there are all, sample, "),
                                             (["bus", "play", "dance"], "no event 'dance'; ")))
def test_what_there_is_not_is_named(program, arguments, said):
    result = run(program, *arguments)
    assert result.returncode == 2 and said in result.stderr
