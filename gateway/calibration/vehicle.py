"""From drives and statements to a vehicle's posterior: one hierarchical fit.

    teach(drives, vehicle) -> Taught          the vehicle, every drive's load, and what each statement was worth

A drive is driven by a vehicle that nearly is the one that is sought; by how much it deviates is in the table. Its load
is what somebody stated of it, with that doubt, or unknown; errors that statements have in common are found too
(gateway.calibration.claims). Heave and pitch are fitted to what the sensors would measure on the centre line, roll to
all three sensors with the half-car as found; they take turns (docs/architecture.md). Drives left out, weighed
as the service weighs, show the model's error.
"""

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, field, replace
from enum import StrEnum
from functools import cached_property
from itertools import combinations
from math import exp, isfinite, log, nan, pi, sqrt
from statistics import fmean
from typing import Final

import numpy as np

from gateway.calibration.claims import LEAST_PRECISION, Terms, common_causes, shared_disagreement
from gateway.calibration.left_out import (
    USUAL_FRONT_SHARE_PCT,
    USUAL_PAYLOAD_SHARE,
    LeftOut,
    Limits,
    limits_shown_by,
    most_misfit,
)
from gateway.calibration.statements import Claim, LoadPrior, Statement, load_prior_of
from gateway.core.bends import joined_gains
from gateway.core.cargo import known_shape, shape_hypotheses
from gateway.core.vehicle import Load, Vehicle
from gateway.errors import CalibrationImpossibleError
from gateway.model import fit
from gateway.model.car import Ground
from gateway.model.checks import MOST_TENSION, reach_of
from gateway.model.expected import log_stroke_speeds, with_strokes
from gateway.model.place import ROLL_BAND_HZ, spectra_of_sides
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
GROSS_ERRORS: Final = 0.05  # chosen: probability that a statement is of another load
MOST_SUSPECTS: Final = 4  # chosen: statements compared before one is held
MOST_PAIRS: Final = 2  # chosen: statements that may have been exchanged; each pair costs a rough fit
WEAK_DISAGREEMENT: Final = 2.5  # chosen: from here on a statement counts less, as in Huber's estimate of a mean
LEAST_WITNESSES: Final = 3  # chosen: two drives must remain for a scale
MOST_DIRECTIONS: Final = 8  # chosen: they carry 98 % and more of the payload's variance
SCALES: Final = np.array([10.0, 0.2, 0.005])  # chosen: kg, %, m of equal weight
SPRINGS_FROM_PRIORS: Final = "springs_from_priors"
UNTESTED: Final = "intervals_untested"

