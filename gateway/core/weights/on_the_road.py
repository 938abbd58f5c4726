"""The weights of a vehicle: gross, per axle and per wheel, and the place of its payload."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from gateway.core.vehicle import Vehicle, left_share_pct
from gateway.estimates.batch_estimate import UNKNOWN, Estimate, Lack, Quantity, Weight, Weights
from gateway.estimates.posterior import CG_LEFT, FRONT_SHARE, PAYLOAD, Posterior, Source


@dataclass(frozen=True, slots=True)
class Unsprung:
    """Unsprung masses of both axles in kg; ``correlation`` is that of their errors. A stated mass has no error."""

    front: Quantity = UNKNOWN
    rear: Quantity = UNKNOWN
    correlation: float = 0.0

    @property
    def both(self) -> Quantity:
        """The sum of both axles."""
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
    front = vehicle.empty_front_share
    found = []
    for stated_kg, kerb_kg, share in (
        (vehicle.unsprung_front_kg, vehicle.kerb_front_axle_kg, front),
        (vehicle.unsprung_rear_kg, vehicle.kerb_rear_axle_kg, 1.0 - front),
    ):
        by_kerb_kg = math.nan if kerb_kg is None else kerb_kg - share * vehicle.empty_mass_kg
        found.append(by_kerb_kg if stated_kg is None else stated_kg)
    return found[0], found[1]


ROLL_UNKNOWN: Final = Quantity()


def weighed(estimate: Estimate, vehicle: Vehicle | None, unsprung: Unsprung = NOT_CALIBRATED) -> Estimate:
    """``estimate`` with the weights that follow from it; without a vehicle all are unknown."""
    if vehicle is None:
        return replace(estimate, weights=Weights(), left_share=UNKNOWN)
    roll_share = Quantity(estimate.roll_share_front, estimate.roll_share_front_std)
    posterior, track_m = estimate.posterior, vehicle.track_width_m
    left_share = UNKNOWN
    if posterior is not None and posterior.size > CG_LEFT and track_m is not None:
        share_pct = left_share_pct(float(posterior.mean[CG_LEFT]), track_m)
        left_share = posterior.linear(share_pct, [0.0, 0.0, 100.0 / track_m])
    weights = weights_of(vehicle, posterior, roll_share, unsprung)
    return replace(estimate, weights=weights, left_share=left_share)


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
    mean = np.full(3, np.nan)
    if posterior is not None:
        mean[: posterior.size] = posterior.mean
    payload_kg, share_pct, left_m = mean.tolist()
    sprung_kg, share = vehicle.empty_mass_kg + payload_kg, share_pct / 100.0
    track_m = math.nan if vehicle.track_width_m is None else vehicle.track_width_m
    gross_kg = sprung_kg + below.front.number + below.rear.number
    is_placed = math.isfinite(left_m) and math.isfinite(roll_share.number)
    lack = Lack.UNSPRUNG_MASS if math.isfinite(sprung_kg) else Lack.ESTIMATE
    lack_of_axle = lack if math.isfinite(share) else Lack.ESTIMATE
    lack_of_wheel = lack_of_axle
    if lack_of_axle is not Lack.ESTIMATE:
        lack_of_wheel = Lack.TRACK_WIDTH if math.isnan(track_m) else lack_of_axle if is_placed else Lack.ROLL_RATE
    found = {
        "gross": _weight(
            posterior, gross_kg, [1.0], below.both.std, vehicle.gross_limit_kg, lack, is_estimated=below.is_estimated
        )
    }
    for axle, part, sign, phi, own in (
        ("front", share, 1.0, roll_share.number, below.front),
        ("rear", 1.0 - share, -1.0, 1.0 - roll_share.number, below.rear),
    ):
        kg, is_estimated = part * sprung_kg + own.number, own.std > 0.0
        limit_kg: float | None = getattr(vehicle, f"{axle}_axle_limit_kg")
        slopes = [part, sign * sprung_kg]
        found[f"{axle}_axle"] = _weight(
            posterior, kg, slopes, own.std, limit_kg, lack_of_axle, is_estimated=is_estimated
        )
        limit_kg = getattr(vehicle, f"{axle}_wheel_limit_kg")
        for side, place in ((1.0, "left"), (-1.0, "right")):
            per_track = side / track_m
            moment = per_track * left_m  # in sprung masses
            slopes = [0.5 * part + phi * moment, 0.5 * sign * sprung_kg, phi * sprung_kg * per_track]
            std_kg = math.hypot(0.5 * own.std, sprung_kg * moment * roll_share.std)
            wheel_kg = 0.5 * kg + phi * sprung_kg * moment
            found[f"{axle}_{place}"] = _weight(
                posterior, wheel_kg, slopes, std_kg, limit_kg, lack_of_wheel, is_estimated=is_estimated
            )
    return Weights(**found)


def _weight(
    posterior: Posterior | None,
    kg: float,
    slopes: Sequence[float],
    independent_std_kg: float,
    limit_kg: float | None,
    lack: Lack,
    *,
    is_estimated: bool,
) -> Weight:
    """A weight with its error; ``slopes`` are its derivatives by payload (kg), front share (0..1) and place (m).

    ``lack`` is the missing input if the weight is unknown. ``is_estimated`` is of the unsprung mass: errors of both
    axles may cancel in the weight, and yet it was not stated.
    """
    if math.isnan(kg) or posterior is None:
        return Weight(limit_kg=limit_kg, lacks=lack)
    per_percent = [slope / (100.0 if i == FRONT_SHARE else 1.0) for i, slope in enumerate(slopes)]
    found = posterior.linear(kg, per_percent, independent_std_kg)
    return Weight(kg, found.std, limit_kg, None, is_estimated, found.interval95)


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
