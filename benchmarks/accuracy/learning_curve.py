"""The page of the learning curve (gateway.calibration.judgement), from its numbers alone."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final

from benchmarks.accuracy.markdown import Column, Row, number, page, table_of, text
from gateway.calibration.judgement.coverage import IDEAL_SCORE


def learning_curve_page(found: Mapping[str, Any]) -> str:
    """The page in Markdown, from LearningCurve.to_json."""
    return page(
        "How many known loads are enough",
        f"learning-curve CAMPAIGN.toml --seed {found['seed']} --output DIR",
        "Each line calibrates on the identification parts of some of the campaign's runs, the empty one among "
        "them, as `springscale calibrate --runs` would, and judges what that has not seen: *left out*, all batches "
        "of the runs that were left out, so loads that calibration never met; *later part*, the validation part of "
        "every run, the calibrated loads among them. Errors are (12), percent of the vehicle's ranges: mean over "
        "the choices of runs +- standard deviation between choices. Batches that were rejected (most as "
        "`out_of_range`: loads outside those calibrated) stand in no mean; the last column counts them. +- is the "
        "mean of half the 95 % intervals; the interval score is their width and 40 times what the truth lies "
        f"outside, {IDEAL_SCORE:g} times the mean error where they are as wide as they should be.",
        "",
        *_rung_table(found["rungs"]),
        "",
        "## Three runs: every triple of the empty run and two loads at different positions",
        "",
        *_rung_table(found["triples"]),
        "",
        on=f" on the campaign of the vehicle `{found['campaign']}`",
    )


def _rung_table(rungs: Sequence[Row]) -> list[str]:
    """A row for each number of runs, estimator and part of the campaign that was judged."""
    rows = [
        {**rung, **rung[key], "where": where}
        for rung in rungs
        for where, key in (("left out", "left_out"), ("later part", "validation"))
        if rung[key]["n_trials"]
    ]
    refused = [{**rung, "where": "no calibration"} for rung in rungs if rung["n_refused"] == rung["n_subsets"]]
    return table_of(RUNG_COLUMNS, sorted([*rows, *refused], key=lambda row: (int(row["n_runs"]), _name(row))))


def _name(rung: Row) -> str:
    return str(rung["estimator"]).replace("_", " ")


def _judged(cell: Callable[[Row], str]) -> Callable[[Row], str]:
    """The cell if there was a calibration to judge."""
    return lambda row: "" if row["where"] == "no calibration" else cell(row)


def _with_spread(target: str) -> Callable[[Row], str]:
    def cell(row: Row) -> str:
        mean, std = row[f"{target}_mean_pct"], row[f"{target}_std_pct"]
        return "none" if mean is None or std is None else f"{mean:.1f} +- {std:.1f}"

    return cell


def _share(key: str) -> Callable[[Row], str]:
    return lambda row: "none" if row[key] is None else f"{100.0 * row[key]:.0f} %"


def _columns(target: str, title: str) -> tuple[Column, ...]:
    return (
        (f"{title}, mean abs. error %", _judged(_with_spread(target))),
        ("worst choice", _judged(number(f"{target}_worst_pct", 1))),
        ("95 % covers", _judged(_share(f"{target}_coverage95"))),
        ("+- %", _judged(number(f"{target}_half_width_pct", 1))),
        ("score %", _judged(number(f"{target}_interval_score_pct", 1))),
    )


RUNG_COLUMNS: Final[tuple[Column, ...]] = (
    ("Runs", text("n_runs")),
    ("Estimator", _name),
    ("Choices", text("n_subsets")),
    ("Refused", text("n_refused")),
    ("Judged on", text("where")),
    *_columns("payload", "Payload"),
    *_columns("front_share", "Share"),
    ("Batches rejected", _judged(_share("rejected_share"))),
)