_GYRATION, _MODE = OWN.index(INDEX["payload_gyration_m2"]), OWN.index(INDEX["payload_mode_hz"])
_COMPACT_LOG_S: Final = log(0.1)
NO_TERMS: Final = Terms.of((), ())

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
    """One drive's likelihood, as a function of the common vector (N + m,) and of its own.

    The common vector has the vehicle's parameters and the errors that claims share (gateway.calibration.claims), the
    own vector (N_OWN + 2,) the drive's deviations from the vehicle, its payload and its front share.
    """

    def __init__(self, drive: TaughtDrive, vehicle: Vehicle, segments: Segments, reading: Reading) -> None:
        self.drive, self.vehicle, self._segments = drive, vehicle, segments
        self.stated = load_prior_of(drive.statement, vehicle)
        self.terms = NO_TERMS
        self.spectra = grouped(segments, reading)
        self.ground = Ground.of(vehicle, with_roll=self.spectra.has_roll)
        self.roll: F64 = np.empty(0)
        self.moment_kgm = self.stated.payload_kg * self.stated.left_m
        self.whittle = self._whittle(self.spectra.without_roll)

    @property
    def claims(self) -> tuple[Claim, ...]:
        """The words on its payload."""
        return self.drive.statement.claims_as(self.drive.name)

    @property
    def placed_by(self) -> str:
        """The name of the statement that says its place."""
        return self.drive.statement.placed_by or self.drive.name

    def believing(
        self,
        held: Collection[str],
        softened: Mapping[str, float],
        causes: Sequence[str],
        *,
        is_one_day: bool = True,
    ) -> "_Drive":
        """The same drive without the statements that are held; those softened have so many times their error. If
        it is not of one day with the others, it deviates from the vehicle like any drive.
        """
        one, statement = copy(self), self.drive.statement
        if statement.is_of_payload:
            statement = replace(
                statement,
                placed_by=self.placed_by,
                claims=tuple(claim.softened(softened.get(claim.name, 1.0)) for claim in self.claims),
            )
        for name in held:
            if name == statement.placed_by or any(claim.name == name for claim in statement.claims):
                statement = statement.without(name)
        statement = replace(statement, is_compact=statement.is_compact and is_one_day)
        one.drive = replace(self.drive, statement=statement)
        one.stated = load_prior_of(statement, self.vehicle)
        one.terms = Terms.of(statement.claims, causes)
        return one

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
        off = self.terms.off(float(own[N_OWN]), common[N:])
        return self.whittle.cost(self.point(common, own)) + 0.5 * float(off @ off)

    def curvature(self, common: F64, own: F64) -> tuple[F64, F64]:
        point = self.point(common, own)
        n, n_common = len(point.theta), len(common)
        found = self.whittle.curvature(point, [*range(N), n, n + 1])
        chosen = [*range(N), *OWN, N, N + 1]
        at = [*range(N), *range(n_common, n_common + N_OWN + 2)]
        gradient = np.zeros(n_common + N_OWN + 2)
        information = np.zeros((len(gradient), len(gradient)))
        gradient[at], information[np.ix_(at, at)] = found.gradient[chosen], found.information[np.ix_(chosen, chosen)]
        said, rows = [n_common + N_OWN, *range(N, n_common)], self.terms.rows
        gradient[said] += rows.T @ self.terms.off(float(own[N_OWN]), common[N:])
        information[np.ix_(said, said)] += rows.T @ rows
        return gradient, information

    def own_curvature(self, common: F64, own: F64) -> tuple[F64, F64]:
        """By the own vector alone."""
        point = self.point(common, own)
        n = len(point.theta)
        found = self.whittle.curvature(point, [*OWN, n, n + 1])
        gradient, information, by_payload = found.gradient.copy(), found.information.copy(), self.terms.rows[:, 0]
        gradient[N_OWN] += by_payload @ self.terms.off(float(own[N_OWN]), common[N:])
        information[N_OWN, N_OWN] += by_payload @ by_payload
        return gradient, information

    def theta(self, common: F64, own: F64) -> F64:
        """(N,) the vehicle of this drive."""
        return of_drive(common[:N], own[:N_OWN])

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
    """What a fit found of one drive: its load with what is stated of it, and what the drive says without.

    own_std_kg is of the payload if the vehicle were known: of what tells the drives' loads apart. without and its
    standard deviation (kg) are NaN if nothing was stated of the payload. stated (kg) is what the statements say once
    their common errors are known, NaN if nothing is believed. ``is_held``: a statement disagrees beyond chance and
    taught nothing.
    """

    name: str
    load: Load
    payload_std_kg: float
    without_kg: float
    without_std_kg: float
    is_held: bool
    own_std_kg: float = nan
    stated_kg: float = nan
    stated_std_kg: float = nan


class ClaimState(StrEnum):
    """What a statement taught."""

    USED = "used"
    WEAK = "weak"
    HELD = "held"


@dataclass(frozen=True, slots=True)
class FoundClaim:
    """What the fit made of a statement about one drive.

    said (kg) is its payload with the whole error that was stated. disagreement is that of the statement with the drive
    as the others see it, in standard deviations of their difference; without (kg) is what the drive says without it.
    ``is_of_place``: its payload agrees, its place does not. ``exchanged_with`` is the drive whose statement explains
    this one, and which this statement explains.
    """

    name: str
    drive: str
    state: ClaimState
    disagreement: float
    said_kg: float
    said_std_kg: float
    without_kg: float
    without_std_kg: float
    is_of_place: bool = False
    exchanged_with: str | None = None

    def distance(self, other: "FoundClaim") -> float:
        """Of two statements, each from what the other's drive says, in standard deviations."""
        off = [
            (one.said_kg - drive.without_kg) / np.hypot(one.said_std_kg, drive.without_std_kg)
            for one, drive in ((self, other), (other, self))
        ]
        return float(np.hypot(*off))


