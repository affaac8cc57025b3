# SPDX-License-Identifier: MIT
"""docs/cycles.md: its bounds add up, its hand-written parts stay, its summary is that of the committed figures."""
import json
from pathlib import Path

import cycles_page
import listing
import pytest
from pages import replaced

FIGURES = json.loads(Path("tests/bench/baseline.json").read_text())
PAGE = Path("docs/cycles.md")


def test_a_block_is_replaced_and_the_rest_kept():
    page = "by hand\n<!-- one: by a tool -->\nold\n<!-- end -->\nbetween\n<!-- two: by a tool -->\nstays\n<!-- end -->\nafter\n"
    assert replaced(page, "one", "new\n") == page.replace("old", "new")
    with pytest.raises(SystemExit, match="three"):
        replaced(page, "three", "new\n")


@pytest.mark.parametrize("row", cycles_page.lower_bounds())
def test_every_cycle_of_the_library_is_accounted_for(row):
    terms = cycles_page.lower_bounds()[row]
    assert cycles_page.total(terms["bound"]) + cycles_page.total(terms["above"]) == FIGURES[row]["cycles_max"]


def test_the_page_has_the_summary_of_the_committed_figures():
    page = PAGE.read_text()
    assert replaced(page, "summary", "\n".join(cycles_page.summary(FIGURES)) + "\n") == page, "run make bench"


def test_all_transforms_have_a_bound():
    kernels = {f"{name}_q15.registers" for name in ("clarke", "park", "invpark", "invclarke")}
    assert set(cycles_page.lower_bounds()) == {*cycles_page.LIBRARY, *kernels}


class _Sources:
    text = ["void FabricIrq0_IRQHandler(void)", "{", "a();", "/* stage: first */", "b();", "/* stage: second */", "c();"]

    def chain(self, address):
        return [("inline", "file.c", 99), ("step", "file.c", 50), ("FabricIrq0_IRQHandler", "file.c", address)]

    def line(self, path, number):
        return self.text[number - 1]


def test_stages():
    assert [cycles_page.stage_of(_Sources(), line) for line in (3, 5, 7)] == ["step", "first", "second"]


def test_a_line_of_the_loop():
    class Note:
        def note(self, step):
            return "c();"
    step = listing.Step(0, "ldr r0, [r1]", 2, listing.LOAD, "load: address, data")
    assert cycles_page.listed(step, Note()).split() == ["2", "ldr", "r0,", "[r1]", "load:", "address,", "data", "c();"]
