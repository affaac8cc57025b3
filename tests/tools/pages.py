# SPDX-License-Identifier: MIT
"""Generated parts of documents: what stands between <!-- NAME: by whom --> and <!-- end --> is replaced, the rest is kept."""
import re


def replaced(page, name, text, path=""):
    """The page with the text of one block."""
    mark = re.compile(rf"(<!-- {re.escape(name)}: .*?-->\n).*?(<!-- end -->)", re.S)
    if not mark.search(page):
        raise SystemExit(f"mssfoc: {path or 'the page'} has no block '{name}'")
    return mark.sub(lambda m: m.group(1) + text + m.group(2), page, count=1)


def replace_block(path, name, text):
    path.write_text(replaced(path.read_text(), name, text, path.name))
