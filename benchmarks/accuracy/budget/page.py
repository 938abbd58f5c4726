"""The page of the budget study, from its numbers alone."""

from collections.abc import Mapping
from typing import Any, Final

from benchmarks.accuracy.markdown import number_cell, page, rejected_cell, score_cell, share_cell, table

ALONE: Final = (
    "Source", "Batches",
    "Payload: stated kg", "found kg", "slope", "z squared",
    "Share: stated %", "found %", "slope", "z squared",
)  # fmt: skip
TOGETHER: Final = (
    "Roll rate", "Said", "Quantity", "Batches", "Rejected",
    "Mean abs. error", "95 % covers", "by van", "z squared", "+-", "score (ideal)",
)  # fmt: skip
WATCHED: Final = {
    "misfit": "misfit",
    "tension": "tension",
    "sensor_position_score": "sensor position",
    "sensor_noise_score": "sensor noise",
}
REFUSALS: Final = ("Roll rate", "Batches", "Refused", *(f"{name}: 50, 99, 100 %" for name in WATCHED.values()))
MOST_REFUSED: Final = 0.01  # chosen: share of healthy batches
QUANTITIES: Final = {"payload": "payload, %", "front_share": "front share, %", "cg_left": "lateral place, cm"}
SLOPE: Final = (0.8, 1.25)  # chosen: within a quarter
Z2_ALONE: Final = (0.7, 1.4)  # chosen: single sources are few
COVERAGE: Final = (0.93, 0.97)  # chosen: about 95 %
Z2_TOGETHER: Final = (0.8, 1.2)  # chosen: within a fifth


def budget_page(found: Mapping[str, Any]) -> str:
    """The page in Markdown, from its numbers."""
    n_vans = found["n_vans"]
    return page(
        "The budget of the error",
        f"budget --output DIR --vans {n_vans} --seed {found['seed']}",
        "## Each source alone",
        "",
        f"{n_vans} simulated vans, calibrated on six known loads without a roll rate, drive once with a load like "
        "the calibrated ones and once more, on the same road in the same way, for each source with that alone "
        "drawn from the distribution that the estimator states of it: springs, tyres and dampers of another day; "
        "another temperature of the sensors; an undeclared load of another length and height; "
        "one that stands beside the centre line; a calibration by a fitter who was wrong about the empty front "
        "share. Stated and found are root mean squares: of the standard deviations that the columns of a source "
        "state, and of the shifts found. The slope is that of the shifts found over those predicted for what was "
        "drawn; for the load's shape predicted is by how much the answer differs from that under the true shape. "
        "z squared is the mean square of the shifts over the variances stated. Right are slopes from "
        f"{SLOPE[0]:g} to {SLOPE[1]:g} and z squared from {Z2_ALONE[0]:g} to {Z2_ALONE[1]:g}.",
        "",
        *table(ALONE, [_alone_cells(row) for row in found["alone"]]),
        "",
        *_alone_verdicts(found["alone"]),
        "",
        "## All at once",
        "",
        f"{n_vans} vans with all of these drawn at once, mixed drives (town, country, motorway), and loads of any "
        "shape: boxes, parcels all over the floor, a filled bay, tall and long ones, pipes, some with a part on "
        "the roof. Every drive is weighed four times: by a calibration with a roll rate and by one without, with "
        "nothing said of the loads, and with what the vehicle carries said rightly for this load. Payload is in "
        "percent of the rated payload, front share in percent of 20 percentage points. Coverage is of the 95 % "
        "intervals, with its own 95 % limits by runs; +- is the mean of half these intervals; the interval score "
        "is their width and 40 times what the truth lies outside, in brackets what it would be for normal errors "
        f"and intervals of the right width. Right are {100 * COVERAGE[0]:.0f} to {100 * COVERAGE[1]:.0f} % and z "
        f"squared from {Z2_TOGETHER[0]:g} to {Z2_TOGETHER[1]:g}.",
        "",
        *table(TOGETHER, [cells for row in found["together"] for cells in _together_cells(row)]),
        "",
        *_together_verdicts(found["together"]),
        "",
        "## Refusals of healthy vans",
        "",
        "Nothing is wrong with these vans and sensors, so every batch refused as misfit or as a changed sensor is "
        "refused for nothing. The rate is of those, with its 95 % limits by van; the other columns tell how near "
        "to its limit each watched figure comes (ratios; at 1 a batch is refused). Nothing is said of the loads. "
        f"Right is a rate of at most {100.0 * MOST_REFUSED:g} %.",
        "",
        *table(REFUSALS, [_refusal_cells(row) for row in found["together"] if not row["is_shape_said"]]),
        "",
    )


