# SPDX-License-Identifier: MIT
"""The line that is typed, against a model that knows only texts; what a terminal shows; completion; the mode for programs."""
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rigs.console import SAID, VERSION, Operator
from unit.console_page import PAGE, page

LINE_MAX, KEPT = 80, 8
UP, DOWN, RIGHT, LEFT, HOME, END = b"\x1b[A", b"\x1b[B", b"\x1b[C", b"\x1b[D", b"\x1b[H", b"\x1b[F"
DELETE, TAB = b"\x1b[3~", b"\t"


def typed_so_far(operator):
    return bytes(operator.console.line.text).split(b"\0")[0].decode()


class Screen:
    """The last line of a terminal that can only go back by a place."""

    def __init__(self):
        self.cells, self.column = [], 0

    def show(self, text):
        for c in text:
            if c == "\r":
                self.column = 0
            elif c == "\n":
                self.cells, self.column = [], 0
            elif c == "\b":
                assert self.column > 0, "left of the screen"
                self.column -= 1
            elif c != "\a":
                self.cells[self.column:self.column + 1] = [c]
                self.column += 1


class Model:
    """What should stand in the line, and where the cursor."""

    def __init__(self):
        self.text, self.cursor, self.kept, self.back = "", 0, [], 0

    def key(self, key):
        text, cursor = self.text, self.cursor
        if key in (LEFT, b"\x02"):
            self.cursor = max(cursor - 1, 0)
        elif key in (RIGHT, b"\x06"):
            self.cursor = min(cursor + 1, len(text))
        elif key in (HOME, b"\x01", b"\x1b[1~", b"\x1bOH"):
            self.cursor = 0
        elif key in (END, b"\x05", b"\x1b[4~"):
            self.cursor = len(text)
        elif key in (b"\b", b"\x7f"):
            self.text, self.cursor = text[:max(cursor - 1, 0)] + text[cursor:], max(cursor - 1, 0)
        elif key in (DELETE, b"\x04"):
            self.text = text[:cursor] + text[cursor + 1:]
        elif key == b"\x15":
            self.text, self.cursor = text[cursor:], 0
        elif key == b"\x0b":
            self.text = text[:cursor]
        elif key == b"\x17":
            left = text[:cursor].rstrip(" ")
            left = left[:left.rfind(" ") + 1]
            self.text, self.cursor = left + text[cursor:], len(left)
        elif key in (UP, b"\x10", DOWN, b"\x0e"):
            self.recall(self.back + (1 if key in (UP, b"\x10") else -1))
        elif key == b"\r":
            self.enter()
        elif len(key) == 1 and len(text) < LINE_MAX:
            self.text, self.cursor = text[:cursor] + key.decode() + text[cursor:], cursor + 1

    def recall(self, back):
        if 0 <= back <= min(len(self.kept), KEPT):
            self.back = back
            self.text = self.kept[-back] if back else ""
            self.cursor = len(self.text)

    def enter(self):
        if self.text and self.text != (self.kept[-1] if self.kept else None):
            self.kept.append(self.text)
        self.text, self.cursor, self.back = "", 0, 0


PRINTABLE = st.sampled_from([bytes([c]) for c in b"agz 9 "])
KEYS = st.sampled_from([UP, DOWN, LEFT, RIGHT, HOME, END, DELETE, b"\x01", b"\x02", b"\x04", b"\x05", b"\x06", b"\b", b"\x7f",
                        b"\x0b", b"\x0e", b"\x10", b"\x15", b"\x17", b"\x1b[1~", b"\x1b[4~", b"\x1bOH", b"\r",
                        b"\x1b[5~", b"\x1b[1;5Z", b"\x1bx"])  # the last three mean nothing


@given(st.lists(st.one_of(PRINTABLE, PRINTABLE, KEYS), max_size=120))
def test_any_keys_leave_what_the_screen_shows(c, keys):
    operator, model, screen = Operator(c), Model(), Screen()
    screen.show(operator.greeting)
    for key in keys:
        screen.show(operator.type(key))
        model.key(key)
        line = operator.console.line
        assert (typed_so_far(operator), line.length, line.cursor) == (model.text, len(model.text), model.cursor)
        assert "".join(screen.cells).rstrip(" ") == ("> " + model.text).rstrip(" ") and screen.column == 2 + model.cursor


def test_eight_lines_are_kept_and_one_comes_again(operator):
    for n in range(10):
        operator.type(b"speed %d\r" % n)
    operator.type(UP * 7)
    assert typed_so_far(operator) == "speed 3"
    operator.type(UP * 5)
    assert typed_so_far(operator) == "speed 2", "the eighth is the last"
    assert operator.type(b"\r").endswith("error: the drive is not in operation; use 'on' and wait for it\r\n> ")


def test_a_line_that_is_too_long_stays_refused_however_it_is_mended(operator):
    said = operator.type(b"x" * 81 + b"\b" * 81 + b"version\r")
    assert "error: line longer than 80 characters; ignored" in said and VERSION not in said
    assert VERSION in operator.type(b"version\r")


