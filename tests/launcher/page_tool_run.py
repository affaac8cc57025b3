# SPDX-License-Identifier: MIT
"""The page as a tool, on one drive in QEMU: settings, what is measured on plots, setting up, positions, two tabs."""
import re

import numpy as np
import pytest
from browser import CAPACITY, browsed, served

from scope import words
from rows import param_rows, remarks, texts


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
    shown = page.script("return [...document.querySelectorAll('#parameters details')].map((d) => ["
                        "d.querySelector('table').ariaLabel, [...d.querySelectorAll('input')].map((i) => i.name).join(' ')])")
    assert {group: set(members.split()) for group, members in shown} == {
        group: set(members.split()) for group, members in words.GROUPS.items()}
    for name, what in texts().items():
        assert what in row(page, name) and remarks()[name][1] in row(page, name), name


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
    for ms, line in ((12, "cyclic_ms = 12 ms  (1...1000)"), (13, "set cyclic_ms 13")):  # 'get all', 'get --changed'
        (tmp_path / "got.txt").write_text(f"# as the console shows it\n{line}\n\n")
        assert "from got.txt: 1 changed" in choose_file(page, tmp_path / "got.txt")
        assert drives(page, "cyclic_ms") == ms


# ---- what is measured ----

def test_values_at_and_between_cursors(page):
    """As numpy has them, of a capture of a running drive; the plot shows where the cursors stand."""
    page.go("captures")
    page.arm("i_q", "never", 0)
    page.click("[data-line='scope fire']")
    shown = page.until_captured()
    time, i_q = np.array(shown["time"]), np.array(shown["i_q"])
    a, b = time[10], time[400]
    page.script("$('measure_on').value = 'captured'; $('measure_on').onchange();"
                "$('cursor_a').value = arguments[0]; $('cursor_b').value = arguments[1]; $('cursor_a').oninput()", a + 2e-6, b)
    rows = page.script("return [...$('measured').rows].map((row) => [...row.cells].map((cell) => cell.textContent))")
    heading, found = rows[0][1:], {row[0]: [float(x) for x in row[1:]] for row in rows[1:]}
    inside = i_q[11:401]
    wanted = {"at A": i_q[10], "at B": i_q[400], "B - A": i_q[400] - i_q[10], "mean": inside.mean(),
              "rms": np.sqrt((inside ** 2).mean()), "least": inside.min(), "most": inside.max(), "span": np.ptp(inside)}
    assert heading == list(wanted) and set(found) == {f"{name} [{unit}]" if unit else name for name, unit in page.script(
        "return captured.names.map((name, k) => [name, captured.units[k]])")}
    assert found["i_q [A]"] == pytest.approx(list(wanted.values()), rel=1e-4, abs=1e-9)
    assert page.text("between").startswith(f"B - A: {b - a - 2e-6:.5g} s")
    assert set(page.script("return Object.keys(captured.plots.lines)")) == {"mark", "cursor-a", "cursor-b"}


def test_a_click_sets_a_cursor(page):
    at = "const g = captured.plots.graphs[0].dygraph; g.getFunctionOption('clickCallback').call(g, {shiftKey: %s}, %s, [])"
    page.script(at % ("false", 0.001))
    page.script(at % ("true", 0.003))
    assert page.script("return [$('cursor_a').value, $('cursor_b').value]") == ["0.001", "0.003"]
    page.click("#between_cursors")
    assert page.script("return captured.plots.graphs.map((g) => g.dygraph.xAxisRange())") == [[0.001, 0.003]] * page.script(
        "return captured.plots.graphs.length")
    page.click("#all")
    low, high = page.script("return captured.plots.graphs[0].dygraph.xAxisRange()")
    assert low <= -0.005 and high > 0.02


def test_all_plots_have_one_axis_of_time_and_one_cursor(page):
    drawn = page.script("return captured.plots.graphs.map((g) => g.dygraph.getOptionForAxis('drawAxis', 'x'))")
    assert drawn == [False] * (len(drawn) - 1) + [True] and len(drawn) > 3
    edges = page.script("return captured.plots.graphs.map((g) => [g.dygraph.getArea().x, g.dygraph.getArea().w])")
    assert len(set(map(tuple, edges))) == 1, "the same time above the same"
    page.script("captured.plots.graphs[1].dygraph.setSelection(7, undefined, false, true)")
    assert page.script("return captured.plots.graphs.map((g) => g.dygraph.getSelection())") == [7] * len(drawn)
    page.script("const g = captured.plots.graphs[1].dygraph; g.updateOptions({ dateWindow: [0.002, 0.004] });"  # as a drag
                "g.getFunctionOption('zoomCallback').call(g, 0.002, 0.004, [])")
    assert page.script("return captured.plots.graphs.map((g) => g.dygraph.xAxisRange())") == [[0.002, 0.004]] * len(drawn)
    page.script("captured.plots.graphs[2].dygraph.resetZoom()")  # as a double click
    low, high = page.script("return captured.plots.graphs[0].dygraph.xAxisRange()")
    assert low <= -0.005 and high > 0.02


