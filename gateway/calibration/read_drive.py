"""A drive as a fit reads it: its spectra, its statement, and its likelihood as a function of vehicle and load."""

from collections.abc import Collection, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from gateway.calibration.prior import own_prior
from gateway.calibration.stated_drive import StatedDrive
from gateway.calibration.statements import Claim, Terms, load_prior_of
from gateway.core.vehicle import Load, Vehicle
from gateway.model.car import Ground
from gateway.model.expected import log_stroke_speeds, with_strokes
from gateway.model.mixture import MOST_LOAD_SHARE
from gateway.model.place import ROLL_BAND_HZ
from gateway.model.spectra import CrossSpectra, Reading, Segments, grouped, level, mount_of
from gateway.model.table import INDEX, N_OWN, OWN, N, of_drive
from gateway.model.whittle import Point, Whittle
from gateway.records import F64

BAND_HZ: Final = (1.1, 14.0)  # chosen: body and wheel resonances
N_SEGMENT: Final = 256  # chosen: 5 s at 50 Hz, short enough for town traffic
EVIDENCE: Final = 0.2  # chosen: weight of a drive's evidence; minutes of driving repeat the same model error
MOST_OFFSET_STD_M: Final = 0.1  # chosen: of the sensor's lateral place; with a worse one roll is not used
UNKNOWN_SHARE: Final = 0.1  # chosen: of the empty mass; a payload stated no better than that has several starts
NO_TERMS: Final = Terms.of((), ())


def can_roll(vehicle: Vehicle) -> bool:
    """Whether the vehicle's data suffice to use a roll rate: its track, and the sensor's position.

    An unknown lever arm cannot be estimated from the roll itself: suspension mounts and the body bring roll into the
    acceleration that no lever arm of the sensor explains (docs/method.md).
    """
    return vehicle.track_width_m is not None and vehicle.sensor_left_std_m <= MOST_OFFSET_STD_M


class ReadDrive:
    """One drive's likelihood, as a function of the common vector (N + m,) and of its own.

    The common vector has the vehicle's parameters and the errors that claims share (gateway.calibration.statements),
    the own vector (N_OWN + 2,) the drive's deviations from the vehicle, its payload and its front share.
    """

    def __init__(self, drive: StatedDrive, vehicle: Vehicle, segments: Segments, reading: Reading) -> None:
        self.drive, self.vehicle, self._segments = drive, vehicle, segments
        self.stated = load_prior_of(drive.statement, vehicle)
        self.terms = NO_TERMS
        self.own_prior = own_prior(self.stated, vehicle)
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
    ) -> "ReadDrive":
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
        one.own_prior = own_prior(one.stated, self.vehicle, is_said=bool(one.terms.names))
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

    def seen_by(self, theta: F64, usual_mps: tuple[float, float] | None, load: Load) -> "ReadDrive":
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
class OfVehicle:
    """A drive's likelihood by its own vector alone, its vehicle fixed."""

    drive: ReadDrive
    theta: F64

    def cost(self, common: F64, own: F64) -> float:
        return self.drive.cost(self.theta, own)

    def curvature(self, common: F64, own: F64) -> tuple[F64, F64]:
        return self.drive.own_curvature(self.theta, own)


class RollingDrive:
    """All three sensors of a drive, by the roll parameters (r,) and its payload's moment about the centre line (kg
    m).
    """

    def __init__(self, drive: ReadDrive, theta: F64, load: Load) -> None:
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
