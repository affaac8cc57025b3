# SPDX-License-Identifier: MIT
"""How the page looks: in three sizes, light and dark, for somebody who sees little, or nothing, or has no mouse."""
import itertools
import re

import axe
import pytest
from browser import browsed, served

SIZES = {1440: 900, 1024: 768, 390: 844}
LOOKS = list(itertools.product(SIZES, ("light", "dark")))
TASKS = ("operate", "setup", "tune", "captures", "parameters", "log")
LEAST_CONTRAST = 3.0  # of what is no text: WCAG 2.1, 1.4.11


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    with served(tmp_path_factory.mktemp("scope")) as (address, _):
        with browsed(address, tmp_path_factory.mktemp("downloads")) as shown:
            yield shown


@pytest.fixture(scope="module")
def program():
    return axe.program()


def look(page, width, scheme):
    preferred = {"name": "prefers-color-scheme", "value": scheme}
    page.browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": [preferred]})
    page.browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", {
        "width": width, "height": SIZES[width], "deviceScaleFactor": 1, "mobile": width < 500})
    page.wait(lambda: page.script("return [innerWidth, matchMedia('(prefers-color-scheme: dark)').matches]")
              == [width, scheme == "dark"])
    page.script("scrollTo(0, 0)")


def is_stale(page):
    return page.script("return document.body.classList.contains('stale')")


looks = pytest.mark.parametrize("width, scheme", LOOKS)


@looks
def test_nothing_for_axe(page, program, width, scheme):
    look(page, width, scheme)
    page.script("document.querySelectorAll('details').forEach((one) => { one.open = true; })")
    found = []
    for task in TASKS:
        page.go(task)
        for _ in range(5):  # a machine that is busy may leave the drive silent for a while, which is grey; what is wrong stays
            page.wait(lambda: not is_stale(page))
            wrong = axe.violations(page, program)
            if not wrong:
                break
        found += [f"{task}: {one}" for one in wrong]
    page.script("document.querySelectorAll('details').forEach((one) => { one.open = false; })")
    assert not found, "\n".join(found)


def test_axe_finds_a_field_without_a_name(page, program):
    page.go("operate")
    page.script("document.querySelector('#arguments').insertAdjacentHTML('afterend', '<input id=nameless>')")
    page.script("$('twin').hidden = false")
    found = axe.violations(page, program)
    page.script("$('nameless').remove()")
    assert any(one.startswith("label: ") and "nameless" in one for one in found)


def luminance(rgb):
    parts = [c / 255 for c in rgb]
    linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in parts]
    return sum(k * c for k, c in zip((0.2126, 0.7152, 0.0722), linear))


def contrast(one, other):
    low, high = sorted(luminance(c) for c in (one, other))
    return (high + 0.05) / (low + 0.05)


# seven currents in one plot, each at a height of its own
SEVEN = "i_a,i_b,i_c,i_d,i_q,i_d_ref,i_q_ref"
DRAW = """live.held = true;
live.plots.graphs.forEach(({ dygraph }) => dygraph.updateOptions({ strokeWidth: 4 })); // thinner ones have edges only
live.plots.draw([...Array(100).keys()].map((k) => [k / 1000, ...live.names.map((_, n) => n)]));"""

