# SPDX-License-Identifier: MIT
"""`make mutants`: seeded mistakes in the drive, its plant and their tools, and what share the tests notice: docs/mutants.md."""
import argparse
import fnmatch
import os
import re
import signal
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests"))

from mutants import by_hand  # noqa: E402  (the path must be set first)
from mutants.choose import Sources  # noqa: E402
from mutants.engine import Engine  # noqa: E402
from mutants.ladder import load_rungs  # noqa: E402
from mutants.report import complaints, lines, load_survivors, write_json, write_page  # noqa: E402
from mutants.store import Store  # noqa: E402
from mutants.tree import Project, Trouble  # noqa: E402

HERE = Path(__file__).resolve().parent
IMAGE = (*(f"build/mssfoc{end}" for end in (".elf", ".hex", ".bin", "-envm.hex")), "build/libmssfoc.a", "target-tests",
         "bringup-image", "twin")


def project(root):
    cross = os.environ.get("CROSS") or "arm-none-eabi-"
    return Project(root, ("make", "-s", f"-j{len(os.sched_getaffinity(0))}"), ("unit", "twin", "plant", "registers"), IMAGE,
                   (*(f"build/arm/{room}/**/*.o" for room in ("firmware", "drivers", "startup", "lib")), "build/bringup/*.o"),
                   ("build/mssfoc.elf", "build/bringup.elf", "build/tests/target/*.elf"), cross + "objcopy",
                   os.environ.get("CC_ARM") or cross + "gcc", ("--first",))


def options(argv):
    parser = argparse.ArgumentParser(prog="tests/mutants/run.py", description=__doc__)
    for name, kind, usual, what in (
            ("count", int, 400, "how many mutants"), ("seed", str, "1", "of the choice: the same seed, the same mutants"),
            ("files", str, "*", "globs of the files that get mistakes, e.g. 'firmware/axis/*'"),
            ("by", str, "", "a file with mistakes of one's own, docs/mutants.md, in place of drawn ones"),
            ("rungs", str, "", "names of the only rungs to ask, e.g. 'unit target'"),
            ("part", str, "1/1", "which of how many parts to judge now, e.g. 2/4; the table has all so far"),
            ("jobs", int, len(os.sched_getaffinity(0)), "workers"),
            ("budget", float, 100.0, "CPU seconds of the image's tests that a mutant may take, 30 %% of it of others; 0: all")):
        parser.add_argument(f"--{name}", type=kind, default=usual, help=f"{what} (default: {usual})")
    parser.add_argument("--remember", action="store_true", help="write table and survivors into docs/mutants.md")
    chosen = parser.parse_args(argv)
    part = re.fullmatch(r"([1-9]\d*)/([1-9]\d*)", chosen.part)
    if chosen.count < 1 or chosen.jobs < 1 or chosen.budget < 0 or not part or int(part[1]) > int(part[2]):
        parser.error("N and JOBS must be at least 1, BUDGET at least 0, PART like 2/4")
    if chosen.by and chosen.remember:
        parser.error("docs/mutants.md has drawn mistakes, not those of BY: leave out REMEMBER")
    chosen.part = int(part[1]) - 1, int(part[2])
    return chosen


def main(argv=None):
    """0: enough are noticed and it is known what survivors would do; 1: not so; 2: the run could not be made."""
    chosen = options(argv)
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))
    try:
        return play(chosen)
    except (Trouble, ValueError, OSError) as error:
        print(f"mssfoc: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("mssfoc: interrupted; what is known stays, the same command goes on from here", file=sys.stderr)
        return 130


def play(chosen):
    begun, build = time.monotonic(), Path(os.environ.get("BUILD") or "build")
    folder = (build if build.is_absolute() else ROOT / build) / "mutants"
    folder.mkdir(parents=True, exist_ok=True)
    rungs = [rung for rung in load_rungs(HERE / "ladder.toml") if not chosen.rungs or rung.name in chosen.rungs.split()]
    if not rungs:
        raise Trouble(f"RUNGS='{chosen.rungs}' names no rung of tests/mutants/ladder.toml")
    made = project(ROOT)
    sources = Sources(ROOT, build=build, arm=made.compiler, host=os.environ.get("HOSTCC") or "cc")
    drawn = by_hand.load(chosen.by, sources) if chosen.by else sources.draw(
        chosen.count, chosen.seed, lambda name: any(fnmatch.fnmatch(name, g) for g in chosen.files.split()))
    if not drawn:
        raise Trouble(f"FILES='{chosen.files}' names no file with anything to break")
    known, store = {} if chosen.by else load_survivors(HERE / "survivors.toml"), Store(folder, ROOT, drawn)
    engine = Engine(made, folder, drawn, rungs, store, lambda line: print(line, flush=True), chosen.jobs, chosen.budget)
    how = f"make mutants N={chosen.count} SEED={chosen.seed}" + (f" RUNGS='{chosen.rungs}'" if chosen.rungs else "") + (
        f" BUDGET={chosen.budget:g}" if chosen.budget != 100 else "")
    try:
        judged = engine.run([one for n, one in enumerate(drawn) if n % chosen.part[1] == chosen.part[0] or
                             store.verdict(one, [rung.name for rung in rungs])])
    except (KeyboardInterrupt, SystemExit):
        if chosen.remember:
            write_page(ROOT / "docs/mutants.md", engine.judged, known, ROOT, how, drawn)
        raise
    write_json(folder / "result.json", judged, known, chosen.seed)
    print("", *lines(judged, known), sep="\n")
    if chosen.remember:
        write_page(ROOT / "docs/mutants.md", judged, known, ROOT, how, drawn)
    print(f"\n{len(judged)} of {len(drawn)} mutants in {(time.monotonic() - begun) / 60:.1f} minutes; all of them: "
          f"{folder / 'result.json'}", flush=True)
    wrong = [f"{name} fails without any mutant" for name in engine.broken] + list(complaints(judged, known, sources))
    for line in wrong:
        print(f"mssfoc: {line}", file=sys.stderr)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
