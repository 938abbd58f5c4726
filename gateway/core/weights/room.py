"""The payload that may still be loaded, and where, so that no axle and no gross limit is passed.

    room = room_of(weights, vehicle)      # None: a limited weight is unknown, or nothing is limited

An axle takes only its part of a load between the axles, so the whole vehicle usually has more room than its tightest
axle. With a load at x behind the front axle and wheelbase l, the rear axle bears the share x / l and the front axle
1 - x / l (moments about an axle; over the rear axle's overhang the front is relieved). A load that may lie anywhere in
a half of the loading area counts on each axle with the largest share that it can have there, so what is promised holds
wherever in that half the load lies, and in however many pieces.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations
from typing import Final

from gateway.core.vehicle import Vehicle
from gateway.estimates.batch_estimate import Z95, Quantity, Weight, Weights

USUAL_AREA: Final = (0.35, 1.25)
"""Chosen: the loading area in wheelbases behind the front axle if none is stated; longer than that of usual vans at
either end, so that less is promised.
"""
ROUNDING_KG: Final = 1e-9


@dataclass(frozen=True, slots=True)
class Halves:
    """Two loads (kg): one in the front half of the loading area, one in its rear half."""

    front_kg: float
    rear_kg: float

    @property
    def kg(self) -> float:
        return self.front_kg + self.rear_kg


NOTHING: Final = Halves(0.0, 0.0)


@dataclass(frozen=True, slots=True)
class Spare:
    """The weight (kg) that the vehicle and its axles may still bear; negative: too much; infinite: no limit."""

    gross_kg: float = math.inf
    front_axle_kg: float = math.inf
    rear_axle_kg: float = math.inf

    @property
    def least_kg(self) -> float:
        return min(self.gross_kg, self.front_axle_kg, self.rear_axle_kg)


@dataclass(frozen=True, slots=True)
class LoadingArea:
    """Where a load may lie: from its front end to its rear end, in wheelbases behind the front axle."""

    begin: float
    end: float

    @classmethod
    def of(cls, vehicle: Vehicle) -> "LoadingArea":
        """The stated one, or a usual one."""
        if vehicle.loading_area_m is None:
            return cls(*USUAL_AREA)
        begin_m, end_m = vehicle.loading_area_m
        return cls(begin_m / vehicle.wheelbase_m, end_m / vehicle.wheelbase_m)

    @property
    def middle(self) -> float:
        return (self.begin + self.end) / 2.0

    def most(self, spare: Spare) -> Halves:
        """The most that may go in, as even as that allows.

        Each limit is a line in the plane of both loads, so the largest sum lies where two of the lines cross. Where
        that sum is reached along a line, the point nearest to equal loads is taken.
        """
        if spare.least_kg <= 0.0 or math.isinf(spare.least_kg):
            return NOTHING
        rows = [row for row in self._borne(spare) if not math.isinf(row[2])]
        inside = [
            found
            for found in _crossings([*rows, (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)])
            if min(found) >= -ROUNDING_KG and all(f * found[0] + r * found[1] <= kg + ROUNDING_KG for f, r, kg in rows)
        ]
        most_kg = max(sum(found) for found in inside)
        low_kg, high_kg = 0.0, most_kg
        for front, rear, kg in rows:  # front x + rear (most - x) <= kg
            if front > rear:
                high_kg = min(high_kg, (kg - rear * most_kg) / (front - rear))
            elif front < rear:
                low_kg = max(low_kg, (rear * most_kg - kg) / (rear - front))
        front_kg = min(max(most_kg / 2.0, low_kg), max(high_kg, 0.0))
        return Halves(front_kg, most_kg - front_kg)

    def anywhere_kg(self, spare: Spare) -> float:
        """The most that may go in wherever it lies; negative as ``spare``."""
        if spare.least_kg <= 0.0:
            return spare.least_kg
        front, rear = _clipped(1.0 - self.begin), _clipped(self.end)
        return min(
            spare.gross_kg,
            spare.front_axle_kg / front if front else math.inf,
            spare.rear_axle_kg / rear if rear else math.inf,
        )

    def least_to_take_out(self, spare: Spare) -> Halves | None:
        """The least that must come out to get below every limit; None if no unloading does that.

        A piece from a half relieves each axle by the least share that it can have there; if it lies over an overhang,
        it takes weight off the other axle, which comes back.
        """
        if spare.least_kg >= 0.0:
            return NOTHING
        rows = [
            (1.0, 1.0, -spare.gross_kg),
            (1.0 - self.middle, 1.0 - self.end, -spare.front_axle_kg),
            (self.begin, self.middle, -spare.rear_axle_kg),
        ]
        rows = [row for row in rows if not math.isinf(row[2])]
        enough = [
            Halves(max(front_kg, 0.0), max(rear_kg, 0.0))
            for front_kg, rear_kg in _crossings([*rows, (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)])
            if min(front_kg, rear_kg) >= -ROUNDING_KG
            and all(f * front_kg + r * rear_kg >= kg - ROUNDING_KG for f, r, kg in rows)
        ]
        return min(enough, key=lambda halves: (halves.kg, abs(halves.front_kg - halves.rear_kg)), default=None)

    def _borne(self, spare: Spare) -> Iterator[tuple[float, float, float]]:
        """The largest share of a load in each half that a limit bears, and the room."""
        yield 1.0, 1.0, spare.gross_kg
        yield _clipped(1.0 - self.begin), _clipped(1.0 - self.middle), spare.front_axle_kg
        yield _clipped(self.middle), _clipped(self.end), spare.rear_axle_kg


def _clipped(share: float) -> float:
    """A load over an overhang relieves the other axle; nothing is promised on that."""
    return max(share, 0.0)


def _crossings(lines: list[tuple[float, float, float]]) -> Iterator[tuple[float, float]]:
    """Where any two of the lines a x + b y = c cross."""
    for (a, b, c), (d, e, f) in combinations(lines, 2):
        if determinant := a * e - b * d:
            yield (c * e - b * f) / determinant, (a * f - c * d) / determinant


@dataclass(frozen=True, slots=True)
class LoadRoom:
    """The payload that may still go in.

    ``most`` is the best estimate with its 95 % interval, negative if something is too heavy. ``safe`` and
    ``take_out`` hold at the unfavourable ends of all the weights' intervals. ``is_anywhere``: ``safe`` may lie anywhere
    in the loading area, all of it in one place. ``take_out`` is None if no unloading helps.
    """

    most: Quantity
    safe: Halves
    is_anywhere: bool
    take_out: Halves | None


def room_of(weights: Weights, vehicle: Vehicle) -> LoadRoom | None:
    """The room of a vehicle with these weights; None if nothing is limited or a limited weight is unknown."""
    places = [weights.gross, weights.front_axle, weights.rear_axle]
    limited = [one for one in places if one.limit_kg is not None]
    if not limited or not all(one.is_known for one in limited):
        return None
    area = LoadingArea.of(vehicle)
    worst, best, well = (
        Spare(*(math.inf if one.limit_kg is None else one.limit_kg - kg for one, kg in zip(places, ends, strict=True)))
        for ends in zip(*map(_ends, places), strict=True)
    )
    safe = area.most(worst)
    low_kg, most_kg, high_kg = sorted(
        spare.least_kg if spare.least_kg <= 0.0 else area.most(spare).kg for spare in (worst, best, well)
    )
    return LoadRoom(
        Quantity(most_kg, (high_kg - low_kg) / (2.0 * Z95), (low_kg, high_kg)),
        safe,
        area.anywhere_kg(worst) >= safe.kg - ROUNDING_KG,
        area.least_to_take_out(worst),
    )


def _ends(weight: Weight) -> tuple[float, float, float]:
    """The upper end of its interval, the weight, the lower end; the weight alone if its error is unknown."""
    low_kg, high_kg = (weight.kg if math.isnan(kg) else kg for kg in weight.interval95_kg)
    return high_kg, weight.kg, low_kg
