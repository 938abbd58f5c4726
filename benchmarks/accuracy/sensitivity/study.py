"""Every constant halved and doubled: calibrate, weigh and inspect the same fresh vans, and compare.

sensitivity(Scope(), seed) -> Sensitivity
"""

from collections.abc import Iterator, Sequence
from contextlib import nullcontext
from dataclasses import asdict, dataclass, replace
from enum import StrEnum
from functools import partial
from typing import Any, Final

import numpy as np

from benchmarks.accuracy.coverage_drives import TRIPS, Scope, driven, unseen_load
from benchmarks.accuracy.coverage_table import JudgedBatch, Line, coverage_table, judged_batches
from benchmarks.accuracy.runner import OnDone, run_each
from benchmarks.accuracy.sensitivity.changes import Pair, pairs_of
from benchmarks.accuracy.sensitivity.constants import CONSTANTS, FACTORS, Acts, Constant, scaled
from benchmarks.accuracy.vans import FreshVan, fresh_van
from gateway.calibration.half_car import known_spectra
from gateway.calibration.inspection.axes import apart_findings, phase_findings, phases
from gateway.calibration.inspection.finding import Kind
from gateway.calibration.inspection.loads import compare_loads
from gateway.calibration.judgement import judge
from gateway.calibration.judgement.learning_curve import calibrated_on
from gateway.calibration.known_run import KnownRun
from gateway.core.calibrated import CalibratedVehicle
from gateway.core.change import Rules
from gateway.core.cross_spectrum.measured import CrossSpectra

ESTIMATOR: Final = "cross_spectrum"
SEED: Final = 20_283  # arbitrary, of this study alone
MISLABELLED_SHARE: Final = 1.0 / 3.0  # chosen: of the rated payload, the error of a laden run's label
AS_IT_IS: Final = "as it is"


@dataclass(frozen=True, slots=True)
class Inspected:
    """One van: right drives and labels and how many were doubted, wrong ones and how many were found."""

    n_right: int = 0
    n_doubted: int = 0
    n_wrong: int = 0
    n_named: int = 0

    def __add__(self, other: "Inspected") -> "Inspected":
        return Inspected(*(a + b for a, b in zip(_counts(self), _counts(other), strict=True)))


def _counts(one: Inspected) -> tuple[int, int, int, int]:
    return one.n_right, one.n_doubted, one.n_wrong, one.n_named


@dataclass(frozen=True, slots=True)
class Weighing:
    """One setting over all vans. ``smallest_change_kg`` is the median over pairs of batches, ``n_false`` of the
    ``n_unchanged`` pairs showed a change, ``n_seen`` of the ``n_changed`` pairs with a larger true change did.
    """

    line: Line
    smallest_change_kg: float | None
    n_unchanged: int
    n_false: int
    n_changed: int
    n_seen: int


@dataclass(frozen=True, slots=True)
class Sensitivity:
    """By setting ("NAME x 0.5", or as it is): the results of weighing and of inspection. ``constants`` are the original
    values.
    """

    seed: int
    n_vans: int
    constants: dict[str, list[float]]
    weighing: dict[str, Weighing]
    inspection: dict[str, Inspected]

    def to_json(self) -> dict[str, Any]:
        """The figures for a file or a page."""
        return asdict(self)


@dataclass(frozen=True, slots=True)
class _OfVan:
    batches: list[JudgedBatch]
    pairs: dict[str, list[Pair]]
    inspected: dict[str, Inspected]


def sensitivity(
    scope: Scope,
    seed: int = SEED,
    *,
    constants: Sequence[Constant] = CONSTANTS,
    workers: int = 1,
    on_van: OnDone = lambda done, of: None,
) -> Sensitivity:
    """Drive every van once, and repeat the rest for every setting."""
    vans = list(run_each(partial(of_one_van, scope, seed, constants), scope.n_vans, workers, on_van))
    table = coverage_table([batch for van in vans for batch in van.batches], seed)
    lines = {line.kind: line for line in table.lines}
    pairs = {name: [pair for van in vans for pair in van.pairs[name]] for name in vans[0].pairs}
    return Sensitivity(
        seed,
        scope.n_vans,
        {one.name: [float(x) for x in np.ravel(one.current)] for one in constants},
        {name: _weighing(lines[name], of_setting) for name, of_setting in pairs.items()},
        {name: sum((van.inspected[name] for van in vans), Inspected()) for name in vans[0].inspected},
    )


