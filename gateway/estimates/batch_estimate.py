"""The estimate of one batch: payload, front share and lateral position with their uncertainty, or the reason why there
is none.

Inside, a share is in percent wherever it is a :class:`Quantity`, as everybody outside reads it.
"""

import hashlib
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, fields, replace
from enum import StrEnum
from typing import Final

from gateway.estimates.budget import BudgetLine
from gateway.estimates.posterior import CG_LEFT, FRONT_SHARE, PAYLOAD, Posterior
from gateway.estimates.quantity import UNKNOWN, UNKNOWN_INTERVAL, Z95, Quantity
from gateway.records import Spectra, Why


@dataclass(frozen=True, slots=True)
class Epoch:
    """The fused estimate of the batches since the load last changed (core.fusion)."""

    payload: Quantity
    front_share: Quantity
    n_batches: int
    cg_left: Quantity = UNKNOWN
    posterior: Posterior | None = None


class Lack(StrEnum):
    """Facts that are missing for a weight."""

    CALIBRATION = "calibration"  # nobody says what the vehicle weighs empty
    ESTIMATE = "estimate"  # the batch was rejected; of axles and wheels: or it does not tell the front share
    UNSPRUNG_MASS = "unsprung_mass"
    TRACK_WIDTH = "track_width"
    ROLL_RATE = "roll_rate"  # nothing tells where the load lies sideways


@dataclass(frozen=True, slots=True)
class Weight:
    """A weight on the road, its standard deviation and its limit (None: no limit stated); NaN if unknown.

    ``is_unsprung_estimated``: calibration found the unsprung mass, since nobody stated one.
    """

    kg: float = math.nan
    std_kg: float = math.nan
    limit_kg: float | None = None
    lacks: Lack | None = Lack.CALIBRATION
    is_unsprung_estimated: bool = False
    interval95_kg: tuple[float, float] = UNKNOWN_INTERVAL

    @property
    def is_known(self) -> bool:
        return math.isfinite(self.kg)


@dataclass(frozen=True, slots=True)
class Weights:
    """Static weights of the vehicle on level ground, unsprung masses included (core.weights)."""

    gross: Weight = Weight()
    front_axle: Weight = Weight()
    rear_axle: Weight = Weight()
    front_left: Weight = Weight()
    front_right: Weight = Weight()
    rear_left: Weight = Weight()
    rear_right: Weight = Weight()

    def items(self) -> Iterator[tuple[str, Weight]]:
        """Each place with its weight."""
        return ((place, getattr(self, place)) for place in PLACES)


PLACES: Final = tuple(place.name for place in fields(Weights))


@dataclass(frozen=True, slots=True)
class Place:
    """A position in degrees of WGS 84, rounded as the settings say; NaN if unknown or not kept."""

    latitude_deg: float = math.nan
    longitude_deg: float = math.nan

    @property
    def is_known(self) -> bool:
        return math.isfinite(self.latitude_deg) and math.isfinite(self.longitude_deg)


NOWHERE: Final = Place()


@dataclass(frozen=True, slots=True)
class Watched:
    """Door and ignition during that time: None if neither was received."""

    door_opened: bool | None = None
    ignition_off: bool | None = None

    def joined(self, other: "Watched") -> "Watched":
        """Door and ignition during both times together."""
        return Watched(_either(self.door_opened, other.door_opened), _either(self.ignition_off, other.ignition_off))


UNWATCHED: Final = Watched()


@dataclass(frozen=True, slots=True)
class Stop:
    """A standstill within a batch, from and to; it may continue in the next one."""

    t_start_ns: int
    t_end_ns: int
    watched: Watched = UNWATCHED
    place: Place = NOWHERE


@dataclass(frozen=True, slots=True)
class Way:
    """The distance and standstills of one batch. ``distance_m`` covers the ``known_s`` in which the speed was known.

    Odometer readings are the first and the last within the batch. ``before`` is the standstill between this drive and
    the one before, in the first batch of a drive alone. ``since_ns`` is the start of the way if later than that of the
    batch: windows pooled from before have their way in their own records.
    """

    distance_m: float = math.nan
    known_s: float = 0.0
    moving_s: float = 0.0
    odometer_start_m: float = math.nan
    odometer_end_m: float = math.nan
    start: Place = NOWHERE
    end: Place = NOWHERE
    stops: tuple[Stop, ...] = ()
    before: Watched = UNWATCHED
    since_ns: int | None = None


