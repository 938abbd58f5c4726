"""The statement: what somebody knows of the load of a drive, each number with its doubt.

Known loads of a campaign, an empty vehicle, a delivery note, a weighbridge and nothing at all are the same record with
other doubts. Plus-minus is half a 95 % interval.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from gateway.core.vehicle import Carries, Load, Vehicle, front_share_pct
from gateway.quantity import Z95
from gateway.stated.statement import StatementSource

__all__ = ["Claim", "LoadPrior", "Statement", "StatementSource", "empty", "load_prior_of"]

UNKNOWN_PART: Final = (0.45, 0.7)
"""Chosen: mean and standard deviation of a payload that nobody stated, in parts of the largest payload. Wide enough
that the drive itself decides.
"""
UNKNOWN_PLACE: Final = (0.62, 0.22)  # chosen: likewise of its place behind the front axle, in wheelbases
UNKNOWN_LEFT_STD_M: Final = 0.15  # chosen: of its place across
EMPTY_PLUS_MINUS_KG: Final = 10.0  # chosen: driver and tank differ
KNOWN_PLUS_MINUS_KG: Final = 4.0  # chosen: of a weighed known load
KNOWN_PLACE_PLUS_MINUS_M: Final = 0.05  # chosen: of a measured place
KNOWN_SHARE_PLUS_MINUS_PCT: Final = 0.4  # the same as a front share, of a load of a quarter of the vehicle
LEAST_SHARE_STD: Final = 0.002  # chosen: 0..1, of any stated place


@dataclass(frozen=True, slots=True, kw_only=True)
class Claim:
    """One statement's word on a payload.

    plus_minus_kg is of the error that no other claim has. ``shared`` are errors that it has in common with others, each
    a cause and its standard deviation (kg): a delivery note leaves out the packaging like every other note.
    ``is_confirmed``: somebody insists on it, so that it is believed whatever the drive shows.
    """

    name: str
    payload_kg: float
    plus_minus_kg: float
    shared: tuple[tuple[str, float], ...] = ()
    is_confirmed: bool = False

    @property
    def own_std_kg(self) -> float:
        """Standard deviation of the error that no other claim has."""
        return self.plus_minus_kg / Z95

    @property
    def std_kg(self) -> float:
        """Standard deviation of its whole error."""
        return float(np.hypot.reduce([self.own_std_kg, *(std_kg for _, std_kg in self.shared)]))

    @property
    def stated_plus_minus_kg(self) -> float:
        """Half the 95 % interval that its statement gives."""
        return Z95 * dict(self.shared).get(self.name, self.own_std_kg)

    def softened(self, factor: float) -> "Claim":
        """The same with its own error so many times as large."""
        shared = tuple((cause, std_kg * (factor if cause == self.name else 1.0)) for cause, std_kg in self.shared)
        return replace(self, plus_minus_kg=factor * self.plus_minus_kg, shared=shared)


@dataclass(frozen=True, slots=True, kw_only=True)
class Statement:
    """What is known of one drive's load. None: nobody knows.

    The place is along the vehicle behind the front axle, or the front share of the sprung mass instead; left_m is the
    payload's place left of the centre line. ``is_compact``: the load has the shape of the vehicle's other known loads.
    If several statements are about one load, or their errors have a cause in common, ``claims`` are their words on the
    payload, of which payload_kg is the mean; ``placed_by`` names the one that says the place.
    """

    source: StatementSource | None = None
    payload_kg: float | None = None
    payload_plus_minus_kg: float = KNOWN_PLUS_MINUS_KG
    position_m: float | None = None
    position_plus_minus_m: float = KNOWN_PLACE_PLUS_MINUS_M
    front_share_pct: float | None = None
    front_share_plus_minus_pct: float = KNOWN_SHARE_PLUS_MINUS_PCT
    left_m: float | None = None
    left_plus_minus_m: float = 0.04
    is_compact: bool = False
    carries: Carries | None = None
    claims: tuple[Claim, ...] = ()
    placed_by: str | None = None

    @property
    def is_of_payload(self) -> bool:
        """Whether it says how heavy the load is."""
        return self.payload_kg is not None

    @property
    def has_place(self) -> bool:
        """Whether it says where the load is along the vehicle."""
        return self.payload_kg == 0.0 or self.position_m is not None or self.front_share_pct is not None

    def claims_as(self, name: str) -> tuple[Claim, ...]:
        """Its claims; without any the payload itself, by this name."""
        if self.claims or self.payload_kg is None:
            return self.claims
        return (Claim(name=name, payload_kg=self.payload_kg, plus_minus_kg=self.payload_plus_minus_kg),)

    def saying(self, claims: Sequence[Claim]) -> "Statement":
        """The same place with these words on the payload, if there are any."""
        if not claims:
            return replace(self, payload_kg=None, claims=())
        weights = np.array([claim.std_kg**-2.0 for claim in claims])
        payload_kg = float(weights @ [claim.payload_kg for claim in claims] / weights.sum())
        plus_minus_kg = float(Z95 * weights.sum() ** -0.5)
        return replace(self, payload_kg=payload_kg, payload_plus_minus_kg=plus_minus_kg, claims=tuple(claims))

    def without(self, name: str) -> "Statement":
        """What is left if the claim of this name, and the place if that says it, is not believed."""
        left = [claim for claim in self.claims if claim.name != name]
        if not left:
            return NOTHING_KNOWN
        placed = replace(
            self, position_m=None, front_share_pct=None, left_m=None, placed_by=None, is_compact=False
        ) if self.placed_by == name else self  # fmt: skip
        return placed.saying(left)


NOTHING_KNOWN: Final = Statement()


def empty() -> Statement:
    """The vehicle is empty."""
    return Statement(
        source=StatementSource.EMPTY, payload_kg=0.0, payload_plus_minus_kg=EMPTY_PLUS_MINUS_KG, is_compact=True
    )


@dataclass(frozen=True, slots=True)
class LoadPrior:
    """The statement as the fit reads it: means and standard deviations of payload (kg), front share (0..1) and place
    across (m); the share's mean follows the payload.
    """

    payload_kg: float
    payload_std_kg: float
    front_share: float
    front_share_std: float
    left_m: float
    left_std_m: float
    is_compact: bool
    carries: Carries | None = None

    @property
    def load(self) -> Load:
        """Its middle."""
        return Load(self.payload_kg, 100.0 * self.front_share)


def load_prior_of(statement: Statement, vehicle: Vehicle) -> LoadPrior:
    """The prior of a drive's load that a statement makes."""
    most_kg = vehicle.largest_payload_kg
    if statement.payload_kg is None:
        payload_kg, payload_std_kg = (part * most_kg for part in UNKNOWN_PART)
    else:
        payload_kg, payload_std_kg = statement.payload_kg, statement.payload_plus_minus_kg / Z95
    share, share_std = _share(statement, payload_kg, payload_std_kg, vehicle)
    is_across_known = statement.left_m is not None or payload_kg == 0.0
    return LoadPrior(
        payload_kg=payload_kg,
        payload_std_kg=payload_std_kg,
        front_share=share,
        front_share_std=share_std,
        left_m=statement.left_m or 0.0,
        left_std_m=statement.left_plus_minus_m / Z95 if is_across_known else UNKNOWN_LEFT_STD_M,
        is_compact=statement.is_compact,
        carries=statement.carries,
    )


def _share(statement: Statement, payload_kg: float, payload_std_kg: float, vehicle: Vehicle) -> tuple[float, float]:
    """Mean and standard deviation of the front share, 0..1, from the place of the load."""
    if statement.front_share_pct is not None:
        std = statement.front_share_plus_minus_pct / Z95 / 100.0
        return statement.front_share_pct / 100.0, max(std, LEAST_SHARE_STD)
    place_m, place_std_m = (part * vehicle.wheelbase_m for part in UNKNOWN_PLACE)
    if statement.position_m is not None:
        place_m, place_std_m = statement.position_m, statement.position_plus_minus_m / Z95
    share = front_share_pct(vehicle, payload_kg, place_m) / 100.0
    per_metre = payload_kg / ((vehicle.empty_mass_kg + payload_kg) * vehicle.wheelbase_m)
    lighter = front_share_pct(vehicle, max(payload_kg - payload_std_kg, 0.0), place_m) / 100.0
    return share, float(np.hypot(np.hypot(per_metre * place_std_m, share - lighter), LEAST_SHARE_STD))
