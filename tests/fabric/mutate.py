# SPDX-License-Identifier: MIT
"""Puts each fault of tests/fabric/mutants.toml into a copy of the RTL and asks the proofs to refute it.

mutate.py [FILE ...]   prints one line a file and one for each fault that survives; exits 1 if one does

A fault is refuted by a run from reset that breaks a promise, or, where none is found, by an induction that fails.
"""
import shutil
import sys
import tempfile
import tomllib
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import prove
from places import ROOT, RTL

MUTANTS = ROOT / "tests/fabric/mutants.toml"
# by how many clocks runs from reset are longer than the proof's depth, unless the proof has its own `further`
FURTHER = 6


def load(path=MUTANTS):
    """[(file, text, other text, proof)]"""
    groups = tomllib.loads(path.read_text(encoding="utf-8"))
    return [(name, fault["from"], fault["to"], fault.get("by", group.get("by", name)))
            for name, group in groups.items() for fault in group["list"]]


class Misplaced(Exception):
    """Why a fault says nothing: its text does not stand in the file exactly once, or the proof fails without it."""


def mutated(name, old, new):
    text = (RTL / f"{name}.v").read_text(encoding="utf-8")
    if text.count(old) != 1 or old == new:
        raise Misplaced(f"{name}.v has {text.count(old)} times: {old!r}")
    return text.replace(old, new)


def sound(top, proof):
    """Without a fault no run from reset may break a promise, or refuting would mean nothing."""
    try:
        prove.prove(top, proof, further=proof.get("further", FURTHER), steps=["base case"])
    except prove.Unproved as why:
        raise Misplaced(f"{top} does not hold without a fault: {why}") from None


def refuted(fault, proofs):
    """How the fault was found, or None."""
    name, old, new, top = fault
    text = mutated(name, old, new)
    with tempfile.TemporaryDirectory() as folder:
        rtl = Path(folder) / "rtl"
        shutil.copytree(RTL, rtl)
        (rtl / f"{name}.v").write_text(text, encoding="utf-8")
        try:
            prove.prove(top, proofs[top], rtl, proofs[top].get("further", FURTHER))
        except prove.Unproved as why:
            if "yosys" in str(why):
                raise Misplaced(f"{name}.v with {new!r}: {why}") from None
            return str(why).split(":")[0]
    return None


def main(names):
    proofs = prove.load()
    faults = [fault for fault in load() if not names or fault[0] in names]
    tally, survived = {}, []
    try:
        with ThreadPoolExecutor(2) as pool:
            list(pool.map(lambda top: sound(top, proofs[top]), sorted({fault[3] for fault in faults})))
            for fault, how in zip(faults, pool.map(lambda fault: refuted(fault, proofs), faults)):
                tally.setdefault(fault[0], Counter())[how] += 1
                if how is None:
                    survived.append(fault)
                    print(f"mutants {fault[0]}: SURVIVES {fault[1]!r} -> {fault[2]!r}", flush=True)
    except Misplaced as error:
        print(f"mutants: {error}", file=sys.stderr)
        return 1
    for name, counts in tally.items():
        print(f"mutants {name}: {sum(counts.values()) - counts[None]} of {sum(counts.values())} refuted, "
              f"{counts['base case']} of them by a run from reset")
    print(f"mutants: {len(faults) - len(survived)} of {len(faults)} refuted")
    return 1 if survived or not faults else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
