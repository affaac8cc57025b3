# SPDX-License-Identifier: MIT
"""What came of it: a table by room and by kind, every survivor, and docs/mutants.md."""
import json
import subprocess
import tomllib
from collections import Counter
from datetime import date
from pathlib import Path

from tools.pages import replace_block

LEAST_PERCENT, ROOM_PERCENT = 90, 80
ROOM_LEAST = 10  # mutants: of fewer a share says little
SHORT = Path(__file__).resolve().parents[1] / "short.txt"
FIELDS = ("file", "function", "original", "replacement")
NAMES = {"qemu/twin": "plant (qemu/twin)", "qemu/launcher": "judge (qemu/launcher)", "qemu/client": "client (qemu/client)"}


def load_survivors(path):
    """{identity: row} of those that a person has looked at: `user`, what it would do to one, or `equivalent`, why nothing."""
    known = {}
    for row in tomllib.loads(path.read_text(encoding="utf-8")).get("mutant", []):
        missing = [key for key in FIELDS if key not in row]
        if missing or bool(row.get("user")) == bool(row.get("equivalent")):
            raise ValueError(f"{path}: a mutant without {missing[0] if missing else 'either user or equivalent'}: {row}")
        known["|".join([*(row[key] for key in FIELDS), str(row.get("nth", 1))])] = row
    return known


def room(file):
    parts = Path(file).parts
    name = "/".join(parts[:2]) if len(parts) > 2 and parts[0] in ("firmware", "qemu") else parts[0]
    return NAMES.get(name, name)


def counted(judged, known):
    """[(mutant, entry)] of those that could be noticed."""
    return [(mutant, entry) for identity, (mutant, entry) in judged.items() if entry["outcome"] == "noticed" or
            entry["outcome"] == "survived" and not known.get(identity, {}).get("equivalent")]


def percent(entries):
    return 100 * sum(entry["outcome"] == "noticed" for entry in entries) / len(entries) if entries else 0.0


def of_short(found):
    """Of 100 that could be noticed, by how many a test of tests/short.txt came first: what `make test` notices at least."""
    names = [line for line in SHORT.read_text(encoding="utf-8").splitlines() if line and not line.startswith("#")]
    short = tuple(name for name in names if not name.startswith("- "))
    but = tuple(name[2:] for name in names if name.startswith("- "))
    by = [entry["by"] or "" for _, entry in found if entry["outcome"] == "noticed"]
    first = sum(name.startswith(short) and not (but and name.startswith(but)) for name in by)
    return 100 * first / len(found) if found else 0.0


def grouped(found, what=lambda mutant: room(mutant.file)):
    groups = {}
    for mutant, entry in found:
        groups.setdefault(what(mutant), []).append(entry)
    return [*sorted(groups.items()), ("all", [entry for _, entry in found])]


def complaints(judged, known, sources):
    """One line for everything that makes the run fail."""
    found = counted(judged, known)
    for name, entries in grouped(found):
        least, enough = (LEAST_PERCENT, 1) if name == "all" else (ROOM_PERCENT, ROOM_LEAST)
        if len(entries) >= enough and percent(entries) < least:
            yield f"{name}: {percent(entries):.0f} % of {len(entries)} noticed, at least {least} % are asked for"
    silent = [mutant for mutant, entry in found if entry["outcome"] == "survived" and mutant.identity not in known]
    if silent:
        yield f"survivors.toml does not say of {len(silent)} what they would do, the first {silent[0].file}:{silent[0].line}"
    for identity, row in known.items():
        if judged.get(identity, (None, {}))[1].get("outcome") == "noticed":
            yield f"survivors.toml: {row['file']}: '{row['replacement']}' is noticed by {judged[identity][1]['by']}"
        elif row["file"] not in sources.texts or identity not in {one.identity for one in sources.mutants(row["file"])}:
            yield f"survivors.toml: there is no such mutant any more: {row['file']}: '{row['replacement']}'"


