# SPDX-License-Identifier: MIT
"""What came of it: a table by room and by kind, who noticed, and every survivor with its diff and reason."""
import difflib
import json
import tomllib
from collections import Counter
from pathlib import Path

LEAST_PERCENT = 95
FIELDS = ("file", "function", "original", "replacement")


def load_reasons(path):
    """{identity: reason} of the mutants that change nothing that matters."""
    with open(path, "rb") as stream:
        rows = tomllib.load(stream).get("mutant", [])
    reasons = {}
    for row in rows:
        missing = [key for key in (*FIELDS, "reason") if not str(row.get(key, "")).strip()]
        if missing:
            raise ValueError(f"{path}: a mutant without {missing[0]}: {row}")
        reasons["|".join([*(row[key] for key in FIELDS), str(row.get("nth", 1))])] = row["reason"]
    return reasons


def load_hints(path):
    """{identity: the test that noticed it when somebody last looked}."""
    return json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}


def write_hints(path, judged, sources):
    """Adds who noticed; what is no fault of these sources any more goes."""
    present = {fault.identity for faults in sources.faults.values() for fault in faults}
    hints = {identity: by for identity, by in load_hints(path).items() if identity in present}
    hints |= {identity: entry["by"] for identity, (_, entry) in judged.items() if entry["by"]}
    path.write_text(json.dumps(hints, indent=0, sort_keys=True, ensure_ascii=False) + "\n", encoding="utf-8")


def complaints(judged, reasons, sources):
    """One line for everything that makes the run fail."""
    noticed = sum(entry["outcome"] == "noticed" for _, entry in judged.values())
    if not judged or 100 * noticed < LEAST_PERCENT * len(judged):
        yield f"{noticed} of {len(judged)} noticed, at least {LEAST_PERCENT} % are asked for"
    for identity, (fault, entry) in judged.items():
        if entry["outcome"] == "survived" and identity not in reasons:
            yield f"{fault.file}:{fault.line}: nothing notices '{fault.replacement}' for '{fault.original}'"
        if entry["outcome"] == "noticed" and identity in reasons:
            yield f"equivalent.toml: {fault.file}:{fault.line} is noticed now, by {entry['by']}: take it out"
    present = {fault.identity for faults in sources.faults.values() for fault in faults}
    for identity in sorted(set(reasons) - present):
        yield f"equivalent.toml: there is no such fault any more: {identity}"


def diff(fault, text):
    lines = difflib.unified_diff(text.splitlines(), fault.applied(text).splitlines(), fault.file, fault.file, n=1, lineterm="")
    return "\n".join(lines)


def room(file):
    parts = Path(file).parts
    return "/".join(parts[:2]) if len(parts) > 2 else parts[0]


def table(title, rows):
    """Lines of a table from (what, outcome, rung)."""
    total, noticed, rungs = Counter(), Counter(), Counter()
    for what, outcome, rung in rows:
        total[what] += 1
        if outcome == "noticed":
            noticed[what] += 1
            rungs[what, rung] += 1
    names = sorted({rung for _, rung in rungs})
    width = max([len(title), *map(len, total)]) if total else len(title)
    yield f"{title:<{width}}  mutants  noticed       " + "".join(f"{name:>13}" for name in names)
    for what in (*sorted(total), None):
        if what is None:
            n, seen, by = sum(total.values()), sum(noticed.values()), Counter()
            for (_, rung), count in rungs.items():
                by[rung] += count
        else:
            n, seen, by = total[what], noticed[what], {name: rungs[what, name] for name in names}
        yield (f"{what or 'all':<{width}}  {n:7}  {seen:7} {100 * seen / n if n else 0:4.0f} %" +
               "".join(f"{by[name] or '-':>13}" for name in names))


def spent(judged, tried):
    """A line for each outcome: how many and what one took."""
    times = {}
    for _, entry in [*judged.values(), *tried.values()]:
        times.setdefault(entry["outcome"], []).append((entry["build_s"], entry["tests_s"]))
    for outcome, pairs in sorted(times.items()):
        build_s, tests_s = (sum(column) / len(pairs) for column in zip(*pairs))
        yield f"{outcome:<14} {len(pairs):4}: {build_s:.1f} s to build and {tests_s:.1f} s of tests each"


def noticers(judged):
    """The tests that noticed first, most often first."""
    by = Counter(entry["by"] for _, entry in judged.values() if entry["by"])
    return [f"{count:4}  {name}" for name, count in sorted(by.items(), key=lambda item: (-item[1], item[0]))]


def lines(judged, tried, reasons, sources):
    found = list(judged.values())
    yield from table("room", [(room(fault.file), entry["outcome"], entry.get("rung", "")) for fault, entry in found])
    yield ""
    yield from table("kind", [(fault.kind, entry["outcome"], entry.get("rung", "")) for fault, entry in found])
    yield ""
    yield from spent(judged, tried)
    yield ""
    yield "noticed first by"
    yield from noticers(judged)
    for identity, (fault, entry) in judged.items():
        if entry["outcome"] == "survived":
            yield ""
            yield f"survived: {fault.function} in {fault.file}:{fault.line} ({fault.kind}; {entry['how']})"
            yield diff(fault, sources.texts[fault.file])
            yield f"reason: {reasons.get(identity, 'none given')}"


def write_json(path, judged, tried, reasons, sources, seed):
    rows = [{"file": fault.file, "line": fault.line, "function": fault.function, "kind": fault.kind,
             "original": fault.original, "replacement": fault.replacement, "nth": fault.nth,
             **{key: entry.get(key) for key in ("outcome", "by", "how", "rung", "build_s", "tests_s")},
             "reason": reasons.get(fault.identity), "diff": diff(fault, sources.texts[fault.file])}
            for fault, entry in [*judged.values(), *tried.values()]]
    noticed = sum(row["outcome"] == "noticed" for row in rows)
    path.write_text(json.dumps({"seed": seed, "mutants": len(judged), "noticed": noticed, "rows": rows}, indent=1) + "\n")
