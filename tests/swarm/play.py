# SPDX-License-Identifier: MIT
"""`make swarm`: plays histories by lot, judges them, shrinks those in which something is wrong.

    PYTHONPATH=tests python3 -m swarm.play run SEED N         the histories 1 to N of a seed
    PYTHONPATH=tests python3 -m swarm.play show SEED NUMBER   one as a text, which build/swarm/swarm1 plays
"""
import collections
import itertools
import os
import re
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from swarm import lots

ROOT = Path(__file__).resolve().parents[2]
PROGRAMS = Path(os.environ.get("BUILD") or ROOT / "build") / "swarm"
BATCH = 50

# what is known to be wrong, {why: how the judge says it}
KNOWN = {}


def known(what):
    return next((why for why, said in KNOWN.items() if re.match(said, what)), None)


def play(texts, programs=PROGRAMS, environments=({}, {})):
    """[[(milliseconds, what is wrong)]] of histories, in their order; what the programs' environments have besides."""
    found = [[] for _ in texts]
    for axes in (1, 2):
        numbers = [number for number, text in enumerate(texts) if ("axes 2" in text) == (axes == 2)]
        if not numbers:
            continue
        told = "".join(f"history {number}\n{texts[number]}" for number in numbers)
        result = subprocess.run([f"{programs}/swarm{axes}"], input=told, capture_output=True, text=True,
                                env=os.environ | environments[axes - 1])
        if result.returncode not in (0, 1):
            raise SystemExit(f"mssfoc: swarm{axes} ends with {result.returncode}: {result.stderr.strip()}")
        findings = []
        for line in result.stdout.splitlines():
            if match := re.match(r"wrong at (\d+): (.*)$", line):
                findings.append((int(match[1]), match[2]))
            elif match := re.match(r"history (\d+): ", line):
                found[int(match[1])], findings = findings, []
    return found


def kinds(findings):
    return {what for _, what in findings}


def shrunk(text, kind, programs=PROGRAMS):
    """The fewest lines in which it is still wrong in this way."""
    axes, *body, end = text.splitlines()

    def still(body, end):
        return kind in kinds(play(["\n".join([axes, *body, end]) + "\n"], programs)[0])

    size = len(body)
    while size >= 1:
        at = 0
        while at < len(body):
            without = body[:at] + body[at + size:]
            if still(without, end):
                body = without
            else:
                at += size
        size //= 2
    last = max((int(line.split()[0]) for line in body if line[0].isdigit()), default=0)
    sooner = (f"end {last + ms}" for ms in (20, 300, 1000))
    return "\n".join([axes, *body, next((one for one in sooner if still(body, one)), end)]) + "\n"


def run(seed, count, programs=PROGRAMS):
    """({kind: [(number, text)]}, number of histories in which something is wrong)"""
    found, wrong = collections.defaultdict(list), 0

    def batch(first):
        texts = [lots.history(seed, number) for number in range(first, min(first + BATCH, count + 1))]
        return list(zip(itertools.count(first), texts, play(texts, programs)))

    with ThreadPoolExecutor(2) as both:
        for number, text, findings in itertools.chain.from_iterable(both.map(batch, range(1, count + 1, BATCH))):
            wrong += bool(findings)
            for what in kinds(findings):
                found[what].append((number, text))
    return found, wrong


def print_findings(found, programs=PROGRAMS):
    """The known ones in a line each; of each other the shortest history, shrunk."""
    for what, histories in sorted(found.items(), key=lambda item: -len(item[1])):
        number, text = min(histories, key=lambda one: (len(one[1].splitlines()), one[0]))
        said = f"in {len(histories)} histories, first {min(histories)[0]}: {what}"
        if known(what):
            print(f"known, {said} ({known(what)})")
        else:
            print(f"\nWRONG {said}")
            print("".join(f"    {line}\n" for line in [f"history {number}", *shrunk(text, what, programs).splitlines()]))


def main(arguments):
    if arguments[:1] not in (["run"], ["show"]) or len(arguments) != 3:
        print(__doc__, file=sys.stderr)
        return 2
    what, seed, count = arguments
    if not re.fullmatch("[1-9][0-9]{0,6}", count):
        print(f"mssfoc: N={count}: how many histories, 1 to 9999999", file=sys.stderr)
        return 2
    if what == "show":
        print(f"history {count}\n{lots.history(seed, int(count))}", end="")
        return 0
    began_s = time.monotonic()
    found, wrong = run(seed, int(count))
    took_s, spent = time.monotonic() - began_s, os.times()
    print_findings(found)
    print(f"{count} histories of seed {seed} in {took_s:.0f} s, {spent.children_user + spent.children_system:.0f} s of "
          f"processor; something is wrong in {wrong}, of {len(found)} kinds")
    return any(not known(what) for what in found)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
