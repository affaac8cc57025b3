# SPDX-License-Identifier: MIT
"""The interrupt's proof as part of the tests: both codes, without the mistakes; and what it must not accept."""
import os
import re
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest
import z3

sys.path.insert(0, str(Path(__file__).resolve().parent))

import arrays  # noqa: E402
import invariant  # noqa: E402
import prove_interrupt  # noqa: E402
from abstraction import Products  # noqa: E402
from admitted import Admitted  # noqa: E402
from arrays import Span  # noqa: E402
from disassembly import Reg, functions  # noqa: E402
from evaluate import States, as_signed  # noqa: E402
from image import Image  # noqa: E402
from interrupt import Interrupt  # noqa: E402
from interrupt_mistakes import by_stage, mutate, refute, stages  # noqa: E402
from machine import Machine  # noqa: E402
from proof import Refuted  # noqa: E402
from subject import Subject  # noqa: E402

BUILD = Path(os.environ.get("BUILD", "build"))
STEPS = 20000


def quiet(*_):
    pass


@pytest.fixture(scope="module", name="admitted")
def fixture_admitted():
    subprocess.run(["make", "-s", "interrupt-objects"], check=True)
    return Admitted(BUILD / "prove" / "admitted", STEPS)


@pytest.fixture(scope="module", name="image")
def fixture_image(admitted):
    assert admitted
    return Image(BUILD / "mssfoc.elf")


def test_every_handler_of_the_vector_is_proved_or_listed_with_its_reason(image, monkeypatch):
    said = []
    prove_interrupt.say_what_is_not_proved(BUILD / "mssfoc.elf", lambda *words: said.append(words))
    assert [name for name, _ in said] == sorted(prove_interrupt.NOT_PROVED)
    page = Path("docs/prove.md").read_text()
    assert dict(re.findall(r"(?m)^\| `(\w+)` \| (.*) \|$", page[page.index("**Not proved.**"):])) == prove_interrupt.NOT_PROVED
    monkeypatch.delitem(prove_interrupt.NOT_PROVED, "handlers_hall_ab")
    with pytest.raises(Refuted, match="handlers_hall_ab: in the vector, neither proved"):
        prove_interrupt.say_what_is_not_proved(BUILD / "mssfoc.elf", quiet)


def test_both_handlers_are_proved_and_mistakes_are_refuted(image, admitted):
    subject = Subject(image, admitted)
    prove_interrupt.prove_ranges(subject, admitted, quiet)
    assert subject.spans["COMPARE_A"].low >= 0 and subject.spans["COMPARE_A"].high <= subject.k.half_counts
    subject.draw()
    codes, cuts = {name: image.code(*names) for name, names in prove_interrupt.CODE.items()}, subject.cuts()
    prove_interrupt.prove_codes(subject, cuts, codes, quiet)
    assert cuts.asked > 50 and cuts.sums
    code = codes[prove_interrupt.BY_HAND]
    queues = by_stage(code, prove_interrupt.SOURCE)
    for stage in ("Clarke", "Park", "space vector", "dead time and compares", "observer", "protection and return"):
        assert any(refute(subject, cuts, code, (stage, *mutant), quiet) for mutant in queues[stage][:4]), stage


def test_a_stage_whose_mistakes_do_not_show_is_told(image, monkeypatch):
    monkeypatch.setattr("interrupt_mistakes.refute", lambda *_: False)
    with pytest.raises(Refuted, match="no mutation of stage"):
        mutate(None, None, image.code(prove_interrupt.BY_HAND), prove_interrupt.SOURCE, 1, quiet)


def test_the_source_names_the_stage_of_each_instruction():
    code = functions(BUILD / "mssfoc.elf", {prove_interrupt.BY_HAND})[prove_interrupt.BY_HAND]
    found = stages(prove_interrupt.SOURCE)
    assert len(found) == sum(i.base != "nop" for i in code.instructions)
    assert found[0] == "entry" and found[-1] == "protection and return"


@pytest.mark.parametrize("constant, off", [("dead", 1), ("kp_shift", 1), ("adc_status_taken", -1)])
def test_a_handler_that_does_otherwise_is_refuted(image, admitted, constant, off):
    changed = SimpleNamespace(**vars(admitted.k) | {constant: getattr(admitted.k, constant) + off})
    subject = Subject(image, SimpleNamespace(k=changed, circle=admitted.circle))
    subject.measure()
    subject.known |= prove_interrupt.half_times(subject.k, subject.known)
    subject.find_spans()
    subject.hold_integrals()
    subject.draw()
    code = image.code(*prove_interrupt.CODE[prove_interrupt.BY_HAND])
    with pytest.raises(Refuted):
        prove_interrupt.prove_codes(subject, subject.cuts(), {prove_interrupt.BY_HAND: code}, quiet)


