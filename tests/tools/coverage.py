# SPDX-License-Identifier: MIT
"""What of the firmware no unit test enters: the libraries of tests/unit, built to count (gcov), in a folder of their own.

usage: coverage.py [pytest argument...]     tests/unit, or these of it; prints rooms, functions and lines
"""
import json
import os
import subprocess
import sys
from collections import defaultdict
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
COUNTED = ("firmware/", "drivers/", "lib/")


def play(build, arguments):
    """Counts of an earlier run would be added to."""
    for old in (ROOT / build).rglob("*.gcda"):
        old.unlink()
    told = {**os.environ, "BUILD": build, "UNIT_WATCHED": "--coverage", "PYTHONPATH": str(ROOT / "tests")}
    result = subprocess.run([sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", *(arguments or ["tests/unit"])],
                            cwd=ROOT, env=told)
    return result.returncode


def counted(build):
    """{file: ({line: times}, {(line, branch): times}, {function: (line, times)})} over all objects that include it."""
    files = defaultdict(lambda: (defaultdict(int), defaultdict(int), {}))
    objects = sorted(str(path) for path in (ROOT / build).rglob("*.gcda"))
    output = subprocess.run(["gcov", "--json-format", "--branch-probabilities", "--stdout", *objects], cwd=ROOT,
                            capture_output=True, text=True, check=True).stdout
    for report in map(json.loads, filter(None, output.splitlines())):
        for file in report["files"]:
            if file["file"].startswith(COUNTED):
                add(files[file["file"]], file)
    return files


def add(total, file):
    lines, branches, functions = total
    for line in file["lines"]:
        lines[line["line_number"]] += line["count"]
        for number, branch in enumerate(line["branches"]):
            branches[line["line_number"], number] += branch["count"]
    for function in file["functions"]:
        before = functions.get(function["name"], (0, 0))[1]
        functions[function["name"]] = function["start_line"], before + function["execution_count"]


def spans(numbers):
    """"3-5, 9" of 3, 4, 5, 9."""
    found = []
    for number in sorted(numbers):
        if found and found[-1][1] == number - 1:
            found[-1][1] = number
        else:
            found.append([number, number])
    return ", ".join(f"{first}-{last}" if first != last else f"{first}" for first, last in found)


def missed(times):
    return [what for what, count in times.items() if not count]


def report(files):
    rooms = defaultdict(lambda: [0, 0, 0, 0])
    for name, (lines, branches, _) in files.items():
        room = rooms[name.rsplit("/", 1)[0]]
        for at, times in ((0, lines), (2, branches)):
            room[at] += len(times)
            room[at + 1] += len(missed(times))
    yield f"{'room':24}{'lines':>8}{'missed':>8}{'branches':>10}{'missed':>8}"
    for room, figures in [*sorted(rooms.items()), ("all", [sum(column) for column in zip(*rooms.values())])]:
        yield f"{room:24}{figures[0]:8}{figures[1]:8}{figures[2]:10}{figures[3]:8}"
    yield "\nfunctions that nothing enters"
    for name, (_, _, functions) in sorted(files.items()):
        yield from (f"{name}:{line} {function}" for function, (line, times) in functions.items() if not times)
    yield "\nlines that nothing enters"
    for name, (lines, _, _) in sorted(files.items()):
        if missed(lines):
            yield f"{name}: {spans(missed(lines))}"


def main():
    build = f"{os.environ.get('BUILD', 'build')}/coverage"
    status = play(build, sys.argv[1:])
    print(*report(counted(build)), sep="\n")
    return status


if __name__ == "__main__":
    sys.exit(main())
