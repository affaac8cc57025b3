# SPDX-License-Identifier: MIT
"""The scope's page in a browser, on the image in QEMU: what a person does with it, and who is not let in.

Needs chromium. Where it is missing and may not be installed, the test is skipped and says so.
"""
import http.client
import re
import socket
import time
from urllib.parse import urlsplit

import pytest

from launcher.paths import REPO as ROOT

from browser import CAPACITY, browsed, served
from rigs.modbus_line import write_one
from rigs.mdf import Mdf
from rows import faults


@pytest.fixture(scope="module")
def modbus_port():
    with socket.create_server(("127.0.0.1", 0)) as free:
        return free.getsockname()[1]


@pytest.fixture(scope="module")
def address(tmp_path_factory, modbus_port):
    """Of a page that has been served for this module alone."""
    with served(tmp_path_factory.mktemp("scope"), "--modbus", f"tcp:{modbus_port}") as (where, _):
        yield where


@pytest.fixture(scope="module")
def downloads(tmp_path_factory):
    return tmp_path_factory.mktemp("downloads")


@pytest.fixture(scope="module")
def page(address, downloads):
    with browsed(address, downloads) as shown:
        yield shown


def answer(address, path, **headers):
    parts = urlsplit(address)
    connection = http.client.HTTPConnection("127.0.0.1", parts.port, timeout=5)
    connection.request("GET", path, headers=headers)
    return connection.getresponse().status


def test_only_the_address_with_the_token_is_answered(address):
    parts = urlsplit(address)
    token = parts.path.strip("/")
    assert len(token) >= 30 and answer(address, f"/{token}/") == 200
    for path in ("/", "/scope.js", f"/{token[:-1]}/", f"/{token}x/", "/socket", f"/{token[:-1]}/socket"):
        assert answer(address, path) == 403, path
    assert answer(address, f"/{token}/", Host="evil.example") == 403, "a name that somebody has pointed here"
    upgrade = {"Upgrade": "websocket", "Connection": "Upgrade", "Sec-WebSocket-Version": "13",
               "Sec-WebSocket-Key": "dGhlIHNhbXBsZSBub25jZQ=="}
    assert answer(address, f"/{token}/socket", Origin="http://evil.example", **upgrade) == 403, "another page of the browser"
    assert answer(address, f"/{token}/../web.py") in (403, 404) and answer(address, f"/{token}/%2e%2e%2fweb.py") == 404
    with pytest.raises(OSError):  # on this machine's own address only
        http.client.HTTPConnection("127.0.0.2", parts.port, timeout=2).request("GET", "/")


def test_start_run_and_step(page):
    page.click("[data-line=on]")
    page.wait(lambda: page.state() == "operation enabled")
    page.type("#speed", 400), page.click("#run_speed")
    page.wait(lambda: abs(page.latest("speed") - 400) < 20)
    page.arm("speed", "rises", 600)
    page.type("#speed", 800), page.click("#run_speed")
    shown = page.until_captured()
    assert shown["time"][100] == 0 and shown["speed"][100] >= 600 > shown["speed"][99], "the step's own way through 600 rpm"
    assert shown["time"][101] == pytest.approx(50e-6) and max(shown["i_q"]) > 0.3
    page.wait(lambda: abs(page.latest("speed") - 800) < 20)


