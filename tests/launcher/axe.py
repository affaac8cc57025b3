# SPDX-License-Identifier: MIT
"""axe-core looks at a page. It comes from npm, checked against its hash, and stays outside the repository."""
import base64
import hashlib
import os
import subprocess
import tarfile
from pathlib import Path

import pytest

from launcher.paths import REPO as ROOT

VERSION = "4.10.3"
SHA512 = "Xm7bpRXnDSX2YE2YFfBk2FnF0ep6tmG7xPh8iHee8MIcrgq762Nkce856dYtJYLkuIoYZvGfTs/PbZhideTcEg=="  # as npm's list has it


def program():
    """axe.min.js of the pinned version; skips the test where npm or its registry is not to be had."""
    folder = Path(os.environ.get("BUILD") or ROOT / "build").resolve() / "axe"
    archive = folder / f"axe-core-{VERSION}.tgz"
    folder.mkdir(parents=True, exist_ok=True)
    if not archive.is_file():
        try:
            done = subprocess.run(["npm", "pack", f"axe-core@{VERSION}", "--pack-destination", str(folder)], cwd=folder,
                                  capture_output=True, text=True, check=False, timeout=120)
        except (OSError, subprocess.TimeoutExpired) as error:
            pytest.skip(f"accessibility was not tested: npm gives no axe-core {VERSION}: {error}")
        if done.returncode != 0:
            pytest.skip(f"accessibility was not tested: npm gives no axe-core {VERSION}: {done.stderr.strip()[-200:]}")
    data = archive.read_bytes()
    assert base64.b64encode(hashlib.sha512(data).digest()).decode() == SHA512, f"{archive} is not axe-core {VERSION}"
    with tarfile.open(archive) as opened:
        return opened.extractfile("package/axe.min.js").read().decode("utf-8")


def violations(page, source):
    """What of the page is an obstacle to somebody, one line each."""
    page.browser.execute_cdp_cmd("Runtime.evaluate", {"expression": source})
    run = "axe.run(document, { resultTypes: ['violations'] }).then(arguments[0])"
    found = page.browser.execute_async_script(run)["violations"]
    return [f"{one['id']}: {one['help']}: {node['html'][:120]}" for one in found for node in one["nodes"]]
