"""The weights of a vehicle: gross, per axle and per wheel, and the place of its payload."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from gateway.core.vehicle import Vehicle, left_share_pct
from gateway.estimate import UNKNOWN, Estimate, Lack, Quantity, Weight, Weights
from gateway.posterior import CG_LEFT, FRONT_SHARE, PAYLOAD, Posterior, Source


@dataclass(frozen=True, slots=True)
class Unsprung:
    """Unsprung masses of both axles in kg; ``correlation`` is that of their errors. A stated mass has no error."""

    front: Quantity = UNKNOWN
    rear: Quantity = UNKNOWN
    correlation: float = 0.0

    @property
    def both(self) -> Quantity:
        """Their sum."""
        one, other = self.front.std, self.rear.std
        variance = one**2 + other**2 + 2.0 * self.correlation * one * other
        return Quantity(self.front.number + self.rear.number, math.sqrt(max(0.0, variance)))

    @property
    def is_estimated(self) -> bool:
        """Whether an unsprung mass was estimated because nobody stated it."""
        return self.front.std > 0.0 or self.rear.std > 0.0

    def unless_stated(self, vehicle: Vehicle) -> "Unsprung":
        """The masses that the fitter of ``vehicle`` stated, and these where none was."""
        front_kg, rear_kg = unsprung_kg(vehicle)
        return Unsprung(
            self.front if math.isnan(front_kg) else Quantity(front_kg, 0.0),
            self.rear if math.isnan(rear_kg) else Quantity(rear_kg, 0.0),
            self.correlation,
        )


NOT_CALIBRATED: Final = Unsprung()


def unsprung_kg(vehicle: Vehicle) -> tuple[float, float]:
    """Unsprung mass at the front and the rear axle; NaN if neither it nor the kerb weight is stated."""
    share = vehicle.empty_front_share
    return (
        _unsprung(vehicle.unsprung_front_kg, vehicle.kerb_front_axle_kg, share * vehicle.empty_mass_kg),
        _unsprung(vehicle.unsprung_rear_kg, vehicle.kerb_rear_axle_kg, (1.0 - share) * vehicle.empty_mass_kg),
    )


def _unsprung(stated_kg: float | None, kerb_kg: float | None, sprung_kg: float) -> float:
    if stated_kg is not None:
        return stated_kg
    return math.nan if kerb_kg is None else kerb_kg - sprung_kg


ROLL_UNKNOWN: Final = Quantity()


def weighed(estimate: Estimate, vehicle: Vehicle | None, unsprung: Unsprung = NOT_CALIBRATED) -> Estimate:
    """``estimate`` with the weights that follow from it; without a vehicle all are unknown."""
    if vehicle is None:
        return replace(estimate, weights=Weights(), left_share=UNKNOWN)
    roll_share = Quantity(estimate.roll_share_front, estimate.roll_share_front_std)
    weights = weights_of(vehicle, estimate.posterior, roll_share, unsprung)
    return replace(estimate, weights=weights, left_share=_left_share(vehicle, estimate.posterior))


def _left_share(vehicle: Vehicle, posterior: Posterior | None) -> Quantity:
    if posterior is None or posterior.size <= CG_LEFT or vehicle.track_width_m is None:
        return UNKNOWN
    share_pct = left_share_pct(float(posterior.mean[CG_LEFT]), vehicle.track_width_m)
    return posterior.linear(share_pct, [0.0, 0.0, 100.0 / vehicle.track_width_m])


def weights_of(
    vehicle: Vehicle,
    posterior: Posterior | None,
    roll_share: Quantity = ROLL_UNKNOWN,
    unsprung: Unsprung = NOT_CALIBRATED,
) -> Weights:
    """Gross weight, axle loads and wheel loads of a loaded ``vehicle`` on level ground.

    An axle carries its share D of the sprung mass m = M + L and its unsprung mass u, half of each on either wheel:

        F_front = D m + u_front,    F_rear = (1 - D) m + u_rear,    G = F_front + F_rear

    A centre of gravity y left of the centre line adds the moment m g y, of which the front axle takes phi, the
    ``roll_share``, according to its springs and anti-roll bar (Gillespie, Fundamentals of Vehicle Dynamics, ch. 6: roll
    moment distribution). With w the track width, left wheels carry more, and right ones less, by

        front: phi m y / w,    rear: (1 - phi) m y / w

    The body's lean is neglected. Each weight is J (L, D, y) to first order, with variance J S J' of the posterior's
    covariance S; phi's error counts as independent. Empty figures count as exact. An unsprung mass that was not stated
    follows from the kerb weight of its axle, else from calibration (``unsprung``) with its error. That error counts as
    independent of all others: it moves an axle load by kilograms, and hardly moves payload and share. A weight with a
    missing input is unknown and says which (``Weight.lacks``).
    """
    below = unsprung.unless_stated(vehicle)
    known = _Known.of(vehicle, posterior, roll_share)
    front = _Axle(known, share=known.share, sign=1.0, roll_share=roll_share.number, unsprung=below.front)
    rear = _Axle(known, share=1.0 - known.share, sign=-1.0, roll_share=1.0 - roll_share.number, unsprung=below.rear)
    gross_kg = known.sprung_kg + below.front.number + below.rear.number
    is_estimated = below.is_estimated
    return Weights(
        gross=known.weight(gross_kg, [1.0], below.both.std, vehicle.gross_limit_kg, is_estimated=is_estimated),
        front_axle=front.whole(vehicle.front_axle_limit_kg),
        rear_axle=rear.whole(vehicle.rear_axle_limit_kg),
        front_left=front.wheel(1.0, vehicle.front_wheel_limit_kg),
        front_right=front.wheel(-1.0, vehicle.front_wheel_limit_kg),
        rear_left=rear.wheel(1.0, vehicle.rear_wheel_limit_kg),
        rear_right=rear.wheel(-1.0, vehicle.rear_wheel_limit_kg),
    )


@dataclass(frozen=True, slots=True)
class _Known:
    """The inputs from an estimate and a vehicle; NaN where unknown. ``share`` is 0..1."""

    posterior: Posterior | None
    sprung_kg: float
    share: float
    cg_left_m: float
    track_m: float
    roll_share: Quantity

    @classmethod
    def of(cls, vehicle: Vehicle, posterior: Posterior | None, roll_share: Quantity) -> "_Known":
        mean = np.full(3, np.nan)
        if posterior is not None:
            mean[: posterior.size] = posterior.mean
        payload_kg, share_pct, cg_left_m = mean.tolist()
        track_m = math.nan if vehicle.track_width_m is None else vehicle.track_width_m
        return cls(posterior, vehicle.empty_mass_kg + payload_kg, share_pct / 100.0, cg_left_m, track_m, roll_share)

    def weight(
        self,
        kg: float,
        slopes: Sequence[float],
        independent_std_kg: float,
        limit_kg: float | None,
        *,
        is_estimated: bool,
    ) -> Weight:
        """A weight with its error; ``slopes`` are its derivatives by payload (kg), front share (0..1) and place (m).

        ``is_estimated`` is of the unsprung mass: errors of both axles may cancel in the weight, and yet it was not
        stated.
        """
        if math.isnan(kg) or self.posterior is None:
            return Weight(limit_kg=limit_kg, lacks=self._lack(len(slopes)))
        per_percent = [slope / (100.0 if i == FRONT_SHARE else 1.0) for i, slope in enumerate(slopes)]
        found = self.posterior.linear(kg, per_percent, independent_std_kg)
        return Weight(kg, found.std, limit_kg, None, is_estimated, found.interval95)

    def _lack(self, n_slopes: int) -> Lack:
        """The first missing input of a weight that depends on the first ``n_slopes`` quantities."""
        is_wheel = n_slopes > CG_LEFT
        if not math.isfinite(self.sprung_kg) or (n_slopes > FRONT_SHARE and not math.isfinite(self.share)):
            return Lack.ESTIMATE
        if is_wheel and math.isnan(self.track_m):
            return Lack.TRACK_WIDTH
        is_sideways = math.isfinite(self.cg_left_m) and math.isfinite(self.roll_share.number)
        return Lack.ROLL_RATE if is_wheel and not is_sideways else Lack.UNSPRUNG_MASS


@dataclass(frozen=True, slots=True)
class _Axle:
    """An axle with ``share`` of the sprung mass and ``roll_share`` of its roll moment.

    ``sign`` is the slope of both by the front's estimated values: 1 for the front axle, -1 for the rear.
    """

    known: _Known
    share: float
    sign: float
    roll_share: float
    unsprung: Quantity

    def whole(self, limit_kg: float | None) -> Weight:
        """The load of both wheels."""
        sprung_kg = self.known.sprung_kg
        kg = self.share * sprung_kg + self.unsprung.number
        slopes = [self.share, self.sign * sprung_kg]
        return self.known.weight(kg, slopes, self.unsprung.std, limit_kg, is_estimated=self.unsprung.std > 0.0)

    def wheel(self, side: float, limit_kg: float | None) -> Weight:
        """The load of one wheel; ``side`` is 1 for the left, -1 for the right."""
        sprung_kg, per_track = self.known.sprung_kg, side / self.known.track_m
        moment = per_track * self.known.cg_left_m  # in sprung masses
        by_roll_share_kg = sprung_kg * moment * self.known.roll_share.std
        return self.known.weight(
            0.5 * (self.share * sprung_kg + self.unsprung.number) + self.roll_share * sprung_kg * moment,
            [
                0.5 * self.share + self.roll_share * moment,
                0.5 * self.sign * sprung_kg,
                self.roll_share * sprung_kg * per_track,
            ],
            math.hypot(0.5 * self.unsprung.std, by_roll_share_kg),
            limit_kg,
            is_estimated=self.unsprung.std > 0.0,
        )


@dataclass(frozen=True, slots=True)
class PayloadPlace:
    """The payload's centre of gravity behind the front axle, and its standard deviation.

    The same left of the centre line, NaN if unknown; ``correlation`` is that of both errors.
    """

    position_m: float
    std_m: float
    left_m: float = math.nan
    left_std_m: float = math.nan
    correlation: float = math.nan


def place_of(vehicle: Vehicle, posterior: Posterior) -> PayloadPlace | None:
    """The place of the payload; None if there may be no payload, and so no place.

    With s the share, s0 the empty share, M the empty mass and l the wheelbase, moments about the front axle give

        d = l (1 - F / L),    F = s (M + L) - s0 M,    the part of L on the front axle,

    the inverse of equation (3) of Bottelli et al. With y and y0 the centres of gravity of the loaded and of the empty
    vehicle left of the centre line, moments about that line give y_L = ((M + L) y - M y0) / L. Errors are to first
    order. The error of the empty share is the same in s and in s0, and cancels.
    """
    payload = posterior.quantity(PAYLOAD)
    if posterior.size <= FRONT_SHARE or not payload.interval95[0] > 0.0:
        return None
    posterior = posterior.without(Source.EMPTY_SHARE)
    load_kg, share = payload.number, float(posterior.mean[FRONT_SHARE]) / 100.0
    total_kg, empty_share = vehicle.empty_mass_kg + load_kg, vehicle.empty_front_share
    front_share_of_load = (share * total_kg - empty_share * vehicle.empty_mass_kg) / load_kg
    along = [
        vehicle.wheelbase_m * slope for slope in ((front_share_of_load - share) / load_kg, -total_kg / load_kg / 100.0)
    ]
    position_m = vehicle.wheelbase_m * (1.0 - front_share_of_load)
    std_m = posterior.linear(position_m, along).std
    if posterior.size <= CG_LEFT:
        return PayloadPlace(position_m, std_m)
    cg_left_m = float(posterior.mean[CG_LEFT])
    left_m = (total_kg * cg_left_m - vehicle.empty_mass_kg * vehicle.empty_cg_left_m) / load_kg
    across = [(cg_left_m - left_m) / load_kg, 0.0, total_kg / load_kg]
    left_std_m = posterior.linear(left_m, across).std
    is_both = std_m * left_std_m > 0.0
    correlation = posterior.covariance_of(along, across) / (std_m * left_std_m) if is_both else math.nan
    return PayloadPlace(position_m, std_m, left_m, left_std_m, correlation)
