# SPDX-License-Identifier: MIT
"""make bench: measures, prints the table and what has changed, and writes build/bench.json, build/cycles.md, all of it,
docs/benchmarks.md, the bounds in docs/cycles.md and tests/bench/baseline.json; to commit the last three accepts them."""
import argparse
import json
import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "qemu"), str(ROOT / "tests"), str(ROOT / "tests" / "tools")]
os.chdir(ROOT)

from bench.measure import measure  # noqa: E402
from bench.report import changes, markdown, table  # noqa: E402
from cycles_page import listings, with_summary  # noqa: E402
from disasm import ImageError  # noqa: E402
from launcher.errors import LauncherError  # noqa: E402
from launcher.paths import build_dir, shown  # noqa: E402

BASELINE = "tests/bench/baseline.json"
DOCUMENT = "docs/benchmarks.md"
CYCLES = Path("docs/cycles.md")


def committed():
    """The figures of the last commit, or of the file where there is no git; None before the first."""
    shown_by_git = subprocess.run(["git", "show", f"HEAD:{BASELINE}"], capture_output=True, text=True, check=False)
    if shown_by_git.returncode == 0:
        return json.loads(shown_by_git.stdout)
    return json.loads(Path(BASELINE).read_text()) if Path(BASELINE).is_file() else None


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
    before = committed()
    if before is not None:
        print("\nagainst the last committed figures:")
        print("\n".join(changes(figures, before)) or "no change")
    results = build_dir() / "bench.json"
    results.write_text(json.dumps(figures, indent=1) + "\n")
    Path(BASELINE).write_text(as_text(figures))
    Path(DOCUMENT).write_text(markdown(figures))
    CYCLES.write_text(with_summary(CYCLES.read_text(), figures))
    every = build_dir() / "cycles.md"
    every.write_text(listings(figures, build_dir()))
    print(f"\nwritten: {shown(results)}, {shown(every)}, {DOCUMENT}, {CYCLES}, {BASELINE}")
    return 0


if __name__ == "__main__":
    try:
        sys.exit(main())
    except (LauncherError, ImageError) as error:
        print(f"mssfoc: {error}", file=sys.stderr)
        sys.exit(2)
