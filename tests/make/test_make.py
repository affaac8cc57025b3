# SPDX-License-Identifier: MIT
"""What a stranger meets: the library's example compiles and links, and what is missing is said in one line."""
import os
import re
import shutil
import subprocess
from pathlib import Path

import pytest

from rigs.shell import BUILD, run

CROSS = os.environ.get("CROSS", "arm-none-eabi-")


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


@pytest.mark.parametrize("probe, tool, jtagsel", (("openocd", "OPENOCD", 1), ("jlink", "JLINK", 0)))
@pytest.mark.parametrize("device, said", (("", "device M2S010 by default"), ("M2S025", "device M2S025;")))
def test_flashing_says_which_device_and_which_jtagsel(probe, tool, jtagsel, device, said):
    result = run(".ci/flash", probe, "image", DEVICE=device, **{tool: "echo"})
    assert result.returncode == 0 and said.split()[1].rstrip(";") in result.stdout
    assert said in result.stderr and f"JTAGSEL must be {jtagsel}\n" in result.stderr


@pytest.mark.parametrize("probe, words", [("", "PROBE=openocd"), ("stlink", "PROBE=openocd"), ("openocd", "OPENOCD="),
                                          ("jlink", "JLINK=")])
def test_flash_says_what_is_missing(probe, words):
    result = run("sh", ".ci/flash", probe, str(BUILD / "mssfoc"), OPENOCD="no-such-openocd", JLINK="no-such-jlink")
    assert words in complaint(result)


@pytest.fixture
def bare(tmp_path):
    """A PATH with nothing on it but what a bare Debian has and the script needs."""
    for name in ("sh", "awk", "id", "mktemp", "tail", "rm"):
        (tmp_path / name).symlink_to(shutil.which(name))
    return tmp_path


# what a purpose needs of a bare system, and what it must not ask for
NEEDS = {"image": ({"gcc-arm-none-eabi"}, {"gcc", "qemu-system-arm", "yosys", "verilator", "clang-format"}),
         "run": ({"gcc-arm-none-eabi", "gcc", "qemu-system-arm"}, {"yosys", "verilator", "g++", "clang-format", "parallel"}),
         "rtl": ({"verilator", "g++"}, {"yosys", "iverilog"}),
         "fabric": ({"yosys", "z3", "verilator", "iverilog", "g++"}, {"gcc-arm-none-eabi", "qemu-system-arm", "clang-format"}),
         "test": ({"gcc-arm-none-eabi", "yosys", "git", "mbpoll"}, {"chromium", "clang-format", "python3-pip"}),
         "lint": ({"gcc-arm-none-eabi", "git", "cppcheck"}, {"clang-format", "qemu-system-arm"}),
         "page": ({"qemu-system-arm"}, {"chromium", "yosys"})}


@pytest.mark.parametrize("purpose", NEEDS)
def test_each_command_asks_for_what_it_uses(bare, purpose):
    """Nothing is installed: the line names the packages."""
    listed = set(complaint(run("/bin/sh", ".ci/tools", purpose, NO_INSTALL="1", PATH=str(bare))).replace(";", "").split())
    wanted, unwanted = NEEDS[purpose]
    assert wanted <= listed and "NO_INSTALL" in listed and not unwanted & listed


@pytest.mark.parametrize("variables, words", [
    ({"CROSS": "foo-"}, "CROSS=foo-: there is no program foo-gcc"), ({"HOSTCC": "foo"}, "HOSTCC=foo"),
    ({"QEMU": "/no/such/qemu"}, "QEMU=/no/such/qemu"), ({"PYTHON": "/no/such/python"}, "PYTHON=/no/such/python"),
    ({"PYTHON": "/bin/false"}, "older than 3.11")])
def test_a_tool_of_the_user_s_own_is_his_to_mend(variables, words):
    """Packages would not help, so none are proposed."""
    line = complaint(run("/bin/sh", ".ci/tools", "run", **variables))
    assert words in line and "packages" not in line


def test_without_root_and_sudo_the_line_is_for_who_has_them(bare):
    (bare / "apt-get").symlink_to("/bin/true")
    (bare / "id").unlink()
    (bare / "id").write_text("#!/bin/sh\necho 1000\n")
    (bare / "id").chmod(0o755)
    line = complaint(run("/bin/sh", ".ci/tools", "image", PATH=str(bare), NO_INSTALL=""))
    assert "as root: apt-get install --no-install-recommends gcc-arm-none-eabi" in line


def test_other_debian_takes_no_folder_of_others(tmp_path):
    assert "give a folder" in complaint(run("sh", ".ci/other-debian")) and "give a folder" in complaint(run("sh", ".ci/bare"))
    (tmp_path / "theirs").touch()
    assert "holds something else" in complaint(run("sh", ".ci/other-debian", str(tmp_path)))
    assert (tmp_path / "theirs").exists()


