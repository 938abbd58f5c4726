"""A drive with what is known of its load: the data of calibration and evaluation."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from gateway.calibration.statements import (
    KNOWN_PLUS_MINUS_KG,
    KNOWN_SHARE_PLUS_MINUS_PCT,
    NOTHING_KNOWN,
    Statement,
)
from gateway.core.vehicle import Load
from gateway.records import Batch
from gateway.stated.statement import StatementSource


@dataclass(frozen=True, slots=True)
class StatedDrive:
    """Batches of one drive, with what is stated of its load.

    payload_kg and front_share_pct are what is believed of the load: by its statement, or by a fit that tested it; NaN:
    nobody knows. ``name`` is the name in a fit, ``number`` counts the drives from 1, ``log`` says where it was
    recorded.
    """

    name: str
    batches: tuple[Batch, ...]
    statement: Statement = NOTHING_KNOWN
    payload_kg: float = math.nan
    front_share_pct: float = math.nan
    number: int = 0
    log: str = ""

    @property
    def load(self) -> Load:
        """What is believed of its load."""
        return Load(self.payload_kg, self.front_share_pct)

    @property
    def is_known(self) -> bool:
        """Whether payload and front share are known."""
        return math.isfinite(self.payload_kg) and math.isfinite(self.front_share_pct)

    @property
    def described(self) -> str:
        """Its load in words, such as "270 kg at 50.4 % front"."""
        if not math.isfinite(self.payload_kg):
            return "an unknown load"
        place = f" at {self.front_share_pct:.1f} % front" if self.is_known else ""
        return f"{round(self.payload_kg, 1):g} kg{place}"


def known_drive(
    number: int,
    log: str,
    payload_kg: float,
    front_share_pct: float,
    batches: tuple[Batch, ...],
    left_m: float | None = None,
    payload_plus_minus_kg: float = KNOWN_PLUS_MINUS_KG,
    front_share_plus_minus_pct: float = KNOWN_SHARE_PLUS_MINUS_PCT,
) -> StatedDrive:
    """A drive whose load was weighed; NaN: payload or front share is unknown.

    If both are known, the load is as compact as the vehicle's other known loads. left_m is the payload's centre of
    gravity left of the vehicle's centre line; None: not noted.
    """
    has_payload, has_place = math.isfinite(payload_kg), math.isfinite(front_share_pct)
    statement = Statement(
        source=StatementSource.KNOWN if has_payload else None,
        payload_kg=payload_kg if has_payload else None,
        payload_plus_minus_kg=payload_plus_minus_kg,
        front_share_pct=front_share_pct if has_place else None,
        front_share_plus_minus_pct=front_share_plus_minus_pct,
        left_m=left_m,
        is_compact=has_payload and has_place,
    )
    return StatedDrive(drive_name(number), batches, statement, payload_kg, front_share_pct, number, log)


def drive_name(number: int) -> str:
    """The name by which a fit knows a drive."""
    return f"drive {number}"


def sensor_rate_seen_hz(drives: Sequence[StatedDrive]) -> tuple[float, float] | None:
    """The slowest and the fastest sampling rate of the counted batches; None if unknown."""
    rates_hz = [batch.sensor_rate_hz for one in drives for batch in one.batches if not batch.rejected]
    known = [one for one in rates_hz if math.isfinite(one)]
    return (min(known), max(known)) if known else None
