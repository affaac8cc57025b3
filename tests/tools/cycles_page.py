# SPDX-License-Identifier: MIT
"""Where the cycles of the library and of the current loop go: `make bench` writes build/cycles.md, every instruction of them,
and renews the table of lower bounds in docs/cycles.md, which is otherwise written by hand.
"""
import re
import tomllib
from collections import Counter
from pathlib import Path

from disasm import Image
from listing import KINDS, Sources, between_readings, steps, texts
from pages import replaced
from timing import EXIT, REFILL, Waits, default_waits
from wcet import HANDLER

HERE = Path(__file__).resolve().parent
LIBRARY = ("Clarke_Lib_Do", "InvClarke_Lib_Do", "Park_Lib_Do", "InvPark_Lib_Do")
BL = 2
STAGE = re.compile(r"/\*\s*stage:\s*(.*?)\s*\*/")


def lower_bounds():
    """{row of make bench: {"bound": [[cycles, why], ...], "above": [...]}}."""
    with open(HERE / "lower_bounds.toml", "rb") as stream:
        return tomllib.load(stream)


def total(terms):
    return sum(cycles for cycles, _ in terms)


def line(*cells):
    return "| " + " | ".join(str(cell) for cell in cells) + " |"


def symbol(image, row):
    """The function that a row of `make bench` calls, or None: of a kernel the one around it, no copy that the drive has."""
    return next((image.functions[name] for name in (f"shipped_{row}", row) if name in image.functions), None)


def kernel_rows(image, figures):
    return [name for name, row in figures.items() if "portable_O2" in row and name not in LIBRARY and symbol(image, name)]


def counted(image, row):
    """(steps, cycles with the call) of the function behind a row."""
    found = steps(image, symbol(image, row))
    return found, BL + sum(step.cycles for step in found)


def summary(figures):
    """Each row that has a lower bound, beside what is measured."""
    yield from (line("row of `make bench`", "lower bound", "measured, worst data", "above"), "|---|--:|--:|--:|")
    for name, terms in lower_bounds().items():
        if name in figures:
            measured, bound = figures[name]["cycles_max"], total(terms["bound"])
            yield line(f"`{name}`", bound, measured, measured - bound)


def terms_table(name, figures):
    terms = lower_bounds().get(name)
    if terms is None or name not in figures:
        return
    yield from (line("cycles", "lower bound"), "|--:|---|")
    yield from (line(cycles, why) for cycles, why in terms["bound"])
    yield from (line(f"**{total(terms['bound'])}**", "**together**"), "")
    rest = figures[name]["cycles_max"] - total(terms["bound"]) - total(terms["above"])
    above = terms["above"] + ([[rest, "not explained"]] if rest else [])
    if above:
        yield from (line("cycles", "above it"), "|--:|---|", *(line(cycles, why) for cycles, why in above), "")


def in_registers(image, row):
    """[Step] of a kernel whose arguments and results are in registers: what stands between the readings that time it."""
    timer = image.functions.get(f"time_{row.replace('.', '_')}")  # tests/bench/rows_registers.c
    return [] if timer is None else between_readings(image, timer, steps(image, timer))


def registers_section(image, figures, row):
    if row not in figures:
        return
    found = in_registers(image, row)
    yield from terms_table(row, figures)
    yield f"In registers, row `{row}`: {figures[row]['cycles_max']} cycles measured."
    if found:
        yield from listed(found, Sources(image, [step.address for step in found]))
    yield ""


def function_section(image, figures, row):
    found, cycles = counted(image, row)
    measured = figures[row]["cycles_max"]
    yield from (f"### {row}", "")
    yield from terms_table(row, figures)
    yield from registers_section(image, figures, f"{row}.registers")
    agreed = "" if cycles == measured else ": **they differ**"
    yield f"By its instructions, with the {BL} of the call: {cycles}; measured, worst data: {measured}{agreed}."
    yield from (*listed(found, Sources(image, [step.address for step in found])), "")


def stage_of(sources, address):
    """The comment `stage: NAME` that stands above in the handler's own source, else the function it calls there."""
    chain = sources.chain(address)
    if not chain:
        return "other"
    _, path, number = chain[-1]
    for above in range(number, 0, -1):
        text = sources.line(path, above)
        mark = STAGE.search(text)
        if mark:
            return mark.group(1)
        if text == "{" or text.startswith(HANDLER) or f" {HANDLER}(" in text:
            break
    return chain[-2][0] if len(chain) > 1 else "the handler itself"


def stages(image, found):
    """{stage: [Step]} in the order in which they begin."""
    sources = Sources(image, [step.address for step in found])
    grouped = {}
    for step in found:
        grouped.setdefault(stage_of(sources, step.address), []).append(step)
    return grouped, sources


def loop_section(image, figures):
    found = steps(image, image.functions[HANDLER])
    grouped, sources = stages(image, found)
    leave = EXIT - (REFILL if not found[-1].text.startswith("bx") else 0)
    entry = Waits(vector=default_waits().vector).entry
    whole = entry + sum(step.cycles for step in found) + leave
    measured = figures["current_loop.interrupt.zero_wait"]["cycles_max"]
    yield (f"By its instructions, with a bus that does not wait: {whole}, entry {entry} and exit {leave} included (the"
           f" returning instruction has the rest of the {EXIT}); measured: {measured}, row `current_loop.interrupt.zero_wait`.")
    yield from ("", line("stage", "instructions", "cycles", *KINDS), "|---|" + "--:|" * (2 + len(KINDS)))
    for name, part in grouped.items():
        kinds = Counter()
        for step in part:
            kinds[step.kind] += step.cycles
        yield line(name, len(part), sum(step.cycles for step in part), *(kinds[kind] or "" for kind in KINDS))
    yield line("entry and exit", "", entry + leave, *("" for _ in KINDS))
    yield from (line("sum", len(found), whole, *("" for _ in KINDS)), "")
    for name, part in grouped.items():
        yield from (f"### Stage: {name}", *listed(part, sources), "")


def listed(found, sources):
    return ("", "```text", *texts(found, sources), "```")


PAGE_TOP = """# Every instruction, and its cycles

Written by `make bench`, from the images it measured: data at their worst, memory that answers at once. docs/timing.md has the
rules, docs/cycles.md what the figures mean. An instruction without a rule takes one cycle as data processing does.
"""


def listings(figures, build):
    """The text of build/cycles.md, from the figures of `make bench` and the images they were measured with."""
    bench, firmware = Image(build / "bench.elf"), Image(build / "mssfoc.elf")
    parts = [
        ("The library", (text for row in LIBRARY for text in function_section(bench, figures, row))),
        ("The Q15 kernels, as functions with data in memory; in the current loop they are inlined",
         (text for row in kernel_rows(bench, figures) for text in function_section(bench, figures, row))),
        ("The current loop", loop_section(firmware, figures)),
    ]
    return PAGE_TOP + "".join(f"\n## {title}\n\n" + "\n".join(lines).rstrip("\n") + "\n" for title, lines in parts)


def with_summary(page, figures):
    """docs/cycles.md with its table renewed."""
    return replaced(page, "summary", "\n".join(summary(figures)) + "\n", "docs/cycles.md")
