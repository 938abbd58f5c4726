"""Writes README.md's table of errors from the numbers beside this file; with --check only tells if it is up to date.

accuracy.json comes from `springscale reproduce`, coverage.json from `python -m benchmarks.accuracy coverage`,
learning_curve.json from its `learning-curve` on the recorded campaign of another simulator.
"""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from generated import keep_up_to_date

from gateway.reports.paper.table import PAPER_PCT, TITLES

DOCS = Path(__file__).parent
README = DOCS.parent / "README.md"
BEGIN: Final = "<!-- errors: python docs/make_readme_table.py -->"
END: Final = "<!-- end of errors -->"
PAPERS_DRIVES: Final = (("test1", "validation"), ("test2", "validation"), ("test3", "validation"))
DRIVES: Final = (*PAPERS_DRIVES, ("experiment", "validation"))
RECORDED: Final = {
    "Other simulator, loads seen": (10, "validation"),
    "Other simulator, loads unseen": (9, "left_out"),
}
HEAD: Final = (
    "| mean error, payload / front share | published | ratio index | cross spectrum | its 95 % intervals held "
    "| refused |\n|---|---|---|---|---|---|"
)


def table() -> str:
    """What stands between the marks."""
    accuracy = json.loads((DOCS / "accuracy.json").read_text(encoding="utf-8"))["tables"]
    coverage = json.loads((DOCS / "coverage.json").read_text(encoding="utf-8"))["lines"]
    rungs = json.loads((DOCS / "learning_curve.json").read_text(encoding="utf-8"))["rungs"]
    rows = [_reproduced(key, accuracy) for key in DRIVES]
    kinds = dict.fromkeys(line["kind"] for line in coverage if line["kind"] != "all")
    rows += [_recorded(title, n_runs, judged_on, rungs) for title, (n_runs, judged_on) in RECORDED.items()]
    rows += [_covered(kind, coverage) for kind in kinds]
    return "\n".join([BEGIN, HEAD, *rows, END])


def _reproduced(key: tuple[str, str], tables: list[dict[str, Any]]) -> str:
    of = {t["method"]: t for t in tables if (t["drive"], t["split"]) == key}
    ours, index = of["cross spectrum"], of["ratio index"]
    paper = " / ".join(f"{pct:.1f} %" for pct in PAPER_PCT[key])
    held = _held(ours["payload"]["coverage95"], ours["front_share"]["coverage95"])
    refused = f"{ours['n_rejected']} of {ours['n_batches']}"
    return f"| {TITLES[key]} | {paper} | {_errors(index)} | **{_errors(ours)}** | {held} | {refused} |"


def _recorded(title: str, n_runs: int, judged_on: str, rungs: list[dict[str, Any]]) -> str:
    of = {rung["estimator"]: rung[judged_on] for rung in rungs if rung["n_runs"] == n_runs}
    ours, index = of["cross_spectrum"], of["ratio_index"]
    held = _held(ours["payload_coverage95"], ours["front_share_coverage95"])
    errors, others = _pair(ours, "mean_pct"), _pair(index, "mean_pct")
    return f"| {title} | | {others} | **{errors}** | {held} | {100.0 * ours['rejected_share']:.0f} % |"


def _covered(kind: str, lines: list[dict[str, Any]]) -> str:
    of = {line["estimator"]: line for line in lines if line["kind"] == kind}
    ours = of["cross_spectrum"]
    held = _held(ours["payload_coverage"]["share"], ours["front_share_coverage"]["share"])
    refused = f"{ours['n_rejected']} of {ours['n_batches']}"
    title = f"{ours['n_vans']} different vans, {kind}"
    errors, others = _pair(ours, "mean_abs_pct"), _pair(of["ratio_index"], "mean_abs_pct")
    return f"| {title} | | {others} | **{errors}** | {held} | {refused} |"


def _errors(of: Mapping[str, Any]) -> str:
    return f"{of['payload']['mean_abs_pct']:.1f} % / {of['front_share']['mean_abs_pct']:.1f} %"


def _pair(line: Mapping[str, Any], ending: str) -> str:
    found = [line[f"{what}_{ending}"] for what in ("payload", "front_share")]
    return " / ".join("none" if pct is None else f"{pct:.1f} %" for pct in found)


def _held(payload: float | None, share: float | None) -> str:
    return " / ".join("none" if held is None else f"{100.0 * held:.0f} %" for held in (payload, share))


def readme() -> str:
    """README.md with the table as it should be. Raises ValueError where the marks are missing."""
    text = README.read_text(encoding="utf-8")
    before, begin, rest = text.partition(BEGIN)
    _, end, after = rest.partition(END)
    if not (begin and end):
        raise ValueError(f"{README} lacks the marks {BEGIN} and {END}")
    return before + table() + after


def main() -> None:
    """Write the page, or compare it."""
    keep_up_to_date(README, readme(), "docs/accuracy.json, docs/coverage.json and docs/learning_curve.json")


if __name__ == "__main__":
    main()
