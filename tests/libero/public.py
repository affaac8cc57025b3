# SPDX-License-Identifier: MIT
"""What of a project no public design shows, as "COMMAND -option" or "MSS BLOCK NAME" or "CORE NAME"."""
import re
from pathlib import Path

UNCONFIRMED, TO_CHECK = re.compile(r"^# unconfirmed: ([^:]+): (.+)$", re.M), re.compile(r"^# to check: (.+)$", re.M)
FILES = ("*.tcl", "*.pdc", "*.sdc")


def fits(pattern, value):
    return re.fullmatch(pattern, value) is not None


def pattern_of(table, name):
    return next((pattern for key, pattern in table.items() if isinstance(pattern, str) and fits(key, name)), None)


def of_words(call, known):
    """Commands, options and their values."""
    command = known["command"].get(call.name)
    if command is None:
        yield f"{call.name} {' '.join(call.words)}"
        return
    for word in call.words:
        if not fits(command.get("positional", r"(?!)"), word):
            yield f"{call.name} {word}"
    for option, values in call.options.items():
        if option in command.get("flags", []):
            continue
        pattern = command.get("options", {}).get(option)
        for value in values or [""]:
            if pattern is None or not fits(pattern, value):
                yield f"{call.name} {option} {value}".strip()


def of_params(where, params, table):
    for name, value in params.items():
        pattern = pattern_of(table, name)
        if pattern is None or not fits(pattern, value):
            yield f"{where} {name}"


def of_mss(call, known):
    done = {"mss_enable_instance": "on", "mss_disable_instance": "off", "mss_configure_instance": "configured"}.get(call.name)
    block = call.one("-instance_name")
    if done is None:
        return
    table = known["mss"]["block"].get(block, {})
    seen = table.get("seen", [])
    if done not in seen and not (done == "configured" and table.keys() - {"seen"}):
        yield f"MSS {block}"
    if done == "configured":
        yield from of_params(f"MSS {block}", call.params(), table)


def of_cores(call, cores, known):
    """Parameters of instances, and whether there is such a core."""
    for option in ("-core_vlnv", "-vlnv"):
        if call.one(option) and call.one(option) not in known["core"]:
            yield f"core {call.one(option)}"
    if call.name == "sd_instantiate_core":
        cores[call.one("-instance_name")] = call.one("-core_vlnv")
    if call.name == "sd_configure_core_instance":
        vlnv, params = cores.get(call.one("-instance_name"), ""), call.params()
        core = known["core"].get(vlnv, {})
        yield from of_params(vlnv, params, core.get("params", {}))
        sets = core.get("together", [])
        if sets and not any(group.items() <= params.items() for group in sets):
            yield f"{vlnv} {' '.join(sets[0])} together"


def facts(calls, known):
    """All that is not confirmed, each once."""
    found, cores = {}, {}
    for script in calls.values():
        for call in script:
            for fact in (*of_words(call, known), *of_mss(call, known), *of_cores(call, cores, known)):
                found[fact] = True
    return list(found)


def texts(folder):
    return "\n".join(path.read_text(encoding="utf-8") for files in FILES for path in sorted(Path(folder).glob(files)))


def marks(folder):
    """{fact: why} of what the project's files mark, and what else they ask to be checked."""
    text = texts(folder)
    return dict(UNCONFIRMED.findall(text)), TO_CHECK.findall(text)


def findings(calls, folder, known):
    marked, unmarked = marks(folder)[0], facts(calls, known)
    for fact in unmarked:
        if fact not in marked:
            yield f"no public design has: {fact}"
    for fact in marked.keys() - set(unmarked):
        yield f"marked as unconfirmed, but not used or confirmed: {fact}"