def test_what_was_drawn_while_it_was_hidden_fits_when_it_is_shown(page):
    page.go("log")
    page.script("drawCapture();"
                "drawBode(Array.from({ length: 9 }, (_, k) => `${100 * 2 ** k}.0 Hz: 0.9, -${9 * k + 9}.0 deg`))")
    for task, places in (("captures", "#captured .curves"), ("tune", "#bode .curves")):
        page.go(task)
        boxes = page.script("return [...document.querySelectorAll(arguments[0])].map((one) => [one.clientWidth,"
                            " one.parentElement.clientWidth, one.querySelector('canvas').getBoundingClientRect().width])",
                            places)
        assert boxes and all(abs(width - room) < 2 and abs(width - drawn) < 2 for width, room, drawn in boxes), boxes
    page.go("captures")


def test_numbers_are_told_as_engineers_read_them(page):
    for x, unit, between, told in (
            (0.005, "s", [-0.005, 0.02], "5 ms"), (1200, "A", [0, 1300], "1.2 kA"), (-5e-10, "A", [-1, 1], "0 A"),
            (0.2, "A", [-0.25, 0.25], "200 mA"), (12.25, "s", [12, 12.5], "12.25 s"), (24.01, "V", [24, 24.02], "24.01 V"),
            (1500, "rpm", [0, 1500], "1500 rpm"), (8000, "Hz", [100, 8000], "8 kHz"), (3, "", [0, 7], "3"),
            (0, "A", [0, 0], "0 A")):
        assert page.script("return engineering(...arguments)", x, unit, between) == told
    ticks = page.script("return [...document.querySelectorAll('#captured .dygraph-axis-label')].map((one) => one.textContent)")
    assert ticks and not [one for one in ticks if "e-" in one] and any(one.endswith(" ms") for one in ticks), ticks


def test_nothing_that_is_there_is_missing_from_a_plot(page):
    """Of more samples than pixels: one that stands out, and the span of what is faster than the pixels, at each of them."""
    rows = """const rows = [...Array(20000).keys()].map((k) => [k / 1000, k === 12345 ? 7 : 0,
        Math.sin(237.3 * 2 * Math.PI * k / 1000), (k * 0.18) % 360]);
        const angles = [false, false, true], found = broken(reduced(rows, 500, angles), angles);"""
    found = np.array(page.script(rows + "return found.map((row) => row.map((x) => (Number.isNaN(x) ? null : x)))"), dtype=float)
    assert 900 < len(found) <= 1004 and np.all(np.diff(found[:, 0]) > 0) and sorted(found[:, 1])[-2:] == [0, 7]
    assert all(low < -0.9 < 0.9 < high for low, high in np.sort(found[2:998, 2].reshape(-1, 2))), "a mean or a draw would beat"
    steps = np.diff(found[:, 3])
    assert np.nanmin(steps) >= 0 and np.isnan(found[:, 3]).sum() == 9, "a turn ends, and nothing leads back"
    page.script("live.held = true; live.plots.layout(['angle'], ['deg'], [1]);"
                "live.plots.draw([...Array(3000).keys()].map((k) => [k / 1000, (k * 60) % 360]))")
    assert page.script("return live.plots.graphs[0].dense") == pytest.approx(1000 / 6, rel=0.01), "turns a second, no comb"
    page.script("live.held = false; watch(live.names)")


def test_two_captures_on_top_of_each_other(page):
    before = page.captured()
    page.click("#compare")
    page.type("#every", 2)
    page.arm("i_q", "never", 0)
    page.click("[data-line='scope fire']")
    now = page.until_captured()
    names, file = page.script("const { columns, dygraph } = captured.plots.graphs.find((g) => g.unit === 'A');"
                              "return [dygraph.getLabels(), captured.plots.rows]")
    assert {"i_q", "i_q before"} <= set(names) and "i_q before" not in now
    known = page.script("return captured.names")
    at = len(known) + known.index("i_q") + 1
    for row in (100, 150, 300):
        k = int(np.argmin(np.abs(np.array(before["time"]) - now["time"][row])))
        assert file[row][at] == before["i_q"][k] and file[row][0] == now["time"][row]
    assert file[-1][at] is None, "it had ended by then"
    page.click("#compare")
    labels = page.script("return captured.plots.graphs.flatMap((g) => g.dygraph.getLabels())")
    assert not [name for name in labels if name.endswith("before")]
    page.type("#every", 1)


