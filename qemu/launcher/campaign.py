# SPDX-License-Identifier: MIT
"""`make campaign`: motors x scenarios x seeds x detunings, played by GNU parallel, judged as one.

Each case is one process that leaves one small JSON file. The folder is named after what was run (image, plugin, data), so
an interrupted campaign goes on where it stopped, and nothing of an older build can pass for a result of this one.
"""
import hashlib
import json
import os
import re
import shutil
import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path

from .claim import keep as keep_claim
from .data import available, files_of, motors_named
from .errors import DoesNotApply, LauncherError, choice
from .paths import MOTORS, QEMU_DIR, REPO, SCENARIOS, build_dir, shown

FAULT_PREFIX = "fault_"
DRIVE_SEEDS, FAULT_SEEDS = 8, 1
TERMINATE_AGAIN_S = 0.3
MOTOR = r"(.+?\.toml|[^/]+)"  # of a key: the path of a file has slashes, too


@dataclass(frozen=True)
class Case:
    """One run. Its key is also the name of its file, with dashes in place of slashes."""
    motor: str
    scenario: str
    seed: int
    detune: str = ""

    @property
    def key(self):
        return "/".join([self.motor, self.scenario, str(self.seed)] + ([self.detune] if self.detune else []))

    @property
    def command(self):
        """What repeats it."""
        detune = f' DETUNE="{self.detune}"' if self.detune else ""
        return f"make run MOTOR={self.motor} SCENARIO={self.scenario} SEED={self.seed}{detune}"

    def file(self, folder):
        return Path(folder) / file_name(self.key)


def file_name(key):
    """Of a case's result."""
    return re.sub(r"[:/]", "--", key).replace(" ", "_") + ".json"


def parse_case(key):
    """A Case from its key."""
    parts = re.fullmatch(rf"{MOTOR}/([^/]+)/(\d+)(?:/(.*))?", key.strip())
    if parts is None:
        raise LauncherError(f"'{key}' is not MOTOR/SCENARIO/SEED or MOTOR/SCENARIO/SEED/DETUNE")
    return Case(parts[1], parts[2], int(parts[3]), parts[4] or "")


def plan(motors=None, scenarios=None, seeds=None, detunes=("",)):
    """Every Case: `seeds` runs of each scenario of the drive and one of each fault, unless `seeds` says otherwise."""
    motors = motors_named(motors) or available(MOTORS)
    scenarios = _chosen(scenarios, available(SCENARIOS), "scenario")
    cases = []
    for scenario in scenarios:
        count = seeds or (FAULT_SEEDS if scenario.startswith(FAULT_PREFIX) else DRIVE_SEEDS)
        cases += [Case(motor, scenario, seed, detune) for motor in motors for seed in range(1, count + 1)
                  for detune in detunes]
    return cases


def _chosen(wanted, there_are, what):
    for name in wanted or []:
        if name not in there_are:
            raise LauncherError(f"no {what} '{name}'; there are: {choice(name, there_are)}")
    return list(wanted or there_are)


# ---- one case ------------------------------------------------------------------------------------------------------

def run_case(case, folder, build=None, qemu=None, aligned=False):
    """Plays the case and leaves its file. A run that could not be made is a result, too: its error is in the file. So is a
    scenario that the motor cannot play: it neither passes nor fails, `passed` is None, and the reason is the error."""
    from .simulate import simulate
    from .verdict import NOT_SET_UP, judged

    outcome = {"motor": case.motor, "scenario": case.scenario, "seed": case.seed, "detune": case.detune}
    with tempfile.TemporaryDirectory(prefix="mssfoc-") as scratch:
        try:
            result = simulate(case.scenario, case.motor, case.seed, scratch, build, qemu, detune=case.detune,
                              aligned=aligned)
            outcome |= {"passed": result.passed, "error": None, "simulated_s": result.scenario.end_s,
                        "figures": [_figure(figure) for figure in result.figures.values()], **vars(judged(result))}
        except DoesNotApply as reason:
            outcome |= {"passed": None, "error": str(reason), "figures": []}
        except LauncherError as error:
            outcome |= {"passed": False, "error": str(error).split("\n")[0], "figures": [], "word": NOT_SET_UP}
    keep(case, outcome, folder)
    return outcome


