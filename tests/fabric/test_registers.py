# SPDX-License-Identifier: MIT
"""What is generated from drivers/fabric/registers.toml follows it; the tables of docs/fabric.md are up to date."""
import copy
import importlib.util
import os
import shutil
import subprocess
import tomllib
import xml.etree.ElementTree as xml
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
GENERATE = ROOT / "drivers/fabric/rtl/generate.py"


def load():
    loaded = importlib.util.spec_from_file_location("generate", GENERATE)
    module = importlib.util.module_from_spec(loaded)
    loaded.loader.exec_module(module)
    return module


generate = load()
SPEC = generate.checked(tomllib.loads((ROOT / generate.SOURCE).read_text(encoding="utf-8")))


def test_the_page_is_not_stale():
    old, new = generate.renewed_page()
    assert old == new


def test_the_page_follows_the_description(tmp_path):
    for path in (generate.SOURCE, generate.PLANT, generate.PAGE):
        (tmp_path / path).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / path, tmp_path / path)
    source = tmp_path / generate.SOURCE
    source.write_text(source.read_text(encoding="utf-8").replace("offset = 0x24", "offset = 0x3C", 1), encoding="utf-8")
    old, new = generate.renewed_page(tmp_path)
    assert old != new


@pytest.mark.parametrize("product", generate.PRODUCTS)
def test_make_writes_each_product_into_the_build(product):
    built = ROOT / os.environ["BUILD"] / "fabric" / product
    described = generate.described(source=generate.source_of(product))
    assert built.read_text(encoding="utf-8") == generate.PRODUCTS[product](described)


@pytest.mark.parametrize("change, said", [
    (lambda spec: spec["block"][0]["register"][1].update(offset=0), "offset or name is taken"),
    (lambda spec: spec["block"][0]["register"][1].update(offset=2), "is not a word"),
    (lambda spec: spec["block"][0]["register"][1].update(offset=0x100), "is not a word"),
    (lambda spec: spec["block"][0]["register"][2].update(reset=0x10000), "bits that no field has"),
    (lambda spec: spec["block"][0]["register"][0]["field"][1].update(bits="0"), "its bits are taken"),
    (lambda spec: spec["block"][0]["register"][0]["field"][0].update(bits="32"), "are not allowed"),
    (lambda spec: spec["block"][0]["register"][0]["field"][0].update(access="W"), "are not allowed"),
    (lambda spec: spec["block"][1].update(slot=0), "slot 0 is taken"),
    (lambda spec: spec["block"][3]["register"][3]["field"][1].update(name="ON"), "two things would be called GATE_CHOPPER_ON"),
])
def test_a_contradiction_is_refused(change, said):
    spec = copy.deepcopy(SPEC)
    change(spec)
    with pytest.raises(generate.Wrong, match=said):
        generate.checked(spec)


def test_the_header_compiles_and_agrees(tmp_path):
    """Offsets as a C compiler sees them, against the description."""
    lines = [f"_Static_assert(FABRIC3_{block['name']}_{register['name']} == "
             f"{block['slot'] * SPEC['slot_bytes'] + register['offset']}, \"\");"
             for block in SPEC["block"] for register in block["register"]]
    (tmp_path / "contract3.h").write_text(generate.c_header(SPEC), encoding="utf-8")
    (tmp_path / "use.c").write_text('#include "contract3.h"\n' + "\n".join(lines) + "\n", encoding="utf-8")
    compiler = ["cc", "-std=c11", "-Wall", "-Wextra", "-Werror", "-fsyntax-only"]
    subprocess.run([*compiler, tmp_path / "use.c"], check=True)


def test_the_svd_has_every_field():
    device = xml.fromstring(generate.svd(SPEC))
    found = {(p.findtext("name"), r.findtext("name"), f.findtext("name"), f.findtext("bitRange"))
             for p in device.iter("peripheral") for r in p.iter("register") for f in r.iter("field")}
    assert found == {(block["name"], register["name"], field["name"], "[{}:{}]".format(*generate.bits_of(field)))
                     for block in SPEC["block"] for register in block["register"] for field in register["field"]}