def test_a_picture_of_the_plots(page, downloads):
    page.click("#picture_capture")
    page.wait(lambda: (downloads / "capture.png").is_file())
    assert (downloads / "capture.png").read_bytes().startswith(b"\x89PNG\r\n")
    colours, width, shown = page.script("""const made = pictureOf($('captured')), seen = new Set();
        const pixels = made.getContext('2d').getImageData(0, 0, made.width, made.height).data;
        for (let k = 0; k < pixels.length; k += 4) seen.add(pixels.slice(k, k + 3).join());
        return [seen.size, made.width, $('captured').clientWidth * devicePixelRatio]""")
    assert colours > 20 and abs(width - shown) < 2


def test_ranges(page):
    """Automatic: noise does not fill the plot, whatever the signal does it is inside; and one that somebody has set."""
    span = "return captured.plots.graphs.find((g) => g.unit === 'A').dygraph.yAxisRange()"
    low, high = page.script(span)
    shown = page.captured()
    assert high - low > 0.3, "23.6 A in 512 of 32768 steps"
    assert low < min(shown["i_q"]) and max(shown["i_q"]) < high
    page.type("#range_of", "A"), page.type("#range_least", -3), page.type("#range_most", 5)
    page.click("#range_set")
    assert page.script(span) == [-3, 5]
    page.type("#range_most", -4), page.click("#range_set")
    assert page.text("range_said") == "the lower one first"
    page.click("#range_auto")
    assert page.script(span) == pytest.approx([low, high])


def test_the_spectrum_is_the_transform(page):
    """Of noise, as numpy has it; of a sine between two lines and its harmonic, their amplitudes within the window's error."""
    noise = np.random.default_rng(1).normal(size=300)
    found = np.array(page.script("return spectrum(arguments[0], 1000)", noise.tolist()))
    last = noise[-256:]
    window = 1 - np.cos(2 * np.pi * np.arange(256) / 256)
    wanted = np.abs(np.fft.fft((last - last.mean()) * window))[:128] * 2 / 256
    assert found[:, 0] == pytest.approx(np.arange(128) * 1000 / 256) and found[:, 1] == pytest.approx(wanted, abs=1e-12)
    t = np.arange(512) / 20000
    sine = 3 + 2 * np.sin(2 * np.pi * 625 * t) + 0.5 * np.sin(2 * np.pi * 3125 * t)
    lines = dict(page.script("return spectrum(arguments[0], 20000)", sine.tolist()))
    assert lines[625] == pytest.approx(2, rel=1e-6) and lines[3125] == pytest.approx(0.5, rel=1e-6) and lines[0] < 1e-9
    page.script("captured.rows = arguments[0].map((v, k) => [k / 20000, ...captured.names.map(() => v)]);"
                "$('fft_of').value = 'i_q'", sine.tolist())
    page.click("#fft_now")
    assert page.text("fft_peak").startswith("most: 2 A at 625 Hz, lines 39.06")


def test_vectors(page):
    page.go("operate")
    page.script("live.names = []; say('scope signals i_d,i_q,v_d,v_q,speed')")
    page.wait(lambda: page.script("return live.names.length") == 5)
    page.script("$('vector_view').open = true; live.held = true; live.rows = [[0, 3, 4, -5, 12, 0]]; drawVectors()")
    assert page.text("vector_i_text") == "i: 5 A, 53 degrees from d; ring 10.65 A"
    assert page.text("vector_v_text") == "v: 13 % of bus, 113 degrees from d; ring 57.735 % of bus"
    tip = """const scale = 0.9 * 110 / 10.65 * 0.8;
             const place = (d, q) => Math.round(110 - q * scale) * 220 + Math.round(110 + d * scale);
             const seen = $('vector_i').getContext('2d').getImageData(0, 0, 220, 220).data;
             return [[3, 4], [-3, 4]].map(([d, q]) => seen[4 * place(d, q) + 3])"""
    drawn, mirrored = page.script(tip)
    assert drawn == 255 and mirrored == 0, "d to the right, q upwards"
    page.script("live.held = false; live.names = []; say('scope signals i_q,speed')")
    page.wait(lambda: "not both among the signals" in page.text("vector_i_text"))
    page.script("$('vector_view').open = false")


