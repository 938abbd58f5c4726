"""The next known load to drive, and its expected benefit.

    plan_first(vehicle)                   before the first drive: a first campaign, from priors alone
    plan_next(outcome, vehicle)           after a calibration: the most informative runs, in order
    stated_widths(known, vehicle, speed)  intervals of one batch now, and once the usual goods are stated

Runs are chosen by gateway.calibration.plan.design. The expected figures are those that the service will state: standard
deviations of five-minute batches over the loads that the vehicle carries, with every source of error.
"""

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from itertools import product
from typing import Any, Final

import numpy as np

from gateway.calibration.calibrate import Outcome
from gateway.calibration.half_car.known_spectra import BAND_HZ, N_SEGMENT
from gateway.calibration.half_car.left_out import model_error
from gateway.calibration.half_car.prior import Inherited, Prior, prior_of
from gateway.calibration.known_run import KnownRun
from gateway.calibration.plan.design import BATCH_S, Design
from gateway.calibration.plan.loads import (
    PlacedLoad,
    drivable_loads,
    empty,
    is_allowed,
    share_within_reach,
    weighed_loads,
)
from gateway.core.cargo import ShapePrior, is_said, shape_prior
from gateway.core.cross_spectrum.calibration import CrossSpectrumCalibration
from gateway.core.cross_spectrum.model.parameters import PARAMETERS, upright
from gateway.core.cross_spectrum.predicted import Drive, predicted
from gateway.core.vehicle import Carries, Load, Vehicle, cg_left_m, front_share_pct
from gateway.errors import CalibrationImpossibleError
from gateway.posterior import PAYLOAD, Source
from gateway.records import F64
from gateway.units import NS_PER_S

LEAST_CG_LEFT_M: Final = 0.03  # chosen: of the sprung mass; a load near the middle shifts it less
TRACK_PART: Final = 0.25  # chosen: of the track width; a heavy load between wheel arches can be this far off
USUAL_TRACK_M: Final = 1.5  # chosen: of cars and vans
PLACE_STEP_M: Final = 0.05  # chosen: round numbers for people


@dataclass(frozen=True, slots=True)
class OffCentreLoad:
    """A load with its centre payload_left_m left of the centre line."""

    load: PlacedLoad
    payload_left_m: float


def sideways_load(runs: Sequence[KnownRun], vehicle: Vehicle) -> OffCentreLoad | None:
    """The heaviest load that may be driven well off the centre line, near the middle lengthwise.

    None without a roll rate, after a run with such a load, or if the limits allow none.
    """
    if all(batch.roll_rate_radps is None for run in runs for batch in run.batches) or _has_sideways(runs, vehicle):
        return None
    left_m = round(round(TRACK_PART * (vehicle.track_width_m or USUAL_TRACK_M) / PLACE_STEP_M) * PLACE_STEP_M, 6)
    placed = [OffCentreLoad(load, left_m) for load in drivable_loads(vehicle) if load.payload_kg > 0.0]
    allowed = [one for one in placed if is_allowed(vehicle, one.load, left_m)]
    middle_pct = vehicle.empty_front_share_pct
    return max(
        allowed, key=lambda one: (one.load.payload_kg, -abs(one.load.front_share_pct - middle_pct)), default=None
    )


def _has_sideways(runs: Sequence[KnownRun], vehicle: Vehicle) -> bool:
    noted_m = [cg_left_m(vehicle, run.payload_kg, run.payload_left_m) for run in runs if run.payload_left_m is not None]
    return any(abs(left_m - vehicle.empty_cg_left_m) >= LEAST_CG_LEFT_M for left_m in noted_m)


FIRST_DRIVE: Final = Drive(600.0, 50.0 / 3.6)  # chosen: ten minutes in town traffic
N_FIRST: Final = 4  # chosen: runs of a first campaign
N_NEXT: Final = 3  # chosen: runs advised at a time
WORTH_DRIVING: Final = 0.1  # chosen: relative gain that is worth a quarter of an hour

Loads = tuple[PlacedLoad, ...]


@dataclass(frozen=True, slots=True)
class Expected:
    """Expected accuracy: standard deviations over the loads that the vehicle carries.

    ``reach_share`` (0..1) of those loads are within the driven range, so that they are not refused as ``out_of_range``;
    None after a single load.
    """

    payload_std_kg: float
    front_share_std_pct: float
    reach_share: float | None


@dataclass(frozen=True, slots=True)
class Advice:
    """One run to drive, and the accuracy expected after it and those advised before it."""

    load: PlacedLoad
    expected: Expected


