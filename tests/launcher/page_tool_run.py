# SPDX-License-Identifier: MIT
"""The page as a tool, on one drive in QEMU: settings, what is measured on plots, setting up, positions, two tabs."""
import re

import pytest
from browser import browsed, served

from scope import words
from tools.param_rows import meanings, param_rows


@pytest.fixture(scope="module")
def downloads(tmp_path_factory):
    return tmp_path_factory.mktemp("downloads")


@pytest.fixture(scope="module")
def page(tmp_path_factory, downloads):
    with served(tmp_path_factory.mktemp("scope")) as (address, _):
        with browsed(address, downloads) as shown:
            shown.wait(lambda: shown.script("return parameters.known.size") > 50)
            yield shown


def change(page, name, value):
    page.script("const field = fieldOf(arguments[0]); field.value = arguments[1]; field.onchange()", name, str(value))


def value(page, name):
    return int(page.script("return fieldOf(arguments[0]).value", name))


def drives(page, name):
    """What the drive itself says."""
    page.script("$('said').textContent = ''; say('get ' + arguments[0])", name)
    page.wait(lambda: re.search(rf"{name} = -?\d+", page.heard()))
    return int(re.search(rf"{name} = (-?\d+)", page.heard())[1])


def row(page, name):
    return page.script("return fieldOf(arguments[0]).closest('tr').textContent", name)


# ---- parameters ----

def test_each_parameter_is_in_one_group_with_its_meaning(page):
    names = [name for group in words.GROUPS.values() for name in group.split()]
    assert sorted(names) == sorted(param_rows()), "each once"
    shown = page.script("return [...document.querySelectorAll('#parameters details')].map((d) => [d.querySelector('table').ariaLabel,"
                        " [...d.querySelectorAll('input')].map((i) => i.name).join(' ')])")
    assert {group: set(members.split()) for group, members in shown} == {
        group: set(members.split()) for group, members in words.GROUPS.items()}
    for name, meaning in meanings().items():
        assert meaning in row(page, name), name


def test_what_differs_from_its_default_is_marked_and_goes_back(page):
    initial = param_rows()["deviation_pct"][2]
    group = "return fieldOf('deviation_pct').closest('details').querySelector('summary').textContent"
    differs = "return fieldOf('deviation_pct').closest('tr').className"
    assert page.script(differs) == "" and "not as by default" not in page.script(group)
    change(page, "deviation_pct", initial + 1)
    page.wait(lambda: page.script(differs) == "differs")
    assert "1 not as by default" in page.script(group)
    page.script("fieldOf('deviation_pct').closest('tr').querySelector('.default').click()")
    page.wait(lambda: page.script(differs) == "")
    assert drives(page, "deviation_pct") == initial == value(page, "deviation_pct")


def test_undo_goes_back_one_change_at_a_time(page):
    old = value(page, "home_rpm"), value(page, "home_pct")
    page.script("parameters.undo = []; undoable()")
    for name, new in (("home_rpm", -40), ("home_pct", 33)):
        change(page, name, new)
        page.wait(lambda name=name, new=new: page.script("return parameters.known.get(arguments[0]).value", name) == new)
    page.click("#undo")
    page.wait(lambda: value(page, "home_pct") == old[1])
    assert drives(page, "home_rpm") == -40, "the first change stays"
    page.wait(lambda: not page.script("return parameters.undoing"))
    page.click("#undo")
    page.wait(lambda: value(page, "home_rpm") == old[0] and page.script("return $('undo').disabled"))
    assert (drives(page, "home_rpm"), drives(page, "home_pct")) == old


def test_undo_that_is_refused_can_be_repeated(page):
    change(page, "home_turns", 11)
    page.wait(lambda: page.script("return parameters.known.get('home_turns').value") == 11)
    page.click("[data-line=on]")
    page.wait(lambda: page.state() == "operation enabled")
    page.click("#undo")
    page.wait(lambda: "undo: 0 changed, 1 refused:\nerror: parameters can change only while" in page.heard())
    assert "undo refused" in row(page, "home_turns") and value(page, "home_turns") == 11
    page.click("[data-line=off]")
    page.wait(lambda: page.state() == "switch on disabled")
    page.click("#undo")
    page.wait(lambda: value(page, "home_turns") == 10)


