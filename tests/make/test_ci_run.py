# SPDX-License-Identifier: MIT
"""The last lines of .ci/run: what the other Debian did, and what not; then the runner's closing line, and its status."""
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tools import passed

ROOT = Path(__file__).resolve().parents[2]
HERE = "7 passed, 3 deselected in 1.50s"
READY = "echo 'on Debian 99: set up'\n"
RAN = READY + "echo 'on Debian 99: make run holds all limits'\n"


def ci_run(tmp_path, there, here=f"echo '{HERE}'", formatter="exit 0", minutes="80"):
    """(status, lines) with programs that say what a test gives in the place of make and of the other Debian."""
    programs = {"bin/make": f'echo "make $*"\n[ "$1" != test ] || {{ {here}; }}\n',
                ".ci/tools": "exit 0\n", ".ci/clang-format": f"{formatter}\n", ".ci/other-debian": there}
    for name, text in programs.items():
        path = tmp_path / name
        path.parent.mkdir(exist_ok=True)
        path.write_text("#!/bin/sh\n" + text)
        path.chmod(0o755)
    shutil.copy2(ROOT / ".ci/run", tmp_path / ".ci/run")
    env = {**os.environ, "PATH": f"{tmp_path / 'bin'}:{os.environ['PATH']}", "XDG_CACHE_HOME": str(tmp_path / "cache"),
           "MINUTES": minutes}
    result = subprocess.run([tmp_path / ".ci/run"], capture_output=True, text=True, env=env)
    return result.returncode, result.stdout.splitlines()


@pytest.mark.parametrize("there, minutes, status, said", [
    (RAN + "echo '9 passed in 2.00s'", "80", 0, "make run holds all limits; make test: whole: 9 passed in 2.00s"),
    (RAN + "echo 'time was up after 4 tests'; echo '4 passed in 2.00s'", "80", 0, "time was up after 4 tests: 4 passed"),
    (RAN + "echo '1 failed, 8 passed in 2.00s'; exit 1", "80", 1, "then failed: 1 failed, 8 passed in 2.00s"),
    (READY + "exit 2", "80", 2, "set up; then failed"),
    (RAN + "exit 137", "80", 0, "make run holds all limits; then time was up"),
    ("echo 'mssfoc: setting up a system takes root' >&2; exit 1", "80", 0, "left out: mssfoc: setting up a system takes root"),
    ("exit 9", "0", 0, "left out: 0 s of 0 minutes are too few"),
])
def test_the_last_lines_say_what_the_other_debian_did(there, minutes, status, said, tmp_path):
    found, lines = ci_run(tmp_path, there, minutes=minutes)
    assert said in lines[-2].replace("-1 s", "0 s") and lines[-1] == HERE and found == status


def test_a_failure_here_is_the_last_line_and_the_status(tmp_path):
    status, lines = ci_run(tmp_path, "exit 9", here="echo '1 failed, 6 passed in 1.00s'; exit 2")
    assert status == 2 and lines[-1] == "1 failed, 6 passed in 1.00s"


def test_without_the_formatter_the_rest_runs_and_that_is_said(tmp_path):
    status, lines = ci_run(tmp_path, RAN + "echo '9 passed in 2.00s'", formatter="echo 'no network' >&2; exit 1")
    assert status == 0 and "make lint" not in lines and "make prove ALL=1" in lines
    assert lines[-3] == "mssfoc: formatting was not judged: no network" and lines[-1] == HERE


@pytest.mark.parametrize("workers, fails, status", [((), "", 0), (("-n", "1"), "", 0), (("-n", "1"), "assert 0", 1)])
def test_a_session_ends_in_time_and_fails_for_failures_alone(workers, fails, status, tmp_path):
    for name in ("tests/unit/register_pages.py", "tests/conftest.py", "tests/night.txt", "tests/rigs/portions.py"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy2(ROOT / name, tmp_path / name)
    (tmp_path / "tests/test_some.py").write_text(
        f"import pytest, time\n@pytest.mark.parametrize('n', range(100))\ndef test_one(n):\n    time.sleep(0.5)\n    {fails}\n")
    result = subprocess.run([sys.executable, "-m", "pytest", "-q", *workers, "-p", "no:cacheprovider",
                             "--until=1", "tests"], cwd=tmp_path, capture_output=True, text=True)
    assert result.returncode == status and "time was up after 1 tests" in result.stdout, result.stdout


@pytest.fixture
def tree(tmp_path):
    """A repository with a file wherever proofs and RTL look."""
    for path in sorted({path for paths, _ in passed.INPUTS.values() for path in paths} | {"docs/other.md"}):
        file = tmp_path / (path.replace("*", "any") if "." in Path(path).name or path == "Makefile" else f"{path}/one.c")
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text("1")
    subprocess.run("git init -q . && git add -A", shell=True, check=True, cwd=tmp_path)
    return tmp_path


@pytest.mark.parametrize("name", sorted(passed.INPUTS))
def test_what_passed_is_not_played_again_unless_an_input_is_another(name, tree):
    before, seen = passed.digest(name, tree), set()
    for file in sorted(path for path in tree.rglob("*") if path.is_file() and ".git" not in path.parts):
        file.write_text("2")
        after = passed.digest(name, tree)
        seen |= {path for path in before if before[path] != after[path]}
        file.write_text("1")
        assert (before == passed.digest(name, tree)) and ("docs/other.md" not in str(file) or before == after)
    assert seen == set(passed.INPUTS[name][0])


def test_inputs_that_are_remembered_are_those_of_each_tool(tmp_path, monkeypatch):
    monkeypatch.setattr(passed, "KEPT", tmp_path / "passed.toml")
    assert passed.others("prove") == list(passed.digest("prove"))
    passed.remember("prove")
    assert not passed.others("prove") and passed.others("fabric")
    monkeypatch.setitem(passed.INPUTS, "prove", (passed.INPUTS["prove"][0], ("z3 --help",)))
    assert passed.others("prove") == ["z3"]