COLOURS = """
const ground = getComputedStyle(document.body).backgroundColor, curves = [];
for (const { dygraph } of live.plots.graphs) {
  const canvas = dygraph.hidden_, pixels = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height).data;
  const seen = new Set();
  for (let k = 0; k < pixels.length; k += 4) if (pixels[k + 3] > 250) seen.add([...pixels.slice(k, k + 3)].join());
  dygraph.getColors().forEach((name) => {
    const rgb = [1, 3, 5].map((at) => parseInt(name.slice(at, at + 2), 16));
    curves.push([name, rgb, [...seen].some((one) => one.split(',').every((v, k) => Math.abs(v - rgb[k]) < 12))]);
  });
}
return [ground.match(/\\d+/g).map(Number), curves, colour('curve-8')];
"""


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_every_curve_stands_out(page, scheme):
    """Each colour that a plot is to use is on its canvas, and has enough contrast to the ground."""
    page.open()  # axe may have kept it busy for so long that it has lost its line
    page.script(f"live.names = []; say('scope signals {SEVEN},speed')")
    page.wait(lambda: page.script("return live.names.length") == 8)
    look(page, 1440, scheme)
    page.script(DRAW)
    ground, curves, eighth = page.script(COLOURS)
    page.script("live.held = false")
    assert len(curves) == 8 and all(seen for *_, seen in curves), curves
    assert len({name for name, *_ in curves}) == 7, "seven currents, seven colours"
    curves.append([eighth, [int(eighth[k:k + 2], 16) for k in (1, 3, 5)], True])
    low = {name: round(contrast(rgb, ground), 2) for name, rgb, _ in curves if contrast(rgb, ground) < LEAST_CONTRAST}
    assert not low, f"on {ground}: {low}"


def test_live_plots_are_above_the_fold(page):
    """With the signals that are chosen from the start, in a window of 1440 x 900."""
    look(page, 1440, "light")
    page.script("live.names = []; say('scope signals i_d,i_q,i_q_ref,vbus,speed,speed_ref,v_q,angle')")
    page.wait(lambda: page.script("return live.names[3]") == "vbus")
    boxes = page.script("return [...document.querySelectorAll('#live .curves')].map((c) => c.getBoundingClientRect().toJSON())")
    assert len(boxes) == 5 and all(box["height"] >= 80 and box["width"] > 700 for box in boxes), boxes
    drawn = page.script("return live.plots.graphs.map((g) => g.dygraph.size().height)")
    assert all(abs(height - box["height"]) < 2 for height, box in zip(drawn, boxes)), f"{drawn} is drawn in {boxes}"
    head = page.script("return $('main').getBoundingClientRect().top")
    assert all(head <= box["top"] and box["bottom"] <= 900 for box in boxes), boxes


def places(page):
    return page.script("return [...document.querySelectorAll('section, nav a, #stop, #numbers b')].map((s) => {"
                       " const box = s.getBoundingClientRect(); return [s.id || s.className, box.left, box.top]; })")


@pytest.mark.parametrize("width", SIZES)
def test_all_stays_where_it_is(page, width):
    """A fault and answers come and go; nothing beside them moves, or lies below them."""
    look(page, width, "light")
    page.go("operate")
    told = "stateCame({ state: 'fault', fault: 'x', since: 'then', hint: Array(30).fill('a long story'), lines: shown_lines })"
    page.script("window.shown_lines = $('status').textContent.split('\\n'); window.kept = takes.status;"
                "takes.status = () => {}")
    page.script("stateCame({ state: 'switch on disabled', fault: 'none', since: '', hint: [], lines: shown_lines })")
    before = places(page)
    page.script(f"{told}; for (let k = 0; k < 40; k++) log('much is said')")
    assert places(page) == before and len(before) >= 16
    end, start = page.script("return ['main', '.news'].map((one) => document.querySelector(one).getBoundingClientRect())"
                             ".map((box) => [box.left, box.top, box.right, box.bottom])")
    assert start[2] <= end[0] or start[1] >= end[3], "the fault has a place of its own"
    for name in ("stop", "word", "numbers"):
        box = page.find(name).rect
        assert box["y"] >= 0 and box["y"] + box["height"] <= SIZES[width], (name, box)
    page.script("takes.status = kept")


