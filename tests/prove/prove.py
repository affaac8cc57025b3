# SPDX-License-Identifier: MIT
"""
make prove: every kernel's assembled instructions against its specification, for all inputs, and seeded mistakes refuted.

    prove.py LIBRARY KERNELS.o DIRECTORY_OF_OTHER_FRACTIONS [symbol...]
"""
import random
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import disassembly
import proof
from disassembly import Unknown
from execution import Execution
from mutation import mutations
from specs import KERNELS
from terms import Misbehaviour

VECTORS = 60
MUTANTS = 6  # to be refuted, a kernel
LEAST = 4
TRIES = 40


class Job:
    """One kernel at one LIB_TRIG_FRAC: its lines of output, and whether all went well."""

    def __init__(self, index, frac, code):
        self.kernel, self.frac, self.code = KERNELS[index], frac, code
        self.lines, self.good = [], True
        fraction = f" F={frac}" if len(self.kernel.fracs) > 1 else ""
        self.name = f"{self.kernel.symbol.removeprefix('prove_')}{fraction}"

    def say(self, what, result, started):
        self.lines.append(f"{self.name:<20} {what} {result}, {time.monotonic() - started:.1f} s")

    def run(self):
        try:
            self.prove()
            if self.frac == 15:
                self.mutate()
        except (Unknown, Misbehaviour, proof.Refuted, proof.Undecided) as error:
            self.good = False
            self.lines.append(f"{self.name:<20} FAILED: {type(error).__name__.lower()}: {error}")
        return self.lines, self.good

    def prove(self):
        kernel, started = self.kernel, time.monotonic()
        proof.check_vectors(kernel, self.code, self.frac, VECTORS)
        proof.prove_equal(kernel, self.code, self.frac)
        ways = proof.prove_overlaps(kernel, self.code)
        count = sum(i.base != "nop" for i in self.code.instructions)
        self.say(f"{count:3} instructions", f"{self.assumes()}{f', {ways} overlaps' if ways else ''}: proved", started)
        for name, _, bound in kernel.bounds:
            started = time.monotonic()
            proof.prove_bounds(kernel, self.frac, name)
            self.say(f"  |{name} - exact| <= {float(bound)} LSB:", "proved", started)

    def assumes(self):
        products = Execution(self.kernel, self.code).products
        kind = "products abstract" if len(products.known) > len(products.definitions) else "exact"
        return f"[{kind}{'; ' if self.kernel.assumption else ''}{self.kernel.assumption}]"

    def mutate(self):
        """A mutation of every kind in turn, until enough are refuted."""
        generator = random.Random(self.kernel.symbol)
        queues = list(mutations(self.code).values())
        for queue in queues:
            generator.shuffle(queue)
        order = [queue[n] for n in range(max(map(len, queues))) for queue in queues if n < len(queue)]
        refuted = 0
        for what, code in order[:TRIES]:
            refuted += self.refute(what, code)
            if refuted == MUTANTS:
                break
        if refuted < LEAST:
            raise proof.Refuted(f"only {refuted} mutations have a counter-example")

    def refute(self, what, code):
        """Is this mutation wrong, with a counter-example that the machine confirms?"""
        started = time.monotonic()
        try:
            if proof.is_equivalent(self.kernel, code, self.frac):
                self.say(f"  {what}", "equivalent (proved), not counted", started)
                return False
            values = proof.counter_example(self.kernel, code, self.frac)
        except (Misbehaviour, Unknown):
            return False  # refused without a solver: shows nothing about it
        except proof.Undecided:
            self.say(f"  {what}", "no answer in time, not counted", started)
            return False
        if values is None:
            self.say(f"  {what}", "no counter-example with these constants, not counted", started)
            return False
        wrong = proof.is_wrong(self.kernel, code, self.frac, values)
        right = proof.is_wrong(self.kernel, self.code, self.frac, values) is None
        if not wrong or not right:
            raise proof.Refuted(f"the counter-example to {what} is none: {values}")
        shown = " ".join(f"{name}={value}" for name, value in values.items())
        self.say(f"  {what}", f"refuted by {shown}: {_differences(*wrong)}", started)
        return True


def _differences(got, wanted):
    shown = {name: "undefined" if value is None else value for name, value in got.items()}
    return ", ".join(f"{name} {shown[name]} not {wanted[name]}" for name in wanted if got[name] != wanted[name])


def run_job(arguments):
    return Job(*arguments).run()


def check_tables(library):
    """The real tables hold words in the range that the proofs assume."""
    for table in {kernel.table for kernel in KERNELS if kernel.table}:
        words = disassembly.table_words(library, table.symbol)
        if len(words) != table.words or not all(table.lowest <= word <= table.highest for word in words):
            raise Unknown(f"table {table.symbol}: not {table.words} words in {table.lowest}...{table.highest}")


def jobs(library, kernels, others, wanted):
    symbols = {kernel.symbol for kernel in KERNELS}
    code = {}
    for frac in sorted({frac for kernel in KERNELS for frac in kernel.fracs}):
        files = [library, kernels] if frac == 15 else [Path(others) / str(frac) / "libmssfoc.a"]
        for file in files:
            code |= {(name, frac): body for name, body in disassembly.functions(file, symbols).items()}
    for index, kernel in enumerate(KERNELS):
        for frac in kernel.fracs:
            if (kernel.symbol, frac) not in code:
                raise Unknown(f"function {kernel.symbol}: it is in no object file")
            if not wanted or kernel.symbol in wanted:
                yield index, frac, code[kernel.symbol, frac]


def main(library, kernels, others, *wanted):
    started = time.monotonic()
    try:
        check_tables(library)
        work = list(jobs(library, kernels, others, wanted))
    except Unknown as error:
        sys.exit(f"mssfoc: prove: {error}")
    failed = 0
    with ProcessPoolExecutor(2) as pool:
        for lines, good in pool.map(run_job, work):
            print("\n".join(lines), flush=True)
            failed += not good
    print(f"{len(work)} proofs, {len(work) - failed} proved, {failed} failed, {time.monotonic() - started:.0f} s")
    if failed:
        sys.exit(f"mssfoc: prove: {failed} of {len(work)} kernels are not proved, see FAILED above")


if __name__ == "__main__":
    main(*sys.argv[1:])
