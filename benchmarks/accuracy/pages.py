"""The pages of the learning curve and of the advice, from the numbers of these studies alone."""

from collections.abc import Mapping, Sequence
from typing import Any, Final

from benchmarks.accuracy.markdown import page, table
from gateway.calibration.judgement.coverage import IDEAL_SCORE

RUNG_COLUMNS: Final = (
    "Runs", "Estimator", "Choices", "Refused", "Judged on",
    "Payload, mean abs. error %", "worst choice", "95 % covers", "+- %", "score %",
    "Share, mean abs. error %", "worst choice", "95 % covers", "+- %", "score %", "Batches rejected",
)  # fmt: skip
ADVICE_ROWS: Final = (
    ("before", "three runs"),
    ("advised", "and the fourth that the plan advises"),
    ("others", "and another fourth, on average"),
    ("least", "and the fourth that the plan calls least useful"),
    ("best", "best fourth by hindsight"),
    ("worst", "worst fourth by hindsight"),
)


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


def advice_page(found: Mapping[str, Any]) -> str:
    """The page in Markdown, from AdviceStudy.to_json."""
    missed, answered = found["with_misses"], found["answered"]
    return page(
        "Does the plan's advice help?",
        "advice CAMPAIGN.toml --output DIR",
        f"From each of {missed['n_choices']} triples of runs (the empty one, and two loads at different positions) "
        "every other run of the campaign is taken as the fourth, and the plan, knowing the triple alone, says "
        "which it would drive. Judged on the validation part of all runs, the same batches for every choice. Mean "
        "|error| (12) of payload and of share, cross spectrum: once with every rejected batch counted as a "
        "mid-range answer, once over answered batches only. The second flatters whoever refuses the hard ones, so "
        "the first decides. What the plan itself expects after three runs, of the loads the vehicle may carry, "
        f"is a mean |error| of {_number(answered['expected'][0], 2)} and {_number(answered['expected'][1], 2)} %: "
        "cautious where it lies above what was found.",
        "",
        "| Calibrated on | Payload % | Share % | Payload %, answered | Share %, answered |",
        "|---|---|---|---|---|",
        *(f"| {what} | {_pair(missed[key])} | {_pair(answered[key])} |" for key, what in ADVICE_ROWS),
        f"| the advised one beats the average of the others | {_often(missed)} | {_often(answered)} |",
        "",
        on=f" on the campaign of the vehicle `{found['campaign']}`",
    )


def _rung_table(rungs: Sequence[Mapping[str, Any]]) -> list[str]:
    rows = [
        _cells(rung, where, rung[key])
        for rung in rungs
        for where, key in (("left out", "left_out"), ("later part", "validation"))
        if rung[key]["n_trials"]
    ]
    refused = [
        [str(rung["n_runs"]), _name(rung), str(rung["n_subsets"]), str(rung["n_refused"]), "no calibration", *[""] * 11]
        for rung in rungs
        if rung["n_refused"] == rung["n_subsets"]
    ]
    ordered = sorted([*rows, *refused], key=lambda cells: (int(cells[0]), cells[1]))
    return table(RUNG_COLUMNS, ordered)


def _cells(rung: Mapping[str, Any], where: str, spread: Mapping[str, Any]) -> list[str]:
    return [
        str(rung["n_runs"]), _name(rung), str(rung["n_subsets"]), str(rung["n_refused"]), where,
        _with_spread(spread["payload_mean_pct"], spread["payload_std_pct"]),
        _number(spread["payload_worst_pct"]), _share(spread["payload_coverage95"]),
        _number(spread["payload_half_width_pct"]), _number(spread["payload_interval_score_pct"]),
        _with_spread(spread["front_share_mean_pct"], spread["front_share_std_pct"]),
        _number(spread["front_share_worst_pct"]), _share(spread["front_share_coverage95"]),
        _number(spread["front_share_half_width_pct"]), _number(spread["front_share_interval_score_pct"]),
        _share(spread["rejected_share"]),
    ]  # fmt: skip


def _name(rung: Mapping[str, Any]) -> str:
    return str(rung["estimator"]).replace("_", " ")


def _with_spread(mean: float | None, std: float | None) -> str:
    return "none" if mean is None or std is None else f"{mean:.1f} +- {std:.1f}"


def _pair(errors: Sequence[float | None]) -> str:
    payload, share = errors
    return f"{_number(payload, 2)} | {_number(share, 2)}"


def _often(comparison: Mapping[str, Any]) -> str:
    payload, share = comparison["better_share"]
    return f"{_share(payload)} of triples | {_share(share)} of triples"


def _number(x: float | None, digits: int = 1) -> str:
    return "none" if x is None else f"{x:.{digits}f}"


def _share(x: float | None) -> str:
    return "none" if x is None else f"{100.0 * x:.0f} %"