@dataclass(frozen=True, slots=True, eq=False)
class Taught:
    """A vehicle as its drives taught it, the load of every drive, and by name the vehicle without each drive left out.

    claims are the statements with what became of them, causes the errors that they have in common: mean and standard
    deviation in units of the cause's own. errors are of batches of the drives left out.
    """

    model: VehicleModel
    loads: tuple[FoundLoad, ...]
    without: dict[str, VehicleModel]
    errors: tuple[LeftOut, ...] = ()
    claims: tuple[FoundClaim, ...] = ()
    causes: Mapping[str, tuple[float, float]] = field(default_factory=dict)

    def load_of(self, name: str) -> FoundLoad | None:
        """What was found of a drive's load; None if the drive taught nothing."""
        return next((one for one in self.loads if one.name == name), None)


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

    def upright(self, n_causes: int) -> fit.Gaussian:
        """Of the half-car (N,), and behind it of errors that claims have in common, each of unit variance."""
        half_car = fit.Gaussian.of(self.mean[:N], self.covariance[:N, :N])
        precision = np.eye(N + n_causes)
        precision[:N, :N] = half_car.precision
        return fit.Gaussian(np.r_[half_car.mean, np.zeros(n_causes)], precision)

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
    prior = _prior(known, vehicle, sister)
    witnesses = [one for one in known if one.drive.statement.is_of_payload]
    n_steps = (1 if sister else len(STARTS)) + 1 + (len(witnesses) if len(witnesses) >= LEAST_WITNESSES else 0)
    done = iter(range(1, n_steps + 1))

    def step() -> None:
        if progress is not None:
            progress(next(done, n_steps), n_steps)

    fitted, claims = _tested(known, prior, step)
    loads = [fitted.found_load(i, claims) for i in range(len(known))]
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
            left, *causes = fitted.without(one, vehicle)
            without[one.drive.name] = replace(left, directions=model.directions)
            errors += _left_out(one, without[one.drive.name], one.terms.truth(*causes))
            step()
    limits = limits_shown_by(errors, model.misfit_limit, vehicle.empty_mass_kg)
    if not errors:
        limits = limits if sister is None else Limits.of(sister)
        model = model.with_warning(UNTESTED)
    return Taught(
        limits.on(model),
        tuple(loads),
        {name: limits.on(one) for name, one in without.items()},
        tuple(errors),
        tuple(claims),
        fitted.found_causes,
    )


def examined(drives: Sequence[TaughtDrive], vehicle: Vehicle, sister: VehicleModel | None) -> tuple[FoundClaim, ...]:
    """The statements about these drives, tested as :func:`teach` does; none if no drive has enough steady driving."""
    try:
        known = _drives(drives, vehicle, sister)
    except CalibrationImpossibleError:
        return ()
    return tuple(_tested(known, _prior(known, vehicle, sister), lambda: None)[1])


def _prior(known: Sequence[_Drive], vehicle: Vehicle, sister: VehicleModel | None) -> Prior:
    with_roll = known[0].spectra.has_roll
    if sister is None:
        return Prior.of_any(vehicle, with_roll=with_roll)
    return Prior.of_sister(sister, vehicle, with_roll=with_roll)


def _tested(known: Sequence[_Drive], prior: Prior, step: Callable[[], None]) -> tuple["_Fitted", list[FoundClaim]]:
    """The fit of all drives, and its statements tested.

    Known loads count as driven in one box on one day. If that makes them contradict each other, the drives may rather
    have been of several days: what is more probable counts.
    """
    fitted, found = _judged(known, prior, step, is_one_day=True)
    if any(one.state is ClaimState.HELD for one in found) and any(one.stated.is_compact for one in known):
        other, found_otherwise = _judged(known, prior, step, is_one_day=False)
        if other.log_evidence(found_otherwise) > fitted.log_evidence(found):
            return other, found_otherwise
    return fitted, found


