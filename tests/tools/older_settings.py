# SPDX-License-Identifier: MIT
"""What an older image leaves in eNVM: tests/closed_loop/older/, which today's image has to read.

    tests/tools/older_settings.py FILE COMMIT [NAME=FORMER...] -- LINE...

builds the image and the twin of that commit in a folder of its own, with parameters under the former names that are given,
types the lines and a `save` at its console, and keeps what its eNVM holds then. tests/closed_loop/older/README.md has the
command of each file.
"""
import re
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PLAY = """
import sys
from pathlib import Path
from launcher import simulate
envm, lines = sys.argv[1], [*sys.argv[2:], "save"]
steps = [{"t_s": 0.02 + 0.02 * n, "console": line} for n, line in enumerate(lines)]
scenario = {"key": "older", "title": "older", "end_s": 0.3 + 0.02 * len(lines), "step": steps}
result = simulate(scenario, out_dir=Path(envm).parent, plant="ideal", spread=0, envm=Path(envm))
print(result.console)
"""


def unpack(commit, folder):
    tree = subprocess.run(["git", "archive", commit], cwd=ROOT, check=True, capture_output=True).stdout
    subprocess.run(["tar", "-x", "-C", folder], input=tree, check=True)


def rename(folder, names):
    for path in sorted((folder / "firmware").rglob("*.[chS]")):
        text = path.read_text()
        for name, former in names.items():
            text = re.sub(rf"\b{name}\b", former, text)
        path.write_text(text)


def main(file, commit, *words):
    at = words.index("--")
    names, lines = dict(word.split("=") for word in words[:at]), words[at + 1:]
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch) / "tree"
        folder.mkdir()
        unpack(commit, folder)
        rename(folder, names)
        subprocess.run(["make", "-s", "-j2", "all", "twin", "NO_INSTALL=1", "BUILD=build"], cwd=folder, check=True)
        envm = Path(scratch) / "envm"
        environment = {"PATH": "/usr/bin:/bin", "PYTHONPATH": "qemu", "BUILD": str(folder / "build")}
        played = subprocess.run([sys.executable, "-c", PLAY, envm, *lines], cwd=folder, check=True, capture_output=True,
                                text=True, env=environment)
        print(played.stdout)
        if "error" in played.stdout or "save 1;" not in played.stdout:
            raise SystemExit("the older image has not saved")
        Path(file).write_bytes(envm.read_bytes())


if __name__ == "__main__":
    main(*sys.argv[1:])
