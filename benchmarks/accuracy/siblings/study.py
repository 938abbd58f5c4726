"""Siblings calibrated in six ways, all judged on the same drives.

    siblings(n_vans, seed) -> SiblingsTable

Vans, roads and seeds serve this study alone: no setting of the line's calibration was chosen with them.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from functools import partial
from typing import Any, Final

import numpy as np

from benchmarks.accuracy.coverage_table import ALL_KINDS, JudgedBatch, coverage_table, judged_batches
from benchmarks.accuracy.runner import OnDone, run_each
from benchmarks.accuracy.siblings.drives import Driven, draw_line, sibling, sister
from gateway.calibration.half_car import CrossSpectrumFit, fit_cross_spectrum
from gateway.calibration.judgement import judge
from gateway.calibration.known_run import KnownRun
from gateway.calibration.line import Line, Sibling, Sister, line_of, with_siblings_left_out
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


@dataclass(frozen=True, slots=True)
class SiblingsTable:
    """A row for each way (coverage_table.Line as JSON), over all kinds of drives."""

    seed: int
    n_lines: int
    n_vans: int
    rows: tuple[dict[str, Any], ...]

    def to_json(self) -> dict[str, Any]:
        """The figures for a file or a page."""
        return {"seed": self.seed, "n_lines": self.n_lines, "n_vans": self.n_vans, "rows": list(self.rows)}


def siblings(
    n_vans: int, seed: int = SEED, *, workers: int = 1, on_van: OnDone = lambda done, of: None
) -> SiblingsTable:
    """Drive, calibrate and judge at least ``n_vans`` siblings, VANS_PER_LINE of each line."""
    n_lines = -(-n_vans // VANS_PER_LINE)
    batches = [one for found in run_each(partial(of_one_line, seed), n_lines, workers, on_van) for one in found]
    table = coverage_table(batches, seed).to_json()
    rows = tuple(line for line in table["lines"] if line["kind"] == ALL_KINDS)
    return SiblingsTable(seed, n_lines, len(table["vans"]), rows)


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
        for way, judged in _ways(van, first, of_one, of_three):
            found += judged(way)
    return found


def _sibling(driven: Driven) -> Sibling:
    fit = fit_cross_spectrum(driven.runs, driven.vehicle)
    return Sibling(Sister(driven.vehicle.name, driven.vehicle, fit.calibration), driven.runs)


def _ways(van: Driven, first: Sister, of_one: Line, of_three: Line) -> Iterator[tuple[Way, "_Judging"]]:
    steady = van.runs[:1]
    as_is = _calibrated(first.vehicle, CrossSpectrumFit(first.calibration, {}))
    yield Way.AS_IS, _Judging(van, as_is)
    yield Way.WEIGHED_EMPTY, _Judging(van, as_is, known_empty(as_is, steady, van.vehicle))
    for way, runs, line in (
        (Way.ALONE, steady, None),
        (Way.LIKE_ONE, steady, of_one),
        (Way.LIKE_ONE_TWO_DRIVES, van.runs, of_one),
        (Way.LIKE_THREE, steady, of_three),
    ):
        fit = fit_cross_spectrum(runs, van.vehicle, inherited=line)
        yield way, _Judging(van, _calibrated(van.vehicle, fit))


@dataclass(frozen=True, slots=True)
class _Judging:
    """A sibling by one calibration, with the knowledge of a known weight if there is one."""

    van: Driven
    calibrated: CalibratedVehicle
    knowledge: Knowledge | None = None

    def __call__(self, way: Way) -> list[JudgedBatch]:
        found = []
        for trip, run in self.van.tests:
            judged = [
                replace(one, estimate=_known(one.estimate, self.knowledge))
                for one in judge([run], self.calibrated, ESTIMATOR)
            ]
            found += judged_batches(judged, self.van.vehicle, trip.kind, way, run)
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
