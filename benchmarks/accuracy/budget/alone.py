"""Each source alone: the same drive with one cause and without it, the observed shift against the predicted one.

The vans have no roll rate and no declared load, so every source is present. ``slope`` is the regression of the observed
shifts on those that the estimator's own derivatives predict for the drawn cause. ``z2`` is the mean square of the
observed shifts over the stated variance.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final, TypeGuard

import numpy as np

from benchmarks.accuracy.budget.nature import (
    Gains,
    amplified,
    as_stated,
    drawn_day,
    drawn_gains,
    drawn_log_s,
    drawn_share_pct,
    exactly_known,
    load_of_shape,
    on_that_day,
    place_std_m,
    to_one_side,
)
from benchmarks.accuracy.budget.response import day_covariance, response_to
from benchmarks.accuracy.calibrated import calibrated_on
from benchmarks.accuracy.drives import (
    TRIPS,
    USUAL,
    FreshVan,
    Scope,
    Trip,
    fresh_van,
    known_run,
    rows_of,
    without_roll_rate,
)
from gateway.core.calibrated import CalibratedVehicle
from gateway.core.cargo import ShapePrior
from gateway.core.cross_spectrum.estimator import Weighed, weigh
from gateway.core.cross_spectrum.sensor_change import gain_of
from gateway.posterior import FRONT_SHARE, PAYLOAD, SHAPE, Source
from gateway.records import F64, Batch, Why
from gateway.sim.vehicle import Load, Vehicle

ESTIMATOR: Final = "cross_spectrum"
MIXED: Final = TRIPS["mixed"]
ON_THE_LINE: Final = replace(MIXED, off_m=(0.0, 0.0))
PARTS: Final = (0.3, 0.9)  # chosen: of the rated payload
PLACES: Final = (0.35, 0.85)  # chosen: of the wheelbase


Pair = tuple[float, float]  # payload in kg, front share in percent


@dataclass(frozen=True, slots=True)
class Shift:
    """The shift of one batch by one source, found and predicted, and the stated variances."""

    source: str
    found: Pair
    predicted: Pair
    variance: Pair


def rows_of_shifts(shifts: Sequence[Shift]) -> list[dict[str, Any]]:
    """A row for each source."""
    sources = dict.fromkeys(shift.source for shift in shifts)
    return [row_of(source, [one for one in shifts if one.source == source]) for source in sources]


def row_of(source: str, shifts: Sequence[Shift]) -> dict[str, Any]:
    """Slopes through the origin, mean squares, and root mean squares of both, over all batches.

    Slope and mean square are None for a quantity that the source does not affect.
    """
    found, predicted, variance = (np.array([getattr(one, name) for one in shifts]) for name in _OF_SHIFT)
    row: dict[str, Any] = {"source": source, "n": len(shifts)}
    for i, name, unit in ((PAYLOAD, "payload", "kg"), (FRONT_SHARE, "front_share", "pct")):
        is_moved = bool(np.any(variance[:, i] > 0.0))
        across = float(predicted[:, i] @ predicted[:, i])
        row |= {
            f"{name}_slope": float(found[:, i] @ predicted[:, i]) / across if is_moved and across > 0.0 else None,
            f"{name}_z2": float(np.mean(found[:, i] ** 2 / variance[:, i])) if is_moved else None,
            f"{name}_stated_{unit}": float(np.sqrt(np.mean(variance[:, i]))),
            f"{name}_found_{unit}": float(np.sqrt(np.mean(found[:, i] ** 2))),
        }
    return row


_OF_SHIFT: Final = ("found", "predicted", "variance")


def of_one_van(seed: int, number: int, scope: Scope = USUAL) -> list[Shift]:
    """One draw of every source on one van."""
    fresh = fresh_van(scope, seed, number)
    runs = [without_roll_rate(run) for run in fresh.runs]
    bench = _Bench(fresh, calibrated_on(runs, fresh.vehicle, ESTIMATOR), scope)
    studies: tuple[Callable[[_Bench], Iterator[Shift]], ...] = (_day, _sensor, _shape, _sideways)
    return [shift for study in studies for shift in study(bench)] + list(_empty_share(bench, runs))


class _Bench:
    """A calibrated van, a load of the calibrated shape, and one drive that is repeated with each cause."""

    def __init__(self, fresh: FreshVan, calibrated: CalibratedVehicle, scope: Scope) -> None:
        if calibrated.cross_spectrum is None:
            raise ValueError("a budget needs the cross-spectral calibration")
        self.fresh, self.calibrated, self.known, self._scope = fresh, calibrated, calibrated.cross_spectrum, scope
        self.rng, self.van = fresh.rng, fresh.van
        part, place = self.rng.uniform(*PARTS), self.rng.uniform(*PLACES)
        self.load = Load(float(part) * self.van.rated_payload_kg, float(place) * self.van.wheelbase_m)
        self.as_known = _shape_of(self.load, self.van)
        self.usual = self.driven(self.van, self.load)
        self.reference = self.weighed(self.usual, exactly_known(self.as_known))

    def driven(
        self, van: Vehicle, load: Load, trip: Trip = ON_THE_LINE, gains: Gains | None = None
    ) -> tuple[Batch, ...]:
        """The drive with this van, load and gains, without its roll rate."""
        rows, today, carried = rows_of(van, (load,), trip, self._scope, self.fresh.test_seed, self.fresh.sensors)
        run = known_run(rows if gains is None else amplified(rows, gains), 1, "budget", today, carried)
        self.left_m = carried[0].left_m
        return without_roll_rate(run).batches

    def weighed(self, batches: Sequence[Batch], prior: ShapePrior | None) -> list[Weighed | Why]:
        """Each batch by the calibration, even if the service would refuse it."""
        return [Why.TOO_SHORT if batch.rejected else weigh(batch, self.known, prior) for batch in batches]

    def pairs(self, batches: Sequence[Batch], prior: ShapePrior | None) -> Iterator[tuple[int, Weighed, Weighed]]:
        """Batches, by their number, answered in both drives: with the cause, and as calibrated.

        Where two loads compete as the answer, it may jump between them. That is a source of its own, so these are left
        out.
        """
        both = zip(self.weighed(batches, prior), self.reference, strict=False)
        for i, (one, usual) in enumerate(both):
            if _is_plain(one) and _is_plain(usual):
                yield i, one, usual


def _is_plain(one: Weighed | Why) -> TypeGuard[Weighed]:
    return isinstance(one, Weighed) and not one.located.is_ambiguous


def _shape_of(load: Load, van: Vehicle) -> float:
    above_m = load.height_m - van.cog_height_m
    part = van.sprung_kg / (van.sprung_kg + load.mass_kg)
    return float(np.log((load.length_m**2 + load.tall_m**2) / 12.0 + part * above_m**2))


def _shifted(source: str, one: Weighed, usual: Weighed, predicted: F64, variance: F64) -> Shift:
    found = one.posterior.mean - usual.posterior.mean
    pairs = [(float(each[PAYLOAD]), float(each[FRONT_SHARE])) for each in (found, predicted, variance)]
    return Shift(source, *pairs)


def _of(name: Source, one: Weighed) -> F64:
    return np.asarray(np.sum(one.posterior.sources[name] ** 2, axis=0))


def _day(bench: _Bench) -> Iterator[Shift]:
    """Springs, tyres and dampers of another day."""
    day = drawn_day(bench.rng)
    batches = bench.driven(on_that_day(bench.van, day), bench.load)
    for _, one, usual in bench.pairs(batches, exactly_known(bench.as_known)):
        predicted, covariance = response_to(usual, bench.known, day), day_covariance(usual, bench.known)
        yield _shifted("day", one, usual, predicted, np.diag(covariance))


def _sensor(bench: _Bench) -> Iterator[Shift]:
    """Another temperature of the sensors."""
    gains = drawn_gains(bench.rng)
    batches = bench.driven(bench.van, bench.load, gains=gains)
    for i, one, usual in bench.pairs(batches, exactly_known(bench.as_known)):
        believed, std = gain_of(batches[i].gravity_mps2, bench.known.gravity_mps2)
        left_open = (gains.acceleration - gains.rate - believed) / std
        column = usual.posterior.sources[Source.SENSOR][0]
        yield _shifted("sensor", one, usual, left_open * column, _of(Source.SENSOR, usual))


def _shape(bench: _Bench) -> Iterator[Shift]:
    """A load whose shape is drawn from the prior, weighed with no shape declared.

    The predicted shift is the answer minus the answer under the true shape, both from the same half-car.
    """
    prior = bench.calibrated.shape_prior
    assert prior is not None
    log_s = drawn_log_s(prior, bench.rng)
    load = load_of_shape(bench.van, bench.load.mass_kg, bench.load.position_m, log_s)
    batches = bench.driven(bench.van, load)
    knowing = bench.weighed(batches, exactly_known(log_s))
    for i, one, usual in bench.pairs(batches, prior):
        if isinstance(known := knowing[i], Weighed):
            goods, own = (one.posterior.sources[name][:1] for name in SHAPE)
            variance = np.sum(goods**2 + own**2, axis=0)
            yield _shifted("load length and height", one, usual, one.posterior.mean - known.posterior.mean, variance)


def _sideways(bench: _Bench) -> Iterator[Shift]:
    """A load off the centre line, which is unobservable without a roll rate."""
    std_m = place_std_m(bench.fresh.vehicle)
    batches = bench.driven(bench.van, bench.load, to_one_side(MIXED, std_m * float(bench.rng.standard_normal())))
    z = bench.left_m / std_m * float(np.sign(bench.fresh.sensors.mount.left_m))
    for _, one, usual in bench.pairs(batches, exactly_known(bench.as_known)):
        column = usual.posterior.sources[Source.SIDEWAYS][0]
        yield _shifted("sideways", one, usual, z * column, _of(Source.SIDEWAYS, usual))


def _empty_share(bench: _Bench, runs: list[Any]) -> Iterator[Shift]:
    """A calibration with a wrong front share of the empty vehicle."""
    off_pct = drawn_share_pct(bench.fresh.vehicle, bench.rng)
    vehicle, stated_runs = as_stated(bench.fresh.vehicle, runs, off_pct)
    wrong = calibrated_on(stated_runs, vehicle, ESTIMATOR).cross_spectrum
    assert wrong is not None
    for batch, usual in zip(bench.usual, bench.reference, strict=True):
        one = Why.TOO_SHORT if batch.rejected else weigh(batch, wrong, exactly_known(bench.as_known))
        if _is_plain(one) and _is_plain(usual):
            part = vehicle.empty_mass_kg / (vehicle.empty_mass_kg + float(usual.posterior.mean[PAYLOAD]))
            column = np.array([0.0, vehicle.empty_front_share_std_pct * part])
            yield _shifted("empty_share", one, usual, np.array([0.0, off_pct * part]), column**2)
