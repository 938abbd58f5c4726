"""The study of the budget: both kinds of drives of every van, and the page."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, Final

from benchmarks.accuracy.budget import alone, together
from benchmarks.accuracy.budget.alone import Shift, rows_of_shifts
from benchmarks.accuracy.budget.together import Weighing, rows_of_weighings
from benchmarks.accuracy.markdown import (
    Column,
    Row,
    number,
    page,
    rejected_cell,
    score_cell,
    share,
    share_cell,
    table_of,
    text,
)
from benchmarks.accuracy.study import Study

SEED: Final = 20_310  # arbitrary, of this study alone
WATCHED: Final = {
    "misfit": "misfit",
    "tension": "tension",
    "sensor_position_score": "sensor position",
    "sensor_noise_score": "sensor noise",
}
MOST_REFUSED: Final = 0.01  # chosen: share of healthy batches
QUANTITIES: Final = {"payload": "payload, %", "front_share": "front share, %", "cg_left": "lateral place, cm"}
SLOPE: Final = (0.8, 1.25)  # chosen: within a quarter
Z2_ALONE: Final = (0.7, 1.4)  # chosen: single sources are few
COVERAGE: Final = (0.93, 0.97)  # chosen: about 95 %
Z2_TOGETHER: Final = (0.8, 1.2)  # chosen: within a fifth


Found = tuple[list[Shift], list[Weighing]]


def of_one_van(seed: int, number: int) -> Found:
    """A van with each source alone, and another with all at once."""
    return alone.of_one_van(seed, number), together.of_one_van(seed + 1, number)


def numbers(seed: int, n: int, vans: Sequence[Found]) -> dict[str, Any]:
    """A row for each source alone, and one for each way of weighing with all at once."""
    shifts, weighings = [one for each, _ in vans for one in each], [one for _, each in vans for one in each]
    rows = {"alone": rows_of_shifts(shifts), "together": rows_of_weighings(weighings)}
    return {"seed": seed, "n_vans": n, **rows}


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
        "drawn from the distribution that the estimator states of it: springs, tyres, dampers and friction of "
        "another day; another temperature of the sensors; an undeclared load of another length and height; "
        "one that stands beside the centre line; a calibration by a fitter who was wrong about the empty front "
        "share. Stated and found are root mean squares: of the standard deviations that the columns of a source "
        "state, and of the shifts found. The slope is that of the shifts found over those predicted for what was "
        "drawn; for the load's shape predicted is by how much the answer differs from that under the true shape. "
        "Batches in which two loads compete as the answer are left out: it may jump between them. "
        "z squared is the mean square of the shifts over the variances stated; where a column nearly vanishes, a small "
        "shift makes it large, and the root mean squares say how much that is. Right are slopes from "
        f"{SLOPE[0]:g} to {SLOPE[1]:g} and z squared from {Z2_ALONE[0]:g} to {Z2_ALONE[1]:g}.",
        "",
        *table_of(ALONE, found["alone"]),
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
        *table_of(TOGETHER, [one for row in found["together"] for one in _by_quantity(row)]),
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
        *table_of(REFUSALS, [row for row in found["together"] if not row["is_shape_said"]]),
        "",
    )


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


def _by_quantity(row: Row) -> Iterator[Row]:
    """The rows of the table: one a quantity that was answered."""
    return ({**row, **row[name], "quantity": words} for name, words in QUANTITIES.items() if row[name]["n"])


def _roll(row: Row) -> str:
    return "yes" if row["has_roll_rate"] else "no"


def _ratios(name: str) -> Callable[[Row], str]:
    def cell(row: Row) -> str:
        found = row["refusals"]["watched"].get(name)
        return "none" if found is None else f"{found['p50']:.2f}, {found['p99']:.2f}, {found['most']:.2f}"

    return cell


ALONE: Final[tuple[Column, ...]] = (
    ("Source", text("source")),
    ("Batches", text("n")),
    ("Payload: stated kg", number("payload_stated_kg")),
    ("found kg", number("payload_found_kg")),
    ("slope", number("payload_slope")),
    ("z squared", number("payload_z2")),
    ("Share: stated %", number("front_share_stated_pct")),
    ("found %", number("front_share_found_pct")),
    ("slope", number("front_share_slope")),
    ("z squared", number("front_share_z2")),
)
TOGETHER: Final[tuple[Column, ...]] = (
    ("Roll rate", _roll),
    ("Said", lambda row: "what is carried" if row["is_shape_said"] else "nothing"),
    ("Quantity", text("quantity")),
    ("Batches", text("n_batches")),
    ("Rejected", rejected_cell),
    ("Mean abs. error", number("mean_abs")),
    ("95 % covers", share("coverage")),
    ("by van", share("coverage_by_van")),
    ("z squared", number("z2")),
    ("+-", number("half_width")),
    ("score (ideal)", lambda row: score_cell(row["interval_score"], row["mean_abs"])),
)
REFUSALS: Final[tuple[Column, ...]] = (
    ("Roll rate", _roll),
    ("Batches", text("n_batches")),
    ("Refused", lambda row: share_cell(row["refusals"]["rate"])),
    *((f"{words}: 50, 99, 100 %", _ratios(name)) for name, words in WATCHED.items()),
)


def _together_verdicts(rows: list[Mapping[str, Any]]) -> list[str]:
    lines = []
    for row in rows:
        way = f"{'with' if row['has_roll_rate'] else 'without'} a roll rate, "
        way += "what is carried said" if row["is_shape_said"] else "nothing said"
        for name, words in QUANTITIES.items():
            coverage, z2 = row[name]["coverage"], row[name]["z2"]
            if coverage is not None and not COVERAGE[0] <= coverage["share"] <= COVERAGE[1]:
                held = f"{100.0 * coverage['share']:.0f} %"
                lines.append(f"- {way}, {words.split(',')[0]}: intervals hold {held} of the truths.")
            if z2 is not None and not Z2_TOGETHER[0] <= z2 <= Z2_TOGETHER[1]:
                lines.append(f"- {way}, {words.split(',')[0]}: z squared is {z2:.2f}.")
    return lines or ["Every coverage and every z squared is right."]


STUDY: Final = Study(
    name="budget",
    does="Does the error agree with its budget? Each source alone, then all at once; ~3 min a van.",
    doing="driving vans with each source alone, and with all at once",
    of_case=of_one_van,
    numbers=numbers,
    page=budget_page,
    seed=SEED,
    n=12,
)
