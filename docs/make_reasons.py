"""Writes docs/reasons.md from gateway/reasons.py; with --check only tells whether it is up to date."""

from pathlib import Path

from generated import keep_up_to_date

from gateway.reasons import EXPLANATIONS, REMEDIES, SOURCES, Cause

PAGE = Path(__file__).with_name("reasons.md")

INTRODUCTION = """\
# Why a batch gave no estimate

Generated from `gateway/reasons.py` by `python docs/make_reasons.py`; do not edit by hand.

Every batch ends as an estimate or with reasons in `rejected`; then the numbers are null. A reason is no fault of the
software: it says that this stretch of driving cannot be weighed honestly. `shares` in the same record tells which part
of the window each cause masked. Limits named below are [settings](settings.md) of `[batch]` unless another place is
given.
"""


def reasons_page() -> str:
    """The whole page as Markdown."""
    return "\n".join([INTRODUCTION, *(_table(cause) for cause in Cause), _budget()])


BUDGET = """\
## Why an estimate is uncertain

`error_budget` in each estimate lists the sources of its error, largest first, each with one standard deviation and,
where there is one, a remedy; `payload_with_remedy_kg` is the standard deviation of the payload once it is taken. The
dashboard shows it under "Why ± 60 kg?".
"""


def _budget() -> str:
    sources = [f"| `{source}` | {words} |" for source, words in SOURCES.items()]
    remedies = [f"| `{remedy}` | {advice} |" for remedy, advice in REMEDIES.items()]
    tables = ["| source | what it is |", "|---|---|", *sources, "", "| remedy | what to do |", "|---|---|", *remedies]
    return BUDGET + "\n" + "\n".join(tables) + "\n"


def _table(cause: Cause) -> str:
    rows = [
        f"| `{why}` | {explained.happened} | {explained.advice} |"
        for why, explained in EXPLANATIONS.items()
        if explained.cause is cause
    ]
    head = "| reason | what happened | what to do |\n|---|---|---|"
    return f"## {cause}\n\n{head}\n" + "\n".join(rows) + "\n"


def main() -> None:
    """Write the page, or compare it."""
    keep_up_to_date(PAGE, reasons_page(), "gateway/reasons.py")


if __name__ == "__main__":
    main()