def keep(case, outcome, folder):
    """Leaves the case's file, whole or not at all."""
    file = case.file(folder)
    begun = file.with_suffix(f".{os.getpid()}")
    begun.write_text(json.dumps(outcome) + "\n")
    os.replace(begun, file)


def _figure(figure):
    value = figure.value if figure.value is None or isinstance(figure.value, str) else float(figure.value)
    return {"name": figure.name, "value": value, "unit": figure.unit, "min": figure.min, "max": figure.max,
            "equal": figure.equal, "passed": figure.passed}


# ---- all of them ---------------------------------------------------------------------------------------------------

def fingerprint(build, motors=()):
    """Of everything a result depends on: image, plugin, data files, scenarios, launcher, and motor files from elsewhere."""
    digest = hashlib.sha256()
    files = [build / "mssfoc.hex", build / "qemu" / "twin.so"]
    files += sorted(path for path in QEMU_DIR.rglob("*") if path.suffix in (".toml", ".py"))
    files += [path for motor in sorted(set(motors)) if motor.endswith(".toml") for path in files_of(motor)]
    for path in files:
        try:
            digest.update(path.read_bytes())
        except OSError as error:
            raise LauncherError(f"cannot read {shown(path)}: {error.strerror}: run make first") from error
    return digest.hexdigest()[:12]


def play(cases, build=None, qemu=None, jobs=None, sshlogin=None):
    """Plays what is not there yet through GNU parallel and returns (folder, {Case: outcome})."""
    parallel = shutil.which("parallel")
    if parallel is None:
        raise LauncherError("GNU parallel is missing (apt-get install parallel)")
    build = build_dir(build)
    folder = build / "campaign" / fingerprint(build, [case.motor for case in cases])
    keep_claim(folder.parent)
    folder.mkdir(exist_ok=True)
    missing = [case for case in cases if not case.file(folder).is_file()]
    if missing:
        _run_parallel(parallel, missing, folder, build, qemu, jobs, sshlogin)
    outcomes = {}
    for case in cases:
        try:
            outcomes[case] = json.loads(case.file(folder).read_text())
        except (OSError, ValueError) as error:
            raise LauncherError(f"no result of {case.key}: see {shown(folder / 'joblog')}") from error
    return folder, outcomes


def _run_parallel(parallel, cases, folder, build, qemu, jobs, sshlogin):
    """GNU parallel schedules, shows progress with an estimate and keeps a log; a case that fails is no failure of its job."""
    listing = folder / "jobs.txt"
    listing.write_text("".join(case.key + "\n" for case in cases))
    joblog = folder / "joblog"
    joblog.unlink(missing_ok=True)  # what is done is known by its file, whoever did it
    if sshlogin and any(Path(case.motor).is_absolute() for case in cases):
        raise LauncherError("a campaign on other machines needs the files of its motors inside the repository")
    here = _relative(folder) if sshlogin else str(folder)
    command = [parallel, "--will-cite", "--joblog", str(joblog), "-a", str(listing)]
    command += ["--bar"] if os.isatty(2) else []  # done, of how many, and an estimate of the rest
    command += ["-j", str(jobs)] if jobs else []
    if sshlogin:
        command += ["--sshlogin", sshlogin, "--workdir", str(REPO), "--return", f"{here}/{{= s,[:/],--,g; s: :_:g =}}.json"]
    worker = [os.environ.get("PYTHON", "/usr/bin/python3"), "qemu/run.py", "case", "{}", "--cases", here, "--build",
              _relative(build) if sshlogin else str(build)]
    worker += ["--qemu", qemu] if qemu else []
    status = _wait(subprocess.Popen([*command, *worker], cwd=REPO, stdin=subprocess.DEVNULL))
    if status > 100:
        raise LauncherError(f"GNU parallel ended with status {status}: see {shown(joblog)}")


def _wait(process):
    """The status of GNU parallel. If the launcher is ended, so are the runs: at the second SIGTERM parallel ends them, too."""
    try:
        return process.wait()
    except BaseException:
        while process.poll() is None:
            process.terminate()
            try:
                process.wait(TERMINATE_AGAIN_S)
            except subprocess.TimeoutExpired:
                pass
        raise


def _relative(path):
    try:
        return str(Path(path).resolve().relative_to(REPO))
    except ValueError as error:
        raise LauncherError("a campaign on other machines needs BUILD inside the repository") from error