def test_it_can_be_dropped_and_drawn_again(operator):
    assert operator.type(b"off\x03") == "off^C\r\n> " and operator.type(b"\r") == "\r\n> "
    operator.type(b"speed" + LEFT * 2)
    assert operator.type(b"\x0c") == "\r\n> speed\b\b"


@pytest.mark.parametrize("typed, becomes", [
    (b"vers", "version "), (b"get ramp", "get ramp_rpm_s "), (b"set pole", "set pole_pairs "), (b"hm i", "hm index "),
    (b"identify u", "identify use "), (b"learn c", "learn cogging "), (b"reaction voltage_l", "reaction voltage_limit "),
    (b"reaction voltage_limit s", "reaction voltage_limit stop "), (b"help rea", "help reaction "),
    (b"machine of", "machine off "), (b"pp b", "pp by "), (b"  get  pole", "  get  pole_pairs ")])
def test_what_is_clear_is_added(operator, typed, becomes):
    operator.type(typed)
    said = operator.type(TAB)
    assert typed_so_far(operator) == becomes and typed.decode() + said == becomes


def test_what_is_not_clear_is_listed(operator):
    operator.type(b"get pwm")
    assert operator.type(TAB) == "_", "so much they have in common"
    assert operator.type(TAB) == "\r\npwm_update  pwm_samples  \r\n> get pwm_"
    assert operator.type(b"\x15hm ") and operator.type(TAB) == "\r\nindex  block  \r\n> hm "


def test_each_command_parameter_and_fault_can_be_completed(operator, c):
    names = {line.split(":")[0].split(" ")[0] for line in operator("help")}
    operator.type(b"")
    assert set(operator.type(TAB).replace(">", "").split()) == names
    operator.type(b"set ")
    listed = operator.type(TAB).split("\r\n")[1].split()
    assert listed == [name for name, _ in c.params._fields_]
    operator.type(b"\x15help ")
    assert set(operator.type(TAB).split("\r\n")[1].split()) == names | set(listed)
    operator.type(b"\x15reaction ")
    listed = operator.type(TAB).split("\r\n")[1].split()
    operator.type(b"\x15")
    assert listed == [line.split(":")[0].replace(" ", "_").lower() for line in operator("reaction")]


@pytest.mark.parametrize("typed", (b"", b"help ", b"reaction ", b"scope "))
def test_a_list_has_each_name_once_and_nothing_between(operator, typed):
    operator.type(typed)
    listed = operator.type(TAB).split("\r\n")[1]
    assert listed == "".join(f"{name}  " for name in dict.fromkeys(listed.split()))


@pytest.mark.parametrize("typed", (b"bogus", b"speed ", b"speed 1 ", b"get nothing", b"off "))
def test_where_nothing_fits_the_bell_rings(operator, typed):
    operator.type(typed)
    assert operator.type(TAB) == "\a" and typed_so_far(operator) == typed.decode()


def test_inside_a_line_nothing_is_completed(operator):
    operator.type(b"vers" + LEFT)
    assert operator.type(TAB) == ""


def test_help_about_one(operator):
    assert operator("help pp") == [line for line in operator("help") if line.startswith("pp ")]
    assert operator("help bogus") == ["error: bogus: no command, parameter or fault; 'help' and 'get all' list them"]


# ---- for programs ----


@pytest.fixture
def program(operator):
    assert operator.type(b"machine on\r") == "machine on\r\nok\r\n"
    return operator


def test_no_echo_no_prompt_and_an_end_to_each_answer(program):
    assert program.type(b"vers") == "" and program.type(b"ion\n") == f"{SAID}\r\n.\r\n"
    assert program.type(b"\n") == ".\r\n"
    assert program.type(b"bogus\n") == "error: bogus: unknown command; 'help' lists them\r\n.\r\n"
    assert program.type(b"get ramp_rpm_s\rversion\r\n") == (
        f"ramp_rpm_s = 5000 rpm/s  (1...1000000)\r\n.\r\n{SAID}\r\n.\r\n")
    assert program.type(b"machine off\n") == "ok\r\n.\r\n> "
    assert program.type(b"v") == "v"


@pytest.mark.parametrize("key", (TAB, UP, b"\b", b"\x03", b"\x15"))
def test_keys_spoil_the_line_of_a_program(program, key):
    assert program.type(b"off" + key + b"\n") == "error: line with unprintable characters; ignored\r\n.\r\n"


def test_what_happens_between_answers_has_its_own_lines(program, c):
    program.axis.faults.cause = c.FAULT_OVERTEMPERATURE
    assert program.type(b"") == "fault: over-temperature; see 'fault', then 'clear'\r\n"
    c.fault_warn(program.axis, c.FAULT_VOLTAGE_LIMIT)
    assert program.type(b"") == "warning: voltage limit\r\n"


@pytest.mark.parametrize("mode", (b"", b"ON", b"of", b"offs", b"on|off"))
def test_it_is_on_or_off(operator, mode):
    said = operator.type(b"machine " + mode + b"\r")
    assert "error: " in said and said.endswith("> ")


def test_the_page_has_every_command(operator):
    assert PAGE.read_text() == page(operator("help")), "stale: write it anew by /usr/bin/python3 tests/unit/console_page.py"
