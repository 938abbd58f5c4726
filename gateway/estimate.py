"""What a batch taught: payload, front share and where the load lies sideways, with how sure they are, or why nothing.

Inside, a share is in percent wherever it is a :class:`Quantity`, as everybody outside reads it.
"""

import hashlib
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, fields, replace
from enum import StrEnum
from typing import Final

from gateway.budget import BudgetLine
from gateway.posterior import CG_LEFT, FRONT_SHARE, PAYLOAD, Posterior
from gateway.quantity import UNKNOWN, UNKNOWN_INTERVAL, Z95, Quantity
from gateway.records import Spectra, Why


@dataclass(frozen=True, slots=True)
class Epoch:
    """What the batches since the load last changed show together (core.fusion)."""

    payload: Quantity
    front_share: Quantity
    n_batches: int
    cg_left: Quantity = UNKNOWN
    posterior: Posterior | None = None


class Lack(StrEnum):
    """What a weight would need to be known."""

    CALIBRATION = "calibration"  # nobody says what the vehicle weighs empty
    ESTIMATE = "estimate"  # the batch was rejected; of axles and wheels: or it does not tell the front share
    UNSPRUNG_MASS = "unsprung_mass"
    TRACK_WIDTH = "track_width"
    ROLL_RATE = "roll_rate"  # nothing tells where the load lies sideways


@dataclass(frozen=True, slots=True)
class Weight:
    """A weight on the road, its standard deviation and what it may be (None: nobody said); NaN where unknown.

    ``is_unsprung_estimated`` where calibration found the unsprung mass in it, since nobody stated one.
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

    @property
    def is_over_limit(self) -> bool:
        """By this number alone; warnings have hysteresis (core.weights)."""
        return self.limit_kg is not None and self.kg > self.limit_kg


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
    """Where, in degrees of WGS 84, rounded as the settings say; NaN where nobody knows or nobody may know."""

    latitude_deg: float = math.nan
    longitude_deg: float = math.nan

    @property
    def is_known(self) -> bool:
        return math.isfinite(self.latitude_deg) and math.isfinite(self.longitude_deg)


NOWHERE: Final = Place()


@dataclass(frozen=True, slots=True)
class Watched:
    """What door and ignition did meanwhile: None where neither was heard of."""

    door_opened: bool | None = None
    ignition_off: bool | None = None

    def joined(self, other: "Watched") -> "Watched":
        """Over both times."""
        return Watched(_either(self.door_opened, other.door_opened), _either(self.ignition_off, other.ignition_off))


UNWATCHED: Final = Watched()


@dataclass(frozen=True, slots=True)
class Stop:
    """A standstill within a batch, from and to; it may go on in the next one."""

    t_start_ns: int
    t_end_ns: int
    watched: Watched = UNWATCHED
    place: Place = NOWHERE


@dataclass(frozen=True, slots=True)
class Way:
    """The way of one batch. ``distance_m`` is of the ``known_s`` in which the speed was known.

    Odometer readings are the first and the last within the batch. ``before`` is what was seen between the drive before
    and this one, in the first batch of a drive alone. ``since_ns`` is where the way begins, if later than the batch:
    what was pooled from windows before has its way with their records.
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
    """What a batch taught: payload (kg) and front share (%), or why nothing. Unknown is NaN (null in JSON).

    With a roll rate also ``cg_left``, where the sprung mass has its centre of gravity (m left of the centre line),
    ``left_share``, its share on the left wheels (%), and ``roll_share_front``, the part of a sideways load's moment
    that the front axle's springs and bar take (0 to 1). ``posterior`` carries all of these errors by their sources;
    ``measured`` is what it was before known weights were taken into account (None: there were none), and
    ``known_weights_id`` names these. A remainder is neither an answer nor a refusal: a window, or a piece of one, with
    too little driving in it to be a batch, kept for its way; ``rejected`` says what it lacks.
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
    measured: Posterior | None = None
    known_weights_id: str | None = None
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
        """True where the batch gave an answer."""
        return not self.rejected

    def refused(self, *whys: Why) -> "Estimate":
        """The same batch without its answer, and why there is none."""
        return replace(
            self,
            payload=UNKNOWN,
            front_share=UNKNOWN,
            cg_left=UNKNOWN,
            left_share=UNKNOWN,
            roll_share_front=math.nan,
            roll_share_front_std=math.nan,
            posterior=None,
            measured=None,
            known_weights_id=None,
            error_budget=(),
            weights=Weights(),
            rejected=whys,
        )

    def answered(self, posterior: Posterior) -> "Estimate":
        """The same batch with this answer; what follows from it with the vehicle's figures is still to come."""
        return replace(
            self,
            posterior=posterior,
            payload=posterior.quantity(PAYLOAD),
            front_share=posterior.quantity(FRONT_SHARE),
            cg_left=posterior.quantity(CG_LEFT),
        )

    @property
    def way_start_ns(self) -> int:
        """Where its way begins; those of one drive touch."""
        since_ns = None if self.way is None else self.way.since_ns
        return self.t_start_ns if since_ns is None else since_ns

    @property
    def raw_payload(self) -> Quantity | None:
        """As measured, where known weights changed it."""
        return None if self.measured is None else self.measured.quantity(PAYLOAD)

    @property
    def raw_front_share(self) -> Quantity | None:
        """As measured, where known weights changed it."""
        return None if self.measured is None else self.measured.quantity(FRONT_SHARE)

    @property
    def payload_front_share_correlation(self) -> float:
        """Of both errors, -1 to 1."""
        return self._correlation(PAYLOAD, FRONT_SHARE)

    @property
    def payload_cg_left_correlation(self) -> float:
        """Of both errors, -1 to 1."""
        return self._correlation(PAYLOAD, CG_LEFT)

    @property
    def front_share_cg_left_correlation(self) -> float:
        """Of both errors, -1 to 1."""
        return self._correlation(FRONT_SHARE, CG_LEFT)

    def _correlation(self, one: int, other: int) -> float:
        return math.nan if self.posterior is None else self.posterior.correlation(one, other)

    @property
    def as_measured(self) -> Posterior | None:
        """What the batch and the calibration alone say: known weights come and go, and no load changes with them."""
        return self.posterior if self.measured is None else self.measured

    @property
    def id(self) -> str:
        """The same batch, vehicle, estimator, calibration and known weights have the same id, whenever it is
        computed.
        """
        parts: tuple[object, ...] = (self.vehicle_id, self.t_start_ns, self.t_end_ns, self.estimator)
        parts += (self.calibration_id, *((self.known_weights_id,) if self.known_weights_id else ()))
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
