# SPDX-License-Identifier: MIT
"""The wires and the parts of docs/libero.md are the board's."""
import pytest
import wiring_page


def test_the_page_is_drawn_from_the_board_s_file():
    text = wiring_page.PAGE.read_text()
    assert wiring_page.page(text) == text, "run tests/tools/wiring_page.py"


@pytest.mark.parametrize("name", ("creative", "sk1"))
def test_each_pin_has_its_line_and_each_line_its_words(name):
    use, signals = wiring_page.use_of(name), wiring_page.project.toml("signals.toml")
    rows = wiring_page.wires.table(use, signals).splitlines()[2:]
    assert [row.split(" | ")[1] for row in rows] == [pin.package for pin in use.pins]
    assert len({tuple(row.split(" | ")[3:]) for row in rows}) == len(rows), "two pins with the same words"


def test_what_a_board_has_not_is_not_bought():
    signals = wiring_page.project.toml("signals.toml")
    bought = {name: wiring_page.wires.shopping(wiring_page.use_of(name), signals) for name in ("creative", "sk1")}
    assert "| 9 | resistor" in bought["creative"] and "| 6 | resistor" in bought["sk1"]
    assert "AD7356" in bought["creative"] and "AD7356" not in bought["sk1"] and "RS-485" not in bought["sk1"]
