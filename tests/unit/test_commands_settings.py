# SPDX-License-Identifier: MIT
"""The console's parameters and reactions, line by line: names, numbers, units and ranges; what is refused changes nothing."""
import re

import pytest

# A parameter of each ending that has a unit, and of none.
UNITS = {"ramp_rpm_s": "rpm/s", "learn_rpm": "rpm", "cyclic_ms": "ms", "winding_tau_s": "s", "i_max_ma": "mA", "v_min_mv": "mV",
         "resistance_mohm": "mohm", "ld_uh": "uH", "flux_uwb": "uWb", "bus_capacitance_uf": "uF", "speed_bw_hz": "Hz",
         "power_max_w": "W", "inertia_gmm2": "g mm2", "home_pct": "%", "profile_speed_pm": "per mille", "t_max_c": "degC",
         "home_turns": "turns", "following_mturn": "mturn", "encoder_counts": "counts", "modbus_baud": "baud",
         "pole_pairs": "", "pwm_update": ""}


@pytest.fixture(autouse=True)
def initial(operator):
    operator.c.params_init(operator.axis.params)


def row(operator, name):
    return operator.c.param_find(name.encode()).contents


def behind(unit):
    return f" {unit}" if unit else ""


@pytest.mark.parametrize("name", UNITS)
def test_commands_settings_of_a_parameter(operator, name):
    """get, set, its ends, what lies beyond them, and what differs from the initial value."""
    info, unit, params = row(operator, name), behind(UNITS[name]), operator.axis.params
    assert operator(f"get {name}") == [f"{name} = {info.initial}{unit}  ({info.min}...{info.max})"]
    for value in (info.min, info.max):
        assert operator(f"set {name} {value}") == ["ok"] and getattr(params, name) == value
        assert operator(f"get {name}") == [f"{name} = {value}{unit}  ({info.min}...{info.max})"]
        changed = [f"set {name} {value}"] if value != info.initial else []
        assert operator("get --changed") == changed
    for value in (info.min - 1, info.max + 1):
        assert operator(f"set {name} {value}") == [f"error: {name} must be {info.min}...{info.max}{unit}"]
        assert getattr(params, name) == info.max


def test_commands_settings_lists_all(operator):
    lines = operator("get all")
    assert len(lines) == operator.c.param_count.value
    assert all(re.fullmatch(r"\w+ = -?\d+( [^ ].*)?  \(-?\d+\.\.\.\d+\)", line) for line in lines)
    for line in lines:
        assert operator(f"get {line.split(' = ')[0]}") == [line]


@pytest.mark.parametrize("line, answer", [
    ("get pole_pear", "pole_pear: no such parameter; 'get all' lists them; did you mean pole_pairs?"),
    ("set pole_pear 1", "pole_pear: no such parameter; 'get all' lists them; did you mean pole_pairs?"),
    ("set learn_rpm 1.5", "1.5: not a whole number"),
    ("reaction stal off",
     "stal: no such fault; 'reaction' lists those with a choice, '_' stands for a blank; did you mean stall?"),
    ("reaction stall of", "of: not one of off, stop, warn, carry"),
    ("reaction over-current stop", "this fault does not allow that; 'reaction' lists what each allows")])
def test_commands_settings_refused(operator, line, answer):
    before = bytes(operator.axis)
    assert operator(line) == [f"error: {answer}"] and bytes(operator.axis) == before


def test_commands_settings_only_while_off(operator, c):
    operator.axis.state = c.AXIS_SWITCHED_ON
    before = bytes(operator.axis)
    assert operator("set learn_rpm 20") == ["error: parameters can change only while the drive is off"]
    assert operator("reaction stall warn")[0].startswith("error: ") and bytes(operator.axis) == before


def test_commands_settings_of_reactions(operator, c):
    """A line for each fault that leaves a choice: what is chosen, and what may be, in the order of the choices."""
    words = ("off", "stop", "warn", "carry")
    expected = []
    for cause in range(1, c.FAULT_COUNT):
        allowed = c.fault_class(cause).contents.allowed
        choice = operator.axis.reactions.choice
        if allowed != 1:
            may = ", ".join(word for n, word in enumerate(words) if allowed >> n & 1)
            expected.append((cause, f"{words[choice[cause]]}  ({may})"))
    lines = operator("reaction")
    assert [line.split(": ", 1)[1] for line in lines] == [text for _, text in expected] and len(lines) > 10
    for line, (cause, _) in zip(lines, expected):
        name, rest = line.split(": ", 1)
        for word in rest[:-1].split("(")[1].split(", "):
            assert operator(f"reaction {name.replace(' ', '_')} {word}") == ["ok"]
            assert operator.axis.reactions.choice[cause] == words.index(word)
            assert f"{name}: {word}  ({rest.split('(')[1]}" in operator("reaction")
    assert operator("reaction none off")[0].startswith("error: none: no such fault")