def table(title, groups):
    """Lines of a table from [(what, entries)]: how many, what share was noticed, by tests of which rung."""
    rungs = sorted({entry["rung"] for _, entries in groups for entry in entries if entry["rung"]})
    width = max(len(title), *(len(what) for what, _ in groups))
    yield f"{title:<{width}}  mutants  noticed       " + "".join(f"{name:>13}" for name in rungs)
    for what, entries in groups:
        by = Counter(entry["rung"] for entry in entries if entry["outcome"] == "noticed")
        yield (f"{what:<{width}}  {len(entries):7}  {sum(by.values()):7} {percent(entries):4.0f} %" +
               "".join(f"{by[name] or '-':>13}" for name in rungs))


def lines(judged, known):
    found = counted(judged, known)
    yield from table("room", grouped(found))
    yield from ["", *table("kind", grouped(found, lambda mutant: mutant.kind)), ""]
    yield f"at least {of_short(found):.0f} % by a test that `make test` plays, too"
    others = Counter(entry["outcome"] for _, entry in judged.values()) - Counter(entry["outcome"] for _, entry in found)
    yield from (f"{count} not counted: {'change nothing' if what == 'survived' else what}" for what, count in others.items())
    for mutant, entry in found:
        if entry["outcome"] == "survived":
            yield f"\nsurvived: {mutant.file}:{mutant.line} {mutant.function} ({mutant.kind}; {entry['how']})"
            yield f"- {mutant.original}\n+ {mutant.replacement}"
            yield f"what it would do: {known.get(mutant.identity, {}).get('user', 'nobody has said yet')}"


def write_json(path, judged, known, seed):
    rows = [{**{key: getattr(mutant, key) for key in (*FIELDS, "nth", "line", "kind")},
             **{key: entry[key] for key in ("outcome", "by", "how", "rung", "rungs", "build_s", "tests_s")},
             **{key: known.get(identity, {}).get(key) for key in ("user", "equivalent")}}
            for identity, (mutant, entry) in judged.items()]
    path.write_text(json.dumps({"seed": seed, "rows": rows}, indent=1) + "\n")


def write_page(path, judged, known, root, how, drawn=()):
    """The block of docs/mutants.md: shares by room, and the survivors; of a run that was ended, what of the draw is left."""
    found, left = counted(judged, known), Counter(room(one.file) for one in drawn if one.identity not in judged)
    left["all"] = sum(left.values())
    how += f"`, of which {len(judged)} of {len(drawn)} were judged to the end" if left["all"] else "`"
    commit = subprocess.run(["git", "rev-parse", "--short", "HEAD"], cwd=root, capture_output=True, text=True).stdout.strip()
    text = [f"`{how}, {date.today().isoformat()}, commit {commit}:", "",
            "| room | mutants | noticed |" + " not judged |" * bool(left["all"]), "|---|---|---|" + "---|" * bool(left["all"])]
    groups = dict(grouped(found))
    for name in sorted({*groups, *left} - {"all"}) + ["all"]:
        text += [f"| {name} | {len(groups.get(name, ()))} | {percent(groups.get(name, ())):.0f} % |" +
                 (f" {left[name]} |" if left["all"] else "")]
    text += ["", f"At least {of_short(found):.0f} % by a test that `make test` plays, too: so many were noticed by one of them "
             "first."]
    text += ["", "| survivor | mistake | what it would do to a user |", "|---|---|---|"]
    for mutant, entry in sorted(found, key=lambda one: (one[0].file, one[0].line)):
        if entry["outcome"] == "survived":
            change = f"`{mutant.replacement or 'nothing'}` for `{mutant.original}`".replace("|", "\\|")
            text.append(f"| {mutant.file}:{mutant.line} | {change} | {known.get(mutant.identity, {}).get('user', '')} |")
    replace_block(path, "mutants", "\n".join(text) + "\n")
