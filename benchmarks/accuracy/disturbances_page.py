"""The page of the disturbances, from the numbers of their study alone."""

from collections.abc import Mapping
from typing import Any, Final

from benchmarks.accuracy.coverage_table import ALL_KINDS
from benchmarks.accuracy.disturbed import DISTURBANCES, UNDISTURBED
from benchmarks.accuracy.markdown import all_but, number_cell, page, refused_cell, score_cell, table
from gateway.records import Why

COLUMNS: Final = (
    "Disturbance", "Batches", "Refused, and why", "Payload, mean abs. error %", "Share, mean abs. error %",
    "Payload held or refused", "Share held or refused",
    "Payload, +- %", "score % (ideal)", "Share, +- %", "score % (ideal)",
)  # fmt: skip
WELL: Final = 0.9  # chosen: of the batches; covered by their 95 % intervals, or refused for a right reason
OF_ANY_DRIVE: Final = (Why.TOO_SLOW, Why.SPEED_SPREAD, Why.SPEED_MISSING, Why.NOT_ENOUGH_EXCITATION)
MENDED_WITHIN: Final = 1.25  # chosen: of the undisturbed error


def disturbances_page(found: Mapping[str, Any]) -> str:
    """The page in Markdown, from CoverageTable.to_json."""
    lines = [line for line in found["lines"] if line["kind"] != ALL_KINDS]
    return page(
        "Disturbances",
        f"disturbances --output DIR --vans {len(found['vans'])} --seed {found['seed']}",
        f"{len(found['vans'])} simulated vans, each calibrated on six known loads. The limits of the misfit and of a "
        "turned gyro, and the widening by worn dampers, were designed with the first two vans of this seed in view; no "
        "other setting was. Each van is driven twice with a load within the calibrated ones, as calibrated and mixed "
        "(town, country, motorway). Every line disturbs the same two drives or, for another sensor, vehicle or load, "
        "repeats them; the last line carries 1.5 times the rated payload. Sensors are up to 0.4 m off the centre line, "
        "loads within 0.1 m of it, "
        "sideways 0.15 to 0.35 m; a line without a roll rate is calibrated without one too. Errors are percent of "
        "the rated payload and of 20 percentage points, over the batches that were answered. The two columns "
        "before the widths count batches whose 95 % interval held, and those refused for a reason that is right. "
        "+- is the mean of half the 95 % intervals; the interval score is their width and 40 times what the truth "
        "lies outside, in brackets what it would be for normal errors and intervals of the right width.",
        "",
        *table(COLUMNS, map(_cells, lines)),
        "",
        *_verdicts(lines),
        "",
    )


def held_or_refused(line: Mapping[str, Any], quantity: str) -> float:
    """The share (0..1) of a line's batches that do not mislead: covered, or refused for a right reason."""
    coverage, answered = line[f"{quantity}_coverage"], line["n_batches"] - line["n_rejected"]
    held = coverage["share"] * answered if coverage else 0.0
    right = {str(why) for why in (*DISTURBANCES[line["kind"]].reasons, *OF_ANY_DRIVE)}
    wrong = sum(n for why, n in line["rejected_by_reason"].items() if why not in right)
    return float((held + line["n_rejected"] - wrong) / line["n_batches"])


def is_mended(line: Mapping[str, Any], undisturbed: Mapping[str, Any]) -> bool:
    """Whether both errors are within 1.25 times the undisturbed ones, or nothing was answered."""
    names = ("payload_mean_abs_pct", "front_share_mean_abs_pct")
    return all(line[name] is None or line[name] <= MENDED_WITHIN * undisturbed[name] for name in names)


def _cells(line: Mapping[str, Any]) -> list[str]:
    return [
        line["kind"],
        str(line["n_batches"]),
        refused_cell(line["n_rejected"], line["rejected_by_reason"]),
        *(
            "–" if line[name] is None else f"{line[name]:.1f}"
            for name in ("payload_mean_abs_pct", "front_share_mean_abs_pct")
        ),
        *(f"{100.0 * held_or_refused(line, quantity):.0f} %" for quantity in ("payload", "front_share")),
        *(cell for quantity in ("payload", "front_share") for cell in _widths(line, quantity)),
    ]


def _widths(line: Mapping[str, Any], quantity: str) -> tuple[str, str]:
    score = score_cell(line[f"{quantity}_interval_score_pct"], line[f"{quantity}_mean_abs_pct"])
    return number_cell(line[f"{quantity}_half_width_pct"]), score


def _verdicts(lines: list[Mapping[str, Any]]) -> list[str]:
    undisturbed = next(line for line in lines if line["kind"] == UNDISTURBED.name)
    misled = [
        line["kind"]
        for line in lines
        if min(held_or_refused(line, quantity) for quantity in ("payload", "front_share")) < WELL
    ]
    unmended = [one["kind"] for one in lines if DISTURBANCES[one["kind"]].is_mended and not is_mended(one, undisturbed)]
    return [
        f"- Held or refused in at least {100 * WELL:.0f} % of the batches: {all_but(misled)}",
        f"- Time stamps, losses and lags within {MENDED_WITHIN:g} times the undisturbed errors: {all_but(unmended)}",
    ]