def _judged(
    known: Sequence[_Drive], prior: Prior, step: Callable[[], None], *, is_one_day: bool
) -> tuple["_Fitted", list[FoundClaim]]:
    """The fit of all drives, of whose statements each is believed, counts less, or is held.

    A wrong statement makes others look wrong, sometimes more than itself: of those that look wrong the one is held
    first without which all drives are explained best. One that agrees once others are held is believed again. If the
    loads of two drives were exchanged, both are held, although one of the drives alone may not be sure enough.
    """
    causes = common_causes(claim for one in known for claim in one.claims)
    confirmed = {claim.name for one in known for claim in one.claims if claim.is_confirmed}
    held: set[str] = set()
    pardoned: set[str] = set()
    exchanged: dict[str, str] = {}
    tried: set[frozenset[str]] = set()
    softened: dict[str, float] = {}
    fitted: _Fitted | None = None
    while True:
        drives = [one.believing(held, softened, causes, is_one_day=is_one_day) for one in known]
        fitted = _fitted(drives, causes, prior, step, fitted)
        found = [claim for i, one in enumerate(known) for claim in fitted.found_claims(i, one, held, softened)]
        off = {one.name: one.disagreement for one in found if one.name not in held | confirmed}
        if suspects := sorted((name for name in off if off[name] > MOST_DISAGREEMENT), key=lambda name: -off[name]):
            held.add(fitted.least_likely(suspects[:MOST_SUSPECTS]))
            continue
        as_stated = [one.believing((), {}, causes, is_one_day=is_one_day) for one in known] if held else []
        others = [one for one in found if one.name not in exchanged and one.name not in confirmed]
        if (pair := _exchanged(as_stated, fitted, found, others, tried)) is not None:
            exchanged |= {pair[0].name: pair[1].drive, pair[1].name: pair[0].drive}
            held |= {one.name for one in pair}
            continue
        agreeing = {one.name for one in found if one.disagreement < WEAK_DISAGREEMENT} & held - pardoned - {*exchanged}
        weak = {name: z / WEAK_DISAGREEMENT for name, z in off.items() if z > WEAK_DISAGREEMENT}
        weak = {name: factor for name, factor in weak.items() if name not in softened}
        if not (agreeing or weak):
            return fitted, [replace(one, exchanged_with=exchanged.get(one.name)) for one in found]
        pardoned |= agreeing
        held -= agreeing
        softened |= weak


def _exchanged(
    known: Sequence[_Drive],
    fitted: "_Fitted",
    found: Sequence[FoundClaim],
    others: Sequence[FoundClaim],
    tried: set[frozenset[str]],
) -> tuple[FoundClaim, FoundClaim] | None:
    """Two of the ``others``, at least one of them held, that explain all drives better once they exchange their drives.

    Those that promise most are tried, by what either drive says and by its likelihood with the other's load; ``tried``
    keeps which.
    """
    places = {one.drive.name: i for i, one in enumerate(known)}
    alone = [one for one in others if sum(other.drive == one.drive or other.name == one.name for other in found) == 1]
    pairs = [
        pair
        for pair in combinations(alone, 2)
        if any(one.state is ClaimState.HELD for one in pair) and frozenset(one.name for one in pair) not in tried
    ]
    gains = {pair: fitted.gain_of_exchange(known, *(places[one.drive] for one in pair)) for pair in pairs}
    likely = [pair for pair in sorted(pairs, key=lambda pair: -gains[pair])[:MOST_PAIRS] if gains[pair] > 0.0]
    near = [pair for pair in pairs if pair[0].distance(pair[1]) < MOST_DISAGREEMENT and pair not in likely]
    best = fitted.log_evidence(found)
    for pair in (*likely, *sorted(near, key=lambda pair: pair[0].distance(pair[1]))[:MOST_PAIRS]):
        tried.add(frozenset(one.name for one in pair))
        drives = list(fitted.seen)
        for one, other in (pair, reversed(pair)):
            i, said = places[one.drive], known[places[other.drive]].drive.statement
            exchanged = copy(fitted.seen[i])
            exchanged.drive = replace(known[i].drive, statement=said)
            drives[i] = exchanged.believing((), {}, fitted.causes)
        if fitted.again(drives).log_evidence([one for one in found if one not in pair]) > best:
            return pair
    return None


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


def _own_prior(stated: LoadPrior, vehicle: Vehicle, *, is_said: bool = False) -> fit.Gaussian:
    """The prior of a drive's own vector: how drives deviate from their vehicle, and what is stated of the load.

    It is flat in the payload if the drive's terms say that (``is_said``).
    """
    if stated.carries is not None:
        vehicle = replace(vehicle, carries=stated.carries, payload_length_m=None, payload_height_m=None)
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
    prior = fit.Gaussian.of(mean, covariance)
    if is_said:
        prior.precision[N_OWN, :] = prior.precision[:, N_OWN] = 0.0
    return prior


