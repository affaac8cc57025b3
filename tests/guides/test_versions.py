# SPDX-License-Identifier: MIT
"""CHANGELOG's table of versions is that of the sources, and what is numbered has its entry."""
import re

from guides.transcript import ROOT


def shown():
    page = (ROOT / "CHANGELOG.md").read_text()
    return dict(re.findall(r"^\| the (\w+)[^|]* \| (?:contract |map )?([\d.]+) \|", page, re.MULTILINE))


def source(path, pattern):
    return re.search(pattern, (ROOT / path).read_text(), re.MULTILINE)[1]


def test_the_versions_are_those_of_the_sources():
    assert shown() == {
        "image": source("firmware/settings/config.h", r'CONFIG_VERSION "([\d.]+)"'),
        "fabric": source("drivers/fabric/registers.toml", r'^contract = "([\d.]+)"'),
        "bus": source("firmware/operate/objects.h", r"MODBUS_MAP_VERSION (\d+)")}


def test_the_image_s_version_has_its_changes():
    headings = re.findall(r"^## (.*)", (ROOT / "CHANGELOG.md").read_text(), re.MULTILINE)
    assert shown()["image"] in headings[0]
    assert re.fullmatch(r"\d+\.\d+\.\d+", shown()["image"])
