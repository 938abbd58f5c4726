"""From drives and statements to a vehicle's posterior: one hierarchical fit.

    teach(drives, vehicle) -> Taught          the vehicle, every drive's load, and what each statement was worth

A drive is driven by a vehicle that nearly is the one that is sought; by how much it deviates is in the table. Its load
is what somebody stated of it, with that doubt, or unknown. Heave and pitch are fitted to what the sensors would measure
on the centre line, roll to all three sensors with the half-car as found; they take turns
(docs/adr/roll-takes-turns.md). Drives left out, weighed as the service weighs, show the model's error.
"""

from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import dataclass, replace
from math import exp, isfinite, log
from statistics import fmean
from typing import Final

import numpy as np

from gateway.calibration.left_out import LeftOut, Limits, limits_shown_by, most_misfit
from gateway.calibration.statements import LoadPrior, Statement, load_prior_of
from gateway.core.bends import joined_gains
from gateway.core.cargo import known_shape, shape_hypotheses
from gateway.core.vehicle import Load, Vehicle
from gateway.errors import CalibrationImpossibleError
from gateway.model import fit
from gateway.model.car import Ground
from gateway.model.checks import MOST_TENSION, reach_of
from gateway.model.expected import log_stroke_speeds, with_strokes
from gateway.model.place import ROLL_BAND_HZ
from gateway.model.spectra import CrossSpectra, Reading, Segments, grouped, level, mount_of, segments_of, usual_floor
from gateway.model.table import INDEX, N_OWN, NAMES, OWN, ROWS, UPRIGHT, N, covariance_of, of_drive, prior_of
from gateway.model.vehicle import VehicleModel
from gateway.model.weigh import MOST_LOAD_SHARE, SOFT_HZ, answers_by_vehicle, mixture_of, weigh
from gateway.model.whittle import Point, Whittle
from gateway.records import F64, Batch, Why

BAND_HZ: Final = (1.1, 14.0)  # chosen: body and wheel resonances
N_SEGMENT: Final = 256  # chosen: 5 s at 50 Hz, short enough for town traffic
EVIDENCE: Final = 0.2  # chosen: weight of a drive's evidence; minutes of driving repeat the same model error
LEAST_MOMENT_STD_KGM: Final = 0.5  # chosen: about the centre line, also of an empty vehicle with its loose items
MOST_OFFSET_STD_M: Final = 0.1  # chosen: of the sensor's lateral place; with a worse one roll is not used
TURNS: Final = 3  # chosen: the second finds the sensor's place, the third the stroke speeds and so friction
STARTS: Final = ((0.0, 0.0), (0.4, 0.3), (-0.4, -0.3))  # log springs, log dampers, off the prior's middle
ROUGH, FINE = 1.0, 0.05  # chosen: tolerances in log posterior, of a start and of the result
RESEEDS: Final = 3  # chosen: attempts to lift drives out of false peaks
RESEED_GAIN: Final = 2.0  # chosen: in log posterior, of a peak that is worth moving to
SEEDS: Final = (8, (0.25, 0.5, 0.75, 1.0))  # chosen: payloads, and places in wheelbases, of a drive's starting loads
UNKNOWN_SHARE: Final = 0.1  # chosen: of the empty mass; a payload stated no better than that has several starts
SHARED: Final = 1e-2  # chosen: what is left of the deviations among known loads: one day, one box, one road
MOST_DISAGREEMENT: Final = 3.7  # chosen: standard deviations; chance exceeds it for one statement in five thousand
LEAST_WITNESSES: Final = 3  # chosen: two drives must remain for a scale
MOST_DIRECTIONS: Final = 8  # chosen: they carry 98 % and more of the payload's variance
SCALES: Final = np.array([10.0, 0.2, 0.005])  # chosen: kg, %, m of equal weight
SPRINGS_FROM_PRIORS: Final = "springs_from_priors"
UNTESTED: Final = "intervals_untested"

_GYRATION, _MODE = OWN.index(INDEX["payload_gyration_m2"]), OWN.index(INDEX["payload_mode_hz"])
_COMPACT_LOG_S: Final = log(0.1)

Progress = Callable[[int, int], None]
"""Called with the steps done and the steps in all."""


@dataclass(frozen=True, slots=True)
class TaughtDrive:
    """A drive's batches with what is stated of its load."""

    name: str
    batches: tuple[Batch, ...]
    statement: Statement