@dataclass(frozen=True, eq=False)
class _Fitted:
    """The result of one fit: the half-car with its drives, and roll."""

    seen: list[_Drive]
    own_priors: list[fit.Gaussian]
    causes: tuple[str, ...]
    half_car: fit.Found
    rolling: fit.Found | None
    prior: Prior
    usual_mps: tuple[float, float] | None

    @property
    def upright(self) -> F64:
        """(N,) the half-car's parameters."""
        return self.half_car.common[:N]

    @property
    def theta(self) -> F64:
        """(n,) its parameters."""
        roll = np.empty(0) if self.rolling is None else self.rolling.common
        theta: F64 = np.r_[self.upright, roll]
        return theta

    @property
    def found_causes(self) -> dict[str, tuple[float, float]]:
        """Mean and standard deviation of each error that claims have in common."""
        stds = np.sqrt(np.diag(self.half_car.covariance)[N:]).tolist()
        return dict(zip(self.causes, zip(self.half_car.common[N:].tolist(), stds, strict=True), strict=True))

    def _joint(self, i: int) -> tuple[F64, F64]:
        """Mean and covariance (1 + m) of drive i's payload and the common causes."""
        found = self.half_car
        m = len(self.causes)
        covariance = np.empty((1 + m, 1 + m))
        covariance[0, 0] = found.own_covariances[i][N_OWN, N_OWN]
        covariance[0, 1:] = covariance[1:, 0] = found.across[i][N:, N_OWN]
        covariance[1:, 1:] = found.covariance[N:, N:]
        return np.r_[found.own[i][N_OWN], found.common[N:]], covariance

    def found_load(self, i: int, claims: Sequence[FoundClaim]) -> FoundLoad:
        """Of drive i."""
        own, covariance = self.half_car.own[i], self.half_car.own_covariances[i]
        across = self.half_car.across[i][:, N_OWN]
        by_vehicle = across @ np.linalg.solve(self.half_car.covariance, across)
        one = self.seen[i]
        without_kg = without_std_kg = stated_kg = stated_std_kg = nan
        if one.terms.names:
            mean, left = one.terms.without(*self._joint(i), range(len(one.terms.names)))
            without_kg, without_std_kg = float(mean[0]), float(left[0, 0]) ** 0.5
            stated_kg, stated_std_kg = one.terms.truth(self.half_car.common[N:], self.half_car.covariance[N:, N:])
        name = one.drive.name
        return FoundLoad(
            name=name,
            load=_load(own),
            payload_std_kg=float(covariance[N_OWN, N_OWN]) ** 0.5,
            without_kg=without_kg,
            without_std_kg=without_std_kg,
            is_held=any(claim.drive == name and claim.state is ClaimState.HELD for claim in claims),
            own_std_kg=max(float(covariance[N_OWN, N_OWN]) - float(by_vehicle), 0.0) ** 0.5,
            stated_kg=stated_kg,
            stated_std_kg=stated_std_kg,
        )

    def found_claims(
        self, i: int, stated: _Drive, held: Collection[str], softened: Mapping[str, float]
    ) -> Iterator[FoundClaim]:
        """Every statement about drive i as it was ``stated``, tested: also what is held."""
        terms, (mean, covariance) = self.seen[i].terms, self._joint(i)
        model_kg, model_share = self._model_error(i)
        for claim in stated.claims:
            whole = Terms.of([claim], self.causes)
            error_kg = float(np.hypot(whole.own_kg[0], model_kg))
            if claim.name in terms.names:
                at = terms.names.index(claim.name)
                by_others, left = terms.without(mean, covariance, [at])
                off = terms.disagreement(at, mean, covariance, error_kg)
            else:
                by_others, left = mean, covariance
                row = np.r_[1.0, -whole.shared_kg[0]]
                off = float(abs(row @ mean - claim.payload_kg) / np.sqrt(row @ covariance @ row + error_kg**2))
            causes = self.found_causes
            for cause, _ in claim.shared:
                if cause == claim.name and cause in causes:
                    off = max(off, shared_disagreement(causes[cause][0], causes[cause][1] ** 2))
            by_place = self._place_disagreement(i, stated, model_share) if claim.name == stated.placed_by else 0.0
            state = ClaimState.WEAK if claim.name in softened else ClaimState.USED
            yield FoundClaim(
                name=claim.name,
                drive=stated.drive.name,
                state=ClaimState.HELD if claim.name in held else state,
                disagreement=max(off, by_place),
                said_kg=claim.payload_kg,
                said_std_kg=claim.std_kg,
                without_kg=float(by_others[0]),
                without_std_kg=float(left[0, 0]) ** 0.5,
                is_of_place=by_place > max(off, WEAK_DISAGREEMENT),
            )

    def log_evidence(self, claims: Sequence[FoundClaim]) -> float:
        """Logarithm of the probability of drives and statements, up to a constant, by Laplace's approximation.

        A statement that is held is a gross error: any payload that the vehicle may carry, with a small probability.
        """
        own = [prior.precision[np.ix_(free, free)] for prior in self.own_priors
               if (free := np.flatnonzero(np.diag(prior.precision)).tolist())]  # fmt: skip
        volume = 0.5 * sum(float(np.linalg.slogdet(precision)[1]) for precision in own) - self.half_car.log_volume
        words = -sum(float(np.sum(np.log(one.terms.own_kg * sqrt(2.0 * pi)))) for one in self.seen)
        most_kg = self.seen[0].vehicle.largest_payload_kg
        n_held = sum(claim.state is ClaimState.HELD for claim in claims)
        return volume + words - self.half_car.cost + n_held * log(GROSS_ERRORS / most_kg)

    def least_likely(self, names: Sequence[str]) -> str:
        """Of these statements the one without which all drives are explained best."""
        if len(names) == 1:
            return names[0]
        costs = {
            name: self.again([one.believing({name}, {}, self.causes) for one in self.seen]).half_car.cost
            for name in names
        }
        return min(names, key=lambda name: costs[name])

    def gain_of_exchange(self, stated: Sequence[_Drive], i: int, j: int) -> float:
        """In log likelihood, if each of two drives carried what is stated of the other, all else as it is."""
        gain = 0.0
        for one, other in ((i, j), (j, i)):
            own, said = self.half_car.own[one].copy(), stated[other].stated
            here = self.seen[one].point(self.half_car.common, own)
            own[N_OWN:] = said.payload_kg, said.front_share
            there = self.seen[one].point(self.half_car.common, own)
            own[N_OWN:] = stated[one].stated.payload_kg, stated[one].stated.front_share
            as_stated = self.seen[one].point(self.half_car.common, own)
            costs = self.seen[one].whittle.costs([there, as_stated, here])
            gain += float(costs[1] - costs[0])
        return gain

    def again(self, drives: list[_Drive]) -> "_Fitted":
        """A rough fit of the same drives with other statements, from here and from a usual vehicle; roll stays."""
        upright = self.prior.upright(len(self.causes))
        priors = [_own_prior(one.stated, one.vehicle, is_said=bool(one.terms.names)) for one in drives]
        starts = ((self.half_car.common, self.half_car.own), (upright.mean, [prior.mean for prior in priors]))
        tried = [
            _lifted(drives, priors, upright, fit.most_probable(common, upright, _at(drives, priors, own), ROUGH))
            for common, own in starts
        ]
        return replace(self, seen=drives, own_priors=priors, half_car=min(tried, key=lambda found: found.cost))

    def _model_error(self, i: int) -> tuple[float, float]:
        """Standard deviations of what drive i says of payload (kg) and front share (0..1) by the model's own error, and
        without a roll rate by the load's unknown place across (gateway.model.weigh says how).
        """
        one, own = self.seen[i], self.half_car.own[i]
        usual = USUAL_PAYLOAD_SHARE * one.vehicle.empty_mass_kg, USUAL_FRONT_SHARE_PCT / 100.0
        point = one.point(self.half_car.common, own)
        sides = spectra_of_sides(one.whittle, point, self._plain) if self.rolling is None else ()
        if not sides:
            return usual
        across = self.half_car.across[i]
        by_vehicle = across.T @ np.linalg.solve(self.half_car.covariance, across)
        information = np.linalg.inv(self.half_car.own_covariances[i] - by_vehicle)
        information[N_OWN, N_OWN] -= np.sum(one.terms.own_kg**-2.0)
        if one.drive.statement.has_place:
            information[N_OWN + 1, N_OWN + 1] -= self.own_priors[i].precision[N_OWN + 1, N_OWN + 1]
        values, vectors = np.linalg.eigh(information)
        free = (vectors / np.maximum(values, LEAST_PRECISION)) @ vectors.T
        n = len(point.theta)

        def moved(parts: F64) -> F64:
            shown = one.whittle.showing(one.whittle.spectra.showing(parts))
            return np.asarray(-free @ shown.curvature(point, [*OWN, n, n + 1]).gradient)[N_OWN:]

        left, right, middle = (moved(parts) for parts in sides)
        found = np.hypot(0.5 * (left - right), 0.5 * (left + right) - middle)
        return float(np.hypot(usual[0], found[0])), float(np.hypot(usual[1], found[1]))

    @cached_property
    def _plain(self) -> VehicleModel:
        return self.model(self.seen[0].vehicle)

    def _place_disagreement(self, i: int, stated: _Drive, model_std: float) -> float:
        """Of the stated front share with that of drive i without it, in standard deviations of the difference."""
        if not stated.drive.statement.has_place or stated.stated.payload_kg == 0.0:
            return 0.0
        share, std = stated.stated.front_share, stated.stated.front_share_std
        mean, variance = (
            float(self.half_car.own[i][N_OWN + 1]),
            float(self.half_car.own_covariances[i][N_OWN + 1, N_OWN + 1]),
        )
        if self.seen[i].drive.statement.has_place:
            left = 1.0 / max(1.0 / variance - std**-2.0, 1e-3 / std**2)
            mean, variance = (mean / variance - share / std**2) * left, left
        return abs(mean - share) / float(np.sqrt(variance + std**2 + model_std**2))

    @cached_property
    def covariance(self) -> F64:
        """(n, n) of all parameters: roll moves with the half-car by -C I_rp."""
        upright = self.half_car.covariance[:N, :N]
        if self.rolling is None:
            return upright
        m = len(self.rolling.common)
        across = np.zeros((m, N))
        for one, own, rolled, moment in zip(
            self.seen, self.half_car.own, self.rolling.across, self.rolling.own, strict=True
        ):
            part = _Rolling(one, one.theta(self.upright, own), _load(own))
            point = part.point(self.rolling.common, moment)
            n = len(point.theta)
            whole = part.whittle.curvature(point, [*range(n), n + 2]).information
            crossed = part.chain(m).T @ whole[N:, :N]
            across -= self.rolling.covariance @ crossed[:m] + np.outer(rolled[:, 0], crossed[m])
        beside = across @ upright
        return np.block([[upright, beside.T], [beside, self.rolling.covariance + beside @ across.T]])

    def model(self, vehicle: Vehicle) -> VehicleModel:
        """The vehicle, its intervals not yet tested on any drive left out."""
        return self._model(vehicle, self.theta, self.covariance)

    def without(self, one: _Drive, vehicle: Vehicle) -> tuple[VehicleModel, F64, F64]:
        """The vehicle as the other drives teach it, from the result of all; roll as all of them show it. With it the
        mean and the covariance of the common causes.
        """
        others = [i for i, each in enumerate(self.seen) if each is not one]
        start = [fit.Drive(self.seen[i], self.own_priors[i], self.half_car.own[i]) for i in others]
        found = fit.most_probable(self.half_car.common, self.prior.upright(len(self.causes)), start, FINE)
        theta, covariance = self.theta, self.covariance.copy()
        theta[:N], covariance[:N, :N] = found.common[:N], found.covariance[:N, :N]
        covariance[N:, :N] = covariance[:N, N:] = 0.0
        fitted = replace(self, seen=[self.seen[i] for i in others], half_car=found)
        return fitted._model(vehicle, theta, covariance), found.common[N:], found.covariance[N:, N:]

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


