# SPDX-License-Identifier: MIT
"""Where a user keeps the folder, and how it came there, is his affair: it builds and runs, or one line says what to do."""
import os
import re
import shutil
import subprocess
from pathlib import Path

import pytest

from rigs.shell import BUILD, run

NAMES = ["my drives (2)", "a[b]{c}", "it's \"so\"", "a&b;c|d", "a,b", "a:b=c@d", "$HOME #5 %d", "~-é ü",
         os.fsdecode(b"caf\xe9"), "back\\slash", "*?!`", "<x>", "a  b\tc"]
# the product, which needs nothing of tests/
PARTS = ["Makefile", ".ci", "lib", "linker", "startup", "drivers", "firmware", "qemu"]
BUILT = ["choices", "commit.h", "libmssfoc.a", "arm", "packed", "fabric/contract3.h", "qemu/twin.so"]
SHORT = 'title = "short"\nend_s = 0.02\npreamble_s = 0.01\n[[figure]]\nname = "faults"\nkind = "all_faults"\nequal = "NONE"\n'


def copied(folder, parts, built=()):
    """Files of the tree without a bit to execute them, all of one time, so that nothing is older than what it is made of."""
    for part in [*parts, *(f"build/{name}" for name in built)]:
        source = BUILD / part.removeprefix("build/") if part.startswith("build/") else Path(part)
        for path in [source] if source.is_file() else [path for path in source.rglob("*") if path.is_file()]:
            to = folder / part / path.relative_to(source) if source.is_dir() else folder / part
            if "__pycache__" not in to.parts:
                to.parent.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(path, to)
                to.chmod(0o644)
                os.utime(to, (1e9, 1e9))
    return folder


@pytest.mark.parametrize("name", NAMES)
def test_a_folder_of_any_name_builds(name, tmp_path):
    """An object of C and one of assembly, which know nothing of where they were made; CDPATH leads elsewhere."""
    here = tmp_path / name
    here.mkdir()
    for part in {Path(part).parts[0] for part in PARTS}:
        (here / part).symlink_to(Path.cwd() / part)
    wanted = ["build/arm/lib/Lib_thumb2.o", "build/arm/firmware/control/bridge.o", "build/commit.h"]
    result = run("make", "-s", *wanted, cwd=here, CDPATH=f"{tmp_path}:/")
    assert result.returncode == 0 and not result.stdout and not result.stderr, result.stderr
    for made in wanted[:2]:
        assert os.fsencode(tmp_path) not in (here / made).read_bytes()
    assert len((here / wanted[2]).read_text().split('"')[1]) == 20


def test_the_worst_folder_links_and_runs(tmp_path):
    """By make and by the launcher; only what names the folder is made anew: the image, and a run of 20 ms."""
    here = copied(tmp_path / "it's \"a\" (b)[c]{d}&;|,:=@$HOME #5 %é~\\*?!`<x>", PARTS, BUILT)
    (here / "qemu/scenarios/short.toml").write_text(SHORT)
    play = ["/usr/bin/python3", "qemu/run.py", "run", "--picture", "--scenario", "short"]
    for command in (["make", "-s", "build/mssfoc.hex"], play):
        result = run(*command, cwd=here, CDPATH=f"{tmp_path}:/", BUILD="build")
        assert result.returncode == 0 and not result.stderr, (command, result.stdout, result.stderr)
    assert (here / "build/run/run.png").stat().st_size > 1000 and "limits hold" in result.stdout


@pytest.mark.parametrize("name, axes", [("a b.toml", "1"), ("x [1].toml", "1"), ("it's (2).toml", "1"), ("no such.toml", "2")])
def test_a_motor_s_file_with_a_blank_is_one_motor(name, axes, tmp_path):
    if axes == "1":
        (tmp_path / name).touch()
    result = run("make", "-s", "--eval", "say-axes: ; @echo $(AXES)", "say-axes", MOTOR=str(tmp_path / name))
    assert result.stdout == f"{axes}\n", result.stderr


def test_windows_line_ends_are_named_and_a_clone_has_none(tmp_path):
    here = copied(tmp_path / "tree", ["Makefile", ".ci", "firmware/settings", "qemu/twin/twin.mk"])
    for path in [path for path in here.rglob("*") if path.is_file()]:
        path.write_bytes(path.read_bytes().replace(b"\n", b"\r\n"))
    result = run("make", "-s", "help", cwd=here)
    assert result.returncode != 0 and result.stderr.count("\n") == 1 and "Windows line ends" in result.stderr
    (here / ".gitattributes").write_bytes(Path(".gitattributes").read_bytes())
    git = ["git", "-c", "core.autocrlf=true", "-c", "user.name=x", "-c", "user.email=x"]
    for command in (["-C", here, "init", "-q"], ["-C", here, "add", "."], ["-C", here, "commit", "-qm", "as it came"],
                    ["clone", "-q", here, tmp_path / "clone"]):
        subprocess.run([*git, *command], check=True, capture_output=True)
    cloned = [path for path in (tmp_path / "clone").rglob("*") if path.is_file() and ".git" not in path.parts]
    assert len(cloned) > 10 and not [path for path in cloned if b"\r" in path.read_bytes()], "what the line says to do"


def test_no_command_of_make_needs_an_execute_bit():
    """A checkout on a disk without them: scripts are given to their shell."""
    rules = "".join(re.sub(r"(?m)^#.*", "", path.read_text()) for path in [Path("Makefile"), *Path("tests").glob("*/*.mk")])
    assert "sh .ci/" in rules and not re.findall(r"(?m)(?:^\t@?|[(|&;=] *@?)\.ci/\w+", rules)