def of_one_van(scope: Scope, seed: int, constants: Sequence[Constant], number: int) -> _OfVan:
    """One van under every setting."""
    fresh = fresh_van(scope, seed, number)
    tests = [
        driven(fresh.van, unseen_load(fresh.van, fresh.rng), trip, scope, one, len(fresh.runs) + i, fresh.sensors)
        for i, (trip, one) in enumerate(zip(TRIPS.values(), fresh.test_seed.spawn(len(TRIPS)), strict=True), 1)
    ]
    found = _OfVan([], {}, {})
    usual = calibrated_on(fresh.runs, fresh.vehicle, ESTIMATOR)
    for name, constant, factor in _settings(constants):
        with scaled(constant, factor) if constant else nullcontext():
            acts = constant.acts if constant else None
            if acts in (None, Acts.IN_INSPECTION):
                found.inspected[name] = _inspected(fresh)
            if acts is not Acts.IN_INSPECTION:
                is_refitted = acts is Acts.IN_CALIBRATION
                calibrated = calibrated_on(fresh.runs, fresh.vehicle, ESTIMATOR) if is_refitted else usual
                _weigh(name, calibrated, tests, found)
    return found


def _settings(constants: Sequence[Constant]) -> Iterator[tuple[str, Constant | None, float]]:
    yield AS_IT_IS, None, 1.0
    for constant in constants:
        for factor in FACTORS:
            yield setting(constant, factor), constant, factor


def setting(constant: Constant, factor: float) -> str:
    """The name of a constant's lines."""
    return f"{constant.name} x {factor:g}"


def _weigh(name: str, calibrated: CalibratedVehicle, tests: Sequence[KnownRun], found: _OfVan) -> None:
    drives = [judge([run], calibrated, ESTIMATOR) for run in tests]
    found.pairs[name] = pairs_of(drives, Rules.of(calibrated.vehicle))
    for run, judged in zip(tests, drives, strict=True):
        found.batches.extend(judged_batches(judged, calibrated.vehicle, name, ESTIMATOR, run))


def _weighing(line: Line, pairs: Sequence[Pair]) -> Weighing:
    unchanged = [pair for pair in pairs if pair.is_one_load]
    changed = [pair for pair in pairs if abs(pair.change_kg) > pair.smallest_kg]
    return Weighing(
        line=line,
        smallest_change_kg=float(np.median([pair.smallest_kg for pair in pairs])) if pairs else None,
        n_unchanged=len(unchanged),
        n_false=sum(pair.is_noticed for pair in unchanged),
        n_changed=len(changed),
        n_seen=sum(pair.is_noticed for pair in changed),
    )


def _inspected(fresh: FreshVan) -> Inspected:
    """Right labels and a wrong one; right axes and a pitch rate with the wrong sign."""
    doubted = {number for number, _ in compare_loads(fresh.runs, fresh.vehicle)}
    found = Inspected(n_right=len(fresh.runs), n_doubted=len(doubted))
    laden = max(fresh.runs, key=lambda run: run.payload_kg)
    wrong_kg = laden.payload_kg - MISLABELLED_SHARE * fresh.vehicle.payload_range_kg[1]
    mislabelled = [replace(run, payload_kg=wrong_kg) if run is laden else run for run in fresh.runs]
    named = {number for number, _ in compare_loads(mislabelled, fresh.vehicle)}
    found += Inspected(n_wrong=1, n_named=int(laden.number in named))
    for known in known_spectra(fresh.runs, fresh.vehicle):
        both_ways = known.spectra, known.spectra.with_pitch_reversed()
        upright, turned = (_kinds_of_axes(spectra, known.run, fresh) for spectra in both_ways)
        found += Inspected(1, int(bool(upright)), 1, int(Kind.PITCH_RATE_SIGN in turned))
    return found


def _kinds_of_axes(spectra: CrossSpectra, run: KnownRun, fresh: FreshVan) -> set[StrEnum]:
    seen = phases(spectra, run, fresh.vehicle)
    return {finding.kind for finding in (*apart_findings(spectra, seen), *phase_findings(seen, None))}
