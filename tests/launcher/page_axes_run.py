# SPDX-License-Identifier: MIT
"""Two axes on one page: of both state, speed and owner; what is done is for the chosen one, what stops for both."""
import socket

import axe
import pytest
from browser import browsed, served
from rates.builds import OWN_HZ, build_of
from rigs.modbus_line import US, write_one


@pytest.fixture(scope="module")
def modbus_port():
    with socket.create_server(("127.0.0.1", 0)) as free:
        return free.getsockname()[1]


@pytest.fixture(scope="module")
def page(tmp_path_factory, modbus_port):
    build = build_of(OWN_HZ, "mssfoc.elf", "mssfoc.hex", folder="two-axes", AXES=2)
    with served(tmp_path_factory.mktemp("scope"), "--motor", "teknic_m2310p maxon_ec22", "--modbus", f"tcp:{modbus_port}",
                build=build) as (address, _):
        with browsed(address, tmp_path_factory.mktemp("downloads")) as shown:
            shown.wait(lambda: shown.script("return parameters.known.size") > 50)
            yield shown


def axes(page):
    return page.script("return [...$('axes').children].map((one) => one.textContent)")


def choose(page, number):
    page.click(f"#axes button:nth-child({number})")
    page.wait(lambda: page.script("return [now.axis, parameters.known.size > 50]") == [number, True])


def start(page, rpm):
    page.click("[data-line=on]")
    page.wait(lambda: page.state() == "operation enabled")
    page.script("say('speed ' + arguments[0])", rpm)
    page.wait(lambda: abs(page.latest("speed") - rpm) < 40)


def test_each_turns_by_its_own_wish_and_both_are_shown(page):
    motor = {1: page.script("return parameters.known.get('pole_pairs').value")}
    start(page, 400)
    choose(page, 2)
    page.wait(lambda: page.state() == "switch on disabled")
    motor[2] = page.script("return parameters.known.get('pole_pairs').value")
    assert motor == {1: 4, 2: 1} and page.script("return $('undo').disabled"), "another motor, and nothing to undo"
    start(page, -900)
    page.wait(lambda: axes(page)[0].startswith("axis 1: ON, ") and axes(page)[1].startswith("axis 2: ON, -"))
    assert [page.script("return $('axes').children[arguments[0]].ariaPressed", k) for k in (0, 1)] == ["false", "true"]
    assert page.find("axes").is_displayed() and abs(float(axes(page)[0].split(", ")[1].split()[0]) - 400) < 40


def test_a_load_is_that_of_the_chosen_axis(page):
    page.script("send({kind: 'disturb', line: 'lock 1'})")
    page.wait(lambda: abs(page.latest("speed")) < 5)
    assert abs(float(axes(page)[0].split(", ")[1].split()[0]) - 400) < 60, "the other one turns on"
    page.script("send({kind: 'disturb', line: 'lock 0'})")
    page.script("say('clear')")


def test_nothing_for_axe_and_no_wide_page(page):
    assert not axe.violations(page, axe.program())
    page.browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride",
                                 {"width": 390, "height": 844, "deviceScaleFactor": 1, "mobile": True})
    assert page.script("return document.documentElement.scrollWidth") <= 390
    page.browser.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})


def test_stop_is_for_both(page):
    page.click("#stop")
    page.wait(lambda: all(one.split(", ")[0].endswith(": OFF") for one in axes(page)))


def test_each_has_its_owner(page, modbus_port):
    """Modbus takes axis 2, at the address behind that of axis 1, and this page goes on with axis 1."""
    page.script("send({kind: 'disturb', line: 'lock 1'})")
    page.wait(lambda: abs(page.latest("speed")) < 5)
    page.script("send({kind: 'disturb', line: 'lock 0'})")
    with socket.create_connection(("127.0.0.1", modbus_port)) as plc:
        def commands(*words):
            for word in words:
                plc.sendall(asked := write_one(0, word, unit=US + 1))
                assert plc.recv(len(asked), socket.MSG_WAITALL) == asked
            return axes(page)[1].endswith("Modbus")
        page.wait(lambda: commands(6, 7, 15))
        page.wait(lambda: commands(15) and page.text("owner") == "Modbus" and page.find("take").is_displayed())
        page.click("#axes button:nth-child(1)")
        page.wait(lambda: commands(15) and page.text("owner") in ("nobody", "the console"))
        assert not axes(page)[0].endswith("Modbus") and not page.find("take").is_displayed()
        page.wait(lambda: not page.script("return $('run_speed').title").startswith("Modbus"))
