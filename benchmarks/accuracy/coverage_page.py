"""docs/coverage.md, from the numbers of the coverage study alone."""

from collections.abc import Mapping
from typing import Any, Final

from benchmarks.accuracy.coverage_table import ALL_KINDS, roll_in_words
from benchmarks.accuracy.markdown import number_cell, page, rejected_cell, score_cell, share_cell, table
from gateway.calibration.judgement.coverage import PROMISED

COLUMNS: Final = (
    "Drive", "Roll rate", "Estimator", "Runs", "Batches", "Rejected",
    "Payload, mean abs. error %", "with misses", "95 % covers", "by van", "+- %", "score % (ideal)",
    "Share, mean abs. error %", "with misses", "95 % covers", "by van", "+- %", "score % (ideal)",
    "Centre of gravity sideways, mean abs. error mm", "95 % covers", "+- mm", "score mm (ideal)",
)  # fmt: skip


def coverage_page(found: Mapping[str, Any]) -> str:
    """The page in Markdown, from CoverageTable.to_json."""
    refused = [f"- {text}" for text in found["refused"]]
    return page(
        "Coverage, and mixed driving",
        f"coverage --output DIR --vans {len(found['vans'])} --seed {found['seed']}",
        _protocol(found),
        "",
        *table(COLUMNS, map(_cells, found["lines"])),
        "",
        *_verdicts(found),
        "",
        *(["Calibrations that were impossible:", "", *refused, ""] if refused else []),
    )


def _protocol(found: Mapping[str, Any]) -> str:
    return (
        f"{len(found['vans'])} vans, random variations of the simulator's three types in masses, wheelbases, "
        "springs, dampers, friction, tyres and places. Each is calibrated on six known loads of ten minutes near "
        "50 km/h, the loads fixed to the floor, then driven with loads it has not seen: as calibrated; at another "
        "steady speed between 30 and 110 km/h; mixed: town, country and motorway in one drive, on roads whose "
        "roughness changes, with potholes; mixed on another day: springs changed by 1.5 %, dampers and tyres by 5 % "
        "(standard deviations, each axle its own); mixed with the load on pallets that ring at 15 Hz, as no "
        "calibration saw it; as calibrated and mixed with the load 0.15 to 0.35 m to one side (0 to 0.1 m else). The "
        "sensor sits up to 0.4 m beside the centre line, its place measured; of every other van nobody noted where the "
        "known loads stood sideways. Every van is calibrated and judged twice on the same drives: with its roll rate "
        "mapped, and without. No setting of either estimator was chosen with these vans, roads or seeds. "
        "Batches of 300 s; errors are percent of the payload each van is rated for and of 20 percentage points; with "
        "misses, a rejected batch counts as a mid-range answer. Coverage is the share of 95 % intervals that held the "
        "truth, with its own 95 % limits: batches of one run (of one van) are alike, so the limits are those of as "
        "many independent batches as scatter like the runs (the vans) do. +- is the mean of half the 95 % intervals. "
        "The interval score is their width and 40 times what the truth lies outside; in brackets what it would be, "
        "were errors normal and intervals as wide as they should be. Loads are of every length and height: boxes, "
        "parcels all over the floor, a filled bay, tall and long ones, pipes, and some with a part on the roof; nobody "
        "says which."
    )


def _verdicts(found: Mapping[str, Any]) -> list[str]:
    """A line for every estimator: does the pooled coverage fall short?"""
    return [
        f"- {_name(line)}, {roll_in_words(line['has_roll_rate'])}, all drives, {what}: {_verdict(line[key])}"
        for line in found["lines"]
        if line["kind"] == ALL_KINDS
        for what, key in (("payload", "payload_coverage"), ("share", "front_share_coverage"))
    ]


def _verdict(coverage: Mapping[str, Any] | None) -> str:
    if coverage is None:
        return "too few answers to tell."
    low, high = coverage["low"], coverage["high"]
    promised = f"{100 * PROMISED[0]:.0f} to {100 * PROMISED[1]:.0f} %"
    if high < PROMISED[0]:
        return f"{share_cell(coverage)}: too narrow, the limits lie below {promised}."
    if low > PROMISED[1]:
        return f"{share_cell(coverage)}: too wide, the limits lie above {promised}."
    return f"{share_cell(coverage)}: agrees with {promised}."


def _cells(line: Mapping[str, Any]) -> tuple[str, ...]:
    return (
        line["kind"], "yes" if line["has_roll_rate"] else "no", _name(line),
        str(line["n_runs"]), str(line["n_batches"]), rejected_cell(line),
        *_of_target(line, "payload"),
        *_of_target(line, "front_share"),
        number_cell(line["cg_left_mean_abs_mm"]), share_cell(line["cg_left_coverage"]),
        number_cell(line["cg_left_half_width_mm"]),
        score_cell(line["cg_left_interval_score_mm"], line["cg_left_mean_abs_mm"]),
    )  # fmt: skip


def _of_target(line: Mapping[str, Any], target: str) -> tuple[str, ...]:
    return (
        number_cell(line[f"{target}_mean_abs_pct"]),
        number_cell(line[f"{target}_mean_abs_pct_with_misses"]),
        share_cell(line[f"{target}_coverage"]),
        share_cell(line[f"{target}_coverage_by_van"]),
        number_cell(line[f"{target}_half_width_pct"]),
        score_cell(line[f"{target}_interval_score_pct"], line[f"{target}_mean_abs_pct"]),
    )


def _name(line: Mapping[str, Any]) -> str:
    return str(line["estimator"]).replace("_", " ")
