"""A drive whose load was weighed: what calibration learns from and evaluation is measured against."""

from dataclasses import dataclass

from gateway.core.vehicle import Load
from gateway.records import Batch


@dataclass(frozen=True, slots=True)
class KnownRun:
    """Batches of one drive with its true payload and front share. ``number`` counts runs of a campaign from 1."""

    number: int
    name: str
    payload_kg: float
    front_share_pct: float
    batches: tuple[Batch, ...]

    @property
    def load(self) -> Load:
        """What it carried."""
        return Load(self.payload_kg, self.front_share_pct)
