"""What a vehicle weighs as a whole, on each axle and on each wheel, from an estimate and its empty figures.

Errors are of first order in what was estimated, in this order: payload L (kg), front share D (0 to 1), lateral place
y of the centre of gravity (m left of the centre line) and the front axle's part phi of a sideways moment (0 to 1).
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Final

from gateway.core.stated_share import measured
from gateway.core.vehicle import Vehicle
from gateway.estimate import UNKNOWN, Z95, Estimate, Lack, Quantity, Weight, Weights

_BY_AXLES: Final = 2  # the first so many make the loads of axles
RELEASE_SHARE: Final = 0.03  # of the limit: how far a load must fall below it before a warning ends


@dataclass(frozen=True, slots=True)
class Sideways:
    """Where the sprung mass lies to the side and how the axles divide its moment; NaN where nothing tells.

    Correlations are of the errors of ``cg_left`` with those of payload and front share.
    """

    cg_left: Quantity = UNKNOWN
    roll_share_front: float = math.nan
    roll_share_front_std: float = math.nan
    payload_correlation: float = math.nan
    front_share_correlation: float = math.nan

    @classmethod
    def of(cls, estimate: Estimate) -> "Sideways":
        """As an estimate has it."""
        return cls(
            estimate.cg_left,
            estimate.roll_share_front,
            estimate.roll_share_front_std,
            estimate.payload_cg_left_correlation,
            estimate.front_share_cg_left_correlation,
        )

    @property
    def is_known(self) -> bool:
        return math.isfinite(self.cg_left.number) and math.isfinite(self.roll_share_front)


NOWHERE: Final = Sideways()


def weighed(estimate: Estimate, vehicle: Vehicle | None) -> Estimate:
    """``estimate`` with the weights on the road that follow from it; without a vehicle none is known."""
    if vehicle is None:
        return replace(estimate, weights=Weights())
    told = weights_of(vehicle, estimate.payload, estimate.front_share, estimate.correlation, Sideways.of(estimate))
    return replace(estimate, weights=told)


def weights_of(
    vehicle: Vehicle,
    payload: Quantity,
    front_share: Quantity,
    correlation: float = 0.0,
    sideways: Sideways = NOWHERE,
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
    unsprung mass that was not stated follows from the kerb weight of its axle; what lacks something is unknown and
    says what (``Weight.lacks``).
    """
    known = _Known(vehicle, payload, front_share, correlation, sideways)
    front_kg, rear_kg = unsprung_kg(vehicle)
    front = _Axle(known, share=known.share, sign=1.0, roll_share=sideways.roll_share_front, unsprung_kg=front_kg)
    rear = _Axle(
        known, share=1.0 - known.share, sign=-1.0, roll_share=1.0 - sideways.roll_share_front, unsprung_kg=rear_kg
    )
    return Weights(
        gross=known.weight(known.sprung_kg + front_kg + rear_kg, [1.0], vehicle.gross_limit_kg),
        front_axle=front.whole(vehicle.front_axle_limit_kg),
        rear_axle=rear.whole(vehicle.rear_axle_limit_kg),
        front_left=front.wheel(1.0, vehicle.front_wheel_limit_kg),
        front_right=front.wheel(-1.0, vehicle.front_wheel_limit_kg),
        rear_left=rear.wheel(1.0, vehicle.rear_wheel_limit_kg),
        rear_right=rear.wheel(-1.0, vehicle.rear_wheel_limit_kg),
    )


class _Errors:
    """Of what was estimated, in the module's order and units; NaN where one is unknown."""

    def __init__(self, payload: Quantity, front_share: Quantity, correlation: float, sideways: Sideways) -> None:
        of_share, of_cg = front_share.std / 100.0, sideways.cg_left.std
        self._std = (payload.std, of_share, of_cg, sideways.roll_share_front_std)
        self._together = {
            (0, 1): _known_or_0(correlation),
            (0, 2): _known_or_0(sideways.payload_correlation),
            (1, 2): _known_or_0(sideways.front_share_correlation),
        }

    def std(self, slopes: Sequence[float]) -> float:
        """Of what has these slopes by the first so many."""
        errors = self._of(slopes)
        if any(map(math.isnan, errors)):
            return math.nan
        largest = max(map(abs, errors))
        if largest == 0.0:
            return 0.0
        relative = [error / largest for error in errors]
        return largest * math.sqrt(max(0.0, self._common(relative, relative)))

    def covariance(self, slopes: Sequence[float], other_slopes: Sequence[float]) -> float:
        """Of two such."""
        return self._common(self._of(slopes), self._of(other_slopes))

    def _of(self, slopes: Sequence[float]) -> list[float]:
        return [slope * std for slope, std in zip(slopes, self._std, strict=False)]

    def _common(self, errors: Sequence[float], others: Sequence[float]) -> float:
        alike = sum(error * other for error, other in zip(errors, others, strict=False))
        crossed = (
            shared * (_at(errors, one) * _at(others, other) + _at(errors, other) * _at(others, one))
            for (one, other), shared in self._together.items()
        )
        return alike + sum(crossed)


def _at(errors: Sequence[float], n: int) -> float:
    return errors[n] if n < len(errors) else 0.0


def _known_or_0(correlation: float) -> float:
    return 0.0 if math.isnan(correlation) else correlation


