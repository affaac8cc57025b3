# SPDX-License-Identifier: MIT
"""make bench: measures, prints the table and what has changed, and writes build/bench.json, build/cycles.md, all of it,
docs/benchmarks.md, the bounds in docs/cycles.md and tests/bench/baseline.json (for GCC 14: baseline-gcc14.json); to commit the
last three accepts them."""
import argparse
import json
import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / folder) for folder in ("qemu", "tests", "tests/tools", "firmware/tables", "linker/bounds")]
os.chdir(ROOT)

from bench.measure import measure  # noqa: E402
from bench.report import BASELINE, baselines, changes, markdown, table  # noqa: E402
from compiler import REFERENCE, file_of, version  # noqa: E402
from cycles_page import listings, with_summary  # noqa: E402
from disasm import ImageError  # noqa: E402
from launcher.errors import LauncherError  # noqa: E402
from launcher.paths import build_dir, shown  # noqa: E402

DOCUMENT = "docs/benchmarks.md"
CYCLES = Path("docs/cycles.md")


def committed(baseline):
    """The figures of the last commit, or of the file where there is no git; None before the first."""
    shown_by_git = subprocess.run(["git", "show", f"HEAD:{baseline.relative_to(ROOT)}"], capture_output=True, text=True,
                                  check=False)
    if shown_by_git.returncode == 0:
        return json.loads(shown_by_git.stdout)
    return json.loads(baseline.read_text()) if baseline.is_file() else None


def as_text(figures):
    """One row a line, so that a difference shows what has changed."""
    lines = [f" {json.dumps(name)}: {json.dumps(row)}" for name, row in figures.items()]
    return "{\n" + ",\n".join(lines) + "\n}\n"


def main():
    parser = argparse.ArgumentParser(prog="tests/bench/run_bench.py", description=__doc__)
    parser.add_argument("--seed", type=int, default=int(os.environ.get("SEED") or 1), help="of the sensors' noise")
    seed = parser.parse_args().seed
    figures = measure(seed=seed)
    print("\n".join(table(figures)))
    baseline = file_of(BASELINE, version())
    before = committed(baseline)
    if before is not None:
        print("\nagainst the last committed figures:")
        print("\n".join(changes(figures, before)) or "no change")
    results = build_dir() / "bench.json"
    results.write_text(json.dumps(figures, indent=1) + "\n")
    baseline.write_text(as_text(figures))
    known = baselines()
    Path(DOCUMENT).write_text(markdown(known))
    CYCLES.write_text(with_summary(CYCLES.read_text(), known[REFERENCE]))
    every = build_dir() / "cycles.md"
    every.write_text(listings(figures, build_dir()))
    print(f"\nwritten: {shown(results)}, {shown(every)}, {DOCUMENT}, {CYCLES}, {shown(baseline)}")
    return 0


if __name__ == "__main__":
    try:
        sys.exit(main())
    except (LauncherError, ImageError) as error:
        print(f"mssfoc: {error}", file=sys.stderr)
        sys.exit(2)