def test_what_is_seen_can_be_downloaded(page, downloads):
    for button, name in (("#save_live", "live.csv"), ("#save_capture", "capture.csv")):
        page.click(button)
        page.wait(lambda: (downloads / name).is_file())
    rows = (downloads / "capture.csv").read_text().splitlines()
    assert rows[0].startswith("time_s,i_d [A],i_q [A],") and len(rows) == 1 + CAPACITY
    shown = page.captured()
    assert [float(row.split(",")[2]) for row in rows[1:]] == shown["i_q"]
    live = [float(row.split(",")[0]) for row in (downloads / "live.csv").read_text().splitlines()[1:]]
    steps = sorted(b - a for a, b in zip(live, live[1:]))
    assert len(live) > 500 and steps[len(steps) // 2] == pytest.approx(0.001, abs=1e-6), "a sample each millisecond"


def test_the_same_as_mdf_and_mcap(page, downloads):
    for kind in ("mf4", "mcap"):
        page.type("#capture_kind", kind), page.click("#save_capture")
        page.wait(lambda kind=kind: (downloads / f"capture.{kind}").is_file())
    page.type("#capture_kind", "csv")
    rows, names, units = page.script("return [captured.rows, captured.names, captured.units]")
    found = Mdf((downloads / "capture.mf4").read_bytes()).channels()
    assert [(name, one[0]) for name, one in found.items()] == [("time", "s"), *zip(names, units)]
    assert [one[1].tolist() for one in found.values()] == [list(column) for column in zip(*rows)]
    assert (downloads / "capture.mcap").read_bytes().count(b'"i_q": ') == 2 + CAPACITY, "its kind, its unit, and each sample"
    page.script("record('x', 'xls', [], [], [])")
    page.wait(lambda: "error: x.xls was not made: mssfoc: no table, or no kind of file" in page.heard())
    assert all("record.xls" in entry["message"] for entry in page.browser.get_log("browser")), "it says so, too"


def test_a_load_and_a_fault_of_the_twins_making(page):
    page.arm("speed", "never", 0)
    page.script("send({kind: 'disturb', line: 'sto B 1'})")  # both, or half a second later they differ
    page.type("#disturbance", "sto"), page.type("#arguments", "A 1")
    page.script("document.getElementById('disturb').requestSubmit()")
    page.wait(lambda: page.state().startswith("fault"))
    shown = page.until_captured()
    assert abs(shown["speed"][100] - 800) < 40 and "by a fault" in page.text("capture")
    text = page.text("fault")
    assert faults()["STO_B"].hint in text, "the drive's own words"
    since = page.text("fault_since")
    assert re.fullmatch(r"\d\d:\d\d:\d\d", since) and page.text("word") == "FAULT"
    page.open()  # who comes later sees it all, too
    page.wait(lambda: page.find("fault_place").is_displayed())
    assert page.text("fault_name") in page.state() and (page.text("fault"), page.text("fault_since")) == (text, since)
    page.click("#see_record")
    page.wait(lambda: page.script("return captured.rows.length") == 64)
    assert page.script("return location.hash") == "#captures" and page.find("captured").is_displayed()
    page.go("operate")
    page.type("#disturbance", "sto"), page.type("#arguments", "A 0")
    page.script("document.getElementById('disturb').requestSubmit()")
    page.wait(lambda: "twin: sto A 0" in page.heard())
    page.script("send({kind: 'disturb', line: 'sto B 0'})")
    page.wait(lambda: "twin: sto B 0" in page.heard())
    page.click("[data-line=clear]")
    page.wait(lambda: page.state() == "switch on disabled")
    page.type("#disturbance", "sto"), page.type("#arguments", "everything")
    page.script("send({kind: 'disturb', line: 'watchdog_reset'})")
    page.wait(lambda: "error: 'watchdog_reset' is not one of" in page.heard())


def brake(page):
    """A rotor without load coasts for seconds."""
    page.script("send({kind: 'disturb', line: 'lock 1'})")
    page.wait(lambda: abs(page.latest("speed")) < 5)
    page.script("send({kind: 'disturb', line: 'lock 0'})")


def test_who_commands_is_shown_and_taken_over_from(page, modbus_port):
    brake(page)
    with socket.create_connection(("127.0.0.1", modbus_port)) as plc:
        def commands(*words):
            for word in words:
                asked = write_one(0, word)
                plc.sendall(asked)
                assert plc.recv(len(asked), socket.MSG_WAITALL) == asked
            return page.text("take") == "take over from Modbus"
        page.wait(lambda: commands(6, 7, 15))  # refused until the drive, too, has seen that the shaft stands
        page.wait(lambda: commands(15) and page.state() == "operation enabled")
        page.type("#speed", 300)
        page.wait(lambda: commands(15) and not page.find("run_speed").is_enabled())
        assert page.find("run_speed").get_attribute("title") == "Modbus commands: take over first"
        page.script("document.getElementById('said').textContent = ''; say('speed 300')")  # the drive says so, too
        page.wait(lambda: commands(15) and "error: Modbus commands" in page.heard())
    page.click("#take")
    page.wait(lambda: "commanded by: the console" in page.script("return $('status').textContent"))
    assert not page.find("take").is_displayed() and page.text("owner") == "the console"
    page.click("#run_speed")
    page.wait(lambda: abs(page.latest("speed") - 300) < 20)
    page.click("#stop")
    page.wait(lambda: page.state() == "switch on disabled")


def change(page, name, value):
    page.script("const field = document.querySelector(arguments[0]); field.value = arguments[1]; field.onchange()",
                f"#parameters input[name={name}]", str(value))


def value(page, name):
    return page.script("return document.querySelector(arguments[0]).value", f"#parameters input[name={name}]")


def test_a_parameter(page):
    page.go("parameters")
    page.wait(lambda: page.script("return document.querySelectorAll('#parameters tr').length") > 50)
    change(page, "speed_bw_hz", 55)
    page.script("document.querySelectorAll('#parameters details').forEach((one) => { one.open = true; })")
    page.script("say('get speed_bw_hz')")
    page.wait(lambda: "speed_bw_hz = 55" in page.heard())
    page.script("const field = document.querySelector('#parameters input[name=i_max_ma]'); field.focus(); field.value = 12")
    page.script("document.querySelector('#parameters input[name=speed_bw_hz]').value = 7")
    page.script("send({kind: 'parameters'})")
    page.wait(lambda: value(page, "speed_bw_hz") == "55")
    assert value(page, "i_max_ma") == "12", "what somebody is typing stays"
    change(page, "speed_bw_hz", 5000)
    page.wait(lambda: "error: speed_bw_hz must be 1...200" in page.heard())
    row = "document.querySelector('#parameters input[name=speed_bw_hz]').closest('tr')"
    assert value(page, "speed_bw_hz") == "55", "a field shows what the drive has, not what it refused"
    assert page.script(f"return {row}.querySelector('.refusal').textContent").startswith("5000 refused: speed_bw_hz must be 1")
    change(page, "speed_bw_hz", 60)
    page.wait(lambda: "refused" not in page.script(f"return {row}.textContent") and value(page, "speed_bw_hz") == "60")


@pytest.mark.parametrize("line, usage", [
    ("load_nm abc", "TORQUE"), ("load_nm", "TORQUE"), ("load_nm 1 2", "TORQUE"), ("load_nm 1e9", "TORQUE"), ("lock 2", "0|1"),
    ("supply_v -3", "VOLTS"), ("supply_v nan", "VOLTS"), ("encoder_slip 1.5", "COUNTS"), ("phase_open D 1", "A|B|C 0|1"),
    ("temperature_c cold", "DEGREES|off (-100...300)"), ("sto C 1", "A|B 0|1 (1: the input asks to stop)")])
def test_what_cannot_happen_to_the_motor_is_refused(page, line, usage):
    page.script("document.getElementById('said').textContent = ''; send({kind: 'disturb', line: arguments[0]})", line)
    page.wait(lambda: f"> twin: {line}\n" in page.heard())
    assert page.heard().splitlines()[1] == f"error: wrong arguments, expected: {line.split()[0]} {usage}"


def test_identify_shows_how_far_it_is_and_what_it_found(page):
    brake(page)

    def begins():
        """Refused until the drive, too, has seen that the shaft stands."""
        page.script("document.getElementById('said').textContent = ''")
        page.click("[data-line=identify]")
        page.wait(lambda: re.search("> identify\n(ok|error)", page.heard()))
        return "> identify\nok" in page.heard()
    page.wait(begins)
    page.wait(lambda: "'resistance'" in page.script("return $('step').textContent"))
    page.wait(lambda: re.search("'(axes|inductance|turn)'", page.script("return $('step').textContent")))
    page.click("#stop")
    found = lambda: page.script("return document.getElementById('identified').textContent")  # noqa: E731
    page.wait(lambda: "ended in step" in found())
    assert re.search(r"resistance\d+\.\d+ \+-\d+\.\d+ mohm", found()), found()
    assert "quickstop" in page.heard() and page.state() == "switch on disabled", "the big button ends a measurement, too"


IDENTIFIED = {"ld": 200, "lq": 200, "pole pairs": 4, "encoder counts": 4000}  # teknic_m2310p, as rated
COLD_MOHM, WARMEST = 360, 1.5  # a winding that was measured before, 125 K warmer at the most
INTERVALS = ("resistance", "dead time", "ld", "lq", "offset", "flux", "inertia", "friction")


def test_identify_to_its_end_and_what_it_found_is_used(page):
    """Each step is shown as it goes, each value with its interval; and the drive takes them."""
    page.click("[data-line=on]")  # the twin tells the first start where the rotor is; identify finds that out
    page.wait(lambda: page.state() == "operation enabled")
    page.click("#stop")
    page.wait(lambda: page.state() == "switch on disabled")
    page.script("document.getElementById('said').textContent = ''")
    page.click("[data-line=identify]")
    steps = []

    def ended():
        shown = re.search("'(.+)'", page.script("return $('step').textContent"))
        if shown and shown[1] not in steps:
            steps.append(shown[1])
        return len(steps) > 1 and not shown and "time: " in page.heard()

    page.wait(ended)
    order = ["resistance", "axes", "inductance", "turn", "ramps", "speeds"]
    assert [step for step in steps if step in order] == order, "short ones may pass between two looks"
    rows = page.script("return [...document.querySelectorAll('#identified tr')].map(r => [...r.cells].map(c => c.textContent))")
    found = dict(rows)
    for name, rated in IDENTIFIED.items():
        assert float(re.match(r"[\d.]+", found[name])[0]) == pytest.approx(rated, rel=0.25), (name, found)
    assert 0.9 < float(re.match(r"[\d.]+", found["resistance"])[0]) / COLD_MOHM < WARMEST, found
    for name in INTERVALS:
        value, interval = map(float, re.match(r"(-?[\d.]+) \+-([\d.]+) ", found[name]).groups())
        assert 0 < interval < max(abs(value), 5), (name, found)
    assert found["pole pairs"] == "4, exactly" and page.state() == "switch on disabled"
    page.click("[data-line='identify use']")
    page.wait(lambda: re.search(r"[1-9]\d* parameters changed", page.heard()))
    used = round(float(re.match(r"[\d.]+", found["resistance"])[0]))
    shown = "return document.querySelector('#parameters input[name=resistance_mohm]').value"
    page.wait(lambda: page.script(shown) == str(used))
    compared = dict(page.script("return [...$('compared').rows].slice(1).map((row) => [row.cells[0].textContent,"
                                " [...row.cells].slice(1).map((cell) => parseInt(cell.textContent))])"))
    assert compared["resistance_mohm"] == [COLD_MOHM, used] and len(compared) > 3, compared
    page.click("#take_back")
    page.wait(lambda: page.script(shown) == str(COLD_MOHM))
    page.click("[data-line='identify use']")
    page.wait(lambda: page.script(shown) == str(used))
    page.click("#setup_save [data-line=save]")
    page.wait(lambda: page.script("return $('setup_turn').open"))
    page.click("#start")
    page.wait(lambda: abs(page.latest("speed") - 300) < 20)  # with what was measured
    page.click("#stop")
    page.wait(lambda: page.state() == "switch on disabled")


def test_on_a_phone(page):
    page.browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride",
                                 {"width": 360, "height": 780, "deviceScaleFactor": 1, "mobile": True})
    page.wait(lambda: page.script("return innerWidth") == 360)
    page.wait(lambda: page.script("return document.documentElement.scrollWidth") == 360)  # nothing stands out to the right
    stop = page.find("stop").rect
    assert stop["x"] + stop["width"] <= 360 and stop["height"] >= 44, "the stop is there, and large enough for a thumb"
    page.go("operate")
    page.browser.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})


def test_who_goes_away_leaves_the_motor_stopped(page):
    page.click("[data-line=on]")
    page.wait(lambda: page.state() == "operation enabled")
    page.type("#speed", 500), page.click("#run_speed")
    page.wait(lambda: page.latest("speed") > 450)
    page.browser.get("about:blank")
    time.sleep(4)
    page.open()
    page.wait(lambda: page.state() == "switch on disabled")
    assert abs(page.latest("speed")) < 60


def test_the_browser_found_nothing_wrong(page):
    log = [entry for entry in page.browser.get_log("browser") if entry["level"] in ("SEVERE", "WARNING")]
    assert not log
