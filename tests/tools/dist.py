# SPDX-License-Identifier: MIT
"""`make dist`: what a user takes home, in one archive: images, library and its sources, registers, RTL, client, documents and a
README of its own, with hashes and a bill of materials. What is not in it is linked to by no page. The same tree and
the same compiler give the same bytes, in any folder, on any day.

usage: dist.py BUILD
"""
import csv
import gzip
import hashlib
import io
import json
import os
import re
import subprocess
import sys
import tarfile
import tomllib
from datetime import datetime, timezone
from pathlib import Path

import client
from pages import replaced

ROOT = Path(__file__).resolve().parents[2]
CROSS = os.environ.get("CROSS", "arm-none-eabi-")
IMAGES = [f"{image}{end}" for image in ("mssfoc", "bringup") for end in (".elf", ".hex", "-envm.hex")] + ["mssfoc.bin"]
GENERATED = ("mssfoc.svd", "contract3.h", "mssfoc_regs.vh")
PAGES = ("CHANGELOG.md", "SECURITY.md")
README = ROOT / "tests/tools/dist_readme.md"
FENCED = re.compile(r"(^ *```.*?^ *```)", re.S | re.M)
LINK = re.compile(r"\[([^\]]*)\]\(([^)\s:#]+)(#[^)\s]*)?\)")


def version():
    return re.search(r'CONFIG_VERSION "([\d.]+)"', (ROOT / "firmware/settings/config.h").read_text())[1]


def ask(*command):
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout.strip()


def built_at():
    """Seconds since 1970 for everything in the archive: $SOURCE_DATE_EPOCH, or the commit's."""
    return int(os.environ.get("SOURCE_DATE_EPOCH") or ask("git", "log", "-1", "--format=%ct"))


def compiler():
    return ask(CROSS + "gcc", "--version").split("\n")[0]


def table(heading, rows):
    out = io.StringIO()
    csv.writer(out, lineterminator="\n").writerows([heading, *rows])
    return out.getvalue().encode()


def fabric_registers():
    spec = tomllib.loads((ROOT / "drivers/fabric/registers.toml").read_text())
    for block in spec["block"]:
        for register in block["register"]:
            at = spec["base"] + block["slot"] * spec["slot_bytes"] + register["offset"]
            for field in register["field"]:
                yield (f"0x{at:08X}", block["name"], register["name"], field["name"], field["bits"],
                       field.get("access", register["access"]), f"0x{register['reset']:X}", field["about"])


def sources(build):
    """{name in the archive: file}."""
    files = {f"image/{name}": build / name for name in IMAGES}
    files |= {"library/libmssfoc.a": build / "libmssfoc.a", "LICENSE": ROOT / "docs/LICENSE",
              "fabric/registers.toml": ROOT / "drivers/fabric/registers.toml"}
    files |= {f"library/lib/{path.name}": path for path in (ROOT / "lib").glob("*.[chS]")}
    files |= {f"library/{name}": ROOT / "lib" / name for name in ("Lib.h", "LibFoc.h")}
    files |= {f"fabric/{name}": build / "fabric" / name for name in GENERATED}
    files |= {f"fabric/rtl/{path.name}": path for path in (ROOT / "drivers/fabric/rtl").glob("*.v")}
    files |= {name: ROOT / name for name in PAGES}
    files |= {str(path.relative_to(ROOT)): path for path in (ROOT / "docs").rglob("*") if path.suffix in (".md", ".png")}
    return files | {"README.md": ROOT / "README.md"}


def relinked(name, path, places):
    """A page's text with its links as they are in the archive; what is not there is named instead. `places`: {file: name}."""
    def moved(match):
        words, target, anchor = match[1], (path.parent / match[2]).resolve(), match[3] or ""
        if target in places:
            return f"[{words}]({os.path.relpath(places[target], Path(name).parent)}{anchor})"
        there = f"`{target.relative_to(ROOT)}`"
        return there if words.strip("`") in there else f"{words} ({there})"

    parts = FENCED.split(path.read_text())
    return "".join(part if at % 2 else LINK.sub(moved, part) for at, part in enumerate(parts)).encode()


def readme():
    limits = re.search(r"<!-- limits: .*?-->\n(.*?)<!-- end -->", (ROOT / "README.md").read_text(), re.S)[1]
    return replaced(README.read_text(), "limits", limits, README.name).encode()


