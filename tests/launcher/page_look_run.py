# SPDX-License-Identifier: MIT
"""How the page looks: in three widths, light and dark, for somebody who sees little, or nothing, or has no mouse."""
import itertools
import re

import axe
import pytest
from browser import browsed, served

SIZES = {1440: 900, 768: 1024, 390: 844}
LOOKS = list(itertools.product(SIZES, ("light", "dark")))
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
def test_nothing_serious_for_axe(page, program, width, scheme):
    look(page, width, scheme)
    page.script("document.querySelectorAll('details').forEach((one) => { one.open = true; })")
    for _ in range(5):  # a machine that is busy may leave the drive silent for a while, which is grey; what is wrong stays
        page.wait(lambda: not is_stale(page))
        found = axe.violations(page, program)
        if not found:
            break
    page.script("document.querySelectorAll('details').forEach((one) => { one.open = false; })")
    assert not found, "\n".join(found)


def test_axe_finds_a_field_without_a_name(page, program):
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
    assert len(boxes) == 5 and all(box["height"] >= 80 and box["width"] > 800 for box in boxes), boxes
    drawn = page.script("return live.plots.graphs.map((g) => g.dygraph.size().height)")
    assert all(abs(height - box["height"]) < 2 for height, box in zip(drawn, boxes)), f"{drawn} is drawn in {boxes}"
    head = page.script("return document.querySelector('header').getBoundingClientRect().bottom")
    assert all(head <= box["top"] and box["bottom"] <= 900 for box in boxes), boxes


def places(page):
    return page.script("return [...document.querySelectorAll('section')].map((s) => { const box = s.getBoundingClientRect();"
                       " return [s.getAttribute('aria-labelledby'), box.left, box.top]; })")


def test_sections_stay_where_they_are(page):
    """A fault, answers and what was measured come and go; nothing above or beside them moves."""
    look(page, 1440, "light")
    before = places(page)
    page.script("$('fault').textContent = 'a\\nlong\\nstory'; $('fault').hidden = false")
    page.script("for (let k = 0; k < 40; k++) log('much is said')")
    assert places(page) == before and len(before) >= 6
    page.script("$('fault').hidden = true")


def test_the_keyboard_reaches_all(page):
    """Tab comes to every control that is shown, and where it is can be seen."""
    look(page, 1440, "light")
    page.script("document.activeElement.blur(); window.reached = new Set(); window.unseen = [];"
                "document.addEventListener('focusin', (event) => { reached.add(event.target);"
                " if (getComputedStyle(event.target).outlineStyle === 'none') unseen.push(event.target.outerHTML); })")
    count = page.script("return document.querySelectorAll('button, input, select, summary').length")
    page.browser.switch_to.active_element.send_keys("\ue004" * (count + 20))
    missed = page.script("return [...document.querySelectorAll('button, input, select, summary')].filter((one) =>"
                         " one.checkVisibility() && !one.disabled && !reached.has(one))"
                         ".map((one) => one.outerHTML.slice(0, 120))")
    assert not missed and not page.script("return unseen")


def test_an_address_without_its_last_slash(page):
    page.browser.get(page.address.rstrip("/"))
    page.wait(lambda: page.script("return live.rows.length") > 50)
    assert page.browser.current_url == page.address and re.match("Teknic", page.find("title").text)
