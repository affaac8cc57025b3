# SPDX-License-Identifier: MIT
"""Every variable of the image by its name: the console reads of it what the trace has, which reads the memory by itself."""
import random
import re

import numpy as np
import pytest
from mssfoc import Refused
from mssfoc.texts import Names, capture, signals
from mssfoc.variables import RAM, RAM_END, Variables

from launcher import probes
from launcher.paths import build_dir
from rigs.played_scope import answer, play

DRAWN, A_LINE = 50, 8
FROM_S, EACH_S = 0.45, 0.02  # the motor turns by then; a line is answered within that
FAST = ["axes[0].loop.i_q_q15", "axes[0].loop.v_q_steps", "axes[0].loop.pll.angle_q32", "axes[0].loop.pll.speed_q32",
        "axes[0].loop.integral_q_q9"]  # the last one is the slow loop's, too, behind one sample of twenty


@pytest.fixture(scope="module")
def image():
    return Variables(build_dir() / "mssfoc.elf")


@pytest.fixture(scope="module")
def drawn(image):
    """By lot, another one for each image: of an array each element counts as much as what has but one."""
    kinds = {}
    for name in image.names:
        if image.find(name).type in probes.READ:
            kinds.setdefault(re.sub(r"\[\d+\]", "[]", name), []).append(name)
    lot = random.Random(repr(image.names))
    return [lot.choice(kinds[kind]) for kind in lot.sample(sorted(kinds), DRAWN)]


@pytest.fixture(scope="module")
def run(image, drawn, tmp_path_factory):
    told = [f"scope values {','.join(image.find(name).words for name in drawn[k:k + A_LINE])}" for k in range(0, DRAWN, A_LINE)]
    names = Names(lambda: image)
    steps = [(0.03, names.line(f"scope signals {','.join(FAST)},sequence")), (0.1, "on"), (0.32, "speed 900"),
             (0.36, "scope before 20"),
             (0.38, names.line("scope trigger axes[0].loop.integral_q_q9 rises 1")), (0.40, "scope arm"), (0.42, "scope fire")]
    watched = [(f"drawn{k}", name, 1.0, True) for k, name in enumerate([*drawn, *FAST])]
    steps += [(FROM_S + EACH_S * at, line) for at, line in enumerate(told)]
    after_s = FROM_S + EACH_S * (len(told) + 1)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(probes, "WATCH", probes.WATCH + watched)
        steps += [(after_s, "scope read"), (after_s + 2, "scope list")]
        yield play(tmp_path_factory.mktemp("run"), steps, after_s + 2.1), told, names


def test_fifty_variables_by_lot_are_what_the_trace_has(image, drawn, run):
    """While the motor turns: each is what stood there within the time that its line took."""
    result, told, _ = run
    t = np.asarray(result.trace["t_s"])
    wrong, moved = [], 0
    for k, name in enumerate(drawn):
        values = answer(result.console, told[k // A_LINE])[2].split()
        assert len(values) == min(A_LINE, DRAWN - k // A_LINE * A_LINE)
        one, began_s = image.find(name), FROM_S + EACH_S * (k // A_LINE)
        column = np.asarray(result.trace[f"drawn{k}"])
        there = set(column[(t >= began_s) & (t < began_s + EACH_S)])
        moved += len(there) > 1
        if round(one.of(int(values[k % A_LINE])) / one.step) not in there:
            wrong.append((name, values[k % A_LINE], sorted(there)[:5]))
    assert not wrong, wrong
    assert moved < DRAWN / 2, "of what moves all the time, the window says little"


def test_a_capture_of_variables_is_the_trace_at_every_sample(image, run):
    result, _, names = run
    raw = capture(answer(result.console, "scope read"))
    found = names.heard(raw["names"], signals(answer(result.console, "scope list")))
    rows = np.array(raw["rows"])
    assert list(found) == [*FAST, "sequence"] and len(rows) > 600
    column = {name: np.asarray(result.trace[f"drawn{DRAWN + k}"]) for k, name in enumerate(FAST)}
    captured = {name: np.round(one.of(rows[:, at]) / one.step) for at, (name, one) in enumerate(found.items())}
    angle = column[FAST[2]]
    starts = np.flatnonzero(angle == captured[FAST[2]][0])
    first = [at for at in starts if np.array_equal(angle[at:at + len(rows)], captured[FAST[2]])]
    assert len(first) == 1, "it stands at one place of the trace"
    for name in FAST:
        same = column[name][first[0]:first[0] + len(rows)] == captured[name]
        assert same.all() or (name == FAST[4] and same.mean() > 0.94), (name, same.mean())
        assert len(set(captured[name])) > 20, name


def test_names_are_found_while_typing(image):
    assert image.like("speed integ")[0] == "axes[0].speed.integral_q29"
    assert image.like("axes[0].faults.ca") == ["axes[0].faults.cause"] and not image.like("nothing like it")
    assert len(image.like("a")) == 20 and len(image.names) > 5000
    for name in random.Random(1).sample(image.names, 300):
        assert RAM <= image.find(name).address < RAM_END and name in image.like(name)


def test_units_fractions_and_words_of_enumerations(image):
    speed, state, cause = (image.find(f"axes[0].{name}") for name in ("speed.speed_rpm_q4", "state", "faults.cause"))
    assert (speed.unit, speed.step, speed.of(-24)) == ("rpm", 1 / 16, -1.5)
    assert state.enum[4] == "operation enabled" and cause.enum[0] == "none"
    assert image.find("axes[0].params.i_max_ma").unit == "mA"


@pytest.mark.parametrize("name, why", [("axes[0].speed.integrl_q29", "is axes.0..speed.integral_q29 meant"),
                                       ("axes[0].speed", "no number"), ("axes[7].state", "no number"),
                                       ("param_table[0].min", "is a constant, and not in RAM")])
def test_what_is_no_variable_is_refused_by_its_name(image, name, why):
    with pytest.raises(Refused, match=why):
        image.find(name)


def test_another_image_is_refused(image):
    with pytest.raises(Refused, match="is not the image of this drive, which runs mssfoc 0.0.7"):
        Variables(build_dir() / "mssfoc.elf", "mssfoc 0.0.7, commit 12345678, PWM 20000 Hz")


@pytest.mark.parametrize("kind, level, when, told", [
    ("s32", 0.5, "rises", "rises 268435.456"), ("s32", -0.5, "below", "below -268435.456"),
    ("u8", 3, "above", "above 50331.648"),
    ("u8", 3, "falls", "falls 67108.863"), ("s16", -2, "rises", "rises -131.072")])
def test_a_level_stands_where_the_variable_does_in_its_word(image, kind, level, when, told):
    """What is beside it in the word neither triggers nor keeps from it."""
    from mssfoc.variables import Variable
    one = Variable("x_q29", RAM + 16, kind, "", 2.0 ** -29 if kind == "s32" else 1, {})
    assert one.trigger(when, level) == told
    with pytest.raises(Refused, match="a trigger is between"):
        one.trigger(when, 1e12)
