# SPDX-License-Identifier: MIT
"""Each task of the page from its start to its end, on a running drive, by the keyboard alone: Tab, Enter, arrows and typing."""
import re

import pytest
from browser import browsed, served

TAB, ENTER, ESCAPE, CONTROL = "\ue004", "\ue007", "\ue00c", "\ue009"


@pytest.fixture(scope="module")
def downloads(tmp_path_factory):
    return tmp_path_factory.mktemp("downloads")


@pytest.fixture(scope="module")
def page(tmp_path_factory, downloads):
    with served(tmp_path_factory.mktemp("scope")) as (address, _):
        with browsed(address, downloads) as shown:
            shown.wait(lambda: shown.script("return parameters.known.size") > 50)
            shown.script("document.activeElement.blur()")
            yield shown


def keys(page, text):
    """To whatever has the focus."""
    from selenium.webdriver.common.action_chains import ActionChains

    ActionChains(page.browser).send_keys(text).perform()


def reach(page, selector):
    """Tab, as often as the page has controls."""
    most = page.script("return document.querySelectorAll('a, button, input, select, summary, [tabindex]').length")
    for _ in range(2 * most):
        if page.script("return document.activeElement.matches(arguments[0])", selector):
            return
        keys(page, TAB)
    pytest.fail(f"{selector} is not reached by Tab: {page.script('return document.activeElement.outerHTML')}")


def press(page, selector):
    page.wait(lambda: page.script("return !document.querySelector(arguments[0]).disabled", selector))
    reach(page, selector)
    keys(page, ENTER)


def fill(page, selector, text):
    from selenium.webdriver.common.action_chains import ActionChains

    reach(page, selector)
    ActionChains(page.browser).key_down(CONTROL).send_keys("a").key_up(CONTROL).send_keys(str(text)).perform()


def go(page, task):
    press(page, f"nav a[href='#{task}']")
    page.wait(lambda: page.script("return document.body.dataset.shown") == task)


def turning(page):
    return float(re.search(r"speed: (-?[\d.]+) rpm", page.text("turning"))[1])


def test_operate(page):
    go(page, "operate")
    press(page, "[data-line=on]")
    page.wait(lambda: page.state() == "operation enabled")
    fill(page, "#speed", 400), press(page, "#run_speed")
    page.wait(lambda: abs(page.latest("speed") - 400) < 20)
    fill(page, "#speed", -200), keys(page, ENTER)  # in the field, too
    page.wait(lambda: abs(page.latest("speed") + 200) < 20)
    keys(page, ESCAPE)
    page.wait(lambda: page.state() == "switch on disabled")


def test_set_up(page):
    """From the limits to a motor that turns, by steps that open one another; the measurement is ended half-way."""
    go(page, "setup")
    if not page.script("return $('setup_limits').open"):
        press(page, "#setup_limits summary")
    press(page, "#limits_set")
    page.wait(lambda: page.script("return $('setup_identify').open"))
    press(page, "[data-line=identify]")
    page.wait(lambda: "'resistance'" in page.text("step"))
    keys(page, ESCAPE)
    page.wait(lambda: "ended in step" in page.text("identified"))
    press(page, "#setup_save summary"), press(page, "#setup_save [data-line=save]")
    page.wait(lambda: page.script("return $('setup_turn').open"))
    fill(page, "#start_rpm", 250), press(page, "#start")
    page.wait(lambda: abs(turning(page) - 250) < 20)
    press(page, "#stop")
    page.wait(lambda: page.state() == "switch on disabled")


def test_tune(page):
    go(page, "tune")
    press(page, "[data-line=on]")
    page.wait(lambda: page.state() == "operation enabled")
    fill(page, "#bode_amplitude", 0.4), keys(page, ENTER)
    page.wait(lambda: "phase margin: " in page.text("bode_said"))
    reach(page, "#step_kind"), keys(page, "speed")
    page.wait(lambda: page.script("return $('step_kind').value") == "speed")
    fill(page, "#step_size", 300), keys(page, ENTER)
    page.wait(lambda: page.text("step_said").startswith("rises"))
    press(page, "[data-line=quickstop]")
    page.wait(lambda: page.state() == "switch on disabled")


def test_captures(page, downloads):
    """Armed by keys, fired, read between cursors, and to a file."""
    go(page, "captures")
    press(page, "#arm")
    page.wait(lambda: "waits" in page.text("capture"))
    press(page, "[data-line='scope fire']")
    page.wait(lambda: page.script("return captured.rows.length") > 100)
    fill(page, "#cursor_a", 0.001), keys(page, TAB)
    press(page, "#save_capture")
    page.wait(lambda: (downloads / "capture.csv").is_file())
    assert page.script("return $('cursor_a').value") == "0.001"


def test_a_variable_of_the_image(page):
    go(page, "captures")
    fill(page, "#variable", "speed.integral")
    press(page, "#variable_show")
    page.wait(lambda: "integral" in page.script("return document.querySelector('#variable').closest('section').innerText"))


def test_parameters(page):
    go(page, "parameters")
    fill(page, "#filter", "speed_bw_hz")
    if not page.script("return fieldOf('speed_bw_hz').checkVisibility()"):
        press(page, "#parameters details:has(input[name=speed_bw_hz]) summary")
    fill(page, "#parameters input[name=speed_bw_hz]", 50), keys(page, ENTER)
    page.wait(lambda: page.script("return parameters.known.get('speed_bw_hz').value") == 50)
    press(page, "#undo")
    page.wait(lambda: page.script("return parameters.known.get('speed_bw_hz').value") == 60)


def test_log(page):
    go(page, "log")
    fill(page, "#line", "get speed_bw_hz"), keys(page, ENTER)
    page.wait(lambda: "speed_bw_hz = 60" in page.heard())


def test_the_browser_found_nothing_wrong(page):
    assert not [entry for entry in page.browser.get_log("browser") if entry["level"] in ("SEVERE", "WARNING")]