@dataclass(frozen=True, slots=True)
class LoadPlan:
    """Runs to drive, in order. ``now`` is None before the first drive.

    ``least`` is the least useful run, for comparison with the first of ``advice``. ``sideways`` is a load to drive off
    the centre line: such a run shows its effect, and the signs of the roll rate and of the sensor's place. None if one
    was driven, or no roll rate is mapped.
    """

    vehicle: str
    n_driven: int
    drive: Drive
    now: Expected | None
    advice: tuple[Advice, ...]
    least: Advice | None
    sideways: OffCentreLoad | None = None

    @property
    def is_enough_driven(self) -> bool:
        """True if even the first of ``advice`` would improve accuracy and reach by less than a tenth."""
        if self.now is None or not self.advice or self.now.reach_share is None:
            return False
        now, then = self.now, self.advice[0].expected
        widths = (
            (then.payload_std_kg, now.payload_std_kg),
            (then.front_share_std_pct, now.front_share_std_pct),
            (now.reach_share or 0.0, then.reach_share or 0.0),
        )
        return all(after > (1.0 - WORTH_DRIVING) * before for after, before in widths)

    def to_json(self) -> dict[str, Any]:
        """Plain numbers for a file or a report."""
        return asdict(self) | {"is_enough_driven": self.is_enough_driven}


def plan_first(vehicle: Vehicle, inherited: Inherited | None = None) -> LoadPlan:
    """A first campaign: empty, then the most informative loads by the prior of any vehicle, or of its sister."""
    prior = (inherited.prior_of if inherited else prior_of)(vehicle, with_roll=False)
    planner = _Planner(
        vehicle, prior.mean, FIRST_DRIVE, _beside_calibration(_of_prior(prior, vehicle), vehicle, FIRST_DRIVE)
    )
    unloaded = empty(vehicle)
    known = planner.after(prior.covariance, unloaded)
    first = Advice(unloaded, planner.expected(known, (unloaded,)))
    return LoadPlan(
        vehicle=vehicle.name,
        n_driven=0,
        drive=FIRST_DRIVE,
        now=None,
        advice=(first, *planner.advice(known, (unloaded,), N_FIRST - 1)),
        least=None,
    )


def plan_next(outcome: Outcome, vehicle: Vehicle) -> LoadPlan:
    """The next runs after a calibration.

    Raises CalibrationImpossibleError without a cross-spectral part, on which the advice rests.
    """
    known = outcome.cross_spectrum.calibration if outcome.cross_spectrum else None
    if known is None:
        raise CalibrationImpossibleError(
            "a plan needs the cross-spectral calibration: leave out --estimator, and see its warning if it has one"
        )
    runs = [one.identification for one in outcome.split]
    drive = usual_drive(runs)
    planner = _Planner(vehicle, known.parameters, drive, _beside_calibration(known, vehicle, drive))
    of_half_car = known.covariance[: len(PARAMETERS), : len(PARAMETERS)]  # roll parameters do not affect the load
    driven = tuple(PlacedLoad(load.payload_kg, None, load.front_share_pct) for load in known.known_loads)
    return LoadPlan(
        vehicle=vehicle.name,
        n_driven=len(runs),
        drive=drive,
        now=planner.expected(of_half_car, driven),
        advice=planner.advice(of_half_car, driven, N_NEXT),
        least=planner.least(of_half_car, driven),
        sideways=sideways_load(runs, vehicle),
    )


def usual_drive(runs: list[KnownRun]) -> Drive:
    """The typical drive of these runs: median usable seconds per run and median speed per batch."""
    counted = [[batch for batch in run.batches if not batch.rejected] for run in runs]
    durations_s = [
        sum(batch.usable_share * (batch.t_end_ns - batch.t_start_ns) / NS_PER_S for batch in batches)
        for batches in counted
        if batches
    ]
    speeds_mps = [batch.mean_speed_mps for batches in counted for batch in batches]
    if not durations_s:
        return FIRST_DRIVE
    return Drive(float(np.median(durations_s)), float(np.median(speeds_mps)))


def _beside_calibration(known: CrossSpectrumCalibration, vehicle: Vehicle, drive: Drive) -> F64:
    """(2,) mean variances of payload (kg) and front share (%) other than the batch's own and the calibration's."""
    prior = shape_prior(vehicle, *known.known_shape)
    most_kg = vehicle.payload_range_kg[1]
    loads = [empty(vehicle).load]
    for part, place in product((0.5, 1.0), (0.35, 0.8)):
        payload_kg = part * most_kg
        loads.append(Load(payload_kg, front_share_pct(vehicle, payload_kg, place * vehicle.wheelbase_m)))
    stated = [predicted(known, prior, load, Drive(BATCH_S, drive.speed_mps)) for load in loads]
    beside: F64 = np.mean([np.diag(one.without(Source.CALIBRATION).shared)[:2] for one in stated], axis=0)
    return beside


