# SPDX-License-Identifier: MIT
"""`make dist`: the same bytes each time, every file hashed, a bill of materials that names what is linked in, no place of this
machine."""
import gzip
import hashlib
import io
import json
import os
import tarfile
from pathlib import Path

import pytest

from tools import dist
from tools.param_rows import param_rows

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
            "docs/guides/first-run.md", "README.md", "CHANGELOG.md", "LICENSE", "sbom.spdx.json", "SHA256SUMS"} <= set(files)


def test_packed_again_it_is_the_same_to_the_byte(files, packed):
    """Whatever order the disk names files in, and whatever the clock says."""
    turned = dict(reversed(files.items()))
    assert dist.archive(turned, "mssfoc-x", WHEN) == packed
    assert dist.complete(dist.contents(BUILD), WHEN) == files
    with tarfile.open(fileobj=io.BytesIO(packed)) as tar:
        assert {(entry.mtime, entry.uid, entry.gid, entry.uname, entry.mode) for entry in tar} == {(WHEN, 0, 0, "", 0o644)}
    assert gzip.decompress(packed) and packed[3] == 0, "no file name in gzip's header"


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