def _fitted(
    known: Sequence[_Drive], causes: tuple[str, ...], prior: Prior, step: Callable[[], None], before: _Fitted | None
) -> _Fitted:
    """The most probable vehicle of all drives together: the best of several starts, or from the fit ``before``; then
    roll and half-car in turn.
    """
    vehicle = known[0].vehicle
    with_roll = known[0].spectra.has_roll
    upright = prior.upright(len(causes))
    priors = [_own_prior(one.stated, vehicle, is_said=bool(one.terms.names)) for one in known]
    seen = list(known)
    if with_roll:
        theta, usual_mps = (prior.mean, None) if before is None else (before.theta, before.usual_mps)
        seen = [one.seen_by(theta, usual_mps, one.stated.load) for one in known]
    if before is None:
        starts = STARTS[:1] if prior.like else STARTS
        tried = []
        for springs, dampers in starts:
            common = upright.mean.copy()
            for end in ("front", "rear"):
                common[INDEX[f"spring_{end}_npm"]] += springs
                common[INDEX[f"damper_{end}_nspm"]] += dampers
            tried.append(fit.most_probable(common, upright, _at(seen, priors, [one.mean for one in priors]), ROUGH))
            step()
        found = min(tried, key=lambda one: one.cost)
    else:
        start = _at(seen, priors, before.half_car.own)
        found = fit.most_probable(before.half_car.common, upright, start, ROUGH)
    found = _lifted(seen, priors, upright, found)
    if not with_roll:
        found = fit.most_probable(found.common, upright, _at(seen, priors, found.own), FINE)
        return _Fitted(seen, priors, causes, found, None, prior, None)
    of_roll = fit.Gaussian.of(prior.mean[N:], prior.covariance[N:, N:])
    usual_mps = prior.like.usual_stroke_mps if prior.like else None
    rolling = _roll(seen, found, of_roll, prior.mean[N:])
    for _ in range(TURNS - 1):
        if usual_mps is None:
            strokes = [one.log_strokes(found.common[:N], _load(own)) for one, own in zip(seen, found.own, strict=True)]
            front, rear = np.median(strokes, axis=0).tolist()
            usual_mps = exp(front), exp(rear)
        theta = np.r_[found.common[:N], rolling.common]
        for one, moment in zip(seen, rolling.own, strict=True):
            one.moment_kgm = float(moment[0])
        seen = [one.seen_by(theta, usual_mps, _load(own)) for one, own in zip(seen, found.own, strict=True)]
        found = fit.most_probable(found.common, upright, _at(seen, priors, found.own), FINE)
        rolling = _roll(seen, found, of_roll, rolling.common)
    return _Fitted(seen, priors, causes, found, rolling, prior, usual_mps)


