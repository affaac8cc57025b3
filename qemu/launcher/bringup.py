# SPDX-License-Identifier: MIT
"""`make bringup`: the bring-up image on the twin, which is the device as docs/silicon.md has it, or one made otherwise."""
import re
import subprocess
import time

from .claim import keep
from .config import twin_config
from .data import read_toml
from .drive import load_drive
from .errors import LauncherError
from .paths import QEMU_DIR, build_dir, shown
from .qemu import LOOK_S, STALL_S, Qemu, command, escape, reason, start, tail
from .scenario import load_scenario

MOTOR = "teknic_m2310p"  # what hangs on the fabric; no gate is ever on
WRONG = QEMU_DIR / "chips/wrong.toml"
LATEST_S = 5.0           # of simulated time, for a page that does not come to its end
AS_DOCUMENTED = ("time cycles",)
GOOD = "as documented"
VERDICT = re.compile(rf"(?m)^({GOOD}|not as documented: \d+)\r?\n")


class _Image:
    def __init__(self, build):
        self.hex, self.plugin = build / "bringup.hex", build / "qemu/twin.so"
        for path in (self.hex, self.plugin):
            if not path.is_file():
                raise LauncherError(f"{shown(path)} is missing: run make bringup-image twin first")


def chips():
    """{name: {"title": ..., "twin": [...], "differs": [...]}}"""
    return read_toml(WRONG)


def lines_of(wrong):
    """The twin's configuration for the device as documented, or as wrong.toml has it."""
    if not wrong:
        return list(AS_DOCUMENTED)
    known = chips()
    if wrong not in known:
        raise LauncherError(f"WRONG '{wrong}' is none of {', '.join(sorted(known))}")
    return [*AS_DOCUMENTED, *known[wrong]["twin"]]


def play(lines, build, qemu, out_dir, until=VERDICT, latest_s=LATEST_S):
    """The console's text, up to what `until` matches. `lines`: of the twin's configuration."""
    image, qemu = _Image(build), Qemu(qemu)
    config, console, log = (out_dir / name for name in ("twin.cfg", "console.txt", "qemu.log"))
    plan = load_scenario({"end_s": latest_s}, drive := load_drive(MOTOR))
    text = twin_config(drive, plan, 1, [], {"progress": out_dir / "progress"})
    config.write_text(text + "".join(line + "\n" for line in lines))
    console.unlink(missing_ok=True)
    arguments = command(qemu, image, config, f"file,id=console,path={escape(console)}")
    with open(log, "wb") as file:
        process = start(arguments, qemu.environment(), stdin=subprocess.DEVNULL, stdout=file, stderr=file)
    try:
        said = _listen(process, console, until)
    finally:
        if process.poll() is None:
            process.terminate()
        process.wait()
    if not until.search(said):
        raise LauncherError(f"the page has no end: {reason(process.returncode)}{tail(console)}{tail(log)}")
    return said


def _listen(process, console, until):
    limit = time.monotonic() + STALL_S
    while True:
        ended = process.poll() is not None
        said = console.read_text(errors="replace") if console.exists() else ""
        if ended or until.search(said) or time.monotonic() > limit:
            return said
        time.sleep(LOOK_S)


def verdict(page):
    return VERDICT.search(page).group(1)


def bringup(wrong, build, qemu, out, say):
    """0 if all is as documented, 1 if anything differs."""
    build = build_dir(build)
    lines = lines_of(wrong)
    out_dir = (out or build / "bringup/run").resolve()
    keep(out_dir)
    page = play(lines, build, qemu, out_dir)
    say(page.replace("\r", "").strip())
    return 0 if verdict(page) == GOOD else 1
