"""A weight stated by a person for a time: from a weighbridge ticket, or a known load."""

from dataclasses import dataclass, field
from enum import StrEnum

from gateway.schema import described


class Drive(StrEnum):
    """Which drive carried the weight, seen from the time at which it was taken."""

    BEFORE = "before"
    AFTER = "after"


@dataclass(frozen=True, slots=True)
class StatedWeight:
    """The gross weight, or both axle weights, or the payload and, unless it is zero, its position.

    ``at`` is RFC 3339. ``position_m`` is behind the front axle. ``drive`` None: the drive follows from the time.
    ``std_kg`` is the standard deviation of each number; None: the usual one of its kind.
    """

    at: str
    gross_kg: float | None = None
    front_axle_kg: float | None = None
    rear_axle_kg: float | None = None
    payload_kg: float | None = None
    position_m: float | None = None
    drive: Drive | None = None
    std_kg: float | None = field(
        default=None, metadata=described("standard deviation of each number; null: as usual for its kind")
    )
