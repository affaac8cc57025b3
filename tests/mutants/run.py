# SPDX-License-Identifier: MIT
"""`make mutants`: seeded faults in the drive, and what share of them the tests notice. docs/mutants.md says how."""
import argparse
import fnmatch
import os
import signal
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests"))

from mutants.choose import Sources  # noqa: E402  (the path must be set first)
from mutants.ctext import NotUnderstood  # noqa: E402
from mutants.engine import Engine  # noqa: E402
from mutants.ladder import load_rungs  # noqa: E402
from mutants.report import complaints, lines, load_hints, load_reasons, write_hints, write_json  # noqa: E402
from mutants.store import Store, fingerprint  # noqa: E402
from mutants.tree import Project, Tree, Trouble, digest  # noqa: E402

HERE = Path(__file__).resolve().parent
HINTS = HERE / "noticed.json"
JUDGES = ("firmware", "drivers", "startup", "lib", "linker", "qemu", "tests", "Makefile")  # a survivor holds for these


def project(root):
    cross = os.environ.get("CROSS") or "arm-none-eabi-"
    build = [f"build/mssfoc{end}" for end in (".elf", ".hex", ".bin", "-envm.hex")]
    compiler = os.environ.get("CC_ARM") or cross + "gcc"
    return Project(root, ("make", "-s"), (*build, "build/libmssfoc.a", "twin", "target-tests", "bringup-image"),
                   (*(f"build/arm/{room}/**/*.o" for room in ("firmware", "drivers", "startup")), "build/bringup/*.o"),
                   ("build/mssfoc.elf", "build/bringup.elf", "build/tests/target/*.elf"), cross + "objcopy", compiler)


def options(argv):
    cores = sorted(os.sched_getaffinity(0))
    parser = argparse.ArgumentParser(prog="tests/mutants/run.py", description=__doc__)
    parser.add_argument("--count", type=int, default=220, help="how many mutants (default: 220)")
    parser.add_argument("--seed", default="1", help="of the choice: the same seed, the same mutants (default: 1)")
    parser.add_argument("--files", default="*", help="globs of the files that get faults, e.g. 'firmware/axis/*'")
    parser.add_argument("--rungs", default="", help="names of the only rungs to ask, e.g. 'unit target' (default: all)")
    parser.add_argument("--jobs", type=int, default=len(cores), help="workers (default: one a core)")
    parser.add_argument("--budget", type=float, default=100.0,
                        help="CPU seconds of tests for a mutant, then it counts as not noticed; 0: all tests (default: 100)")
    parser.add_argument("--remember", action="store_true", help="write who noticed into tests/mutants/noticed.json")
    parser.add_argument("--keep-going", action="store_true", help="leave out tests that fail without any fault; the run fails")
    parser.add_argument("--listed", action="store_true", help="try those of equivalent.toml, too")
    parser.add_argument("--list", action="store_true", help="only print the faults in their order")
    chosen = parser.parse_args(argv)
    if chosen.count < 1 or chosen.jobs < 1 or chosen.budget < 0:
        parser.error("N and JOBS must be at least 1, BUDGET at least 0")
    chosen.cores = cores
    return chosen


def main(argv=None):
    """0: enough are noticed and every survivor has its reason; 1: not so; 2: the run could not be made."""
    chosen = options(argv)
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))
    try:
        return play(chosen)
    except (Trouble, NotUnderstood, ValueError, OSError) as error:
        print(f"mssfoc: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("mssfoc: interrupted; what is known stays, the same command goes on from here", file=sys.stderr)
        return 130


def play(chosen):
    begun = time.monotonic()
    build = Path(os.environ.get("BUILD") or "build")
    folder = (build if build.is_absolute() else ROOT / build) / "mutants"
    folder.mkdir(parents=True, exist_ok=True)
    sources = Sources(ROOT)
    files = [name for name in sources.faults if any(fnmatch.fnmatch(name, glob) for glob in chosen.files.split())]
    if not any(sources.faults[name] for name in files):
        raise Trouble(f"FILES='{chosen.files}' names no file with anything to break")
    rungs = [rung for rung in load_rungs(HERE / "ladder.toml") if not chosen.rungs or rung.name in chosen.rungs.split()]
    if not rungs:
        raise Trouble(f"RUNGS='{chosen.rungs}' names no rung of tests/mutants/ladder.toml")
    reasons = load_reasons(HERE / "equivalent.toml")
    made = project(ROOT)
    trees = [Tree(made, folder / f"w{n}", chosen.cores[n % len(chosen.cores)]) for n in range(chosen.jobs)]
    store = Store(folder / "results.jsonl", ROOT, {name: digest(text) for name, text in sources.texts.items()},
                  digest(fingerprint(ROOT, JUDGES), chosen.budget, *[rung.name for rung in rungs]))
    engine = Engine(sources, trees, rungs, store, chosen.seed, lambda line: print(line, flush=True), chosen.keep_going,
                    frozenset() if chosen.listed else frozenset(reasons), load_hints(HINTS), chosen.budget)
    if chosen.list:
        return show_plan(engine, files, chosen)
    judged = engine.run(chosen.count, files)
    write_json(folder / "result.json", judged, engine.tried, reasons, sources, chosen.seed)
    if chosen.remember:
        write_hints(HINTS, judged, sources)
    text = "\n".join(lines(judged, engine.tried, reasons, sources))
    (folder / "result.txt").write_text(text + "\n")
    print("\n" + text)
    wrong = [f"{name} fails without any fault" for name in engine.broken] + list(complaints(judged, reasons, sources))
    minutes = (time.monotonic() - begun) / 60
    print(f"\n{len(judged)} mutants in {minutes:.1f} minutes; all of them: {folder / 'result.json'}", flush=True)
    for line in wrong:
        print(f"mssfoc: {line}", file=sys.stderr)
    return 1 if wrong else 0


def show_plan(engine, files, chosen):
    for file, fault in engine.plan(chosen.count, files):
        print(f"{file}:{fault.line} {fault.kind}: {fault.original}  ->  {fault.replacement}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
