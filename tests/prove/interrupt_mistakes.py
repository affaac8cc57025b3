# SPDX-License-Identifier: MIT
"""Mistakes on purpose in the handler: for each a state with which it writes something else, confirmed by running both codes."""
import random
import re
from pathlib import Path

from comparison import Comparison, differences
from disassembly import Unknown
from mutation import mutations
from proof import Refuted
from terms import Misbehaviour

TRIES = 24  # mutations of a stage
LEAST = 8  # times as many as are wanted of each stage
NOTHING_TO_SEE = ("entry",)  # another base: an address of nothing known


def stages(source):
    """The stage of each instruction of the handler, in order; IT is none of its own in the listing."""
    found, stage = [], "entry"
    of_two = r"(?ms)^#if AXIS_COUNT == 2\n.*?^#(else|endif)\n"  # what an image for two motors has instead
    for line in re.sub(of_two, "", Path(source).read_text(encoding="utf-8")).splitlines():
        if match := re.match(r"/\* stage: ([^,*]+)", line):
            stage = match.group(1).strip()
        elif match := re.match(r"        ([a-z]\w*)\s", line):
            found += [] if re.fullmatch(r"it[te]{0,3}", match.group(1)) else [stage]
    return found


def by_stage(code, source):
    """{stage: its mutations}, in an order that is always the same."""
    own = [i.address for i in code.instructions]
    stage_of = dict(zip(own, stages(source)))
    found = {}
    for kind in mutations(code).values():
        for what, changed in kind:
            address = re.search(r" at (0x[0-9a-f]+): ", what)
            if address and int(address.group(1), 16) in stage_of:
                found.setdefault(stage_of[int(address.group(1), 16)], []).append((what, changed))
    for stage, queue in found.items():
        random.Random(stage).shuffle(queue)
    return found


def mutate(subject, cuts, code, source, most, say):
    """Mutations of each stage, until enough of them are refuted."""
    refuted = 0
    for stage, queue in by_stage(code, source).items():
        found = 0
        for what, changed in queue[:TRIES]:
            found += refute(subject, cuts, code, (stage, what, changed), say)
            if found == most:
                break
        if found == 0 and stage not in NOTHING_TO_SEE:
            raise Refuted(f"no mutation of stage '{stage}' has a counter-example")
        refuted += found
    if refuted < LEAST * most:
        raise Refuted(f"only {refuted} mutations have a counter-example")
    return refuted


def refute(subject, cuts, code, mutant, say):
    stage, what, changed = mutant
    try:
        ways = subject.run(changed, cuts)
        number = Comparison(subject).refutation(ways, cuts.states)
    except (Misbehaviour, Unknown):
        return False  # refused without a sample: shows nothing about it
    if number is None:
        say(f"  {stage}: {what}", f"{'equivalent (proved)' if _proved(subject, cuts, ways) else 'no answer'}, not counted")
        return False
    values = subject.drawn_state(number)
    comparison = Comparison(subject)
    wanted, wrong = comparison.expected(values), comparison.concrete(changed, values)
    if wrong == wanted or comparison.concrete(code, values) != wanted:
        raise Refuted(f"the counter-example to {what} is none: {values}")
    shown = " ".join(f"{name}={values[name]}" for name in subject.inside)
    say(f"  {stage}: {what}", f"refuted by {shown}: {differences(wrong, wanted)}")
    return True


def _proved(subject, cuts, ways):
    try:
        Comparison(subject).prove(ways, cuts)
    except Refuted:
        return False
    return True