def _at(seen: Sequence[_Drive], priors: Sequence[fit.Gaussian], own: Sequence[F64]) -> list[fit.Drive]:
    return [fit.Drive(one, prior, x) for one, prior, x in zip(seen, priors, own, strict=True)]


def _lifted(
    seen: Sequence[_Drive], priors: Sequence[fit.Gaussian], upright: fit.Gaussian, found: fit.Found
) -> fit.Found:
    """The peak that was found, its drives lifted out of false peaks of their own: another load, a softer mount."""
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


def _left_out(one: _Drive, model: VehicleModel, truth_kg: tuple[float, float]) -> list[LeftOut]:
    """Every batch of a drive, weighed by a vehicle that it has not taught. ``truth_kg`` is what its statements say of
    the payload once their common errors are known, with its standard deviation.
    """
    drive, stated = one.drive, one.stated
    shapes = known_shape(*model.known_shape) if stated.is_compact else shape_hypotheses(one.vehicle, *model.known_shape)
    found = []
    is_among = reach_of(stated.load, model) == 0.0
    for batch in drive.batches:
        weighed = None if batch.rejected else weigh(batch, model, shapes)
        if weighed is None or isinstance(weighed, Why) or weighed.signs.tension > MOST_TENSION:
            continue  # the service would refuse it
        posterior = weighed.posterior
        true = np.array([truth_kg[0], 100.0 * stated.front_share, np.nan])
        is_placed = drive.statement.left_m is not None or stated.payload_kg == 0.0
        if posterior.size == 3 and is_placed:
            theta = weighed.mixture.point.theta
            true[2] = one.cg_left_m(theta, stated.payload_kg, stated.payload_kg * stated.left_m)
        if not drive.statement.has_place:
            true[1] = np.nan
        found.append(
            LeftOut(
                run=drive.name,
                error=posterior.mean - true[: posterior.size],
                stated_std=np.array([truth_kg[1], 100.0 * stated.front_share_std, 0.02])[: posterior.size],
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
