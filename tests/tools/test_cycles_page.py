# SPDX-License-Identifier: MIT
"""docs/cycles.md: its bounds add up, and its tables are those of the committed figures."""
import re
from pathlib import Path

import cycles_page
import listing
import pytest
from bench.report import baselines
from compiler import REFERENCE
from pages import replaced

FIGURES = baselines()[REFERENCE]
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
    assert cycles_page.with_summary(page, FIGURES) == page, "run make bench"


HANDLERS = ("assembly", "encoder_ab", "forced_ab", "injection_ab")


def test_the_page_has_the_committed_figures_of_the_handlers():
    told = re.findall(r"^\| (?:assembly|C): .*?\| (\d+) \|", PAGE.read_text(), re.M)
    assert [int(text) for text in told] == [FIGURES[f"handler.{name}.zero_wait"]["cycles_max"] for name in HANDLERS]


def test_the_handler_in_assembly_is_worth_its_keep():
    """At least 10 % quicker than the compiler's, or it goes; and the compiler's is good enough by itself."""
    assembly, compiled = (FIGURES[f"handler.{name}.zero_wait"]["cycles_max"] for name in HANDLERS[:2])
    assert compiled <= 255 and assembly <= 0.9 * compiled


def test_no_handler_takes_longer_for_other_data():
    for name in HANDLERS:
        row = FIGURES[f"handler.{name}.zero_wait"]
        assert row["cycles_min"] == row["cycles_max"]


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
    text, = listing.texts([listing.Step(0, "ldr r0, [r1]", 2, listing.LOAD, "load: address, data")], Note())
    assert text.split() == ["2", "ldr", "r0,", "[r1]", "load:", "address,", "data", "c();"]
