# SPDX-License-Identifier: MIT
"""What the processor's side can suffer while the motor turns: the bridge is off at once, the next life says why."""
import pytest

from launcher import simulate

from rigs.steps import faults

ON_S, SPEED_S, INJECT_S = 0.1, 0.4, 0.65
PERIOD_S = 50e-6
SOFT_RESET_CR = "0x40038048"
HELD = 0x07FFFFFF & ~(1 << 0 | 3 << 2 | 7 << 6 | 1 << 16 | 1 << 18 | 31 << 20)  # nothing that the drive needs


def run(tmp_path, *events, end_s=INJECT_S + 0.2, lines=(), **design):
    steps = [{"t_s": ON_S, "console": "on"}, {"t_s": SPEED_S, "console": "speed 600"}]
    steps += [{"t_s": t_s, "event": kind, "args": list(args)} for t_s, kind, *args in events]
    steps += [{"t_s": t_s, "console": text} for t_s, text in lines]
    return simulate({"key": "device", "end_s": end_s, "preamble_s": 0.05, "step": sorted(steps, key=lambda step: step["t_s"]),
                     "expect_refusal": ".*"}, out_dir=tmp_path, plant="ideal", spread=0, aligned=True, **design)


def gates_on_s(result):
    """When a gate was on, after the injection."""
    t_s = result.trace["t_s"][result.trace["gates"] > 0]
    return t_s[t_s > INJECT_S] - INJECT_S


CASES = {
    "pll_lost": ("FAULT_PLL", "the MSS PLL lost its lock (39)"),
    "fabric_pll_lost": ("FAULT_PLL", "the fabric's PLL lost its lock (48)"),
    "memory_error": ("FAULT_ECC", "a memory error that cannot be corrected (45)"),
}


@pytest.mark.parametrize("event", CASES)
def test_what_cannot_be_trusted_any_more_ends_the_program_with_the_bridge_off(event, tmp_path):
    cause, said = CASES[event]
    events = [(INJECT_S, event, "1")]
    if event != "memory_error":
        events.append((INJECT_S + 50e-6, event, "0"))  # it locks again, before the next life looks
    result = run(tmp_path, *events, lines=[(INJECT_S + 0.1, "clear"), (INJECT_S + 0.15, "status")])
    assert len(gates_on_s(result)) <= 1, "off before the next period begins"
    assert faults(result) == [cause]
    assert f"processor exception before the last reset: {said}" in result.console
    assert "state: switch on disabled" in result.console.split("> clear")[-1]


def test_a_memory_error_whose_interrupt_is_not_enabled_is_found_by_the_slow_loop(tmp_path):
    """Traffic on FIC_0 has just taken the enabling bits back."""
    result = run(tmp_path, (INJECT_S - 1e-6, "put_back"), (INJECT_S, "memory_error", "1"), chip="m2s025")
    assert faults(result) == ["FAULT_ECC"] and len(gates_on_s(result)) <= 21


def test_the_slow_loop_enables_it_again(tmp_path):
    """Then it is off before the next period begins, and not when the slow loop comes to look."""
    result = run(tmp_path, (INJECT_S - 2e-3, "put_back"), (INJECT_S, "memory_error", "1"), chip="m2s025")
    assert faults(result) == ["FAULT_ECC"] and len(gates_on_s(result)) <= 1


@pytest.mark.parametrize("block, wired", ((1 << 16, "m2f"), (1 << 8, "m2f"), (1 << 20, "core_reset_p")))
def test_a_block_that_is_put_back_into_reset_while_the_motor_turns_ends_this_life(block, wired, tmp_path):
    """The fabric, MMUART_1, GPIO: what traffic on FIC_0 might do on an M2S005 or M2S010."""
    result = run(tmp_path, (INJECT_S, "poke", SOFT_RESET_CR, hex(HELD | block)), wired=wired, chip="m2s025",
                 lines=[(INJECT_S + 0.1, "fault"), (INJECT_S + 0.12, "clear"), (INJECT_S + 0.15, "status")])
    assert len(gates_on_s(result)) <= 21, "at the slow loop's next step, or, with the fabric, at once"
    said = result.console.split("'help' lists the commands")[-1]
    assert "a block was put back into reset: traffic on FIC_0, or the design (24)" in said
    assert "fault: processor exception\n" in said and "state: switch on disabled" in said


def test_where_the_fabric_does_not_hang_on_its_bit_the_motor_turns_on(tmp_path):
    result = run(tmp_path, (INJECT_S, "poke", SOFT_RESET_CR, hex(HELD | 1 << 16)), wired="core_reset_p",
                 lines=[(INJECT_S + 0.1, "status")])
    assert not faults(result) and "state: operation enabled" in result.console and gates_on_s(result)[-1] > 0.19


@pytest.mark.parametrize("chip", ("m2s010", "m2s025"))
@pytest.mark.parametrize("reset", ("watchdog_reset", "lockup_reset", "soft_reset", "user_reset", "power_cut"))
def test_a_reset_while_the_motor_turns_leaves_no_gate_on(reset, chip, tmp_path):
    result = run(tmp_path, (INJECT_S, reset), chip=chip)
    after_s = result.trace["t_s"][result.trace["t_s"] > INJECT_S + PERIOD_S]
    assert not len(gates_on_s(result)) and after_s[0] < INJECT_S + 0.1


def test_a_corrected_error_is_counted_and_disturbs_nothing(tmp_path):
    events = [(INJECT_S + n * 1e-3, "memory_error", "0") for n in range(3)]
    result = run(tmp_path, *events, lines=[(INJECT_S + 0.05, "status")])
    assert not faults(result) and "memory errors corrected: 3\n" in result.console
    assert "state: operation enabled" in result.console