def test_the_factor_against_real_time(page):
    half = "const p = new Pace(); for (let k = 0; k < 100; k++) p.note(k * 0.05, k * 0.1); return p.factor()"
    assert page.script(half) == pytest.approx(0.5) and page.script("return new Pace().factor()") is None
    page.wait(lambda: re.fullmatch(r"\d\.\d\d of real time", page.text("pace")))
    fed = page.script("return [pace.pairs.at(-1)[0] === live.time, performance.now() / 1000 - pace.pairs.at(-1)[1]]")
    assert fed[0] and 0 <= fed[1] < 60, "from the samples' own times, and the clock"


# ---- setting up ----

def test_limits_that_are_refused_are_shown_and_those_that_are_taken_lead_on(page):
    trip = value(page, "i_trip_ma")
    page.go("setup")
    page.script("$('setup_limits').open = true")
    page.wait(lambda: re.fullmatch(r"2\d\.\d+ V", page.text("bus")))
    page.script("limitOf('i_trip_ma').value = 3000000")
    page.click("#limits_set")
    page.wait(lambda: page.text("limits_said") == "error: i_trip_ma must be 10...2000000 mA")
    assert page.script("return [limitOf('i_trip_ma').value, $('setup_identify').open]") == [str(trip), False]
    page.script("limitOf('i_trip_ma').value = arguments[0]", trip - 100)
    page.click("#limits_set")
    page.wait(lambda: page.script("return $('setup_identify').open && !$('setup_limits').open"))
    assert drives(page, "i_trip_ma") == trip - 100
    page.click("#undo")
    page.wait(lambda: value(page, "i_trip_ma") == trip)


def test_saved_and_turning(page):
    page.script("$('setup_save').open = true")
    page.click("#setup_save [data-line=save]")
    page.wait(lambda: page.script("return $('setup_turn').open"))
    assert "slot A, save 1" in page.heard()
    page.type("#start_rpm", 250)
    page.click("#start")
    page.wait(lambda: re.match(r"speed: 2[45]\d\.\d+ rpm, reference 250", page.text("turning")))


# ---- positions ----

def where(page):
    """(mode, counts, target or None, homed), as the page shows it."""
    found = re.match(r"mode: (\w+) .*position: (-?\d+)(?:, target (-?\d+))?.* counts(, homed)?$", page.text("position"))
    return found and (found[1], int(found[2]), found[3] and int(found[3]), bool(found[4]))


def test_positions_and_homing(page):
    page.go("operate")
    page.script("$('counts').value = 8000")
    page.click("#to button[value='by ']")
    page.wait(lambda: where(page)[0] == "pp" and abs(where(page)[1] - where(page)[2]) <= 2)
    page.script("$('counts').value = arguments[0]", where(page)[2] - 3000)
    page.click("#to button[value='']")
    target = where(page)[2] - 3000
    page.wait(lambda: where(page)[2] == target and abs(where(page)[1] - target) <= 2)
    page.click("#home")
    page.wait(lambda: where(page)[0] == "pp" and where(page)[3] and abs(where(page)[1]) <= 2)


def test_the_shaft_turns_as_long_as_a_button_is_held(page):
    from selenium.webdriver.common.action_chains import ActionChains

    page.script("live.names = []; say('scope signals i_q,speed,speed_ref')")
    page.wait(lambda: page.script("return live.names.length") == 3)
    page.type("#jog_rpm", 90)
    mouse = ActionChains(page.browser)
    mouse.click_and_hold(page.find("jog_back")).perform()
    page.wait(lambda: page.latest("speed") < -70)
    mouse.release().perform()
    page.wait(lambda: page.latest("speed_ref") == 0)
    assert "> speed -90\nok\n> speed 0\nok" in page.heard()
    page.script("$('jog_on').dispatchEvent(new KeyboardEvent('keydown', { key: ' ' }))")
    page.wait(lambda: page.latest("speed") > 70)
    page.script("clearInterval(jogging)")  # a page that hangs
    page.wait(lambda: page.latest("speed_ref") == 0)
    page.script("release()")
    page.click("#stop")
    page.wait(lambda: page.state() == "switch on disabled")


# ---- variables of the image ----

