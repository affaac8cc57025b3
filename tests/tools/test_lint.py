# SPDX-License-Identifier: MIT
"""What lint says of a file that is too long, a function that is, and of two static functions of one name."""
import importlib.util
from pathlib import Path

# under a name of its own: the fabric's tests have a lint, too
SPEC = importlib.util.spec_from_file_location("house_lint", Path(__file__).with_name("lint.py"))
lint = importlib.util.module_from_spec(SPEC)
SPEC.loader.exec_module(lint)

BODY = "    x++;\n"


def function(lines, name="step"):
    return f"static void {name}(void)\n{{\n{BODY * (lines - 3)}}}\n"


def test_a_function_may_have_forty_lines_and_no_more():
    path = Path("firmware/drive/x.c")
    assert not list(lint.check_sizes(path, function(lint.FUNCTION_LINES)))
    found = [what for _, what in lint.check_sizes(path, function(lint.FUNCTION_LINES + 1))]
    assert found == ["step() has 41 lines, at most 40"]


def test_a_file_may_have_four_hundred_lines_and_no_more():
    path = Path("firmware/drive/x.c")
    assert not list(lint.check_sizes(path, "\n" * lint.FILE_LINES))
    assert len(list(lint.check_sizes(path, "\n" * (lint.FILE_LINES + 1)))) == 1


def test_a_static_name_stands_once_in_the_firmware():
    texts = {"firmware/a.c": function(5), "firmware/b.c": function(6), "firmware/c.c": function(6, "other")}
    assert lint.shared_statics(texts) == {"step": ["firmware/a.c", "firmware/b.c"]}