class _Known:
    """What an estimate and a vehicle say together, and how sure it is."""

    def __init__(
        self, vehicle: Vehicle, payload: Quantity, front_share: Quantity, correlation: float, sideways: Sideways
    ) -> None:
        self.sprung_kg = vehicle.empty_mass_kg + payload.number
        self.share = front_share.number / 100.0
        self.track_m = math.nan if vehicle.track_width_m is None else vehicle.track_width_m
        self.cg_left_m = sideways.cg_left.number
        self._errors = _Errors(payload, front_share, correlation, sideways)
        self._has_answer = math.isfinite(self.sprung_kg) and math.isfinite(self.share)
        self._is_sideways = sideways.is_known

    def weight(self, kg: float, slopes: Sequence[float], limit_kg: float | None) -> Weight:
        """``slopes`` by what was estimated, in the module's order: as many as this weight follows from."""
        if math.isnan(kg):
            return Weight(limit_kg=limit_kg, lacks=self._lack(is_wheel=len(slopes) > _BY_AXLES))
        return Weight(kg, self._errors.std(slopes), limit_kg, None)

    def _lack(self, *, is_wheel: bool) -> Lack:
        """Why a weight is unknown, the first cause first."""
        if not self._has_answer:
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
    unsprung_kg: float

    def whole(self, limit_kg: float | None) -> Weight:
        """Both wheels."""
        sprung_kg = self.known.sprung_kg
        return self.known.weight(
            self.share * sprung_kg + self.unsprung_kg, [self.share, self.sign * sprung_kg], limit_kg
        )

    def wheel(self, side: float, limit_kg: float | None) -> Weight:
        """``side`` is 1 to the left, -1 to the right."""
        sprung_kg, per_track = self.known.sprung_kg, side / self.known.track_m
        moment = per_track * self.known.cg_left_m  # in sprung masses
        return self.known.weight(
            0.5 * (self.share * sprung_kg + self.unsprung_kg) + self.roll_share * sprung_kg * moment,
            [
                0.5 * self.share + self.roll_share * moment,
                0.5 * self.sign * sprung_kg,
                self.roll_share * sprung_kg * per_track,
                self.sign * sprung_kg * moment,
            ],
            limit_kg,
        )


@dataclass(frozen=True, slots=True)
class Place:
    """Where the payload's centre of gravity is, behind the front axle, and its standard deviation.

    Left of the centre line likewise, NaN where nothing tells; ``correlation`` is of both errors.
    """

    position_m: float
    std_m: float
    left_m: float = math.nan
    left_std_m: float = math.nan
    correlation: float = math.nan


def place_of(
    vehicle: Vehicle,
    payload: Quantity,
    front_share: Quantity,
    correlation: float = 0.0,
    sideways: Sideways = NOWHERE,
) -> Place | None:
    """Where the payload lies; None where there may be none, and so no place to tell.

    With s the share, s0 the empty share, M the empty mass and l the wheelbase, moments about the front axle give

        d = l (1 - F / L),    F = s (M + L) - s0 M,    the part of L that rests on the front axle,

    the inverse of equation (3) of Bottelli et al. With y and y0 the centres of gravity left of the centre line of
    the whole and of the empty vehicle, moments about that line give y_L = ((M + L) y - M y0) / L. Errors are of
    first order in L, s and y, as correlated as :func:`weights_of` has it. What the
    empty share adds to the error of s (core.stated_share) is in s0 too, and drops out.
    """
    if not payload.number > Z95 * payload.std:
        return None
    load_kg, total_kg = payload.number, vehicle.empty_mass_kg + payload.number
    share, empty_share = front_share.number / 100.0, vehicle.empty_front_share
    front_share_of_load = (share * total_kg - empty_share * vehicle.empty_mass_kg) / load_kg
    cg_left_m = sideways.cg_left.number
    left_m = (total_kg * cg_left_m - vehicle.empty_mass_kg * vehicle.empty_cg_left_m) / load_kg
    share_std_pct, correlation = measured(payload, front_share, correlation, vehicle)
    _, with_cg = measured(payload, front_share, sideways.front_share_correlation, vehicle)
    beside_empty = replace(sideways, front_share_correlation=with_cg)
    errors = _Errors(payload, replace(front_share, std=share_std_pct), correlation, beside_empty)
    along = [vehicle.wheelbase_m * slope for slope in ((front_share_of_load - share) / load_kg, -total_kg / load_kg)]
    across = [(cg_left_m - left_m) / load_kg, 0.0, total_kg / load_kg]
    std_m, left_std_m = errors.std(along), errors.std(across)
    is_both = std_m * left_std_m > 0.0
    return Place(
        position_m=vehicle.wheelbase_m * (1.0 - front_share_of_load),
        std_m=std_m,
        left_m=left_m,
        left_std_m=left_std_m,
        correlation=errors.covariance(along, across) / (std_m * left_std_m) if is_both else math.nan,
    )


def unsprung_kg(vehicle: Vehicle) -> tuple[float, float]:
    """Unsprung mass at the front and the rear axle; NaN where neither it nor the kerb weight is stated."""
    share = vehicle.empty_front_share
    return (
        _unsprung(vehicle.unsprung_front_kg, vehicle.kerb_front_axle_kg, share * vehicle.empty_mass_kg),
        _unsprung(vehicle.unsprung_rear_kg, vehicle.kerb_rear_axle_kg, (1.0 - share) * vehicle.empty_mass_kg),
    )


def is_over_limit(weights_kg: Iterable[float], limit_kg: float | None) -> bool:
    """Whether the last of a series of weights counts as over the limit, with hysteresis.

    A warning begins above the limit and ends 3 % below it, so that an estimate that wavers about the
    limit does not make it flicker. No limit, or no known weight: no warning.
    """
    is_over = False
    for weight_kg in weights_kg:
        if limit_kg is None or math.isnan(weight_kg):
            continue
        is_over = weight_kg > limit_kg * (1.0 - RELEASE_SHARE if is_over else 1.0)
    return is_over


def _unsprung(stated_kg: float | None, kerb_kg: float | None, sprung_kg: float) -> float:
    if stated_kg is not None:
        return stated_kg
    return math.nan if kerb_kg is None else kerb_kg - sprung_kg
