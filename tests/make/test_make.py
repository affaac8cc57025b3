# SPDX-License-Identifier: MIT
"""What a stranger meets: the library's example compiles and links, and what is missing is said in one line."""
import os
import re
import shutil
import subprocess
from pathlib import Path

import pytest

BUILD = Path(os.environ.get("BUILD", "build")).resolve()
CROSS = os.environ.get("CROSS", "arm-none-eabi-")


def run(*command, **variables):
    env = {key: value for key, value in os.environ.items() if not key.startswith("MAKE")} | variables
    return subprocess.run(command, capture_output=True, text=True, env=env, stdin=subprocess.DEVNULL, check=False)


def complaint(result):
    """The one line of ours on stderr; make's own line about the failed target may follow."""
    assert result.returncode != 0, result.stdout
    ours = [line for line in result.stderr.splitlines() if not line.startswith("make")]
    assert len(ours) == 1 and ours[0].startswith("mssfoc: "), result.stderr
    return ours[0]


@pytest.mark.parametrize("given, meant", [
    ("{root}/build", "build"), ("{root}/a/b", "a/b"), ("/elsewhere/build", None), ("b", "b")])
def test_a_folder_of_the_project_has_one_name(given, meant):
    """An object made under the absolute one would not be remade, under the other, when a header changes."""
    given = given.format(root=Path.cwd())
    result = run("make", "-s", "--eval", "say-build: ; @echo $(BUILD)", "say-build", f"BUILD={given}")
    assert result.stdout.strip() == (meant or given), result.stderr


def test_the_example_compiles_and_links(tmp_path):
    code = re.search(r"```c\n(.*?)```", Path("docs/library.md").read_text(), re.S).group(1)
    (tmp_path / "example.c").write_text(code + "\nint main(void)\n{\n    parkoutput_type dq;\n"
                                        "    currents_to_rotor_frame(1000, -500, 32768, 0, &dq);\n    return (int)dq.id;\n}\n")
    out = tmp_path / "example.elf"
    result = run(CROSS + "gcc", "-mcpu=cortex-m3", "-mthumb", "-Wall", "-Wextra", "-Werror", "-Ilib", "-nostartfiles",
                 "-nodefaultlibs", "-Wl,-emain", str(tmp_path / "example.c"), f"-L{BUILD}", "-lmssfoc", "-o", str(out))
    assert result.returncode == 0, result.stderr
    assert out.exists()


def test_readme_commands_exist():
    pages = Path("README.md").read_text() + Path("CONTRIBUTING.md").read_text()
    targets = set(re.findall(r"`make ([a-z]+)", pages))
    database = run("make", "-pRrq", "help").stdout
    assert len(targets) > 5 and targets <= set(re.findall(r"(?m)^([a-z-]+):", database))


@pytest.mark.parametrize("probe, words", [("", "PROBE=openocd"), ("stlink", "PROBE=openocd"), ("openocd", "OPENOCD="),
                                          ("jlink", "JLINK=")])
def test_flash_says_what_is_missing(probe, words):
    result = run(".ci/flash", probe, str(BUILD / "mssfoc"), OPENOCD="no-such-openocd", JLINK="no-such-jlink")
    assert words in complaint(result)


def test_missing_tools_are_listed_and_nothing_is_installed(tmp_path):
    result = run("/bin/sh", ".ci/tools", NO_INSTALL="1", CROSS="no-such-prefix-", HOSTCC="no-such-compiler")
    line = complaint(result)
    assert "gcc-arm-none-eabi" in line and "gcc" in line and "NO_INSTALL" in line


def test_other_debian_takes_no_folder_of_others(tmp_path):
    assert "give a folder" in complaint(run(".ci/other-debian"))
    (tmp_path / "theirs").touch()
    assert "holds something else" in complaint(run(".ci/other-debian", str(tmp_path)))
    assert (tmp_path / "theirs").exists()


def test_wrong_qemu_is_named():
    assert "QEMU=/no/such/qemu" in complaint(run("make", "-s", "run", QEMU="/no/such/qemu"))
    assert "not a QEMU" in complaint(run("make", "-s", "run", QEMU="/bin/true", BUILD=str(BUILD)))


@pytest.mark.parametrize("variable, value", [("MOTOR", "no-such-motor"), ("SCENARIO", "no-such-scenario"), ("SEED", "many")])
def test_wrong_names_are_named(variable, value):
    assert value in complaint(run("make", "-s", "run", BUILD=str(BUILD), **{variable: value}))


def test_wrong_trig_fraction_does_not_build(tmp_path):
    result = run("make", "-s", f"BUILD={tmp_path}", "LIB_TRIG_FRAC=32", f"{tmp_path}/libmssfoc.a")
    assert result.returncode != 0 and "LIB_TRIG_FRAC" in result.stderr


def test_another_trig_fraction_in_the_same_folder_is_another_library(tmp_path):
    library = tmp_path / "libmssfoc.a"
    contents = []
    for fraction in ("15", "16", "16", "15"):
        result = run("make", "-s", f"BUILD={tmp_path}", f"LIB_TRIG_FRAC={fraction}", str(library))
        assert result.returncode == 0, result.stderr
        contents.append((library.read_bytes(), library.stat().st_mtime_ns))
    first, second, again, back = contents
    assert first[0] != second[0] and back[0] == first[0]
    assert again == second, "nothing to do is nothing done"


@pytest.mark.parametrize("build", ["two words", ""])
def test_a_build_folder_that_make_cannot_handle_is_named(build):
    result = run("make", "-s", f"BUILD={build}", "all")
    assert result.returncode != 0 and result.stderr.count("\n") == 1, result.stderr
    assert f"mssfoc: BUILD='{build}' must be one folder without a blank" in result.stderr


def test_makes_in_one_folder_build_in_turn(tmp_path):
    """Whoever came second waits; every rule that builds in BUILD for others does so alone."""
    rule = "t: ; $(ALONE) sh -c 'mkdir $(BUILD)/busy && sleep 0.2 && rmdir $(BUILD)/busy && echo built'"
    command = ["make", "-s", "--eval", rule, "t", f"BUILD={tmp_path}"]
    makes = [subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) for _ in range(3)]
    said = [process.communicate() for process in makes]
    assert all(out.endswith("built\n") and not errors for out, errors in said), said
    for file in [Path("Makefile"), *Path("tests").glob("*/*.mk")]:
        for line in re.findall(r"(?m)^\t.*\$\(MAKE\).* -j2 .*$", file.read_text()):
            assert line.startswith("\t$(ALONE) $(MAKE) "), f"{file}: {line}"
