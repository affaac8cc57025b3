# SPDX-License-Identifier: MIT
"""The scope's page, served for a test and looked at in a browser."""
import contextlib
import os
import re
import subprocess
import time

import pytest

from launcher.paths import REPO as ROOT

PATIENCE_S = 120  # only what hangs takes so long
CAPACITY = 512


@contextlib.contextmanager
def served(folder, *options, build=None):
    """(address, process) of a page with the drive in QEMU, whose files are in the folder; `build`: where another image is."""
    found = subprocess.run(["sh", str(ROOT / ".ci/tools"), "page", "browser"], capture_output=True, text=True, cwd=ROOT,
                           check=False)
    if found.returncode != 0:
        pytest.skip(f"the page was not tested: {(found.stderr.strip().splitlines() or ['no browser'])[-1]}")
    chosen = {"BUILD": str(build)} if build else {}
    server = subprocess.Popen(["/usr/bin/python3", "qemu/run.py", "scope", "--no-browser", "--start", "aligned", "--seed", "1",
                               "--out", str(folder), *options],
                              env=os.environ | chosen, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    said = []
    for line in server.stdout:
        said.append(line)
        if match := re.search(r"http://\S+", line):
            break
    else:
        pytest.fail("".join(said))
    try:
        yield match.group(0), server
    finally:
        server.terminate()
        status = server.wait(PATIENCE_S)
    assert status == 0


@contextlib.contextmanager
def browsed(address, downloads):
    """The Page at an address."""
    from selenium import webdriver
    from selenium.webdriver.chrome.service import Service

    options = webdriver.ChromeOptions()
    for word in ("--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--window-size=1200,1700"):
        options.add_argument(word)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    browser = webdriver.Chrome(service=Service("/usr/bin/chromedriver"), options=options)
    browser.set_script_timeout(PATIENCE_S)
    browser.execute_cdp_cmd("Browser.setDownloadBehavior", {"behavior": "allow", "downloadPath": str(downloads)})
    try:
        yield Page(browser, address)
    finally:
        browser.quit()


class Page:
    """A person at the page: clicks, types, reads."""

    def __init__(self, browser, address):
        self.browser, self.address = browser, address
        self.open()

    def open(self):
        self.browser.get(self.address)
        self.wait(lambda: self.script("return live.rows.length") > 50)

    def script(self, text, *arguments):
        return self.browser.execute_script(text, *arguments)

    def find(self, name):
        return self.browser.find_element("id", name)

    def text(self, name):
        """Also of what another task hides."""
        return self.script("return $(arguments[0]).textContent", name)

    def go(self, task):
        """To a task, by its link."""
        self.click(f"nav a[href='#{task}']")
        self.wait(lambda: self.script("return document.body.dataset.shown") == task)

    def wait(self, holds):
        end = time.monotonic() + PATIENCE_S
        while not holds():
            assert time.monotonic() < end, "\n".join([self.text("said"), self.text("state"), str(self.script(
                "return [live.names, live.rows.length, live.rows.at(-1), live.time, live.held, document.visibilityState]"))])
            time.sleep(0.05)

    def click(self, selector):
        self.script("arguments[0].click()", self.browser.find_element("css selector", selector))

    def type(self, selector, text):
        self.script("arguments[0].value = arguments[1]; arguments[0].dispatchEvent(new Event('input'))",
                    self.browser.find_element("css selector", selector), str(text))

    def state(self):
        return self.text("state")

    def heard(self):
        return self.text("said")

    def latest(self, name):
        return self.script("return live.rows.at(-1)[1 + live.names.indexOf(arguments[0])]", name)

    def captured(self):
        """{name: values, "time": ...} of what the page shows."""
        rows, names = self.script("return [captured.rows, captured.names]")
        return {name: [row[k] for row in rows] for k, name in enumerate(["time", *names])}

    def arm(self, signal, when, level):
        self.script("captured.rows = []; document.getElementById('captured').dataset.samples = 0")
        self.type("#trigger", signal), self.type("#when", when), self.type("#level", level), self.type("#before", 100)
        self.script("document.getElementById('trigger').onchange()")
        self.click("#arm")
        self.wait(lambda: "waits" in self.text("capture"))

    def until_captured(self):
        self.wait(lambda: self.script("return captured.rows.length") == CAPACITY)
        return self.captured()