@pytest.mark.parametrize("name, wider", [("kp_d_q9", Span(0, 17000)), ("IA", Span(-40000, 40000))])
def test_outside_of_the_invariant_products_wrap(image, admitted, monkeypatch, name, wider):
    monkeypatch.setitem(invariant.INPUTS if name in invariant.INPUTS else invariant.STATE, name, wider)
    subject = Subject(image, admitted)
    subject.measure()
    with pytest.raises(OverflowError):
        subject.find_spans()


def test_a_turn_too_large_lets_integrals_grow(image, admitted):
    subject = Subject(image, admitted)
    prove_interrupt.prove_ranges(subject, admitted, quiet)
    subject.inside["turn_q15"] = Span(-19660, 19660)
    with pytest.raises(Refuted, match="integral of [dq]"):
        subject.hold_integrals()


@pytest.mark.parametrize("name", ["kp_q_q9", "i_ref", "turn_q15", "feedforward_q_steps", "dead_shift"])
def test_what_leaves_the_invariant_is_told(admitted, monkeypatch, name):
    monkeypatch.setitem(admitted.spans, name, Span(0, 10**6))
    with pytest.raises(Refuted, match="may be"):
        admitted.check()


@pytest.mark.parametrize("compare", ["cmp", "cmn"])
@pytest.mark.parametrize("cond", ["ge", "lt", "gt", "le"])
def test_the_exact_difference_tells_what_the_flags_tell(compare, cond):
    """By the solver, for all values: Interrupt.holds() against Machine.holds()."""
    machine = Interrupt(SimpleNamespace(instructions=[]), None, SimpleNamespace(products=Products()), {}, None, {})
    machine.instruction, machine.condition = SimpleNamespace(text="", sets_flags=True), z3.BoolVal(True)
    getattr(machine, f"do_{compare}")(Reg(1), Reg(2))
    assert machine.order is not None
    solver = z3.Solver()
    solver.add(machine.holds(cond) != Machine.holds(machine, cond))
    assert solver.check() == z3.unsat


def test_terms_are_evaluated_as_the_solver_does():
    x, y = z3.BitVecs("x y", 32)
    count = 64
    states = States(count, {})
    values = [states.of(term) for term in (x, y)]
    terms = [x + y, x - y, x * y, -x, ~x, x & y, x | y, x ^ y, x >> 3, z3.LShR(x, 5), x << 7, z3.Extract(20, 4, x),
             z3.Concat(z3.Extract(7, 0, x), z3.Extract(23, 0, y)), z3.SignExt(12, x), z3.ZeroExt(12, x),
             z3.If(x < y, x, y), z3.If(z3.And(z3.ULT(x, y), z3.Not(x == y)), x, y), z3.If(z3.Or(x <= y, x == 3), y, x)]
    for term in terms:
        got = states.of(term)
        for n in range(count):
            pairs = [(v, z3.BitVecVal(int(array[n]), 32)) for v, array in zip((x, y), values)]
            assert z3.simplify(z3.substitute(term, *pairs)).as_long() == int(got[n]), term
    assert as_signed(states.of(z3.BitVecVal(2**32 - 5, 32)), 32)[0] == -5


def test_spans_hold_what_numbers_give():
    o = arrays.Intervals({}, {})
    x, y = Span(-5, 7), Span(2, 3)
    for a in range(-5, 8):
        for b in (2, 3):
            for got, exact in ((x + y, a + b), (x - y, a - b), (o.product(x, y), a * b), (o.floor(x, 1), a >> 1),
                               (o.max(x, y), max(a, b)), (o.min(x, y), min(a, b)), (o.select(x > y, x, y), a if a > b else b)):
                assert got.low <= exact <= got.high
    assert (x > Span(-9, -6)) is True and (x > Span(7, 9)) is False and (x > y) is None and (x < Span(8, 9)) is True
    with pytest.raises(OverflowError):
        o.cut("sum", Span(2**31 - 1, 2**31 - 1) + 1)