# ---- the file ----

def choose_file(page, path):
    page.script("$('said').textContent = ''")
    page.find("from_file").send_keys(str(path))
    page.wait(lambda: path.name in page.heard())
    return page.heard()


def test_settings_go_to_a_file_and_come_back(page, downloads):
    """All of them; and what is changed afterwards is as in the file again, and nothing else is touched."""
    change(page, "cyclic_ms", 17)
    page.wait(lambda: page.script("return parameters.known.get('cyclic_ms').value") == 17)
    page.click("#to_file")
    path = downloads / "settings.txt"
    page.wait(path.is_file)
    lines = path.read_text().splitlines()
    assert lines[0].startswith("# Teknic") and len(lines) == 1 + len(param_rows()) and "set cyclic_ms 17" in lines
    for name, new in (("cyclic_ms", 10), ("retry_count", 3)):
        change(page, name, new)
        page.wait(lambda name=name, new=new: page.script("return parameters.known.get(arguments[0]).value", name) == new)
    assert "from settings.txt: 2 changed" in choose_file(page, path)
    assert (drives(page, "cyclic_ms"), drives(page, "retry_count")) == (17, 0)
    assert "has these settings already" in choose_file(page, path)
    page.click("#undo")
    page.wait(lambda: value(page, "cyclic_ms") == 10 and value(page, "retry_count") == 3)  # a file is one step
    page.script("apply({ retry_count: 0 }, 'the test')")
    page.wait(lambda: value(page, "retry_count") == 0)


@pytest.mark.parametrize("text, why", [
    ("set cyclic_ms 20\nset cyclic 5\n", "line 2: this drive has no cyclic"),
    ("set cyclic_ms 0\n", "line 1: cyclic_ms must be 1...1000, not 0"),
    ("set cyclic_ms 20\nhello world\n", "line 2 is not 'set NAME VALUE': hello world"),
    ("set cyclic_ms 2.5\n", "line 1 is not 'set NAME VALUE': set cyclic_ms 2.5")])
def test_a_file_that_cannot_be_taken_changes_nothing(page, tmp_path, text, why):
    (tmp_path / "wrong.txt").write_text(text)
    assert f"error: wrong.txt, nothing has changed: {why}" in choose_file(page, tmp_path / "wrong.txt")
    assert drives(page, "cyclic_ms") == 10


def test_what_the_console_lists_is_a_file_too(page, tmp_path):
    (tmp_path / "got.txt").write_text("# as 'get all' shows it\ncyclic_ms = 12 ms  (1...1000)\n\n")
    assert "from got.txt: 1 changed" in choose_file(page, tmp_path / "got.txt")
    assert drives(page, "cyclic_ms") == 12


# ---- two tabs ----

def test_two_tabs_see_each_others_commands(page):
    page.script("$('said').textContent = ''")
    first = page.browser.current_window_handle
    page.browser.switch_to.new_window("tab")
    try:
        page.open()
        page.wait(lambda: page.script("return parameters.known.size") > 50)
        change(page, "home_rpm", 25)
        page.script("say('speed 77')")
        page.wait(lambda: "\n> speed 77\nerror: " in page.heard())
        page.browser.switch_to.window(first)
        page.wait(lambda: "another page > set home_rpm 25\nok\nanother page > speed 77\nerror: " in page.heard())
        page.wait(lambda: value(page, "home_rpm") == 25)
        page.click("#undo")  # also what another page has changed
        page.wait(lambda: value(page, "home_rpm") == 30)
        page.browser.switch_to.window(page.browser.window_handles[-1])
        page.wait(lambda: "another page: undo: 1 changed" in page.heard() and value(page, "home_rpm") == 30)
    finally:
        page.browser.switch_to.window(page.browser.window_handles[-1])
        page.browser.close()
        page.browser.switch_to.window(first)


def test_the_browser_found_nothing_wrong(page):
    assert not [entry for entry in page.browser.get_log("browser") if entry["level"] in ("SEVERE", "WARNING")]
