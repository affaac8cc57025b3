# SPDX-License-Identifier: MIT
"""`make campaign PART=...`: the parts there are, their cases, and how one is played."""
import re
import tempfile

from . import (part_detune, part_identified, part_identify, part_saliency, part_sensorless, part_start, part_supervision,
               part_wiring)
from .campaign import MOTOR, keep
from .data import available, motors_named
from .drive import load_drive
from .errors import LauncherError, choice
from .kind import Run
from .part import PartCase, matches
from .paths import MOTORS

PARTS = {module.NAME: module for module in (part_start, part_wiring, part_supervision, part_detune, part_identify,
                                            part_identified, part_sensorless, part_saliency)}


def is_part(key):
    """Whether a key is one of a part's case: lot:7 is a motor."""
    return re.match(r"(?!lot:)\w+:", key) is not None


def parse(key):
    """A PartCase from its key."""
    found = re.fullmatch(rf"(\w+):{MOTOR}/(.+)", key.strip())
    if not found or found[1] not in PARTS:
        raise LauncherError(f"'{key}' is not PART:MOTOR/WHAT with PART one of {', '.join(PARTS)}")
    return PartCase(*found.groups())


def plan_part(part, motors, options):
    """Every case of a part. `motors`: names, or none for all; `options`: of the command line, by name."""
    if part not in PARTS:
        raise LauncherError(f"no PART '{part}'; there are: {choice(part, PARTS)}")
    cases, wanted = PARTS[part].plan(motors_named(motors) or available(MOTORS), options), (options.get("what") or "").split()
    if not cases:
        raise LauncherError(f"PART {part} has no case for these motors: docs/campaign.md says which it has")
    chosen = [case for case in cases if not wanted or matches(case.what, wanted)]
    if not chosen:
        raise LauncherError(f"WHAT '{options['what']}' is none of the cases of {part}, for example {cases[0].what}")
    return chosen


def play_part_case(case, out_dir, build=None, qemu=None, **more):
    """(Result, Verdict) of a case."""
    from .simulate import simulate

    setup = PARTS[case.part].setup(case.what, load_drive(case.motor))
    result = simulate(setup.scenario, case.motor, out_dir=out_dir, build=build, qemu=qemu, **setup.arguments, **more)
    run = Run(result.trace, result.console, result.drive, result.enums, result.scenario.names, result.scenario.steps,
              figures=result.figures)
    if setup.follow is None:
        return result, setup.judge(run)

    def play(scenario, **arguments):
        with tempfile.TemporaryDirectory(prefix="mssfoc-") as scratch:
            return simulate(scenario, case.motor, out_dir=scratch, build=build, qemu=qemu, **arguments)
    return result, setup.follow(run, play)


def run_part_case(case, folder, build=None, qemu=None):
    """Plays the case and leaves its file. A run that could not be made is a failure, too."""
    from .verdict import NOT_SET_UP, judged_part

    outcome = {"part": case.part, "motor": case.motor, "what": case.what}
    with tempfile.TemporaryDirectory(prefix="mssfoc-") as scratch:
        try:
            result, verdict = play_part_case(case, scratch, build, qemu)
            outcome |= {"outcome": verdict.outcome, "passed": verdict.passed, "why": verdict.why, "figures": verdict.figures,
                        "simulated_s": float(result.trace["t_s"][-1]), **vars(judged_part(result, verdict))}
        except LauncherError as error:
            outcome |= {"outcome": "no run", "passed": False, "why": str(error).split("\n")[0], "figures": {},
                        "simulated_s": None, "word": NOT_SET_UP, "cause": str(error).split("\n")[0], "truth": ""}
    keep(case, outcome, folder)
    return outcome