def _of_prior(prior: Prior, vehicle: Vehicle) -> CrossSpectrumCalibration:
    """The prior as a calibration; its model error is that of other vans."""
    theta = upright(prior.mean)
    usual = model_error((), vehicle.empty_mass_kg)
    return CrossSpectrumCalibration(
        empty_mass_kg=vehicle.empty_mass_kg,
        empty_front_share_pct=vehicle.empty_front_share_pct,
        wheelbase_m=vehicle.wheelbase_m,
        band_hz=BAND_HZ,
        n_segment=N_SEGMENT,
        names=PARAMETERS,
        parameters=theta,
        covariance=np.zeros((len(theta), len(theta))),
        directions=np.zeros((len(theta), 0)),
        model_std=usual.std,
        model_per_reach=usual.per_reach,
        misfit_limit=math.inf,
        acceleration_rms_mps2=1.0,
        pitch_rate_rms_radps=1.0,
        payload_seen_kg=vehicle.payload_range_kg,
        front_share_seen_pct=vehicle.front_share_range_pct,
        speed_seen_mps=(FIRST_DRIVE.speed_mps, FIRST_DRIVE.speed_mps),
    )


class _Planner:
    """A design together with the figures stated beside its advice."""

    def __init__(self, vehicle: Vehicle, theta: F64, drive: Drive, beside: F64) -> None:
        """``beside`` (2,) are the variances of payload (kg) and front share (%) that no known load reduces."""
        self._loads = drivable_loads(vehicle)
        self._targets = weighed_loads(vehicle)
        self._design = Design(vehicle, theta, drive, self._targets)
        self._beside = beside

    def advice(self, covariance: F64, driven: Loads, n_runs: int) -> tuple[Advice, ...]:
        """The most useful run, then the most useful after that one, and so on."""
        steps: list[Advice] = []
        for _ in range(n_runs):
            load = self._design.best(covariance, self._loads)
            covariance = self._design.after(covariance, load)
            new = (*(step.load for step in steps), load)
            steps.append(Advice(load, self.expected(covariance, driven, new)))
        return tuple(steps)

    def least(self, covariance: F64, driven: Loads) -> Advice:
        """The least useful single run."""
        load = self._design.worst(covariance, self._loads)
        return Advice(load, self.expected(self._design.after(covariance, load), driven, (load,)))

    def after(self, covariance: F64, load: PlacedLoad) -> F64:
        """The covariance of the parameters after a run with ``load``."""
        return self._design.after(covariance, load)

    def expected(self, covariance: F64, driven: Loads, new: Loads = ()) -> Expected:
        """The accuracy that the service would state."""
        spread = self._design.spread(covariance)
        return Expected(
            payload_std_kg=math.sqrt(spread.payload_std_kg**2 + float(self._beside[0])),
            front_share_std_pct=math.sqrt(spread.front_share_std_pct**2 + float(self._beside[1])),
            reach_share=share_within_reach(self._targets, (*driven, *new)),
        )


TYPICAL_PART: Final = 0.5  # chosen: of the largest payload
TYPICAL_PLACE: Final = 0.5  # chosen: of the wheelbase, behind the front axle


@dataclass(frozen=True, slots=True)
class Stated:
    """The payload that one batch states, and half its 95 % interval."""

    payload_kg: float
    half_width_kg: float


@dataclass(frozen=True, slots=True)
class StatedOf:
    """The estimate of goods of one kind: before and after they are stated."""

    unsaid: Stated
    said: Stated


@dataclass(frozen=True, slots=True)
class StatedWidths:
    """The estimates of ``payload_kg`` in the middle of the wheelbase, for each kind of goods in ``carries``."""

    payload_kg: float
    carries: dict[Carries, StatedOf]

    def to_json(self) -> dict[str, Any]:
        """The figures as JSON."""
        return asdict(self)


def stated_widths(known: CrossSpectrumCalibration, vehicle: Vehicle, speed_mps: float) -> StatedWidths | None:
    """Estimates for a load with each kind's median shape. None if the fitter stated the goods, or a single load was
    driven.
    """
    if is_said(vehicle) or known.payload_seen_kg[0] == known.payload_seen_kg[1]:
        return None
    payload_kg = TYPICAL_PART * vehicle.payload_range_kg[1]
    load = Load(payload_kg, front_share_pct(vehicle, payload_kg, TYPICAL_PLACE * vehicle.wheelbase_m))
    drive = Drive(BATCH_S, speed_mps)
    nothing_said = shape_prior(vehicle, *known.known_shape)

    def stated(prior: ShapePrior, log_s: float) -> Stated:
        payload = predicted(known, prior, load, drive, log_s).quantity(PAYLOAD)
        low, high = payload.interval95
        return Stated(payload.number, 0.5 * (high - low))

    def stated_of(kind: Carries) -> StatedOf:
        said = shape_prior(replace(vehicle, carries=kind), *known.known_shape)
        return StatedOf(stated(nothing_said, said.median), stated(said, said.median))

    return StatedWidths(payload_kg, {kind: stated_of(kind) for kind in Carries if kind is not Carries.MIXED})
