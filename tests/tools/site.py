# SPDX-License-Identifier: MIT
"""`make site`: the documents as pages with a search, in BUILD/site, by mkdocs. What they link to of the sources is among them.

usage: site.py BUILD
"""
import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
OF_ROOT = {"README.md": "about.md", "CHANGELOG.md": "changelog.md", "CONTRIBUTING.md": "contributing.md",
           "SECURITY.md": "security.md"}
LINK = re.compile(r"\]\(([^)\s#]+)(#[^)\s]*)?\)")
TAG = re.compile(r'(href|src)="([^"#:]+)(?=[#"])')
SECTION = re.compile(r"^\| (to [^|]+) \| \|$")


def staged(target):
    """Where a file of the tree is put, from the site's root."""
    path = target.relative_to(ROOT)
    if path.parts[0] == "docs":
        return str(path.relative_to("docs"))
    return OF_ROOT.get(str(path)) or f"source/{path}.txt"


def page_text(path, wanted):
    """Its text, with links as they are on the site; what is wanted besides pages is added to `wanted`."""
    here = Path(staged(path)).parent

    def moved(match):
        if "://" in match[1]:
            return match[0]
        target = (path.parent / match[1]).resolve()
        if target.is_dir():
            return "]()" if target == ROOT else f"](# \"{match[1]}\")"
        if target.suffix != ".md":
            wanted.add(target)
        return f"]({os.path.relpath(staged(target), here)}{match[2] or ''})"

    def moved_tag(match):
        target = (path.parent / match[2]).resolve()
        if target.suffix != ".md":
            wanted.add(target)
        to = re.sub(r"README\.md$", "index.html", staged(target)).removesuffix(".md")
        return f'{match[1]}="{os.path.relpath(to, here)}{".html" if target.suffix == ".md" and "." not in to else ""}'

    return TAG.sub(moved_tag, LINK.sub(moved, path.read_text(encoding="utf-8")))


def pages():
    return sorted(DOCS.rglob("*.md")) + [ROOT / name for name in OF_ROOT]


def navigation():
    """[{section: [{title: page}]}] as docs/README.md has it."""
    found = [{"mssfoc": "README.md"}, {"about": "about.md"}]
    for line in (DOCS / "README.md").read_text(encoding="utf-8").split("\n"):
        if section := SECTION.match(line):
            found.append({section[1]: []})
        elif line.startswith("| ") and len(found) > 2:
            found[-1][next(iter(found[-1]))] += [{title: staged((DOCS / target.split("#")[0]).resolve())} for title, target
                                                 in re.findall(r"\[([^\]]+)\]\(([^)]+\.md)(?:#[^)]*)?\)", line)]
    return found


def stage(folder):
    shutil.rmtree(folder, ignore_errors=True)
    wanted = set()
    for path in pages():
        to = folder / staged(path)
        to.parent.mkdir(parents=True, exist_ok=True)
        to.write_text(page_text(path, wanted), encoding="utf-8")
    for target in wanted:
        to = folder / staged(target)
        to.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(target, to)


def main(build):
    build = Path(build).resolve()
    stage(build / "site-pages")
    config = {"site_name": "mssfoc", "site_url": "", "docs_dir": str(build / "site-pages"), "site_dir": str(build / "site"),
              "use_directory_urls": False, "theme": "readthedocs", "plugins": ["search"], "nav": navigation(),
              "markdown_extensions": ["tables", "fenced_code", {"toc": {"permalink": True}}]}
    (build / "mkdocs.yml").write_text(json.dumps(config))  # which is YAML, too
    done = subprocess.run(["mkdocs", "build", "--strict", "--quiet", "--config-file", build / "mkdocs.yml"], check=False)
    if done.returncode != 0:
        raise SystemExit("mssfoc: the site was not built")
    print(f"mssfoc: {build / 'site' / 'index.html'}")


if __name__ == "__main__":
    main(sys.argv[1])
