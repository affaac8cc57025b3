# SPDX-License-Identifier: MIT
"""How deep the stacks went in a run: start-up paints the main stack, the twin writes it to a file at the end."""
import os
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
if str(ROOT / "qemu") not in sys.path:
    sys.path.insert(0, str(ROOT / "qemu"))

PAINT = (0xC5A3C5A3).to_bytes(4, "little")  # STARTUP_STACK_PAINT, startup/startup.h
# every command of the console and every state of the drive, so that the run goes as deep as a person can make it go
EXERCISE = {
    "key": "stack_exercise", "title": "every command and state, for the deepest stack", "end_s": 4.3, "preamble_s": 0.05,
    "step": [{"t_s": t, "console": text} for t, text in (
        (0.20, "help"), (0.36, "get all"), (0.50, "status"), (0.55, "fault"), (0.58, "bogus"), (0.60, "set speed_max_rpm 1"),
        (0.63, "@parameters"), (0.70, "clear"), (0.72, "version"), (0.75, "on"), (2.70, "speed 1500"), (3.10, "status"),
        (3.20, "torque 1.5"), (3.25, "speed -500"), (3.40, "quickstop"), (3.60, "off"), (3.65, "on"),
        (3.90, "speed 500"), (4.10, "fault"))]
    + [{"t_s": 2.80, "event": "load_nm", "args": ["rated_torque_Nm"]}, {"t_s": 3.10, "event": "load_nm", "args": ["0"]},
       {"t_s": 4.05, "event": "encoder_cut", "args": ["1"]}]}


def used(stack):
    """Bytes from the lowest word that lost its paint to the top; `stack` is the memory from its limit upwards."""
    clean = 0
    while clean < len(stack) and stack[clean:clean + 4] == PAINT:
        clean += 4
    return len(stack) - clean


def measure(image, out_dir, scenario=None, **options):
    """(bytes used of the main stack, Result of the run)."""
    from launcher import simulate

    low, top = image.value("link_stack_limit"), image.value("link_stack_top")
    result = simulate(scenario or EXERCISE, out_dir=out_dir, dumps={"stack.bin": (low, top - low)},
                      **{"plant": "ideal", "spread": 0, **options})
    stack = (Path(out_dir) / "stack.bin").read_bytes()
    if len(stack) != top - low:
        raise SystemExit("mssfoc: the twin did not write the whole stack")
    return used(stack), result


def compare(image, bounds, out=print):
    """Prints the mark beside the bound; 1 if the bound is wrong."""
    build = Path(os.environ.get("BUILD", "build"))
    mark, result = measure(image, build / "stack")
    out(f"high-water mark: {mark} bytes in {result.trace['t_s'][-1]:.1f} s with every command and state,"
        f" {100 * mark / bounds.main:.0f} % of the bound")
    if mark > bounds.main:
        print("mssfoc: the stack went deeper than its bound: the bound is wrong", file=sys.stderr)
        return 1
    return 0
