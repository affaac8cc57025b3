# SPDX-License-Identifier: MIT
"""
make prove: the current loop's interrupt as a whole: the handler by hand and the compiled one, for every state of the invariant.

    prove_interrupt.py IMAGE PROGRAM_OF_ADMITTED_C STEPS MUTANTS_A_STAGE [source]
"""
import sys
import time
from math import sqrt
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path += [str(ROOT / "tests/tools"), str(ROOT / "linker/bounds")]

from admitted import Admitted  # noqa: E402
from comparison import Comparison, differences  # noqa: E402
from disasm import Image as Disassembled  # noqa: E402
from disassembly import Unknown  # noqa: E402
from entries import choices  # noqa: E402
from image import Image  # noqa: E402
from lemmas import half_times  # noqa: E402
from interrupt_mistakes import mutate  # noqa: E402
from proof import Refuted  # noqa: E402
from subject import SAMPLES, Subject  # noqa: E402
from terms import Misbehaviour  # noqa: E402

BY_HAND, COMPILED = "FabricIrq0_IRQHandler", "handlers_encoder_ab"
# the other handlers that the vector can hold, and what stands in a proof's way; docs/prove.md has the same list
NOT_PROVED = {
    "handlers_forced_ab": "the angle is advanced, and the dead time's knee has a width: no chain of numbers is written for it",
    "handlers_observer_ab": "the same, and the observer's state has no invariant yet",
    "handlers_injection_ab": "the same for the injection's two Park transforms and its drawn signs",
    "handlers_hall_ab": "the same for the table of edges; which row holds depends on all edges before",
    "handlers_weakening_ab": "it calls, and its root by a table and its rows of currents have no invariant yet",
    "handlers_overmodulating_ab": "the same, beyond the circle",
    "scoped_tick": "seven instructions in front of whichever handler it finds: that one is proved or not",
}
CODE = {BY_HAND: (BY_HAND, "current_loop_fault"), COMPILED: (COMPILED, "current_loop_fault")}
SOURCE = "firmware/system/current_loop_isr.S"
VECTORS = 12
ENTRIES_BEFORE = ("scoped_tick",)  # current_loop_divert() puts them before a handler


class Report:
    def __init__(self):
        self.started = time.monotonic()

    def __call__(self, what, result):
        now = time.monotonic()
        print(f"interrupt            {what}: {result}, {now - self.started:.1f} s", flush=True)
        self.started = now


def prove_ranges(subject, admitted, say):
    count = admitted.check()
    say("what the slow loop writes, within the invariant", f"seen with {count} sets of parameters; integrals at most "
        f"{admitted.integral_most} by its clamps: proved")
    lengths = ", ".join(f"|{name}| <= {sqrt(square):.2f}" for name, square in zip(("(cos, sin)", "i", "v"), subject.measure()))
    say(f"{lengths}", "all cases tried")
    subject.known |= half_times(subject.k, subject.known)
    say("half on-times lie about the middle of the period", "proved")
    subject.find_spans()
    low, high = _check_room(subject)
    say(f"{len(subject.spans)} values within 32 bits, table indices inside, compares {low}...{high} of "
        f"0...{subject.k.half_counts}", "proved")
    most = subject.hold_integrals()
    say(f"integrals stay within 2^29; by themselves within {most}", "proved")


def _check_room(subject):
    """A shortest pulse and the dead times fit on both sides of a phase."""
    ends = [subject.spans[f"COMPARE_{phase}"] for phase in "ABC"]
    low, high = min(end.low for end in ends), max(end.high for end in ends)
    if min(2 * low, 2 * (subject.k.half_counts - high)) < subject.k.taken_counts:
        raise Refuted(f"compares of {low}...{high} leave no room for dead times and pulses")
    return low, high


def prove_codes(subject, cuts, codes, say):
    for name, code in codes.items():
        check_vectors(subject, code)
        before, ways = cuts.asked, subject.run(code, cuts)
        Comparison(subject).prove(ways, cuts)
        count = sum(i.base != "nop" for i in code.instructions)
        say(f"{name}, {count} instructions, {len(ways)} ways",
            f"all that it writes is what the chain says, {cuts.asked - before} questions: proved")


def in_the_vector(path):
    """Names of all that the image can put into the current loop's vector."""
    image = Disassembled(path)
    found = {function.name for functions in choices(image).values() for function in functions}
    return found | {name for name in ENTRIES_BEFORE if name in image.functions}


def say_what_is_not_proved(path, say):
    known = {*CODE, *NOT_PROVED}
    if unknown := sorted(in_the_vector(path) - known):
        raise Refuted(f"{', '.join(unknown)}: in the vector, neither proved nor listed as not")
    for name in sorted(in_the_vector(path) - set(CODE)):
        say(name, f"not proved: {NOT_PROVED[name]}")


def check_vectors(subject, code):
    """Some samples with constants, through the same machine and the chain in Python's integers."""
    for number in range(0, SAMPLES, SAMPLES // VECTORS):
        values = subject.drawn_state(number)
        got, wanted = Comparison(subject).concrete(code, values), Comparison(subject).expected(values)
        if got != wanted:
            raise Refuted(f"for {values}: {differences(got, wanted)}")


def main(image, program, steps, mutants, source=SOURCE):
    started, say = time.monotonic(), Report()
    try:
        admitted = Admitted(program, steps)
        subject = Subject(Image(image), admitted)
        prove_ranges(subject, admitted, say)
        subject.draw()
        codes, cuts = {name: subject.image.code(*names) for name, names in CODE.items()}, subject.cuts()
        prove_codes(subject, cuts, codes, say)
        say_what_is_not_proved(image, say)
        refuted = mutate(subject, cuts, codes[BY_HAND], source, int(mutants), say) if int(mutants) else 0
    except (Refuted, Misbehaviour, Unknown, OverflowError) as error:
        sys.exit(f"mssfoc: prove: the interrupt is not proved: {type(error).__name__.lower()}: {error}")
    print(f"the interrupt proved whole, {refuted} mutations refuted, {time.monotonic() - started:.0f} s")


if __name__ == "__main__":
    main(*sys.argv[1:])
