"""What a vehicle weighs as a whole, on each axle and on each wheel, from an estimate and its empty figures."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

from gateway.core.vehicle import Vehicle
from gateway.core.weights.errors import Errors
from gateway.core.weights.sideways import NOWHERE, Sideways
from gateway.core.weights.unsprung import NOT_CALIBRATED, Unsprung
from gateway.estimate import Estimate, Lack, Quantity, Weight, Weights

_BY_PAYLOAD: Final = 1  # the first so many make the gross weight
_BY_AXLES: Final = 2  # and these the loads of axles


def weighed(estimate: Estimate, vehicle: Vehicle | None, unsprung: Unsprung = NOT_CALIBRATED) -> Estimate:
    """``estimate`` with the weights on the road that follow from it; without a vehicle none is known."""
    if vehicle is None:
        return replace(estimate, weights=Weights())
    sideways = Sideways.of(estimate)
    told = weights_of(vehicle, estimate.payload, estimate.front_share, estimate.correlation, sideways, unsprung)
    return replace(estimate, weights=told)


def weights_of(
    vehicle: Vehicle,
    payload: Quantity,
    front_share: Quantity,
    correlation: float = 0.0,
    sideways: Sideways = NOWHERE,
    unsprung: Unsprung = NOT_CALIBRATED,
) -> Weights:
    """Gross weight, axle loads and wheel loads of ``vehicle`` with a payload aboard, standing on level ground.

    On an axle rests its share D of the sprung mass m = M + L and its unsprung mass u, half of each on either wheel:

        F_front = D m + u_front,    F_rear = (1 - D) m + u_rear,    G = F_front + F_rear

    A centre of gravity y left of the centre line adds the moment m g y, of which the front axle takes phi, as its
    springs and anti-roll bar resist roll (Gillespie, Fundamentals of Vehicle Dynamics, ch. 6: roll moment
    distribution). With w the track width, left wheels bear more by, and right ones less by

        front: phi m y / w,    rear: (1 - phi) m y / w

    How far the body leans under it is left out. Errors of L and D have this ``correlation``, those of y with them the
    ones of ``sideways``; where one is NaN they count as independent, as phi's does. Empty figures count as exact. An
    unsprung mass that was not stated follows from the kerb weight of its axle, and without this is the one that
    calibration found, ``unsprung``, with its error, which counts as independent of all others: it moves an axle by
    kilograms, and payload and share hardly. What lacks something is unknown and says what (``Weight.lacks``).
    """
    known = _Known(vehicle, payload, front_share, correlation, sideways)
    below, roll_share = unsprung.unless_stated(vehicle), sideways.roll_share_front
    front = _Axle(known, share=known.share, sign=1.0, roll_share=roll_share, unsprung=below.front)
    rear = _Axle(known, share=1.0 - known.share, sign=-1.0, roll_share=1.0 - roll_share, unsprung=below.rear)
    gross_kg = known.sprung_kg + below.front.number + below.rear.number
    return Weights(
        gross=known.weight(gross_kg, [1.0], below.both.std, vehicle.gross_limit_kg, is_estimated=below.is_estimated),
        front_axle=front.whole(vehicle.front_axle_limit_kg),
        rear_axle=rear.whole(vehicle.rear_axle_limit_kg),
        front_left=front.wheel(1.0, vehicle.front_wheel_limit_kg),
        front_right=front.wheel(-1.0, vehicle.front_wheel_limit_kg),
        rear_left=rear.wheel(1.0, vehicle.rear_wheel_limit_kg),
        rear_right=rear.wheel(-1.0, vehicle.rear_wheel_limit_kg),
    )


class _Known:
    """What an estimate and a vehicle say together, and how sure it is."""

    def __init__(
        self, vehicle: Vehicle, payload: Quantity, front_share: Quantity, correlation: float, sideways: Sideways
    ) -> None:
        self.sprung_kg = vehicle.empty_mass_kg + payload.number
        self.share = front_share.number / 100.0
        self.track_m = math.nan if vehicle.track_width_m is None else vehicle.track_width_m
        self.cg_left_m = sideways.cg_left.number
        self._errors = Errors(payload, front_share, correlation, sideways)
        self._is_sideways = sideways.is_known

    def weight(
        self, kg: float, slopes: Sequence[float], unsprung_std_kg: float, limit_kg: float | None, *, is_estimated: bool
    ) -> Weight:
        """``slopes`` by what was estimated, in the order of Errors: as many as this weight follows from.

        ``is_estimated`` is of the unsprung mass: errors of two axles may cancel in it, and yet it was not stated.
        """
        if math.isnan(kg):
            return Weight(limit_kg=limit_kg, lacks=self._lack(len(slopes)))
        std_kg = math.hypot(self._errors.std(slopes), unsprung_std_kg)
        return Weight(kg, std_kg, limit_kg, None, is_unsprung_estimated=is_estimated)

    def _lack(self, n_slopes: int) -> Lack:
        """Why a weight is unknown that follows from the first so many, the first cause first."""
        is_wheel = n_slopes > _BY_AXLES
        if not math.isfinite(self.sprung_kg) or (n_slopes > _BY_PAYLOAD and not math.isfinite(self.share)):
            return Lack.ESTIMATE
        if is_wheel and math.isnan(self.track_m):
            return Lack.TRACK_WIDTH
        return Lack.ROLL_RATE if is_wheel and not self._is_sideways else Lack.UNSPRUNG_MASS


@dataclass(frozen=True, slots=True)
class _Axle:
    """Has ``share`` of the sprung mass and ``roll_share`` of its sideways moment.

    ``sign`` is the slope of both by what was estimated, the front's: 1 in front, -1 at the rear.
    """

    known: _Known
    share: float
    sign: float
    roll_share: float
    unsprung: Quantity

    def whole(self, limit_kg: float | None) -> Weight:
        """Both wheels."""
        sprung_kg = self.known.sprung_kg
        kg = self.share * sprung_kg + self.unsprung.number
        slopes = [self.share, self.sign * sprung_kg]
        return self.known.weight(kg, slopes, self.unsprung.std, limit_kg, is_estimated=self.unsprung.std > 0.0)

    def wheel(self, side: float, limit_kg: float | None) -> Weight:
        """``side`` is 1 to the left, -1 to the right."""
        sprung_kg, per_track = self.known.sprung_kg, side / self.known.track_m
        moment = per_track * self.known.cg_left_m  # in sprung masses
        return self.known.weight(
            0.5 * (self.share * sprung_kg + self.unsprung.number) + self.roll_share * sprung_kg * moment,
            [
                0.5 * self.share + self.roll_share * moment,
                0.5 * self.sign * sprung_kg,
                self.roll_share * sprung_kg * per_track,
                self.sign * sprung_kg * moment,
            ],
            0.5 * self.unsprung.std,
            limit_kg,
            is_estimated=self.unsprung.std > 0.0,
        )
