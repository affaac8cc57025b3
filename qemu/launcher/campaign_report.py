# SPDX-License-Identifier: MIT
"""Writes what a campaign found, prints the short of it, and gives the verdict."""
from .campaign_plot import draw_scenario
from .campaign_table import as_csv, as_markdown, load_expected, reasons, rows, surprises, words
from .paths import shown
from .simulate import write

SHOWN = 20  # surprises printed; all of them are in the file


def report(outcomes, folder, out):
    """Writes campaign.md, campaign.csv and a picture a scenario; returns the exit status: 0 if nothing is a surprise."""
    expected = load_expected()
    write(folder / "campaign.md", as_markdown(outcomes, expected))
    write(folder / "campaign.csv", as_csv(rows(outcomes)))
    scenarios = list(dict.fromkeys(case.scenario for case in outcomes))
    drawn = [name for name in scenarios if draw_scenario(name, outcomes, folder / f"{name}.png")]
    unexpected, mended = surprises(outcomes, expected)
    verdicts = [outcome["passed"] for outcome in outcomes.values()]
    failed, passed, apart = (verdicts.count(verdict) for verdict in (False, True, None))
    out(f"{passed + failed} runs: {passed} as they should be, {failed - len(unexpected)} failed as expected,"
        f" {len(unexpected)} failed unexpectedly, {len(mended)} passed although a failure is expected")
    if apart:
        out(f"{apart} more do not apply, for reasons of motor or inverter: they stand in campaign.md")
    found = words(outcomes)
    if found:
        out(f"motors that are not shipped: {', '.join(f'{count} {word}' for word, count in found.items())}")
    for case in list(unexpected)[:SHOWN]:
        out(f"  {case.command}")
        out(f"    {reasons(outcomes[case])}")
    for case in list(mended)[:SHOWN]:
        out(f"  {case.command}: passes now, take it out of tests/campaign/expected.toml")
    out(f"written: {shown(folder / 'campaign.md')}, campaign.csv and {len(drawn)} pictures beside it")
    return 1 if unexpected or mended else 0