def test_an_address_names_the_task(page):
    look(page, 1440, "light")
    for task in TASKS:
        page.script("location.hash = arguments[0]", task)
        page.wait(lambda task=task: page.script("return document.body.dataset.shown") == task)
        shown = page.script("return [...document.querySelectorAll('section')].filter((one) => one.checkVisibility())"
                            ".every((one) => one.dataset.task.split(' ').includes(arguments[0]))", task)
        assert shown and page.script("return document.querySelector('[aria-current=page]').hash") == f"#{task}"
        below = page.script("return [...document.querySelectorAll('main .curves')].filter((one) => one.checkVisibility()"
                            " && !one.closest('#fft')).map((one) => one.getBoundingClientRect().bottom)")
        assert all(bottom <= 900 for bottom in below), f"{task}: a plot below the fold"


def test_what_the_state_does_not_allow_says_why(page):
    page.go("operate")
    page.wait(lambda: page.state() == "switch on disabled")
    first = "the drive is off: switch it on first"
    for selector, why in (("#run_speed", first), ("[data-line=quickstop]", "the drive is off already"),
                          ("[data-line=clear]", "there is no fault"), ("[data-line=on]", "")):
        assert page.script("const one = document.querySelector(arguments[0]); return [one.disabled, one.title]", selector) == [
            bool(why), why], selector
    assert first in page.script("return $('run_speed').closest('section').querySelector('.why').innerText")
    page.script("$('speed').value = -1500; $('speed').dispatchEvent(new Event('input'))")
    assert page.text("run_speed") == "run at -1500 rpm"


def test_numbers_are_the_drives(page):
    """With unit and limit; the share of the limit is that of the vector of currents."""
    shown = page.script("return numbersOf(['speed: -1500.250 rpm, reference 0.000 rpm',"
                        " 'current: d 3.000 A, q -4.000 A, reference', 'bus: 24.061 V, winding: 41 degC'])")
    top, most, hot = page.script("return ['speed_max_rpm', 'i_max_ma', 't_max_c'].map((name) =>"
                                 " parameters.known.get(name).value)")
    assert [row[:3] for row in shown] == [["speed", "rpm", -1500.25], ["current q", "A", -4], ["bus", "V", 24.061],
                                          ["winding", "°C", 41]]
    assert [row[5] for row in shown[:2]] == pytest.approx([1500.25 / top, 5000 / most])
    assert str(top) in shown[0][4] and shown[3][5] == (pytest.approx(41 / hot) if hot else 0)
    assert page.script("parameters.known.set('flux_uwb', { value: 7000 }); parameters.known.set('pole_pairs', { value: 4 });"
                       "parameters.known.set('ld_uh', { value: 200 }); parameters.known.set('lq_uh', { value: 300 });"
                       "const t = torqueOf(-2, 3); send({ kind: 'parameters' }); return t") == pytest.approx(18 * 7.2e-3)


def test_the_keyboard_reaches_all(page):
    """Tab comes to every control that is shown, and where it is can be seen."""
    look(page, 1440, "light")
    page.script("document.activeElement.blur(); window.reached = new Set(); window.unseen = [];"
                "document.addEventListener('focusin', (event) => { reached.add(event.target);"
                " if (getComputedStyle(event.target).outlineStyle === 'none') unseen.push(event.target.outerHTML); })")
    for task in TASKS:
        page.go(task)
        count = page.script("return [...document.querySelectorAll('a, button, input, select, summary')]"
                            ".filter((one) => one.checkVisibility()).length")
        page.script("document.activeElement.blur()")
        page.browser.switch_to.active_element.send_keys("\ue004" * (count + 20))
        assert_reached(page)
    assert not page.script("return unseen")


def assert_reached(page):
    missed = page.script("return [...document.querySelectorAll('a, button, input, select, summary')].filter((one) =>"
                         " one.checkVisibility() && !one.disabled && !reached.has(one))"
                         ".map((one) => one.outerHTML.slice(0, 120))")
    assert not missed


def test_an_address_without_its_last_slash(page):
    page.browser.get(page.address.rstrip("/"))
    page.wait(lambda: page.script("return live.rows.length") > 50)
    assert page.browser.current_url == page.address and re.match("Teknic", page.text("title"))
