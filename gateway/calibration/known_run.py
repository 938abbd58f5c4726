"""A drive and what is known of its load: the data of calibration and evaluation."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from gateway.calibration.statements import KNOWN_PLUS_MINUS_KG, KNOWN_SHARE_PLUS_MINUS_PCT, Statement
from gateway.core.vehicle import PAYLOAD_LEFT_NOTED_STD_M, PAYLOAD_LEFT_STD_M, Load
from gateway.records import Batch
from gateway.stated.statement import StatementSource


@dataclass(frozen=True, slots=True)
class KnownRun:
    """Batches of one drive with what is known of its load. ``number`` counts runs of a campaign from 1.

    Payload and front share are NaN if nobody knows them; plus-minus is half a 95 % interval. payload_left_m is the
    payload's centre of gravity left of the vehicle's centre line; None: not noted. ``said`` is what was stated, if that
    is more than payload and share.
    """

    number: int
    name: str
    payload_kg: float
    front_share_pct: float
    batches: tuple[Batch, ...]
    payload_left_m: float | None = None
    payload_plus_minus_kg: float = KNOWN_PLUS_MINUS_KG
    front_share_plus_minus_pct: float = KNOWN_SHARE_PLUS_MINUS_PCT
    said: Statement | None = None

    @property
    def load(self) -> Load:
        """The load of the drive."""
        return Load(self.payload_kg, self.front_share_pct)

    @property
    def has_payload(self) -> bool:
        """Whether the payload is known."""
        return math.isfinite(self.payload_kg)

    @property
    def has_place(self) -> bool:
        """Whether the front share is known."""
        return math.isfinite(self.front_share_pct)

    @property
    def described(self) -> str:
        """Its load in words, such as "270 kg at 50.4 % front"."""
        if not self.has_payload:
            return "an unknown load"
        place = f" at {self.front_share_pct:.1f} % front" if self.has_place else ""
        return f"{round(self.payload_kg, 1):g} kg{place}"

    @property
    def statement(self) -> Statement:
        """What is known of the load. If its payload and place are known, it is as compact as the vehicle's other known
        loads.
        """
        if self.said is not None:
            return self.said
        return Statement(
            source=StatementSource.KNOWN if self.has_payload else None,
            payload_kg=self.payload_kg if self.has_payload else None,
            payload_plus_minus_kg=self.payload_plus_minus_kg,
            front_share_pct=self.front_share_pct if self.has_place else None,
            front_share_plus_minus_pct=self.front_share_plus_minus_pct,
            left_m=self.payload_left_m,
            is_compact=self.has_payload and self.has_place,
        )

    @property
    def payload_left_std_m(self) -> float:
        """Standard deviation of the payload's lateral place; without a note the place is the centre line."""
        return PAYLOAD_LEFT_STD_M if self.payload_left_m is None else PAYLOAD_LEFT_NOTED_STD_M


def sensor_rate_seen_hz(runs: Sequence[KnownRun]) -> tuple[float, float] | None:
    """The slowest and the fastest sampling rate of the counted batches; None if unknown."""
    rates_hz = [batch.sensor_rate_hz for run in runs for batch in run.batches if not batch.rejected]
    known = [one for one in rates_hz if math.isfinite(one)]
    return (min(known), max(known)) if known else None
