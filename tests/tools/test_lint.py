# SPDX-License-Identifier: MIT
"""The tree keeps the rules; what lint says of a long file, a long function, two static functions of one name, no formatter."""
import importlib.util
from pathlib import Path

import pytest

# under a name of its own: the fabric's tests have a lint, too
SPEC = importlib.util.spec_from_file_location("house_lint", Path(__file__).with_name("lint.py"))
lint = importlib.util.module_from_spec(SPEC)
SPEC.loader.exec_module(lint)

BODY = "    x++;\n"


def function(lines, name="step"):
    return f"static void {name}(void)\n{{\n{BODY * (lines - 3)}}}\n"


def test_a_function_may_have_sixty_lines_and_no_more():
    path = Path("firmware/drive/x.c")
    assert not list(lint.check_sizes(path, function(lint.FUNCTION_LINES)))
    found = [what for _, what in lint.check_sizes(path, function(lint.FUNCTION_LINES + 1))]
    assert found == ["step() has 61 lines, at most 60"]


def test_a_file_may_have_seven_hundred_lines_and_no_more():
    path = Path("firmware/drive/x.c")
    assert not list(lint.check_sizes(path, "\n" * lint.FILE_LINES))
    assert len(list(lint.check_sizes(path, "\n" * (lint.FILE_LINES + 1)))) == 1


def test_a_static_name_stands_once_in_the_firmware():
    texts = {"firmware/a.c": function(5), "firmware/b.c": function(6), "firmware/c.c": function(6, "other")}
    assert lint.shared_statics(texts) == {"step": ["firmware/a.c", "firmware/b.c"]}


@pytest.mark.parametrize("line, found", (
    ("from unit.test_axis import fresh", 1), ("from guides import test_links", 1), ("import unit.test_axis", 1),
    ("from rigs.drive import World", 0), ("import testing", 0), ("def x(:", 1)))
def test_no_test_is_imported_by_another(line, found):
    assert len(list(lint.check_python(Path("tests/unit/test_x.py"), line + "\n"))) == found


def test_the_tree_keeps_the_rules():
    assert not [f"{path}:{number}: {what}" for path, number, what in lint.rules()]


def test_a_member_that_nobody_reads_is_found(tmp_path):
    (tmp_path / "a.c").write_text("struct row {\n    int first, last;\n};\nint first(const struct row *r);\n"
                                  "int first(const struct row *r)\n{\n    return r->first;\n}\n")
    ((path, line, what),) = lint.check_members(["a.c"], tmp_path)
    assert (str(path), line) == ("a.c", 2) and "row::last" in what


def test_formatting_is_found_by_one_version(tmp_path, monkeypatch):
    """Where it cannot be had, lint says so instead of passing."""
    formatter = tmp_path / "formatter"
    formatter.write_text("#!/bin/sh\necho \"$0: no network\" >&2\nexit 1\n")
    formatter.chmod(0o755)
    monkeypatch.setattr(lint, "FORMATTER", formatter)
    ((path, _, what),) = lint.check_format(["firmware/main.c"])
    assert str(path) == ".clang-format" and "no network" in what
    formatter.write_text("#!/bin/sh\necho \"$5:3:1: error: code should be clang-formatted\" >&2\nexit 1\n")
    assert [(str(path), number) for path, number, _ in lint.check_format(["a.c", "b.c"])] == [("b.c", 3)]


@pytest.mark.parametrize("line, found", [
    ("c->i_q_ref_q15 = 0;", "i_q_ref_q15 is written"), ("a->loop.pll.speed_q32 -= grows_q32;", "pll is written"),
    ("io->loop->integral_d_q9 = x;", "integral_d_q9 is written"), ("c->dead_shift++;", "dead_shift is written"),
    ("--a->loop.fell_back;", "fell_back is written"), ("(c->w_shift)--;", "w_shift is written"),
    ("axes[axis].loop.handlers = &handlers;", "handlers is written"), ("c->circle_steps[n] <<= 1;", "circle_steps is written"),
    ("c->i_d_ref_q15 =\n        x;", "i_d_ref_q15 is written"), ("(&a->loop)->kp_q_q9 = 0;", "kp_q_q9 is written"),
    ("(*c).turn_q15 %= 2;", "turn_q15 is written"), ("*c = (struct current_loop){0};", "c is written as a whole"),
    ("volatile int32_t *const ref = d ? &c->i_d_ref_q15 : &c->i_q_ref_q15;", "i_d_ref_q15 has a pointer to it"),
    ("cpu_add(&a->loop.pll.speed_q32, x);", "pll has a pointer to it"),
    ("const struct observer *const o = &(a->loop.flux);", "flux has a pointer to it"),
    ("struct current_loop *const other = &a->loop;", "a pointer to the interrupt's memory that is not volatile"),
    ("const volatile struct current_loop *other = &a->loop;", None), ("if (c->i_q_ref_q15 == 0 || c->ki_q15 <= x) {", None),
    ("s->integral_q29 = x & c->status_max;", None), (".i_d_ref_q15 = loop->i_d_ref_q15,", None),
    ("current_loop_set_currents(&a->loop, c->i_d_ref_q15, 0);", None), ("/* c->ki_q15 = 0; */", None)])
def test_the_current_loop_is_asked_by_its_doors(line, found):
    text = f"void ask(struct axis *a, volatile struct current_loop *c)\n{{\n    {line}\n}}\n"
    for path in ("firmware/source/sensorless.c", "firmware/control/observer.c", "drivers/bringup/main.c"):
        if not ("flux" in line and "observer" in path):
            told = [what for number, what in lint.check_doors(Path(path), text) if number == 3]
            assert (found in told[0] if found else not told), told
    assert not list(lint.check_doors(Path("firmware/control/current_loop_frame.c"), text))


def test_parts_of_the_current_loop_have_a_writer_each():
    """And a name is the loop's only in the function that declares it so."""
    text = ("void track(volatile struct current_loop *c)\n{\n    c->flux.track = 0;\n}\n\n"
            "void other(struct capture *c)\n{\n    c->next++;\n}\n")
    assert not list(lint.check_doors(Path("firmware/control/observer.c"), text))
    for path in ("firmware/control/weakening.c", "firmware/monitor/lock_watch.c"):
        ((number, what),) = lint.check_doors(Path(path), text)
        assert number == 3 and what.startswith("flux is written")
