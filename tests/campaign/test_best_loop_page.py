# SPDX-License-Identifier: MIT
"""docs/best-loop.md says what the model does, and what the twin has measured."""
import best_loop_page
import pytest


@pytest.mark.parametrize("block", ("fit", "swings", "told",
                                   *(pytest.param(name, marks=pytest.mark.night) for name in ("promise", "lots"))))
def test_the_page_says_what_the_model_does(block):
    text = best_loop_page.PAGE.read_text()
    made = best_loop_page.BLOCKS[block](*best_loop_page.evidence())
    assert best_loop_page.pages.replaced(text, block, made) == text, "run make best-loop"
