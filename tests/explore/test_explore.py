# SPDX-License-Identifier: MIT
"""A part of `make explore` to its end; and that it would find what it looks for: each invariant is broken once on purpose."""
import os
import subprocess

import pytest

from rigs.firmware import ROOT
from rigs.planted import planted

# (file, what stands there, what is put in its place, setup, what is found[, within so many states])
MUTANTS = {
    "off forgets no restart": ("drive/requests.c", "r->wanted = false;\n    r->waiting = false;\n    r->due = false;", "",
                               "measuring", "it starts without a wish"),
    "a fault leaves the gates open": ("fault/fault.c", "gate_disable(&a->fabric->gate);", ";", "measuring",
                                      "a latched fault and open gates"),
    "the last cause stays": ("fault/fault.c", "if (first) {", "if (true) {", "encoder", "the first cause did not stay"),
    "off is not asked for": ("drive/requests.c", "a->request = AXIS_REQUEST_OFF;", ";", "measuring",
                             "'off' does not lead to rest"),
    "no limit": ("drive/mode_speed.c", "mode_within(rpm, a->params.speed_max_rpm,",
                 "mode_within(rpm, 2 * a->params.speed_max_rpm,", "set-points", "a set-point beyond its limit is accepted"),
    "a set-point outlives off": ("drive/states.c", "a->set_point.waits = false; /* of an earlier operation */", "",
                                 "encoder-kind", "operation begins with a set-point from before", "16000"),
    "another word for a fault's reaction": ("operate/cia402.c", "[AXIS_FAULT_REACTION] = 0x0F",
                                            "[AXIS_FAULT_REACTION] = 0x07", "measuring", "status word: from"),
    "a look and a store apart": ("control/bridge.c", "const uint32_t mask = cpu_irq_save();", "const uint32_t mask = 0;",
                                 "learn-hall", "the gates open while a fault is latched, by"),
    "a lost owner is waited for": ("drive/owner.c", "a->owner.who != OWNER_NONE && owner_is_lost(a)", "false", "encoder",
                                   "it starts without a wish"),
    "who takes over takes a restart": ("drive/owner.c", "retry_withdraw(&a->retry);", "", "encoder",
                                       "it starts without a wish", "25000"),
    "a start has no owner": ("drive/owner.c", "!a->switching.under_way && ", "", "measuring",
                             "it is on and nobody commands it"),
}

def run(program, *arguments, **environment):
    return subprocess.run([program, *arguments], cwd=ROOT, capture_output=True, text=True, timeout=600,
                          env=os.environ | environment)


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
def test_what_is_broken_on_purpose_is_found(program, mutant, tmp_path):
    *place, setup, found, states = (*mutant, "8000")[:6]
    result = run(program, setup, states, **planted(tmp_path, *place))
    assert result.returncode == 1 and f"VIOLATION: {found}" in result.stdout, result.stdout


@pytest.mark.parametrize("arguments, said", ((["nothing"], "no setup 'nothing'; there are all, sample, "),
                                             (["bus", "play", "dance"], "no event 'dance'; ")))
def test_what_there_is_not_is_named(program, arguments, said):
    result = run(program, *arguments)
    assert result.returncode == 2 and said in result.stderr