def can_roll(vehicle: Vehicle) -> bool:
    """Whether the vehicle's data suffice to use a roll rate: its track, and the sensor's position.

    An unknown lever arm cannot be estimated from the roll itself: suspension mounts and the body bring roll into the
    acceleration that no lever arm of the sensor explains (docs/method.md).
    """
    return vehicle.track_width_m is not None and vehicle.sensor_left_std_m <= MOST_OFFSET_STD_M


class _Drive:
    """One drive's likelihood, as a function of the vehicle's vector (N,) and of its own.

    The own vector (N_OWN + 2,) has the drive's deviations from the vehicle, its payload and its front share.
    """

    def __init__(self, drive: TaughtDrive, vehicle: Vehicle, segments: Segments, reading: Reading) -> None:
        self.drive, self.vehicle, self._segments = drive, vehicle, segments
        self.stated = load_prior_of(drive.statement, vehicle)
        self.spectra = grouped(segments, reading)
        self.ground = Ground.of(vehicle, with_roll=self.spectra.has_roll)
        self.roll: F64 = np.empty(0)
        self.moment_kgm = self.stated.payload_kg * self.stated.left_m
        self.whittle = self._whittle(self.spectra.without_roll)

    @property
    def is_unknown(self) -> bool:
        """Whether the statement leaves the payload open."""
        return self.stated.payload_std_kg > UNKNOWN_SHARE * self.vehicle.empty_mass_kg

    @property
    def rolling(self) -> Whittle:
        """Of all three sensors as measured."""
        return self._whittle(self.spectra.within(ROLL_BAND_HZ))

    def read(self, reading: Reading) -> CrossSpectra:
        """The drive's spectra, computed as ``reading`` says."""
        return grouped(self._segments, reading)

    def _whittle(self, spectra: CrossSpectra) -> Whittle:
        return Whittle(spectra, self.ground, EVIDENCE)

    def cost(self, common: F64, own: F64) -> float:
        if abs(own[N_OWN]) > MOST_LOAD_SHARE * self.vehicle.empty_mass_kg or not 0.05 < own[N_OWN + 1] < 0.95:
            return np.inf
        return self.whittle.cost(self.point(common, own))

    def curvature(self, common: F64, own: F64) -> tuple[F64, F64]:
        point = self.point(common, own)
        n = len(point.theta)
        found = self.whittle.curvature(point, [*range(N), n, n + 1])
        chosen = [*range(N), *OWN, N, N + 1]
        return found.gradient[chosen], found.information[np.ix_(chosen, chosen)]

    def own_curvature(self, common: F64, own: F64) -> tuple[F64, F64]:
        """By the own vector alone."""
        point = self.point(common, own)
        n = len(point.theta)
        found = self.whittle.curvature(point, [*OWN, n, n + 1])
        return found.gradient, found.information

    def theta(self, common: F64, own: F64) -> F64:
        """(N,) the vehicle of this drive."""
        return of_drive(common, own[:N_OWN])

    def point(self, common: F64, own: F64) -> Point:
        theta = np.r_[self.theta(common, own), self.roll]
        payload_kg = float(own[N_OWN])
        left_m = self.cg_left_m(theta, payload_kg, self.moment_kgm) if len(self.roll) else 0.0
        return Point(theta, payload_kg, float(own[N_OWN + 1]), left_m)

    def cg_left_m(self, theta: F64, payload_kg: float, moment_kgm: float) -> float:
        """Centre of gravity left of the centre line with this moment of the payload about it."""
        empty_kgm = self.vehicle.empty_mass_kg * theta[INDEX["empty_left_m"]]
        return float((empty_kgm + moment_kgm) / (self.vehicle.empty_mass_kg + payload_kg))

    def seen_by(self, theta: F64, usual_mps: tuple[float, float] | None, load: Load) -> "_Drive":
        """The same drive seen from the centre line by a vehicle theta (n,) that rolls, and, if the usual stroke speeds
        are known, with its axles' own.
        """
        one = copy(self)
        one.roll = level(theta)[N:]
        flat = self.read(replace(self.spectra.reading, mount=mount_of(theta))).without_roll
        if usual_mps is not None:
            flat, one.spectra = (self._stroking(each, theta[:N], usual_mps, load) for each in (flat, self.spectra))
        one.whittle = self._whittle(flat)
        return one

    def _stroking(self, spectra: CrossSpectra, theta: F64, usual: tuple[float, float], load: Load) -> CrossSpectra:
        told = replace(spectra, reading=replace(spectra.reading, usual_stroke_mps=usual))
        return with_strokes(told, theta, load, self.ground)

    def log_strokes(self, theta: F64, load: Load) -> F64:
        """(2,) logarithm of the stroke speed (m/s) of front and rear axle, over all segments."""
        spectra = self.whittle.spectra
        every = log_stroke_speeds(spectra, theta, load, self.ground)
        return np.asarray(np.average(every, axis=0, weights=spectra.n_segments[:, 0]), float)


