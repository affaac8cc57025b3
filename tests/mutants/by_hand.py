# SPDX-License-Identifier: MIT
"""Mistakes that a person has thought of, judged as the drawn ones are."""
import tomllib
from pathlib import Path

from mutants.mutant import mutants_of, without_remarks


def load(path, sources):
    """Those of a file of [[mistake]] with file, old and new: an expression, or whole statements without a declaration."""
    path, made = Path(path), []
    for row in tomllib.loads(path.read_text(encoding="utf-8")).get("mistake", []):
        said = f"{path.name}: {row.get('file')}: '{row.get('old')}'"
        missing = [key for key in ("file", "old", "new") if key not in row]
        if missing or row["file"] not in sources.texts:
            raise ValueError(f"{said}: {f'no {missing[0]}' if missing else 'no file that mistakes are put into'}")
        file, old, new = row["file"], row["old"].strip(), row["new"].strip()
        text = sources.texts[file]
        if text.count(old) != 1:
            raise ValueError(f"{said} stands there {text.count(old)} times; give so much of the text that it is there once")
        start, end = text.index(old), text.index(old) + len(old)
        form = "statement" if old.endswith((";", "}")) else "expression"
        blank = text if file.endswith(".py") else without_remarks(text)
        mutant, = mutants_of(file, blank, [(row.get("function", ""), "by hand", [(start, end, new)], (start, end, form))])
        if not sources.valid(mutant, [one for one in made if one.file == file]):
            raise ValueError(f"{said} for '{new}' does not compile beside the original, or overlaps with another: give an "
                             "expression, or whole statements without a declaration")
        made.append(mutant)
    if not made:
        raise ValueError(f"{path}: no [[mistake]]")
    return made
