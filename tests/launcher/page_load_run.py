# SPDX-License-Identifier: MIT
"""What the page costs this machine while it is kept open: eight signals live, captures of 10 000 points of each.

An hour is played in two halves, each by its own factor: PAGE_S (20) seconds at the rate of the twin's stream, at least 100 Hz,
for the processor, 1/180 of the hour; and all samples of an hour at 100 Hz, as fast as the page takes them, for the memory.
`make page-hour` plays the first for an hour, too.
"""
import os
import time
from pathlib import Path

import pytest
from browser import browsed, served

SECONDS = float(os.environ.get("PAGE_S") or 20)
MOST_SHARE = 0.15       # of a core, of all threads of the page's process
HOUR, HZ = 3600, 100
CAPTURES, POINTS = 8, 10000
GROWS = 1.15, 2 << 20   # the heap between half of an hour and all of it: share, bytes
MOST_HEAP = 64 << 20    # one such capture has 80 000 numbers


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    with served(tmp_path_factory.mktemp("scope")) as (address, _):
        with browsed(address, tmp_path_factory.mktemp("downloads")) as shown:
            shown.browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", {
                "width": 1440, "height": 900, "deviceScaleFactor": 1, "mobile": False})
            yield shown


def renderer(page):
    """The process that runs the page, among those of its browser."""
    below, found = [str(page.browser.service.process.pid)], []
    while below:
        process = Path("/proc") / below.pop()
        for thread in (process / "task").iterdir():
            below += (thread / "children").read_text(encoding="ascii").split()
        if b"--type=renderer" in (process / "cmdline").read_bytes():
            found.append(process.name)
    return max(found, key=used_s)


def used_s(process):
    with open(f"/proc/{process}/stat", encoding="ascii") as stat:
        user, system = stat.read().rsplit(")", 1)[1].split()[11:13]
    return (int(user) + int(system)) / os.sysconf("SC_CLK_TCK")


def heap(page):
    """Bytes that are in use, without what is waste already."""
    page.browser.execute_cdp_cmd("HeapProfiler.collectGarbage", {})
    page.browser.execute_cdp_cmd("Performance.enable", {})
    metrics = page.browser.execute_cdp_cmd("Performance.getMetrics", {})["metrics"]
    return next(one["value"] for one in metrics if one["name"] == "JSHeapUsedSize")


def test_live_plots_leave_the_processor_to_others(page):
    page.click("[data-line=on]")
    page.wait(lambda: page.state() == "operation enabled")
    page.script("say('speed 1500')")
    page.wait(lambda: abs(page.latest("speed") - 1500) < 20 and len(page.script("return live.names")) == 8)
    process = renderer(page)
    begun, before, samples = time.monotonic(), used_s(process), page.script("return live.time")
    time.sleep(SECONDS)
    passed = time.monotonic() - begun
    share, hz = (used_s(process) - before) / passed, (page.script("return live.time") - samples) * 1000 / passed
    print(f"\n{share:.1%} of a core, eight signals at {hz:.0f} Hz, {passed:.0f} s; an hour by a factor of {HOUR / passed:.0f}")
    assert hz >= HZ and page.script("return live.plots.isSeen() && !live.held")
    assert share <= MOST_SHARE


def test_an_hour_of_samples_and_captures_stay_within_bounds(page):
    """Every sample of an hour through where they come in, drawn now and then; captures of 10 000 points after another."""
    page.script("""window.rest = takes.samples; takes.samples = () => {}; // the twin's own
        const points = arguments[0]; let at = live.last ?? 0;
        window.sample = () => { at = (at + 10) & 0xffff; return [at, ...live.names.map(() => Math.random())]; };
        window.hours = (rows) => { for (let k = 0; k < rows; k += 10) {
          samplesCame([...Array(10).keys()].map(sample));
          if (k % 5000 === 0) draw(); } };
        window.captures = (count) => { for (let k = 0; k < count; k++) {
          const rows = [...Array(points).keys()].map((n) => live.names.map((_, c) => Math.sin(n / 50 + c + k)));
          captureCame({ names: live.names, trigger: 0, per_ms: 20, rows }); } };""", POINTS)
    page.go("captures")
    seen = []
    for _ in range(2):
        page.script("live.held = false; hours(arguments[0]); captures(arguments[1])", HOUR * HZ // 2, CAPTURES // 2)
        seen.append((heap(page), page.script("return document.querySelectorAll('*').length")))
    (half, elements), (whole, elements_whole) = seen
    print(f"\n{half / 1e6:.1f} and {whole / 1e6:.1f} MB of heap after half an hour's samples and all of them")
    assert page.script("return live.rows.length") <= 4000 and page.script("return captured.rows.length") == POINTS
    assert whole < half * GROWS[0] + GROWS[1] and whole < MOST_HEAP and elements_whole <= elements + 5
    page.script("takes.samples = rest")
    page.click("#stop")
