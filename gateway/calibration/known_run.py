"""A drive with a weighed load: the data of calibration and evaluation."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from gateway.core.vehicle import PAYLOAD_LEFT_NOTED_STD_M, PAYLOAD_LEFT_STD_M, Load
from gateway.records import Batch


@dataclass(frozen=True, slots=True)
class KnownRun:
    """Batches of one drive with its true payload and front share. ``number`` counts runs of a campaign from 1.

    payload_left_m is the payload's centre of gravity left of the vehicle's centre line; None: not noted.
    """

    number: int
    name: str
    payload_kg: float
    front_share_pct: float
    batches: tuple[Batch, ...]
    payload_left_m: float | None = None

    @property
    def load(self) -> Load:
        """The load of the drive."""
        return Load(self.payload_kg, self.front_share_pct)

    @property
    def payload_left_std_m(self) -> float:
        """Standard deviation of the payload's lateral place; without a note the place is the centre line."""
        return PAYLOAD_LEFT_STD_M if self.payload_left_m is None else PAYLOAD_LEFT_NOTED_STD_M


def sensor_rate_seen_hz(runs: Sequence[KnownRun]) -> tuple[float, float] | None:
    """The slowest and the fastest sampling rate of the counted batches; None if unknown."""
    rates_hz = [batch.sensor_rate_hz for run in runs for batch in run.batches if not batch.rejected]
    known = [one for one in rates_hz if math.isfinite(one)]
    return (min(known), max(known)) if known else None