@dataclass(frozen=True, slots=True)
class _OfVehicle:
    """A drive's likelihood by its own vector alone, its vehicle fixed."""

    drive: _Drive
    theta: F64

    def cost(self, common: F64, own: F64) -> float:
        return self.drive.cost(self.theta, own)

    def curvature(self, common: F64, own: F64) -> tuple[F64, F64]:
        return self.drive.own_curvature(self.theta, own)


class _Rolling:
    """All three sensors of a drive, by the roll parameters (r,) and its payload's moment about the centre line (kg
    m).
    """

    def __init__(self, drive: _Drive, theta: F64, load: Load) -> None:
        self.drive, self.theta, self.load, self.whittle = drive, theta, load, drive.rolling

    def point(self, roll: F64, own: F64) -> Point:
        theta = np.r_[self.theta, roll]
        return Point.of(theta, self.load, self.drive.cg_left_m(theta, self.load.payload_kg, float(own[0])))

    def cost(self, common: F64, own: F64) -> float:
        return self.whittle.cost(self.point(common, own))

    def curvature(self, common: F64, own: F64) -> tuple[F64, F64]:
        point = self.point(common, own)
        n = len(point.theta)
        found = self.whittle.curvature(point, [*range(N, n), n + 2])
        chain = self.chain(n - N)
        return chain.T @ found.gradient, chain.T @ found.information @ chain

    def chain(self, m: int) -> F64:
        """(m + 1, m + 1) derivatives of roll parameters and place by roll parameters and moment."""
        empty_kg = self.drive.vehicle.empty_mass_kg
        chain = np.eye(m + 1)
        chain[-1, INDEX["empty_left_m"] - N] = empty_kg / (empty_kg + self.load.payload_kg)
        chain[-1, -1] = 1.0 / (empty_kg + self.load.payload_kg)
        return chain


@dataclass(frozen=True, slots=True, eq=False)
class FoundLoad:
    """What a fit found of one drive: its load with the statement, and what the drive says without it.

    without and its standard deviation (kg) are NaN if nothing was stated of the payload. ``is_held``: the statement
    disagrees beyond chance and taught nothing.
    """

    name: str
    load: Load
    payload_std_kg: float
    without_kg: float
    without_std_kg: float
    is_held: bool