@dataclass(frozen=True, slots=True)
class Estimate:
    """The estimate of one batch: payload (kg) and front share (%), or the reasons why there is none. Unknown is NaN
    (null in JSON).

    With a roll rate also ``cg_left``, the centre of gravity of the sprung mass (m left of the centre line),
    ``left_share``, its share on the left wheels (%), and ``roll_share_front``, the part of a sideways load's moment
    that the front axle's springs and bar carry (0 to 1). ``posterior`` contains all of these errors by source.
    A remainder is neither an answer nor a refusal: a window, or a piece of one, with too little driving
    for a batch, kept for its way; ``rejected`` says what it lacks.
    """

    t_start_ns: int
    t_end_ns: int
    estimator: str
    calibration_id: str | None = None
    payload: Quantity = UNKNOWN
    front_share: Quantity = UNKNOWN
    ratio_index_acceleration: float = math.nan
    ratio_index_pitch_rate: float = math.nan
    mean_speed_mps: float = math.nan
    gap_share: float = math.nan
    usable_share: float = math.nan
    roll_usable_share: float = math.nan  # of the usable samples, those whose roll rate is known
    roughness_mps2: float = math.nan  # of the road (core.spectrum)
    shares: Mapping[str, float] = field(default_factory=dict)
    rejected: tuple[Why, ...] = ()
    is_provisional: bool = False
    is_remainder: bool = False
    spectra: Spectra | None = None
    diagnostics: Mapping[str, float] = field(default_factory=dict)
    epoch: Epoch | None = None
    posterior: Posterior | None = None
    error_budget: tuple[BudgetLine, ...] = ()
    vehicle_id: str | None = None
    vin: str | None = None
    cg_left: Quantity = UNKNOWN
    left_share: Quantity = UNKNOWN
    roll_share_front: float = math.nan
    roll_share_front_std: float = math.nan
    weights: Weights = Weights()
    way: Way | None = None  # None before there were ways, and for an early look

    @property
    def counted(self) -> bool:
        """True if the batch gave an estimate."""
        return not self.rejected

    def refused(self, *whys: Why) -> "Estimate":
        """This batch without its estimate, with the reasons."""
        return replace(
            self,
            payload=UNKNOWN,
            front_share=UNKNOWN,
            cg_left=UNKNOWN,
            left_share=UNKNOWN,
            roll_share_front=math.nan,
            roll_share_front_std=math.nan,
            posterior=None,
            error_budget=(),
            weights=Weights(),
            rejected=whys,
        )

    def answered(self, posterior: Posterior) -> "Estimate":
        """This batch with an answer; weights still have to be computed with the vehicle's figures."""
        return replace(
            self,
            posterior=posterior,
            payload=posterior.quantity(PAYLOAD),
            front_share=posterior.quantity(FRONT_SHARE),
            cg_left=posterior.quantity(CG_LEFT),
        )

    @property
    def way_start_ns(self) -> int:
        """Start of its way; the ways of one drive adjoin."""
        since_ns = None if self.way is None else self.way.since_ns
        return self.t_start_ns if since_ns is None else since_ns

    @property
    def payload_front_share_correlation(self) -> float:
        """Correlation of both errors, -1 to 1."""
        return self._correlation(PAYLOAD, FRONT_SHARE)

    @property
    def payload_cg_left_correlation(self) -> float:
        """Correlation of both errors, -1 to 1."""
        return self._correlation(PAYLOAD, CG_LEFT)

    @property
    def front_share_cg_left_correlation(self) -> float:
        """Correlation of both errors, -1 to 1."""
        return self._correlation(FRONT_SHARE, CG_LEFT)

    def _correlation(self, one: int, other: int) -> float:
        return math.nan if self.posterior is None else self.posterior.correlation(one, other)

    @property
    def id(self) -> str:
        """The same batch, vehicle, estimator and calibration always have the same id."""
        parts = (self.vehicle_id, self.t_start_ns, self.t_end_ns, self.estimator, self.calibration_id)
        digest = hashlib.sha256("|".join(map(str, parts)).encode()).hexdigest()
        return f"{self.t_end_ns}-{digest[:12]}"


def _either(one: bool | None, other: bool | None) -> bool | None:
    if one is None or other is None:
        return one if other is None else other
    return one or other


__all__ = [
    "NOWHERE",
    "PLACES",
    "UNKNOWN",
    "UNKNOWN_INTERVAL",
    "UNWATCHED",
    "Z95",
    "Epoch",
    "Estimate",
    "Lack",
    "Place",
    "Quantity",
    "Stop",
    "Watched",
    "Way",
    "Weight",
    "Weights",
]
