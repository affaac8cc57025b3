# SPDX-License-Identifier: MIT
"""Who writes what: each way in which a context comes to a write, and each form of a write, is noticed; reading is none."""
import pytest
import writers
from mutants.c import Parser

PROGRAM = """
struct pair { int a, b[3]; };
struct thermal { int heat; struct pair pair; };
struct axis { int state, asked; struct thermal thermal; struct pair first, second; };
struct row { int code; void (*run)(struct axis *); };
struct axis axes[2];
static void fill(int *to) { *to = 1; }
static void only_look(const int *at) { (void)at; }
%s
void Timer1_IRQHandler(void) { axes[0].asked = 0; }
int main(void) { axes[1].asked = 1; at_work(&axes[0]); return 0; }
"""
AT_WORK = "void at_work(struct axis *a) { %s }"


def by(part, text):
    found = writers.Program()
    unit = Parser(writers.ROOT).parse("firmware/example.c", PROGRAM % text)
    assert not [d for d in unit.diagnostics if d.severity >= 3]
    found.read(unit)
    return writers.writers(found)[part]


@pytest.mark.parametrize("statement", (
    "a->state = 2;", "a->state += 2;", "a->state++;", "--a->state;", "fill(&a->state);", "int *p = &a->state; *p = 3;",
    "a[1].state |= 4;", "(*a).state = 1;", "*(volatile int *)&a->state = 1;", "struct axis *b = a; b->state = 1;",
    "*a = (struct axis){0};", "if (a->asked) { for (;;) { a->state = a->asked; } }", "(void)(a->asked && (a->state = 1));"))
def test_a_write_in_any_form(statement):
    assert by("state", AT_WORK % statement) == "thread"


@pytest.mark.parametrize("statement", (
    "int b = a->state; (void)b;", "only_look(&a->state);", "const int *p = &a->state; (void)p;", "struct axis b; (void)b;",
    "struct thermal t; t.heat = 1; (void)t;", "(void)(a->state == 2);", "(void)(a->state <= 2 || a->state >= 1);",
    "const struct axis *b = a; const int *p = &b->state; (void)p;", "a->thermal.heat = a->state;"))
def test_what_reads_or_writes_something_else_is_no_write(statement):
    assert by("state", AT_WORK % statement) == "start-up"


@pytest.mark.parametrize("statement", (
    "a->thermal.heat = 1;", "struct thermal *t = &a->thermal; t->heat = 1;", "a->thermal.pair.b[2] = 1;",
    "fill(a->thermal.pair.b);", "fill(&a->thermal.pair.b[1]);", "struct pair *p = &a->thermal.pair; p->a = 1;",
    "a->thermal = (struct thermal){1};"))
def test_inside_a_part(statement):
    assert by("thermal", AT_WORK % statement) == "thread"


def test_of_two_parts_of_one_type_the_one_whose_address_is_handed_out():
    program = "static void set(struct pair *p) { p->a = 1; }" + AT_WORK % "set(&a->second);"
    assert (by("first", program), by("second", program)) == ("start-up", "thread")


WRITES = "static void writes(struct axis *a) { a->state = 1; }"


@pytest.mark.parametrize("way", (
    "void at_work(struct axis *a) { writes(a); }",
    "static const struct row rows[] = {{1, writes}}; void at_work(struct axis *a) { rows[a->asked].run(a); }",
    "static const struct row rows[] = {[1] = {.run = writes}}; void at_work(struct axis *a) { rows[1].run(a); }",
    "static const struct row one = {.run = writes}; static const struct row *const rows[] = {&one};"
    "void at_work(struct axis *a) { const struct row *r = rows[0]; r->run(a); }",
    "static void (*const table[])(struct axis *) = {writes}; void at_work(struct axis *a)"
    "{ void (*const f)(struct axis *) = table[a->asked]; if (f) { f(a); } }",
    "static void each(void (*f)(struct axis *), struct axis *a) { f(a); } void at_work(struct axis *a) { each(writes, a); }",
    "static void inner(void (*f)(struct axis *), struct axis *a) { f(a); } static void each(void (*f)(struct axis *),"
    "struct axis *a) { inner(f, a); } void at_work(struct axis *a) { each(writes, a); }",
    "void at_work(struct axis *a) { struct row r; r.run = writes; r.run(a); }"))
def test_whatever_way_leads_there(way):
    assert by("state", WRITES + way) == "thread"


def test_a_function_that_nobody_reaches_writes_nothing():
    assert by("state", WRITES + "static const struct row rows[] = {{1, writes}}; void at_work(struct axis *a) { (void)a;"
              " (void)rows; }") == "start-up"


def test_contexts_are_told_apart():
    assert by("asked", AT_WORK % "(void)a;") == "slow loop, thread"
    interrupt = "void handlers_encoder_ab(void) { axes[0].state = 1; }"
    assert by("state", AT_WORK % "(void)a;" + interrupt) == "interrupt"


def test_the_page_is_held_to_it():
    now = {"state": "slow loop", "hall": "interrupt, slow loop"}
    right = "# Page\n" + writers.table(now, {"hall": "per field"})
    assert not list(writers.findings(now, right))
    for wrong in (right.replace("slow loop |", "thread |", 1), right.replace("| per field |", "| |"),
                  right.replace("| `state` | slow loop | |", "| `state` | slow loop | it is so |"),
                  right.replace("`state`", "`stat`")):
        assert list(writers.findings(now, wrong))


def test_the_firmware_is_as_its_page_says():
    assert not list(writers.findings(writers.writers(writers.of_firmware()), writers.PAGE.read_text(encoding="utf-8")))