def test_a_variable_is_found_while_typing_and_shown_as_number_plot_and_trigger(page, downloads):
    name, speed = "axes[0].speed.integral_q29", "axes[0].speed.speed_rpm_q4"
    page.go("captures")
    page.find("variable").send_keys("speed integ")
    page.wait(lambda: page.script("return [...$('variable_names').options].map((one) => one.value)")[:1] == [name])
    assert "s32" in page.script("return $('variable_names').options[0].label")
    for one in (name, speed, "axes[0].state"):
        page.type("#variable", one), page.click("#variable_show")
    shown = ("return Object.fromEntries([...$('variables').rows].map((row) =>"
             " [...row.cells].slice(0, 2).map((cell) => cell.textContent)))")
    page.wait(lambda: page.script(shown).get("axes[0].state") == "switch on disabled")
    chosen = page.script("return live.names")
    for one in ("axes[0].state", name, speed):
        page.type("#variable", one), page.click("#variable_plot")
        page.wait(lambda one=one: page.script("return live.names.includes(arguments[0]) && live.rows.length > 5", one))
    page.click("[data-line=on]")
    page.wait(lambda: page.state() == "operation enabled" and page.script(shown)["axes[0].state"] == "operation enabled")
    page.arm(speed, "rises", 123.5)
    page.script("say('speed 300')")
    page.wait(lambda: page.script("return captured.rows.length") >= CAPACITY)
    found = page.captured()
    assert found[speed][100] >= 123.5 > found[speed][99] and len(set(found[name])) > 3
    assert set(page.script("return captured.names.map((name, k) => captured.units[k])")) >= {"rpm"}
    page.type("#capture_kind", "mcap"), page.click("#save_capture")
    page.wait(lambda: (downloads / "capture.mcap").is_file())
    assert b'"axes[0].state_text": "operation enabled"' in (downloads / "capture.mcap").read_bytes()
    page.wait(lambda: abs(page.latest(speed) - 300) < 20)
    page.wait(lambda: abs(float(page.script(shown)[speed].split(" rpm")[0]) - 300) < 20)
    integral = float(page.script(shown)[name])
    assert 0 < abs(integral) < 4, "a fraction, by its name"
    page.type("#variable", "axes[0].nothing"), page.click("#variable_show")
    page.wait(lambda: "axes[0].nothing is no number of this image" in page.text("variable_said"))
    assert set(page.script(shown)) == {name, speed, "axes[0].state"}
    page.click("#variables button")
    assert set(page.script(shown)) == {speed, "axes[0].state"}
    page.click("#stop")
    page.wait(lambda: page.state() == "switch on disabled")
    page.script("say('scope signals ' + arguments[0])", ",".join(chosen))
    page.wait(lambda: page.script("return live.names") == chosen)


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


def test_margins_are_those_of_the_open_loop(page):
    """An integrator that crosses at 1 kHz, 75 us late: 90 - 27 degrees, and a third of 10 kHz where it turns round."""
    late = """const rows = [...Array(32).keys()].map((k) => { const hz = 100 * 80 ** (k / 31);
        return [hz, 0, 0, 20 * Math.log10(1000 / hz), -90 - 360 * hz * 75e-6]; }); return margins(rows)"""
    (phase, at, degrees, _), (gain, turns, decibels, _) = page.script(late)
    assert (phase, gain) == ("phase margin", "gain margin") and at == pytest.approx(1000, rel=1e-6)
    assert degrees == pytest.approx(63, abs=0.5) and turns == pytest.approx(1 / (4 * 75e-6), rel=0.01)
    assert decibels == pytest.approx(20 * np.log10(turns / 1000), abs=0.2)
    assert page.script("return marginsTold([])") == "the open loop has no margin within these frequencies"


def test_a_bode_plot_of_the_running_drive(page):
    assert page.script("const { re, im } = opened({ hz: 1, re: 0.5, im: -0.5 }); return [re, im]") == [0, -1]
    assert page.script("return phases([1, -1, 1].map((im) => ({ re: -1, im })))") == [-225, -135, -225]
    page.go("tune")
    page.script("say('on')")
    page.wait(lambda: page.text("state") == "operation enabled")
    page.script("$('bode_amplitude').value = 0.4; $('bode_run').requestSubmit()")
    page.wait(lambda: "phase margin: " in page.text("bode_said"))
    said = page.text("bode_said")
    assert "sweep: done, loop: q, amplitude: 0.400 A, points: 32" in said
    margin = float(re.search(r"phase margin: ([\d.]+) degrees", said)[1])
    assert 55 < margin < 75, "62 degrees by the formulas"
    told = re.match(r"phase margin ([\d.]+) ° at [\d.]+ k?Hz", page.text("bode_margins"))
    assert float(told[1]) == pytest.approx(margin, abs=2), "as the drive has it"
    gains = page.script("return bode.graphs[0].rawData_.map((row) => row.slice(1))")
    assert len(gains) == 32 and gains[0][0] == pytest.approx(0, abs=1) and gains[0][1] > 10 > -10 > gains[-1][1]
    page.script("say('off')")
    page.wait(lambda: page.text("state") == "switch on disabled")