def contents(build):
    """{name in the archive: bytes}."""
    files = sources(build)
    places = {path.resolve(): name for name, path in files.items()} | {ROOT / "drivers/fabric/rtl": "fabric/rtl"}
    found = {name: relinked(name, path, places) if path.suffix == ".md" else path.read_bytes() for name, path in files.items()}
    found["README.md"] = readme()
    found["fabric/registers.csv"] = table(
        ("address", "block", "register", "field", "bits", "access", "reset", "what"), fabric_registers())
    return found | {f"client/{name}": data for name, data in client.package().items()}


def spdx_id(name):
    return "SPDXRef-" + re.sub(r"[^\w.]", "-", name)


def package(name, licence, **more):
    return {"SPDXID": spdx_id(name), "name": name, "downloadLocation": "NOASSERTION", "filesAnalyzed": False,
            "licenseConcluded": licence, "licenseDeclared": licence, "copyrightText": "NOASSERTION", **more}


def bill(files, when):
    """SPDX 2.3: the product, the compiler's run-time that is linked into the images, the compiler, and each file."""
    hashes = {name: hashlib.sha256(data).hexdigest() for name, data in sorted(files.items())}
    of_all = hashlib.sha256("".join(hashes.values()).encode()).hexdigest()
    gcc = compiler()
    relations = [("SPDXRef-DOCUMENT", "DESCRIBES", spdx_id("mssfoc")), (spdx_id("mssfoc"), "CONTAINS", spdx_id("libgcc")),
                 (spdx_id("gcc-arm-none-eabi"), "BUILD_TOOL_OF", spdx_id("mssfoc")),
                 *((spdx_id("mssfoc"), "CONTAINS", spdx_id(name)) for name in hashes)]
    return {
        "spdxVersion": "SPDX-2.3", "dataLicense": "CC0-1.0", "SPDXID": "SPDXRef-DOCUMENT", "name": f"mssfoc-{version()}",
        "documentNamespace": f"urn:sha256:{of_all}",
        "creationInfo": {"created": datetime.fromtimestamp(when, timezone.utc).strftime("%Y-%m-%dT%H:%M:%SZ"),
                         "creators": ["Tool: mssfoc make dist"]},
        "packages": [package("mssfoc", "MIT", versionInfo=version()),
                     package("libgcc", "GPL-3.0-or-later WITH GCC-exception-3.1", versionInfo=gcc,
                             comment="the compiler's run-time, in the images; not in libmssfoc.a"),
                     package("gcc-arm-none-eabi", "GPL-3.0-or-later", versionInfo=gcc, comment="not in any file")],
        "files": [{"SPDXID": spdx_id(name), "fileName": f"./{name}", "licenseConcluded": "NOASSERTION",
                   "copyrightText": "NOASSERTION", "checksums": [{"algorithm": "SHA256", "checksumValue": value}]}
                  for name, value in hashes.items()],
        "relationships": [{"spdxElementId": a, "relationshipType": kind, "relatedSpdxElement": b} for a, kind, b in relations],
    }


def complete(files, when):
    """With the bill and, last, the hashes of all."""
    files = {**files, "sbom.spdx.json": (json.dumps(bill(files, when), indent=1) + "\n").encode()}
    sums = "".join(f"{hashlib.sha256(data).hexdigest()}  {name}\n" for name, data in sorted(files.items()))
    return {**files, "SHA256SUMS": sums.encode()}


def archive(files, folder, when):
    """tar.gz of files below a folder: sorted, of nobody, of one time."""
    out = io.BytesIO()
    with gzip.GzipFile(fileobj=out, mode="wb", filename="", mtime=when) as packed, \
            tarfile.open(fileobj=packed, mode="w", format=tarfile.USTAR_FORMAT) as tar:
        for name, data in sorted(files.items()):
            entry = tarfile.TarInfo(f"{folder}/{name}")
            entry.size, entry.mtime, entry.mode = len(data), when, 0o644
            tar.addfile(entry, io.BytesIO(data))
    return out.getvalue()


def main(build):
    when, name = built_at(), f"mssfoc-{version()}"
    files = complete(contents(build), when)
    target = build / "dist"
    target.mkdir(parents=True, exist_ok=True)
    packed = archive(files, name, when)
    (target / f"{name}.tar.gz").write_bytes(packed)
    (target / "SHA256SUMS").write_bytes(files["SHA256SUMS"])
    print(f"{hashlib.sha256(packed).hexdigest()}  {target}/{name}.tar.gz")
    print(f"{len(files)} files, {len(packed) / 1e6:.1f} MB; of each the hash in {target}/SHA256SUMS; with {compiler()}")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
