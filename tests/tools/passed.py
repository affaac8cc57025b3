# SPDX-License-Identifier: MIT
"""Proofs and RTL take a third of what CI has, and their answer is the same for the same inputs: passed.toml keeps the inputs of
the last pass, and `.ci/run` plays them again when one of them is another.

    passed.py NAME              says when these inputs passed; exit status 1 and what is another, if they did not
    passed.py NAME --remember   they did, today
"""
import hashlib
import subprocess
import sys
import tomllib
from datetime import date
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
KEPT = ROOT / "tests/passed.toml"
IMAGE = ("firmware", "drivers", "lib", "startup", "linker", "Makefile", "tests/unit/host")
MODELS = [f"qemu/twin/{name}.c" for name in "pwm adc encoder gate chopper watch fabric_model".split()]  # beside the RTL
# what each reads, and the programs that answer
INPUTS = {
    "prove": ((*IMAGE, "tests/prove", "tests/lib"), ("arm-none-eabi-gcc --version", "z3 --version")),
    "fabric": (("drivers/fabric", "tests/fabric", "qemu/twin/*.h", *MODELS, "docs/fabric.md"),
               ("yosys -V", "verilator --version", "iverilog -V", "z3 --version")),
}


def digest(name, root=ROOT):
    """{folder or file, or program: what it is now}"""
    paths, programs = INPUTS[name]
    found = {path: _files(root, path) for path in paths}
    for program in programs:
        shown = subprocess.run(program.split(), capture_output=True, text=True).stdout.splitlines()
        found[program.split()[0]] = shown[0] if shown else "none"
    return found


def _files(root, path):
    listed = subprocess.run(["git", "ls-files", "-z", "--", path], cwd=root, capture_output=True, check=True).stdout
    names = sorted(filter(None, listed.decode().split("\0")))
    assert names, f"{path} has no file"
    whole = hashlib.sha256()
    for file in (root / name for name in names):
        data = file.read_bytes() if file.exists() else b""
        whole.update(f"{file.relative_to(root)}\0{len(data)}\0".encode() + data)
    return whole.hexdigest()[:16]


def last(name):
    return tomllib.loads(KEPT.read_text(encoding="utf-8")).get(name, {}) if KEPT.exists() else {}


def others(name):
    """What is another than in the last pass."""
    before = last(name).get("inputs", {})
    return [path for path, now in digest(name).items() if before.get(path) != now]


def remember(name):
    kept = {one: last(one) for one in INPUTS if last(one)} | {name: {"date": str(date.today()), "inputs": digest(name)}}
    lines = ["# SPDX-License-Identifier: MIT", "# What passed last, and on which inputs: written by tests/tools/passed.py."]
    for one, entry in sorted(kept.items()):
        inputs = ", ".join(f'"{path}" = "{value}"' for path, value in entry["inputs"].items())
        lines += ["", f"[{one}]", f'date = "{entry["date"]}"', f"inputs = {{ {inputs} }}"]
    KEPT.write_text("\n".join(lines) + "\n", encoding="utf-8")


def main(name, *options):
    if name not in INPUTS or options not in ((), ("--remember",)):
        sys.exit(f"mssfoc: passed.py {'|'.join(INPUTS)} [--remember]")
    if options:
        return remember(name)
    if changed := others(name):
        print(f"make {name}: played, since another than in the last pass: {', '.join(changed)}")
        sys.exit(1)
    print(f"make {name}: passed on {last(name)['date']} on these inputs, tools of the same versions; not played again")


if __name__ == "__main__":
    main(*sys.argv[1:])
