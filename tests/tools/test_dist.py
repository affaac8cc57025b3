# SPDX-License-Identifier: MIT
"""`make dist`: the same bytes each time, every file hashed, a bill of materials that names what is linked in, no place of this
machine."""
import gzip
import hashlib
import io
import json
import os
import re
import subprocess
import tarfile
from pathlib import Path

import pytest

from rigs.page_links import anchors, distances, links
from tools import dist
from rows import param_rows

BUILD = Path(os.environ.get("BUILD", "build"))
WHEN = 1700000000


@pytest.fixture(scope="module")
def files():
    return dist.complete(dist.contents(BUILD), WHEN)


@pytest.fixture(scope="module")
def packed(files):
    return dist.archive(files, "mssfoc-x", WHEN)


def test_the_archive_has_what_a_user_takes_home(files):
    assert {"image/mssfoc.hex", "image/mssfoc-envm.hex", "image/bringup.hex", "library/libmssfoc.a", "library/Lib.h",
            "fabric/mssfoc.svd", "fabric/registers.csv", "fabric/rtl/fabric.v", "client/mssfoc/registers.csv", "docs/README.md",
            "docs/guides/first-run.md", "README.md", "library/lib/Lib_thumb2.S",
            "CHANGELOG.md", "LICENSE", "sbom.spdx.json", "SHA256SUMS"} <= set(files)


def test_packed_again_it_is_the_same_to_the_byte(files, packed):
    """Whatever order the disk names files in, and whatever the clock says."""
    turned = dict(reversed(files.items()))
    assert dist.archive(turned, "mssfoc-x", WHEN) == packed
    assert dist.complete(dist.contents(BUILD), WHEN) == files
    with tarfile.open(fileobj=io.BytesIO(packed)) as tar:
        assert {(entry.mtime, entry.uid, entry.gid, entry.uname, entry.mode) for entry in tar} == {(WHEN, 0, 0, "", 0o644)}
    assert gzip.decompress(packed) and packed[3] == 0, "no file name in gzip's header"


@pytest.fixture
def home(files, tmp_path):
    """Where a user has unpacked it."""
    for name, data in files.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_bytes(data)
    return tmp_path


def test_no_link_is_dead_and_readme_leads_to_every_page(home):
    pages = sorted(home.rglob("*.md"))
    found = {page: list(links(page)) for page in pages}
    dead = [(page.name, target) for page in pages for target, anchor in found[page]
            if not target.exists() or anchor and target.suffix == ".md" and anchor not in anchors(target)]
    assert not dead and len(pages) > 40
    far = distances({page: [target for target, _ in found[page]] for page in pages}, home / "README.md")
    assert {page.relative_to(home) for page in pages if page not in far} == {Path("client/README.md")}, "which pip shows"


def test_readme_names_what_is_there(home):
    text = (home / "README.md").read_text()
    folders = re.findall(r"(?m)^\| `(\w+)/` \|", text)
    assert sorted(folders) == sorted(path.name for path in home.iterdir() if path.is_dir())
    assert "| it drives |" in text and not re.search(r"`(make|build/)", text.replace("begins with `make`", ""))


def built(home, fraction):
    """README's commands, for a number of fraction bits."""
    commands = re.search(r"<!-- build:.*?```sh\n(.*?)```", (home / "README.md").read_text(), re.S)[1]
    script = commands.replace("=16", f"={fraction}").replace("arm-none-eabi-", dist.CROSS)
    subprocess.run(["sh", "-ec", script], cwd=home, check=True)


def sizes(library):
    listed = subprocess.run([dist.CROSS + "size", str(library)], capture_output=True, text=True, check=True).stdout
    return sorted(line.split()[:3] + [line.split()[5]] for line in listed.splitlines()[1:])


def test_the_library_is_built_again_and_one_of_another_fraction_does_not_link(home):
    before = sizes(home / "library/libmssfoc.a")
    built(home, 15)
    assert sizes(home / "library/libmssfoc.a") == before, "the same compiler, the same options"
    built(home, 16)
    calls = {"Lib.h": ("park", "invpark"), "LibFoc.h": ("sincos",)}
    code = {"park": "Park_Lib_Do(0, 0);", "invpark": "InvPark_Lib_Do(0, 0);", "sincos": "SinCos_Lib_Do(0, 0);"}
    for header, names in calls.items():
        for name in names:
            (home / "your.c").write_text(f'#include "{header}"\nint main(void)\n{{\n    {code[name]}\n    return 0;\n}}\n')
            for fraction in (15, 16):
                command = [dist.CROSS + "gcc", "-mcpu=cortex-m3", "-mthumb", "-Ilibrary", "-nostdlib", "-Wl,-emain",
                           f"-DLIB_TRIG_FRAC={fraction}", "your.c", "-Llibrary", "-lmssfoc", "-o", "out.elf"]
                linked = subprocess.run(command, cwd=home, capture_output=True, text=True, check=False)
                assert (linked.returncode == 0) == (fraction == 16), linked.stderr
                assert fraction == 16 or "_LIB_TRIG_FRAC_15'" in linked.stderr


def test_every_file_has_its_hash(files):
    listed = dict(reversed(line.split("  ")) for line in files["SHA256SUMS"].decode().splitlines())
    assert listed == {name: hashlib.sha256(data).hexdigest() for name, data in files.items() if name != "SHA256SUMS"}


def test_the_bill_names_each_file_and_what_is_linked_in(files):
    bill = json.loads(files["sbom.spdx.json"])
    assert bill["spdxVersion"] == "SPDX-2.3" and bill["creationInfo"]["created"] == "2023-11-14T22:13:20Z"
    assert {entry["fileName"][2:] for entry in bill["files"]} == set(files) - {"sbom.spdx.json", "SHA256SUMS"}
    assert {"mssfoc", "libgcc"} <= {entry["name"] for entry in bill["packages"]}
    ids = [entry["SPDXID"] for entry in [*bill["files"], *bill["packages"]]]
    assert len(ids) == len(set(ids))
    used = {side for entry in bill["relationships"] for side in (entry["spdxElementId"], entry["relatedSpdxElement"])}
    assert used == {"SPDXRef-DOCUMENT", *ids}


@pytest.mark.parametrize("name", ["image/mssfoc.elf", "image/bringup.elf", "library/libmssfoc.a"])
def test_nothing_tells_where_it_was_built(files, name):
    assert str(dist.ROOT).encode() not in files[name]


def test_register_lists_are_whole(files):
    fabric, bus = (files[f"{name}/registers.csv"].decode().splitlines() for name in ("fabric", "client/mssfoc"))
    assert any("GATE,ID,VALUE" in line for line in fabric) and any(",map_version," in line for line in bus)
    assert sum(line.startswith("parameter,") for line in bus) == len(param_rows(dist.ROOT))
