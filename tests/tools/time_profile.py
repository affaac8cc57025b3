# SPDX-License-Identifier: MIT
"""Where the time of a run goes: QEMU's process by part, the launcher by phase. make profile [MOTOR= SCENARIO= SEED= PLANT=]

Shares of QEMU come from perf's samples: of the instructions that it executes where the processor counts them, else of its
processor time. Neither moves with what else the machine does.
"""
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
EVENTS = ("instructions:u", "cpu-clock")  # the first that perf can sample here
HERTZ = 2000
# files of the plugin by what they belong to; the first that matches
PARTS = (("cycle model", r"core|cycles\w*|irqlog|irqpath|dwt|reach"),
         ("fabric", r"fabric\w*|pwm|adc|gate|encoder|chopper|watch|lines"),
         ("trace", r"trace\w*|recording|probes"),
         ("link to QEMU, board", r"qemu_\w*|twin|axes|scenario|console|live|serial_bus|can\w*|envm\w*|sysreg|chip|gpio|mmuart|"
                                 r"watchdog"),
         ("plant", r".*"))
LIBRARIES = (("plant", r"/libm\W"), ("translated code", r"perf-\d+\.map|\[JIT\]|//anon|\[unknown\]"),
             ("kernel", r"\[kernel|\[vdso"), ("QEMU", r""))


def fail(text):
    sys.exit(f"mssfoc: {text}")


def sampled_event(perf):
    """The best event that perf can take samples of on this machine."""
    for event in EVENTS:
        with tempfile.NamedTemporaryFile() as file:
            ask = [perf, "record", "-q", "-e", event, "-o", file.name, "true"]
            if subprocess.run(ask, capture_output=True, stdin=subprocess.DEVNULL).returncode == 0:
                return event
    return fail("perf takes no samples here: allow it by sysctl kernel.perf_event_paranoid=1, or as root")


def addresses_of(plugin):
    """{symbol: address} of the plugin's functions."""
    lines = subprocess.run(["nm", plugin], capture_output=True, text=True, check=True).stdout.splitlines()
    return {name: int(address, 16) for address, kind, name in (line.split() for line in lines if len(line.split()) == 3)
            if kind in "tT"}


def files_of(plugin, addresses):
    """{address: name of the source file}, of the function that stands there, inlined or not."""
    text = "\n".join(f"{address:#x}" for address in addresses)
    found = subprocess.run(["addr2line", "-e", plugin], input=text, capture_output=True, text=True, check=True).stdout
    return {address: Path(line.split(":")[0]).stem for address, line in zip(addresses, found.splitlines())}


def part_of(rows, name):
    return next(part for part, pattern in rows if re.search(pattern, name))


def sampled_parts(perf, data, plugin):
    """Samples of QEMU's process by part."""
    lines = subprocess.run([perf, "script", "-i", data, "-F", "ip,sym,symoff,dso"], capture_output=True, text=True).stdout
    symbols, places, parts = addresses_of(plugin), Counter(), Counter()
    for line in lines.splitlines():
        found = re.match(r"\s*\S+ (\S+?)(?:\+0x([0-9a-f]+))? \((.*)\)$", line)
        if found and found[3].endswith(plugin.name) and found[1] in symbols:
            places[symbols[found[1]] + int(found[2] or "0", 16)] += 1
        elif found:
            parts[part_of(LIBRARIES, found[3])] += 1
    files = files_of(plugin, list(places))
    for address, count in places.items():
        parts[part_of([(part, f"^({pattern})$") for part, pattern in PARTS], files[address])] += count
    return parts


class Clock:
    """Processor seconds of this process by phase."""

    def __init__(self):
        self.seconds, self.since = Counter(), 0.0

    def now(self, phase):
        """What came since the last call was this."""
        at = time.process_time()
        self.seconds[phase] += at - self.since
        self.since = at


def play(perf, event, folder):
    """One run as `make run` has it, under perf; (processor seconds by phase, QEMU's seconds, where the samples are)."""
    clock, data = Clock(), folder / "perf.data"
    clock.now("start of Python")
    sys.path.insert(0, str(ROOT / "qemu"))
    import launcher.simulate  # noqa: F401  (to be measured)
    module = sys.modules["launcher.simulate"]
    from launcher.cli import _parser, _plant
    clock.now("imports")
    options = _parser().parse_args(["run"])
    play_it = module.run_to_end

    def measured(arguments, *rest):
        clock.now("preparation")
        play_it([perf, "record", "-q", "-e", event, "-F", str(HERTZ), "-o", str(data), *arguments], *rest)
        clock.now("waiting for QEMU")

    module.run_to_end = measured
    result = module.simulate(options.scenario or module.DEFAULT_SCENARIO, options.motor or module.DEFAULT_MOTOR, options.seed,
                             folder, csv=True, **_plant(options))
    clock.now("reading and judging")
    from launcher.plot import draw
    draw(result, folder / "run.png")
    clock.now("drawing, with its imports")
    return clock.seconds, data


def table(title, rows, unit):
    total = sum(rows.values())
    print(f"{title}: {total:.{unit[1]}f} {unit[0]}")
    for name, value in sorted(rows.items(), key=lambda row: -row[1]):
        print(f"  {name:<28}{value:>9.{unit[1]}f}{value / total:>8.1%}")


def main():
    perf = shutil.which("perf")
    if not perf:
        fail("make profile needs perf: apt-get install linux-perf")
    event = sampled_event(perf)
    folder = Path(os.environ.get("BUILD") or ROOT / "build") / "profile"
    folder.mkdir(parents=True, exist_ok=True)
    seconds, data = play(perf, event, folder)
    parts = sampled_parts(perf, data, folder.parent / "qemu" / "twin.so")
    if event == "cpu-clock":
        table("QEMU's process", {name: count / HERTZ for name, count in parts.items()}, ("s of processor", 2))
    else:
        table("QEMU's process", parts, (f"samples of {event}", 0))
    table("the launcher", seconds, ("s of processor", 2))


if __name__ == "__main__":
    main()