def test_where_dead_time_lowers_the_gain_is_told(page):
    """By formulas: 3 dB less than the integrator that is designed between 200 and 800 Hz. And of the drive, at rest."""
    rows = """parameters.known.set('current_bw_hz', { value: 1000 }); parameters.known.set('i_range_ma', { value: 32000 });
        const rows = [...Array(32).keys()].map((k) => { const hz = 100 * 80 ** (k / 31), db = 20 * Math.log10(1000 / hz);
        return [hz, 0, 0, db - (hz > 200 && hz < 800 ? 3 : 0.5), 0]; });"""
    told = page.script(rows + "return [['q', 0.4, 0.1], ['q', 0.4, 3], ['speed', 1, 0]]"
                       ".map((one) => deadTimeTold(rows, ...one))")
    assert re.match(r"Dead time lowers the gain from 2[0-3]\d Hz to 7\d\d Hz, most by 3.0 dB at [2-7]\d\d Hz: phase", told[0])
    assert "more than 900 mA in the phases" in told[0] and "beyond 500 mA, dead time is compensated in full" in told[1]
    assert told[2] == ""
    assert page.script(rows + "rows.forEach((row) => { row[3] += 4; });"
                       "return deadTimeTold(rows, 'd', 1, 0)").startswith("Though")
    page.script("send({ kind: 'parameters' })")
    assert re.match(r"Dead time lowers the gain from \d+ Hz to [\d.]+ kHz, most by [2-4]\.\d dB at", page.text("bode_dead"))
    assert page.script("return bode.graphs.map((graph) => graph.getLabels().slice(1))") == [
        ["closed", "open", "designed"], ["closed", "open"]]


def test_a_step_response(page):
    """An exponential of 1 ms rises from 10 to 90 % within ln 9 ms; and of the drive, in the task where one tunes."""
    read = """const rows = [...Array(400).keys()].map((k) => [k * 1e-4 - 0.005, k < 50 ? 2 : 4,
        k < 50 ? 2 : 4 - 2 * Math.exp(-(k - 50) * 0.1) + (k === 200 ? 0.2 : 0)]); return stepRead(rows)"""
    found = page.script(read)
    assert found["rise"] == pytest.approx(np.log(9) / 1000, rel=0.01) and found["over"] == pytest.approx(10, abs=0.1)
    assert found["settles"] == pytest.approx(0.015, abs=2e-4)
    page.go("tune")
    page.click("[data-line=on]")
    page.wait(lambda: page.state() == "operation enabled")
    for kind, size, least_s, most_s in (("torque", 2, 1e-4, 6e-4), ("speed", 300, 0.005, 0.5)):
        page.script("$('step_kind').value = arguments[0]; $('step_kind').onchange(); $('step_size').value = arguments[1];"
                    "$('step_said').textContent = ''; $('step_run').requestSubmit()", kind, size)
        page.wait(lambda: page.text("step_said").startswith("rises"))
        rows = page.script("return step.plots.rows")
        assert rows[0][1] == pytest.approx(0, abs=0.05 * size) and rows[-1][1] == pytest.approx(size, rel=0.01)
        assert least_s < page.script("return stepRead(step.plots.rows)")["rise"] < most_s, kind
        assert page.find("stepped").is_displayed() and not page.find("bode").is_displayed()
        page.script("say('speed 0')")
        page.wait(lambda: abs(float(re.search(r"speed: (-?[\d.]+)", page.text("turning"))[1])) < 15)
    page.click("#bode_read")
    page.wait(lambda: page.find("bode").is_displayed() and not page.find("stepped").is_displayed())
    page.click("#stop")
    page.wait(lambda: page.state() == "switch on disabled")


def test_the_browser_found_nothing_wrong(page):
    assert not [entry for entry in page.browser.get_log("browser") if entry["level"] in ("SEVERE", "WARNING")]
