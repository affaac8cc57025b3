# SPDX-License-Identifier: MIT
"""What is said of stored settings, to the letter: loaded, refused, damaged, unknown, missing, saved."""
import ctypes

import pytest


@pytest.fixture
def said(c):
    """Calls a function that puts text, and returns the lines."""
    text = c.structs["text"]()

    def lines(function, what):
        c.host_said_bytes.value = 0
        function(ctypes.byref(text), ctypes.byref(what))
        whole = bytes(c.host_said)[:c.host_said_bytes.value].decode()
        assert whole == "" or whole.endswith("\r\n")
        return whole.split("\r\n")[:-1]
    yield lines
    c.host_said_bytes.value = 0


def view(c, states=("VALID", "EMPTY"), numbers=(7, 0), newest=0):
    one = c.slots_view()
    for slot in (0, 1):
        one.state[slot], one.number[slot] = getattr(c, f"SLOT_{states[slot]}"), numbers[slot]
    one.any, one.newest = "VALID" in states, newest
    return one


@pytest.mark.parametrize("slot, number, line", [
    (0, 1, "slot A, save 1; writes of its pages so far: about 1"),
    (1, 2, "slot B, save 2; writes of its pages so far: about 1"),
    (0, 3, "slot A, save 3; writes of its pages so far: about 2"),
    (1, 2**32 - 1, "slot B, save 4294967295; writes of its pages so far: about 2147483648")])
def test_nvm_text_saved(c, said, slot, number, line):
    worn = "warning: eNVM: a page has been written more often than it is made for"
    dropped = "warning: the cogging map is not stored: the encoder's index, from which it counts, was not seen"
    report = c.saved()
    report.slot, report.number = slot, number
    for report.worn in (False, True):
        for report.cogging_dropped in (False, True):
            assert said(c.store_print_saved, report) == (
                [line] + [worn] * report.worn + [dropped] * report.cogging_dropped)


@pytest.mark.parametrize("states, slots, behind", [
    (("EMPTY", "EMPTY"), "", ""), (("VALID", "EMPTY"), "", ""), (("DAMAGED", "EMPTY"), "A", ""),
    (("DAMAGED", "DAMAGED"), "AB", ""), (("VALID", "DAMAGED"), "B", "; these may be the settings before it"),
    (("DAMAGED", "VALID"), "A", "; these may be the settings before it")])
def test_nvm_text_damage(c, said, states, slots, behind):
    assert said(c.store_print_damage, view(c, states)) == [
        f"warning: slot {slot} is damaged, or its save was cut short{behind}" for slot in slots]


def test_nvm_text_of_nothing_and_of_all(c, said):
    kept = c.nvm_report()
    kept.view, kept.state = view(c, ("EMPTY", "EMPTY")), c.NVM_NOTHING
    kept.missing = kept.unknown = 3
    assert said(c.store_print_loaded, kept) == ["settings: none stored, initial values"]
    kept.view, kept.state = view(c, ("EMPTY", "VALID"), (0, 4000000000), 1), c.NVM_LOADED
    kept.missing = kept.unknown = 0
    assert said(c.store_print_loaded, kept) == ["settings: slot B, save 4000000000, loaded"]
    kept.view = view(c, ("DAMAGED", "VALID"), (0, 8), 1)
    assert said(c.store_print_loaded, kept) == [
        "settings: slot B, save 8, loaded",
        "warning: slot A is damaged, or its save was cut short; these may be the settings before it"]


@pytest.mark.parametrize("unknown, missing", ((1, 0), (0, 1), (2, 78)))
def test_nvm_text_of_another_version(c, said, unknown, missing):
    kept = c.nvm_report()
    kept.view, kept.state, kept.unknown, kept.missing = view(c), c.NVM_LOADED, unknown, missing
    ctypes.memmove(kept.first_unknown, b"old_ma", 6)
    assert said(c.store_print_loaded, kept) == (
        ["settings: slot A, save 7, loaded"] + [f"{unknown} stored records are unknown to this firmware and were passed over, "
                                                "the first is old_ma"] * (unknown > 0)
        + [f"{missing} parameters are not stored and have their initial values"] * (missing > 0))


@pytest.mark.parametrize("about, error, value, text", [
    (b"", "CURRENT_MARGIN", 1647, "current_bw_hz leaves too little phase margin with this pwm_update: at most 1647"),
    (b"i_max_ma", "I_ALIGN_BEYOND_MAX", 5000, "i_max_ma: i_align_ma must not exceed i_max_ma, 5000 mA")])
def test_nvm_text_refused(c, said, about, error, value, text):
    """And nothing is said of what is not taken over anyway."""
    kept = c.nvm_report()
    kept.view, kept.state, kept.unknown, kept.missing = view(c), c.NVM_REFUSED, 2, 3
    ctypes.memmove(kept.about, about, len(about))
    kept.problem.error, kept.problem.value = getattr(c, f"ERROR_{error}"), value
    assert said(c.store_print_loaded, kept) == [
        "settings: slot A, save 7", f"error: settings refused, nothing has changed: {text}"]
