# SPDX-License-Identifier: MIT
"""`make timing`: the cycle model against what was counted by hand and against published silicon."""
import os
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "qemu"), str(ROOT / "tests"), str(Path(__file__).parent)]
os.environ.setdefault("BUILD", "build")

from cases import HAND_COUNTED, PUBLISHED, TOLERANCE, measured, run, sequences  # noqa: E402
from launcher.errors import LauncherError  # noqa: E402


def image(name):
    with tempfile.TemporaryDirectory() as folder:
        return run(name, Path(folder))


def hand_counted():
    wrong = 0
    for name in HAND_COUNTED:
        agree, differ = sequences(image(name))
        wrong += len(differ)
        print(f"  {name:8} {len(agree)} sequences exact, {len(differ)} not")
        for line in differ:
            print(f"           {line}")
    return wrong


def published():
    wrong = 0
    found = measured(image("published"))
    print(f"  {'':24} {'model':>8} {'silicon':>8} {'error':>8}")
    for case in PUBLISHED:
        cycles = found[case.name]
        error = cycles / case.cycles - 1
        wrong += abs(error) > TOLERANCE
        print(f"  {case.name:24} {cycles:8} {case.cycles:8g} {100 * error:+7.2f} %   {case.source}")
    return wrong


def main():
    os.chdir(ROOT)
    print("counted by hand, exact:")
    wrong = hand_counted()
    print(f"\npublished for parts without wait states, within {100 * TOLERANCE:g} %:")
    wrong += published()
    return 1 if wrong else 0


if __name__ == "__main__":
    try:
        sys.exit(main())
    except (LauncherError, AssertionError) as error:
        sys.exit(f"mssfoc: {error}")
