"""The statement: what somebody knows of the load of a drive, each number with its doubt.

Known loads of a campaign, an empty vehicle, a delivery note, a weighbridge and nothing at all are the same record with
other doubts. Plus-minus is half a 95 % interval.

A statement's word on a payload is a claim: a payload x is s kg, up to an error of its own and errors that it has in
common with other claims:

    x = s + a b + e,    e ~ N(0, own^2),    b ~ N(0, 1) for each cause of a common error

So a claim is one more row of the likelihood, in x and in b (m,). What the drive says without it follows from the
Gaussian posterior of (x, b) by taking that row away.
"""

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from gateway.core.vehicle import Carries, Load, Vehicle, front_share_pct
from gateway.estimates.quantity import Z95
from gateway.records import F64
from gateway.stated.statement import StatementSource

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
LEAST_PAYLOAD_SHARE: Final = 0.004  # of the empty mass: no vehicle carries four times its own mass, so these are tonnes
LEAST_PRECISION: Final = 1e-7  # per kg2: of a payload of which nothing is known


def is_in_tonnes(payload_kg: float, vehicle: Vehicle) -> bool:
    """Whether a payload is so small beside its vehicle that somebody wrote tonnes."""
    return 0.0 < payload_kg < LEAST_PAYLOAD_SHARE * vehicle.empty_mass_kg


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


def common_causes(claims: Iterable[Claim]) -> tuple[str, ...]:
    """The causes of error that at least two claims have in common, in order of appearance."""
    counted = Counter(cause for claim in claims for cause, _ in claim.shared)
    return tuple(cause for cause, n in counted.items() if n > 1)


@dataclass(frozen=True, slots=True, eq=False)
class Terms:
    """The claims on one payload: said_kg (c,), own_kg (c,) the standard deviations of their own errors, and shared_kg
    (c, m) the kilograms that one standard deviation of each common cause makes.
    """

    names: tuple[str, ...]
    said_kg: F64
    own_kg: F64
    shared_kg: F64

    @classmethod
    def of(cls, claims: Sequence[Claim], causes: Sequence[str]) -> "Terms":
        """An error whose cause is not among ``causes`` counts as the claim's own."""
        shared = np.zeros((len(claims), len(causes)))
        own = np.zeros(len(claims))
        for i, claim in enumerate(claims):
            alone = [claim.own_std_kg]
            for cause, std_kg in claim.shared:
                if cause in causes:
                    shared[i, causes.index(cause)] = std_kg
                else:
                    alone.append(std_kg)
            own[i] = np.hypot.reduce(alone)
        return cls(tuple(claim.name for claim in claims), np.array([c.payload_kg for c in claims]), own, shared)

    @property
    def rows(self) -> F64:
        """(c, 1 + m) the derivatives of the standardised errors by payload and causes."""
        return np.asarray(np.column_stack([np.ones(len(self.names)), -self.shared_kg]) / self.own_kg[:, None])

    def off(self, payload_kg: float, causes: F64) -> F64:
        """(c,) the standardised errors of the claims."""
        return np.asarray((payload_kg - self.said_kg - self.shared_kg @ causes) / self.own_kg)

    def truth(self, causes: F64, covariance: F64) -> tuple[float, float]:
        """The payload that the claims leave once the common errors are known, and its standard deviation (kg)."""
        each = self.said_kg + self.shared_kg @ causes
        weights = self.own_kg**-2.0
        part = weights / weights.sum()
        shared = part @ self.shared_kg
        return float(part @ each), float(np.sqrt(1.0 / weights.sum() + shared @ covariance @ shared))

    def without(self, mean: F64, covariance: F64, left_out: Sequence[int]) -> tuple[F64, F64]:
        """Mean and covariance (1 + m) of payload and causes without these claims, from those with all."""
        rows = self.rows[left_out]
        precision = np.linalg.inv(covariance)
        pull = precision @ mean - rows.T @ (self.said_kg / self.own_kg)[left_out]
        values, vectors = np.linalg.eigh(precision - rows.T @ rows)
        left = (vectors / np.maximum(values, LEAST_PRECISION)) @ vectors.T
        return np.asarray(left @ pull), np.asarray(left)

    def disagreement(self, i: int, mean: F64, covariance: F64, stated_std_kg: float) -> float:
        """Of claim ``i`` with what the drive and the others say, in standard deviations of the difference.

        ``stated_std_kg`` is of its own error as stated; in the fit it may have less weight.
        """
        by_others, left = self.without(mean, covariance, [i])
        row = np.r_[1.0, -self.shared_kg[i]]
        return float(abs(row @ by_others - self.said_kg[i]) / np.sqrt(row @ left @ row + stated_std_kg**2))


def shared_disagreement(mean: float, variance: float) -> float:
    """The size of a common error by its claims' drives alone, without its prior N(0, 1), in standard deviations."""
    return abs(mean) / float(np.sqrt(max(1.0 - variance, 1e-9)))