def _alone_cells(row: Mapping[str, Any]) -> list[str]:
    return [
        row["source"],
        str(row["n"]),
        number_cell(row["payload_stated_kg"]),
        number_cell(row["payload_found_kg"]),
        number_cell(row["payload_slope"]),
        number_cell(row["payload_z2"]),
        number_cell(row["front_share_stated_pct"]),
        number_cell(row["front_share_found_pct"]),
        number_cell(row["front_share_slope"]),
        number_cell(row["front_share_z2"]),
    ]


def _alone_verdicts(rows: list[Mapping[str, Any]]) -> list[str]:
    """The figures outside their limits, source by source."""
    return [
        f"- {row['source']}, {words}: {what} is {row[key]:.2f}, {_side(row[key], limits)}."
        for row in rows
        for words, name in (("payload", "payload"), ("share", "front_share"))
        for what, key, limits in (("slope", f"{name}_slope", SLOPE), ("z squared", f"{name}_z2", Z2_ALONE))
        if row[key] is not None and not limits[0] <= row[key] <= limits[1]
    ] or ["Every slope and every z squared is right."]


def _side(x: float, limits: tuple[float, float]) -> str:
    return f"below {limits[0]:g}" if x < limits[0] else f"above {limits[1]:g}"


def _together_cells(row: Mapping[str, Any]) -> list[list[str]]:
    return [
        [
            "yes" if row["has_roll_rate"] else "no",
            "what is carried" if row["is_shape_said"] else "nothing",
            words,
            str(row["n_batches"]),
            rejected_cell(row),
            number_cell(row[name]["mean_abs"]),
            share_cell(row[name]["coverage"]),
            share_cell(row[name]["coverage_by_van"]),
            number_cell(row[name]["z2"]),
            number_cell(row[name]["half_width"]),
            score_cell(row[name]["interval_score"], row[name]["mean_abs"]),
        ]
        for name, words in QUANTITIES.items()
        if row[name]["n"]
    ]


def _refusal_cells(row: Mapping[str, Any]) -> list[str]:
    found = row["refusals"]
    watched = [found["watched"].get(name) for name in WATCHED]
    ratios = ["none" if one is None else f"{one['p50']:.2f}, {one['p99']:.2f}, {one['most']:.2f}" for one in watched]
    return ["yes" if row["has_roll_rate"] else "no", str(row["n_batches"]), share_cell(found["rate"]), *ratios]


def _together_verdicts(rows: list[Mapping[str, Any]]) -> list[str]:
    lines = []
    for row in rows:
        way = f"{'with' if row['has_roll_rate'] else 'without'} a roll rate, "
        way += "what is carried said" if row["is_shape_said"] else "nothing said"
        for name, words in QUANTITIES.items():
            coverage, z2 = row[name]["coverage"], row[name]["z2"]
            if coverage is not None and not COVERAGE[0] <= coverage["share"] <= COVERAGE[1]:
                share = f"{100.0 * coverage['share']:.0f} %"
                lines.append(f"- {way}, {words.split(',')[0]}: intervals hold {share} of the truths.")
            if z2 is not None and not Z2_TOGETHER[0] <= z2 <= Z2_TOGETHER[1]:
                lines.append(f"- {way}, {words.split(',')[0]}: z squared is {z2:.2f}.")
    return lines or ["Every coverage and every z squared is right."]
