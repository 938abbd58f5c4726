"""Siblings calibrated in six ways, all judged on the same drives.

Vans, roads and seeds serve this study alone: no setting of the line's calibration was chosen with them.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from enum import StrEnum
from typing import Any, Final

import numpy as np

from benchmarks.accuracy.coverage_table import ALL_KINDS, JudgedBatch, coverage_table, judged_batches
from benchmarks.accuracy.lines import Driven, draw_line, sibling, sister
from benchmarks.accuracy.markdown import Column, page, rejected_cell, table_of, target_columns, text
from benchmarks.accuracy.study import Study
from gateway.calibration.half_car.fit import CrossSpectrumFit, fit_cross_spectrum
from gateway.calibration.judgement.evaluation import judge
from gateway.calibration.known_run import KnownRun
from gateway.calibration.line.left_out import Sibling, with_siblings_left_out
from gateway.calibration.line.line import Line, Sister, line_of
from gateway.core.calibrated import CalibratedVehicle
from gateway.core.known_weights import Knowledge, Observation
from gateway.core.vehicle import Vehicle
from gateway.estimate import Estimate
from gateway.posterior import fused

SEED: Final = 20280  # arbitrary, of this study alone
VANS_PER_LINE: Final = 3  # chosen
SISTERS: Final = 3  # the least that give a scatter (line.scatter.LEAST_SIBLINGS)
ESTIMATOR: Final = "cross_spectrum"
ID: Final = "in memory"
EMPTY_STD_KG: Final = 3.0  # chosen: of an empty vehicle: driver, fuel, loose items
EMPTY_SHARE_STD_PCT: Final = 0.2  # chosen, likewise


class Way(StrEnum):
    """How a sibling is calibrated."""

    AS_IS = "the line's file as it is"
    WEIGHED_EMPTY = "the line's file, and known to be empty once"
    ALONE = "one empty drive, priors of any vehicle"
    LIKE_ONE = "one empty drive, like one sister"
    LIKE_ONE_TWO_DRIVES = "and a second, mixed, empty drive"
    LIKE_THREE = "one empty drive, like a line of three sisters left out in turn"


def of_one_line(seed: int, number: int) -> list[JudgedBatch]:
    """All siblings of one line, in every way."""
    line_seed, sister_seeds, sibling_seeds = np.random.SeedSequence([seed, number]).spawn(3)
    drawn = draw_line(number, np.random.default_rng(line_seed))
    sisters = [sister(drawn, f"sister_{i}", one) for i, one in enumerate(sister_seeds.spawn(SISTERS))]
    calibrated = [_sibling(one) for one in sisters]
    first = calibrated[0].sister
    of_one = line_of([first])
    of_three = with_siblings_left_out(calibrated, line_of([one.sister for one in calibrated])).line
    found: list[JudgedBatch] = []
    for i, one in enumerate(sibling_seeds.spawn(VANS_PER_LINE)):
        van = sibling(drawn, f"{drawn.van.name}_{number}_{i}", one)
        for way, by, knowledge in _ways(van, first, of_one, of_three):
            found += _judged(van, way, by, knowledge)
    return found


def _sibling(driven: Driven) -> Sibling:
    fit = fit_cross_spectrum(driven.runs, driven.vehicle)
    return Sibling(Sister(driven.vehicle.name, driven.vehicle, fit.calibration), driven.runs)


def _ways(
    van: Driven, first: Sister, of_one: Line, of_three: Line
) -> Iterator[tuple[Way, CalibratedVehicle, Knowledge | None]]:
    """The calibrations of a sibling, with the knowledge of a known weight if there is one."""
    steady = van.runs[:1]
    as_is = _calibrated(first.vehicle, CrossSpectrumFit(first.calibration, {}))
    yield Way.AS_IS, as_is, None
    yield Way.WEIGHED_EMPTY, as_is, known_empty(as_is, steady, van.vehicle)
    for way, runs, line in (
        (Way.ALONE, steady, None),
        (Way.LIKE_ONE, steady, of_one),
        (Way.LIKE_ONE_TWO_DRIVES, van.runs, of_one),
        (Way.LIKE_THREE, steady, of_three),
    ):
        yield way, _calibrated(van.vehicle, fit_cross_spectrum(runs, van.vehicle, inherited=line)), None


def _judged(van: Driven, way: Way, calibrated: CalibratedVehicle, knowledge: Knowledge | None) -> list[JudgedBatch]:
    found = []
    for trip, run in van.tests:
        judged = judge([run], calibrated, ESTIMATOR)
        known = [replace(one, estimate=_known(one.estimate, knowledge)) for one in judged]
        found += judged_batches(known, van.vehicle, trip.kind, way, run)
    return found


def _calibrated(vehicle: Vehicle, fit: CrossSpectrumFit) -> CalibratedVehicle:
    known = fit.calibration
    return CalibratedVehicle(ID, vehicle, known.payload_seen_kg, known.front_share_seen_pct, None, known)


def _known(found: Estimate, knowledge: Knowledge | None) -> Estimate:
    if knowledge is None or found.posterior is None:
        return found
    return found.answered(knowledge.applied(found.posterior, found.t_end_ns))


def known_empty(calibrated: CalibratedVehicle, empty: Sequence[KnownRun], vehicle: Vehicle) -> Knowledge | None:
    """The knowledge from an empty drive stated as such; None if no batch of it is answered."""
    answered = [one.estimate for one in judge(empty, calibrated, ESTIMATOR) if one.estimate.counted]
    posteriors = [one.posterior for one in answered if one.posterior is not None]
    if not posteriors:
        return None
    truth = np.array([0.0, vehicle.empty_front_share_pct])
    covariance = np.diag(np.square([EMPTY_STD_KG, EMPTY_SHARE_STD_PCT]))
    t_ns = max(one.t_end_ns for one in answered)
    return Knowledge.of([Observation(ID, t_ns, ID, ESTIMATOR, fused(posteriors), truth, covariance)])


def numbers(seed: int, n: int, lines: Sequence[list[JudgedBatch]]) -> dict[str, Any]:
    """A row for each way (``coverage_table``), over all kinds of drives."""
    table = coverage_table([one for of_line in lines for one in of_line], seed)
    rows = [line for line in table["lines"] if line["kind"] == ALL_KINDS]
    return {"seed": seed, "n_lines": len(lines), "n_vans": len(table["vans"]), "rows": rows}


COLUMNS: Final[tuple[Column, ...]] = (
    ("Calibration of the sibling", text("estimator")),
    ("Batches", text("n_batches")),
    ("Rejected", rejected_cell),
    *target_columns("payload", "Payload"),
    *target_columns("front_share", "Share"),
)


def siblings_page(found: Mapping[str, Any]) -> str:
    """The page in Markdown."""
    return page(
        "Siblings: one empty drive is enough",
        f"siblings --output DIR --vans {found['n_vans']} --seed {found['seed']}",
        f"{found['n_vans']} simulated vans of {found['n_lines']} lines, each line drawn about one of the "
        "simulator's three types. The vans of a line differ about it in springs by 3 %, dampers 10 %, tyres 4 %, "
        "friction 30 %, unsprung masses 3 %, mass, centre of gravity and inertia 1.5 % (standard deviations, each "
        "axle its own). Each has another sensor unit, mounted 2 cm and one degree beside where it should be. "
        "Sisters are calibrated with six known loads of ten minutes near 50 km/h. A sibling is driven empty near "
        "50 km/h, and mixed: town, country, motorway. It is judged on loads that nobody stated: mixed, mixed on "
        "another day (springs changed by 1.5 %, dampers and tyres by 5 %), and at another steady speed from 30 to "
        "110 km/h. All with a roll "
        "rate. What is inherited, and how: [a whole line of vehicles](line.md).",
        "",
        "Batches of 300 s; errors are percent of the payload each van is rated for and of 20 percentage points, "
        "over batches that were answered; with misses, a rejected batch counts as a mid-range answer. +- is the "
        "mean of half the 95 % intervals; the interval score is their width and 40 times what the truth lies "
        "outside, in brackets what it would be for normal errors and intervals of the right width.",
        "",
        *table_of(COLUMNS, found["rows"]),
        "",
        "The line's own file knows nothing of the sibling, and its intervals nothing of that; knowing once that "
        "the vehicle is empty mends the "
        "zero alone. Alone, an empty drive leaves the springs' answer to load to a guess, so that the vehicle is "
        "believed near its own speeds only. A sister shows the rest.",
        "",
    )


def _n_lines(n_vans: int) -> int:
    """Lines with at least as many siblings, VANS_PER_LINE each."""
    return -(-n_vans // VANS_PER_LINE)


STUDY: Final = Study(
    name="siblings",
    does="How much does a line help its next van? Simulated siblings calibrated in six ways; ~1 min a van.",
    doing="calibrating lines and driving their siblings",
    of_case=of_one_line,
    numbers=numbers,
    page=siblings_page,
    seed=SEED,
    n=12,
    n_cases=_n_lines,
)
