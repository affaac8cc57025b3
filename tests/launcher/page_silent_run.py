# SPDX-License-Identifier: MIT
"""A drive that falls silent: the page greys what it knew, says since when and why, and comes back with the drive."""
import os
import re
import signal

import pytest
from browser import PATIENCE_S, browsed, served


@pytest.fixture(scope="module")
def server(tmp_path_factory):
    with served(tmp_path_factory.mktemp("scope")) as (address, process):
        yield address, process


@pytest.fixture(scope="module")
def page(server, tmp_path_factory):
    with browsed(server[0], tmp_path_factory.mktemp("downloads")) as shown:
        yield shown


def qemu_of(process):
    with open(f"/proc/{process.pid}/task/{process.pid}/children", encoding="ascii") as children:
        return int(children.read().split()[0])


def is_stale(page):
    """The values are grey, the state says that it is none, the banner why."""
    opacity = page.script("return ['live', 'status', 'parameters'].map((n) => getComputedStyle($(n)).opacity)")
    told = re.fullmatch(r"silent since \d\d:\d\d:\d\d; last: operation enabled", page.state())
    return page.find("silent").is_displayed() and bool(told) and all(float(value) < 0.5 for value in opacity)


def test_a_qemu_that_is_stopped_and_goes_on(page, server):
    page.click("[data-line=on]")
    page.wait(lambda: page.state() == "operation enabled")
    pid = qemu_of(server[1])

    def stopped():
        os.kill(pid, signal.SIGSTOP)  # again: the launcher, which paces it, may just let it go on
        return is_stale(page)

    page.wait(stopped)
    assert re.match(r"The drive is silent since \S+: no answer for \d+ s\.", page.text("silent"))
    page.script("say('speed 500')")
    page.wait(lambda: "> speed 500\nerror: the drive is silent" in page.heard())
    page.script("send({kind: 'disturb', line: 'load_nm 0.01'})")
    page.wait(lambda: "> twin: load_nm 0.01\nerror: the drive is silent, and has not taken it yet" in page.heard())
    last = page.script("return live.last")
    os.kill(pid, signal.SIGCONT)
    page.wait(lambda: page.state() == "operation enabled" and not page.find("silent").is_displayed())
    page.wait(lambda: page.script("return live.last") != last and not page.script("return document.body.className"))
    page.script("document.getElementById('said').textContent = ''; say('get pole_pairs')")
    page.wait(lambda: "> get pole_pairs\npole_pairs = 4" in page.heard())  # no answer of before passes for it


def test_a_qemu_that_is_killed(page, server):
    os.kill(qemu_of(server[1]), signal.SIGKILL)
    page.wait(lambda: is_stale(page))
    page.wait(lambda: "QEMU was ended by signal SIGKILL; make scope starts it anew" in page.text("silent"))
    page.click("#stop")
    page.wait(lambda: "> stop\nerror: QEMU was ended" in page.heard())
    for kind, line in (("line", "speed 500"), ("disturb", "lock 1")):
        page.script("send({kind: arguments[0], line: arguments[1]})", kind, line)
        page.wait(lambda line=line: re.search(rf"> (twin: )?{line}\nerror: .*QEMU was ended", page.heard()))
    page.browser.get(server[0])  # who comes later sees it, too
    page.wait(lambda: page.find("silent").is_displayed())


def test_the_terminal_has_a_line_for_each_and_no_traceback(page, server):
    process = server[1]
    process.terminate()
    said = process.communicate(timeout=PATIENCE_S)[0]
    lines = [line for line in said.splitlines() if line.startswith("mssfoc: ")]
    assert "Traceback" not in said and "rror" not in said, said
    assert [re.sub(r"\d\d:\d\d:\d\d|\d+ s", "*", line) for line in lines[:3]] == [
        "mssfoc: the drive is silent since *: no answer for *", "mssfoc: the drive answers again",
        "mssfoc: the drive is silent since *: QEMU was ended by signal SIGKILL; make scope starts it anew"]
    assert len(lines) <= 4, said  # and that a motor which was started could not be stopped