def test_wrong_qemu_is_named():
    assert "QEMU=/no/such/qemu" in complaint(run("make", "-s", "run", QEMU="/no/such/qemu"))
    assert "not a QEMU" in complaint(run("make", "-s", "run", QEMU="/bin/true", BUILD=str(BUILD)))


@pytest.mark.parametrize("variable, value", [("MOTOR", "no-such-motor"), ("SCENARIO", "no-such-scenario"), ("SEED", "many")])
def test_wrong_names_are_named(variable, value):
    assert value in complaint(run("make", "-s", "run", BUILD=str(BUILD), **{variable: value}))


@pytest.mark.parametrize("given, words", [("MOTR=x", "did you mean MOTOR=x?"), ("pwm_hz=16000", "did you mean PWM_HZ=16000?"),
                                          ("XYZZY=1", "'make help' has those there are")])
def test_a_variable_that_make_does_not_know_is_refused(given, words):
    result = run("make", "-s", "help", given)
    assert result.returncode != 0 and result.stdout == ""
    assert f"mssfoc: there is no variable {given.split('=')[0]}" in result.stderr and words in result.stderr
    assert result.stderr.count("\n") == 1


@pytest.mark.parametrize("goals, words", [
    ("tset", "tset; did you mean make test?"), ("RUN", "RUN; did you mean make run?"), ("benhc", "did you mean make bench?"),
    ("clean campain", "campain; did you mean make campaign?"), ("docs", "docs; 'make help' has"),
    ("it's", "it's; 'make help' has")])
def test_a_target_that_make_does_not_have_is_refused(tmp_path, goals, words):
    """Before any other is begun, and also where a folder of that name is there."""
    (tmp_path / "kept").touch()
    result = run("make", *goals.split(), f"BUILD={tmp_path}")
    assert result.returncode != 0 and result.stdout == "" and (tmp_path / "kept").exists()
    assert "mssfoc: there is no target " in result.stderr and words in result.stderr and result.stderr.count("\n") == 1


def test_help_is_short_and_the_rest_has_every_target():
    short, long = run("make", "help").stdout, run("make", "help", "ALL=1").stdout
    assert short.count("\n") <= 15 and "help ALL=1" in short and long.startswith(short[:short.rindex("make help")])
    told = set(re.findall(r"(?m)^ *make ([a-z_-]+)", long)) | {"all", "help"}
    inner = {"everything", "twin", "unit", "target-tests"}  # parts of others, for CONTRIBUTING's and tests' use
    phony = set(re.search(r"(?m)^\.PHONY: all (.*)$", Path("Makefile").read_text())[1].split())
    assert phony - told <= inner, phony - told - inner


def test_every_variable_that_help_and_the_pages_name_is_known():
    texts = [run("make", "-s", "help", "ALL=1").stdout,
             *(page.read_text() for page in [Path("README.md"), *Path("docs").rglob("*.md")])]
    named = {word for text in texts for line in re.findall(r"make [^`\n]*|\[[A-Z_]+=.*", text)
             for word in re.findall(r"(?<![\w/])([A-Z][A-Z_]+)=", line)}
    assert len(named) > 30
    result = run("make", "-s", "--eval", "known: ; @echo $(VARIABLES)", "known")
    assert named <= set(result.stdout.split()), named - set(result.stdout.split())


def test_long_commands_say_first_how_long_they_take():
    rules = "".join(path.read_text() for path in [Path("Makefile"), *Path("tests").glob("*/*.mk")])
    said = re.findall(r"(?m)^(\w+): LASTS = ", rules)
    assert {"test", "guides", "results", "campaign", "sizes", "fuzz", "coverage", "prove", "fabric", "explore",
            "mutants"} <= set(said)
    for target in said:
        assert re.search(rf"(?m)^{target}: tools-.*\n\t\$\(says\)$", rules), target
    told = run("make", "-s", "-n", "sizes", NO_INSTALL="1").stdout  # the one of them that calls no other make
    assert "echo 'mssfoc: make sizes: some minutes" in told


def test_a_new_folder_says_that_building_takes_time(tmp_path):
    """On no terminal there is no line that is rewritten."""
    said = run("sh", ".ci/alone", str(tmp_path / "new"), "echo", "built").stdout
    assert said == f"mssfoc: building in {tmp_path / 'new'}, about half a minute on two cores\nbuilt\n"
    (tmp_path / "new" / "mssfoc.elf").touch()
    assert run("sh", ".ci/alone", str(tmp_path / "new"), "echo", "built").stdout == "built\n"
    (tmp_path / "file").touch()
    assert "cannot write to" in complaint(run("sh", ".ci/alone", str(tmp_path / "file" / "b"), "true"))
    assert run("sh", ".ci/alone", str(tmp_path / "new"), "false").returncode == 1


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