@dataclass(frozen=True, slots=True, eq=False)
class Taught:
    """A vehicle as its drives taught it, the load of every drive, and by name the vehicle without each drive left out.

    errors are of batches of the drives left out.
    """

    model: VehicleModel
    loads: tuple[FoundLoad, ...]
    without: dict[str, VehicleModel]
    errors: tuple[LeftOut, ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class Prior:
    """What is assumed of a vehicle before its first drive: mean (n,) and covariance (n, n)."""

    mean: F64
    covariance: F64
    like: VehicleModel | None = None

    @classmethod
    def of_any(cls, vehicle: Vehicle, *, with_roll: bool) -> "Prior":
        """Of any vehicle of this size, by the table."""
        mean, std = prior_of(ROWS if with_roll else UPRIGHT, vehicle)
        return cls(mean, np.diag(std**2))

    @classmethod
    def of_sister(cls, sister: VehicleModel, vehicle: Vehicle, *, with_roll: bool) -> "Prior":
        """Of a vehicle of the same line as one that was taught: its posterior, and by how much vehicles differ."""
        any_one = cls.of_any(vehicle, with_roll=with_roll)
        rows = ROWS if with_roll else UPRIGHT
        n = min(len(rows), len(sister.parameters))
        shared = [i for i in range(n) if rows[i].line]
        mean, covariance = any_one.mean.copy(), any_one.covariance.copy()
        scatter = np.diag([rows[i].line ** 2 for i in shared])
        mean[shared] = sister.parameters[shared]
        covariance[np.ix_(shared, shared)] = sister.covariance[np.ix_(shared, shared)] + scatter
        return cls(mean, covariance, sister)


def teach(
    drives: Sequence[TaughtDrive],
    vehicle: Vehicle,
    sister: VehicleModel | None = None,
    progress: Progress | None = None,
) -> Taught:
    """The vehicle that these drives teach. ``sister`` is a vehicle of the same model, as it was taught.

    A statement that disagrees beyond chance with its own drive, as the others see it, is held: it teaches nothing.
    Raises CalibrationImpossibleError if no drive has enough steady driving.
    """
    known = _drives(drives, vehicle, sister)
    with_roll = known[0].spectra.has_roll
    prior = (
        Prior.of_any(vehicle, with_roll=with_roll)
        if sister is None
        else Prior.of_sister(sister, vehicle, with_roll=with_roll)
    )
    witnesses = [one for one in known if one.drive.statement.is_of_payload]
    n_steps = (1 if sister else len(STARTS)) + 1 + (len(witnesses) if len(witnesses) >= LEAST_WITNESSES else 0)
    done = iter(range(1, n_steps + 1))

    def step() -> None:
        if progress is not None:
            progress(next(done, n_steps), n_steps)

    held: set[str] = set()
    while True:
        fitted = _fitted(known, prior, step)
        loads = [fitted.found_load(i, held) for i in range(len(known))]
        worst = max(loads, key=_disagreement)
        if not _disagreement(worst) > MOST_DISAGREEMENT:
            break
        held.add(worst.name)
        known = [_holding(one) if one.drive.name == worst.name else one for one in known]
    step()
    model = fitted.model(vehicle)
    if not isfinite(model.misfit_limit):
        raise CalibrationImpossibleError(
            "hardly two stretches were driven at one speed, so the fit of the half-car cannot be tested: drive at an "
            "even speed"
        )
    model = replace(model, directions=_directions(model, vehicle, fitted))
    without: dict[str, VehicleModel] = {}
    errors: list[LeftOut] = []
    witnesses = [one for one in fitted.seen if one.drive.statement.is_of_payload]
    if len(witnesses) >= LEAST_WITNESSES:
        for one in witnesses:
            left = fitted.without(one, vehicle)
            without[one.drive.name] = replace(left, directions=model.directions)
            errors += _left_out(one, without[one.drive.name])
            step()
    limits = limits_shown_by(errors, model.misfit_limit, vehicle.empty_mass_kg)
    if not errors:
        limits = limits if sister is None else Limits.of(sister)
        model = model.with_warning(UNTESTED)
    return Taught(
        limits.on(model), tuple(loads), {name: limits.on(one) for name, one in without.items()}, tuple(errors)
    )


def _drives(drives: Sequence[TaughtDrive], vehicle: Vehicle, sister: VehicleModel | None) -> list[_Drive]:
    """The drives with enough steady driving, all read alike: the roll rate only if every one has it."""
    reading = Reading(vehicle.wheelbase_m, BAND_HZ, N_SEGMENT, with_roll=can_roll(vehicle))

    def read(reading: Reading) -> list[tuple[TaughtDrive, Segments]]:
        each = ((one, segments_of([b for b in one.batches if not b.rejected], reading)) for one in drives)
        return [(one, segments) for one, segments in each if segments is not None]

    found = read(reading)
    if not found:
        raise CalibrationImpossibleError(
            "no run has enough steady driving with both sensors for the cross-spectral estimator: drive at least a "
            "minute at speed, and map both"
        )
    if reading.with_roll and any(len(segments.sensed) < 3 for _, segments in found):
        reading = replace(reading, with_roll=False)
        found = read(reading)
    usual = sister.usual_log_amplitude if sister else None
    if usual is None:
        each = [grouped(segments, reading).reading.usual_log_amplitude for _, segments in found]
        usual = float(np.median(np.array(each, float)))
    reading = replace(reading, usual_log_amplitude=usual)
    return [_Drive(one, vehicle, segments, reading) for one, segments in found]


def _own_prior(stated: LoadPrior, vehicle: Vehicle) -> fit.Gaussian:
    """The prior of a drive's own vector: how drives deviate from their vehicle, and what is stated of the load."""
    covariance = np.zeros((N_OWN + 2, N_OWN + 2))
    covariance[:N_OWN, :N_OWN] = covariance_of([UPRIGHT[i] for i in OWN], "day", "load", "batch")
    mean = np.zeros(N_OWN + 2)
    if stated.is_compact:
        covariance[:N_OWN, :N_OWN] *= SHARED**2
    else:
        shapes = shape_hypotheses(vehicle, exp(_COMPACT_LOG_S), 0.7)
        at = np.array([one.log_s - _COMPACT_LOG_S for one in shapes])
        weight = np.array([one.probability for one in shapes])
        mean[_GYRATION] = weight @ at
        covariance[_GYRATION, _GYRATION] = weight @ (
            np.array([one.std for one in shapes]) ** 2 + (at - mean[_GYRATION]) ** 2
        )
    covariance[N_OWN, N_OWN], covariance[N_OWN + 1, N_OWN + 1] = stated.payload_std_kg**2, stated.front_share_std**2
    mean[N_OWN:] = stated.payload_kg, stated.front_share
    return fit.Gaussian.of(mean, covariance)


def _holding(one: _Drive) -> _Drive:
    """The drive with its statement held: nothing is known of its load."""
    held = copy(one)
    held.drive = replace(one.drive, statement=one.drive.statement.without_payload())
    held.stated = load_prior_of(held.drive.statement, one.vehicle)
    return held


@dataclass(frozen=True, slots=True, eq=False)
class _Fitted:
    """The result of one fit: the half-car with its drives, and roll."""

    seen: list[_Drive]
    own_priors: list[fit.Gaussian]
    half_car: fit.Found
    rolling: fit.Found | None
    prior: Prior
    usual_mps: tuple[float, float] | None

    @property
    def theta(self) -> F64:
        """(n,) its parameters."""
        roll = np.empty(0) if self.rolling is None else self.rolling.common
        theta: F64 = np.r_[self.half_car.common, roll]
        return theta

    def load(self, i: int) -> Load:
        """Of drive i."""
        return _load(self.half_car.own[i])

    def found_load(self, i: int, held: set[str]) -> FoundLoad:
        """Of drive i. Without its statement its payload is a ratio of two Gaussians: posterior over statement."""
        own, covariance = self.half_car.own[i], self.half_car.own_covariances[i]
        drive = self.seen[i].drive
        variance, of_statement = float(covariance[N_OWN, N_OWN]), self.seen[i].stated.payload_std_kg ** 2
        without_kg = without_std_kg = np.nan
        if drive.statement.is_of_payload:
            left = max(1.0 / variance - 1.0 / of_statement, 1e-3 / of_statement)
            pulled = own[N_OWN] / variance - self.seen[i].stated.payload_kg / of_statement
            without_kg, without_std_kg = float(pulled / left), left**-0.5
        return FoundLoad(drive.name, self.load(i), variance**0.5, without_kg, without_std_kg, drive.name in held)

    def covariance(self) -> F64:
        """(n, n) of all parameters: roll moves with the half-car by -C I_rp."""
        if self.rolling is None:
            return self.half_car.covariance
        m = len(self.rolling.common)
        across = np.zeros((m, N))
        for one, own, rolled, moment in zip(
            self.seen, self.half_car.own, self.rolling.across, self.rolling.own, strict=True
        ):
            part = _Rolling(one, one.theta(self.half_car.common, own), _load(own))
            point = part.point(self.rolling.common, moment)
            n = len(point.theta)
            whole = part.whittle.curvature(point, [*range(n), n + 2]).information
            crossed = part.chain(m).T @ whole[N:, :N]
            across -= self.rolling.covariance @ crossed[:m] + np.outer(rolled[:, 0], crossed[m])
        beside = across @ self.half_car.covariance
        return np.block([[self.half_car.covariance, beside.T], [beside, self.rolling.covariance + beside @ across.T]])

    def model(self, vehicle: Vehicle) -> VehicleModel:
        """The vehicle, its intervals not yet tested on any drive left out."""
        return self._model(vehicle, self.theta, self.covariance())

    def without(self, one: _Drive, vehicle: Vehicle) -> VehicleModel:
        """The vehicle as the other drives teach it, from the result of all; roll as all of them show it."""
        others = [i for i, each in enumerate(self.seen) if each is not one]
        start = [fit.Drive(self.seen[i], self.own_priors[i], self.half_car.own[i]) for i in others]
        upright = fit.Gaussian.of(self.prior.mean[:N], self.prior.covariance[:N, :N])
        found = fit.most_probable(self.half_car.common, upright, start, FINE)
        theta, covariance = self.theta, self.covariance().copy()
        theta[:N], covariance[:N, :N] = found.common, found.covariance
        covariance[N:, :N] = covariance[:N, N:] = 0.0
        fitted = replace(self, seen=[self.seen[i] for i in others], half_car=found)
        return fitted._model(vehicle, theta, covariance)

    def _model(self, vehicle: Vehicle, theta: F64, covariance: F64) -> VehicleModel:
        reading = self.seen[0].whittle.spectra.reading
        batches = [batch for one in self.seen for batch in one.drive.batches if not batch.rejected]
        points = [one.point(theta[:N], own) for one, own in zip(self.seen, self.half_car.own, strict=True)]
        misfits = [one.whittle.misfit(point) for one, point in zip(self.seen, points, strict=True)]
        loads = tuple(_load(own) for own in self.half_car.own)
        like = self.prior.like
        limits = Limits.usual(vehicle.empty_mass_kg, most_misfit(misfits))
        stated = [one.stated.payload_kg for one in self.seen if not one.is_unknown]
        speeds = [batch.mean_speed_mps for batch in batches]
        model = VehicleModel(
            empty_mass_kg=vehicle.empty_mass_kg,
            empty_front_share_pct=vehicle.empty_front_share_pct,
            wheelbase_m=vehicle.wheelbase_m,
            band_hz=reading.band_hz,
            n_segment=reading.n_segment,
            names=NAMES[: len(theta)],
            parameters=theta,
            covariance=0.5 * (covariance + covariance.T),
            directions=np.zeros((len(theta), 0)),
            model_std=limits.model_std,
            spread=limits.spread,
            misfit_limit=limits.misfit_limit,
            acceleration_rms_mps2=float(np.median([one.spectra.acceleration_rms_mps2 for one in self.seen])),
            pitch_rate_rms_radps=float(np.median([one.spectra.pitch_rate_rms_radps for one in self.seen])),
            speed_seen_mps=(min(speeds), max(speeds)),
            taught_loads=loads,
            usual_log_amplitude=float(reading.usual_log_amplitude or 0.0),
            usual_stroke_mps=self.usual_mps,
            warnings=(SPRINGS_FROM_PRIORS,) if like is None and len({*stated}) <= 1 and len(loads) == 1 else (),
            track_width_m=vehicle.track_width_m,
            sensor_left_m=vehicle.sensor_left_m,
            sensor_left_std_m=vehicle.sensor_left_std_m,
            least_slack=self.seen[0].ground.least_slack,
            gravity_mps2=fmean(batch.gravity_mps2 for batch in batches),
            floor=usual_floor(batches, with_roll=reading.with_roll),
            gyro_gain=joined_gains([batch.gyro_gain for batch in batches]),
        )
        return model if like is None else _in_ranges_of(like, model)


def _in_ranges_of(sister: VehicleModel, model: VehicleModel) -> VehicleModel:
    """The model, valid over the speeds, roads and loads of its sister too."""
    slow, fast = zip(sister.speed_seen_mps, model.speed_seen_mps, strict=True)
    return replace(
        model,
        speed_seen_mps=(min(slow), max(fast)),
        acceleration_rms_mps2=sister.acceleration_rms_mps2,
        pitch_rate_rms_radps=sister.pitch_rate_rms_radps,
        taught_loads=(*sister.taught_loads, *model.taught_loads),
    )


def _load(own: F64) -> Load:
    return Load(float(own[N_OWN]), 100.0 * float(own[N_OWN + 1]))


def _disagreement(found: FoundLoad) -> float:
    """Of a statement with its drive, in standard deviations of the difference; 0 without one."""
    if found.is_held or not isfinite(found.without_kg):
        return 0.0
    gain = found.payload_std_kg**2 / found.without_std_kg**2  # of the statement's variance and that of both together
    if gain >= 1.0:
        return 0.0
    return float(abs(found.load.payload_kg - found.without_kg) / found.without_std_kg / (1.0 - gain) ** 0.5)


def _fitted(known: Sequence[_Drive], prior: Prior, step: Callable[[], None]) -> _Fitted:
    """The most probable vehicle of all drives together: the best of several starts, then roll and half-car in turn."""
    vehicle = known[0].vehicle
    with_roll = known[0].spectra.has_roll
    upright = fit.Gaussian.of(prior.mean[:N], prior.covariance[:N, :N])
    priors = [_own_prior(one.stated, vehicle) for one in known]
    seen = list(known)
    if with_roll:
        seen = [one.seen_by(prior.mean, None, one.stated.load) for one in known]
    starts = STARTS[:1] if prior.like else STARTS
    tried = []
    for springs, dampers in starts:
        theta = prior.mean[:N].copy()
        for end in ("front", "rear"):
            theta[INDEX[f"spring_{end}_npm"]] += springs
            theta[INDEX[f"damper_{end}_nspm"]] += dampers
        tried.append(_from_start(seen, priors, upright, theta))
        step()
    found = min(tried, key=lambda one: one.cost)
    if not with_roll:
        found = fit.most_probable(found.common, upright, _at(seen, priors, found.own), FINE)
        return _Fitted(seen, priors, found, None, prior, None)
    of_roll = fit.Gaussian.of(prior.mean[N:], prior.covariance[N:, N:])
    usual_mps = prior.like.usual_stroke_mps if prior.like else None
    rolling = _roll(seen, found, of_roll, prior.mean[N:])
    for _ in range(TURNS - 1):
        if usual_mps is None:
            strokes = [one.log_strokes(found.common, _load(own)) for one, own in zip(seen, found.own, strict=True)]
            front, rear = np.median(strokes, axis=0).tolist()
            usual_mps = exp(front), exp(rear)
        theta = np.r_[found.common, rolling.common]
        for one, moment in zip(seen, rolling.own, strict=True):
            one.moment_kgm = float(moment[0])
        seen = [one.seen_by(theta, usual_mps, _load(own)) for one, own in zip(seen, found.own, strict=True)]
        found = fit.most_probable(found.common, upright, _at(seen, priors, found.own), FINE)
        rolling = _roll(seen, found, of_roll, rolling.common)
    return _Fitted(seen, priors, found, rolling, prior, usual_mps)


def _at(seen: Sequence[_Drive], priors: Sequence[fit.Gaussian], own: Sequence[F64]) -> list[fit.Drive]:
    return [fit.Drive(one, prior, x) for one, prior, x in zip(seen, priors, own, strict=True)]


def _from_start(seen: Sequence[_Drive], priors: Sequence[fit.Gaussian], upright: fit.Gaussian, theta: F64) -> fit.Found:
    """The peak from one start, its drives lifted out of false peaks of their own: another load, a softer mount."""
    found = fit.most_probable(theta, upright, _at(seen, priors, [prior.mean for prior in priors]), ROUGH)
    for _ in range(RESEEDS):
        own, n_moved = _reseeded(seen, priors, found)
        if not n_moved:
            break
        found = fit.most_probable(found.common, upright, _at(seen, priors, own), ROUGH)
    return found


def _reseeded(seen: Sequence[_Drive], priors: Sequence[fit.Gaussian], found: fit.Found) -> tuple[list[F64], int]:
    """The drives' own vectors, each at the best of the peaks that a grid of loads, firm and soft, leads to; and how
    many moved.
    """
    every, n_moved = [], 0
    soft = log(SOFT_HZ) - float(found.common[INDEX["payload_mode_hz"]])
    for one, prior, here in zip(seen, priors, found.own, strict=True):
        least, best = one.cost(found.common, here) + prior.cost(here), here
        if not one.stated.is_compact:
            for mode in (0.0, soft):
                start = _seed(one, prior, found.common, mode)
                there = fit.climb(_OfVehicle(one, found.common), prior, start, ROUGH, least)
                if there.cost < least - RESEED_GAIN:
                    least, best = there.cost, there.own[0]
        n_moved += best is not here
        every.append(best)
    return every, n_moved


def _seed(one: _Drive, prior: fit.Gaussian, theta: F64, mode: float) -> F64:
    """The start of a drive's own vector: of a grid of loads the one that fits a vehicle best."""
    start = prior.mean.copy()
    start[_MODE] = mode
    if not one.is_unknown:
        return start
    vehicle = one.vehicle
    n_payloads, places = SEEDS
    most_kg = max(vehicle.payload_range_kg[1], vehicle.empty_mass_kg / 3.0)
    starts = []
    for payload_kg in np.linspace(0.0, most_kg, n_payloads).tolist():
        for place in places if payload_kg else (0.5,):
            own = start.copy()
            front_kg = vehicle.empty_front_share * vehicle.empty_mass_kg + (1.0 - place) * payload_kg
            own[N_OWN:] = payload_kg, front_kg / (vehicle.empty_mass_kg + payload_kg)
            starts.append(own)
    costs = one.whittle.costs([one.point(theta, own) for own in starts]) + [prior.cost(own) for own in starts]
    return starts[int(np.argmin(costs))]


def _roll(seen: Sequence[_Drive], found: fit.Found, prior: fit.Gaussian, start: F64) -> fit.Found:
    """The most probable roll parameters, the half-car as found, with each drive's moment about the centre line."""
    drives = []
    for one, own in zip(seen, found.own, strict=True):
        std_kgm = abs(own[N_OWN]) * one.stated.left_std_m + LEAST_MOMENT_STD_KGM
        moment_kgm = np.array([own[N_OWN] * one.stated.left_m])
        drives.append(
            fit.Drive(
                _Rolling(one, one.theta(found.common, own), _load(own)),
                fit.Gaussian(moment_kgm, np.array([[std_kgm**-2.0]])),
                moment_kgm,
            )
        )
    return fit.most_probable(start, prior, drives, FINE)


def _directions(model: VehicleModel, vehicle: Vehicle, fitted: _Fitted) -> F64:
    """(n, k) with independent causes of unit variance as columns: those that move the loads of these drives most."""
    shapes = shape_hypotheses(vehicle, *model.known_shape)
    rows = []
    for one in fitted.seen:
        answers = answers_by_vehicle(mixture_of(one.read(model.reading), model, shapes), model)
        rows.append(answers / SCALES[: len(answers), None])
    values, vectors = np.linalg.eigh(model.covariance)
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    _, _, directions = np.linalg.svd(np.concatenate(rows) @ root, full_matrices=False)
    return np.asarray(root @ directions[:MOST_DIRECTIONS].T)


def _left_out(one: _Drive, model: VehicleModel) -> list[LeftOut]:
    """Every batch of a drive, weighed by a vehicle that it has not taught."""
    drive, stated = one.drive, one.stated
    shapes = known_shape(*model.known_shape) if stated.is_compact else shape_hypotheses(one.vehicle, *model.known_shape)
    found = []
    is_among = reach_of(stated.load, model) == 0.0
    for batch in drive.batches:
        weighed = None if batch.rejected else weigh(batch, model, shapes)
        if weighed is None or isinstance(weighed, Why) or weighed.signs.tension > MOST_TENSION:
            continue  # the service would refuse it
        posterior = weighed.posterior
        true = np.array([stated.payload_kg, 100.0 * stated.front_share, np.nan])
        is_placed = drive.statement.left_m is not None or stated.payload_kg == 0.0
        if posterior.size == 3 and is_placed:
            theta = weighed.mixture.point.theta
            true[2] = one.cg_left_m(theta, stated.payload_kg, stated.payload_kg * stated.left_m)
        has_place = drive.statement.position_m is not None or drive.statement.front_share_pct is not None
        if not (has_place or stated.payload_kg == 0.0):
            true[1] = np.nan
        found.append(
            LeftOut(
                run=drive.name,
                error=posterior.mean - true[: posterior.size],
                stated_std=np.array([stated.payload_std_kg, 100.0 * stated.front_share_std, 0.02])[: posterior.size],
                posterior=posterior,
                reach=weighed.signs.reach,
                misfit=weighed.signs.misfit if is_among else np.nan,
                is_compact=stated.is_compact,
            )
        )
    return found


def information_of(spectra: CrossSpectra, point: Point, ground: Ground, statement: Statement, vehicle: Vehicle) -> F64:
    """(N, N) what one more drive with these spectra, without a roll rate, would add to the vehicle's precision.

    The drive's own deviations and its load, of which ``statement`` is known, are eliminated as in the fit.
    """
    whole = Whittle(spectra, ground, EVIDENCE).curvature(point, range(N + 2)).information
    own, prior = [*OWN, N, N + 1], _own_prior(load_prior_of(statement, vehicle), vehicle)
    across = whole[:N, own]
    told = whole[:N, :N] - across @ np.linalg.solve(whole[np.ix_(own, own)] + prior.precision, across.T)
    return np.asarray(0.5 * (told + told.T), float)
