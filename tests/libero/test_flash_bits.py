# SPDX-License-Identifier: MIT
"""The flash bits that follow from this project's Libero parameters, by the rules of eleven public designs, are what
docs/silicon.md has; tests/bringup shows that the bring-up image says so."""
import pytest

from rigs import flash_bits
from silicon import facts


@pytest.mark.parametrize("design", flash_bits.PUBLIC["design"], ids=lambda design: design["source"].split("/")[-1])
def test_the_rules_make_of_a_public_design_what_it_has(design):
    assert flash_bits.words(design) == design["words"]


@pytest.mark.parametrize("rule, value", [("ALWAYS", ["ENVM0"]), ("FREQRNG", {"50": 2, "100": 5, "140": 6}),
                                         ("BASE_DIVISOR_WITHOUT_FIC", 0), ("ALWAYS_SINCE_11_8", ["TIMER"]), ("WITH", {})])
def test_another_rule_does_not(rule, value, monkeypatch):
    monkeypatch.setitem(flash_bits.PUBLIC, rule, value)
    assert any(flash_bits.words(design) != design["words"] for design in flash_bits.PUBLIC["design"])


@pytest.mark.parametrize("board", flash_bits.BOARDS)
def test_the_page_has_what_this_project_s_parameters_make(board):
    page = {name.split(":")[1]: fact.value for fact in facts.facts() for name in fact.code
            if name.startswith(("reset:", "power-on:"))}
    for register, word in flash_bits.at_start(flash_bits.of_board(board)).items():
        differs = facts.number(page[f"SYSREG.{register}"]) ^ word
        assert differs & ~(flash_bits.BY_THE_BOARD if register == "SOFT_RESET_CR" else 0) == 0, f"{register}: {word:#x}"
