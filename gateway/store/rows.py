"""The rows the database holds, each knowing its own INSERT."""

from dataclasses import astuple, dataclass, replace
from typing import Any, ClassVar


@dataclass(frozen=True, slots=True)
class EstimateRow:
    """One batch: an estimate or a rejection. ``text`` is its JSON, compact; ``seq`` orders and never repeats.

    ``previous`` is the number of the one accepted before it, 0 where there is none: the chain shows what is missing.
    """

    INSERT: ClassVar[str] = (
        "INSERT INTO estimates (seq, id, t_end_ns, vehicle_id, estimator, calibration_id, is_rejected, previous,"
        " received_ns, text, checksum) VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?) ON CONFLICT (id) DO NOTHING"
    )

    seq: int
    id: str
    t_end_ns: int
    vehicle_id: str | None
    estimator: str
    calibration_id: str | None
    is_rejected: bool
    previous: int
    received_ns: int
    text: str


@dataclass(frozen=True, slots=True)
class EventRow:
    """Something that happened to the service: start, stop, bus lost, disk full."""

    INSERT: ClassVar[str] = "INSERT INTO events (t_ns, kind, text) VALUES (?, ?, ?)"

    t_ns: int
    kind: str
    text: str


@dataclass(frozen=True, slots=True)
class CalibrationRow:
    """A calibration file's content under its hash, so that every estimate can be traced to it."""

    INSERT: ClassVar[str] = (
        "INSERT INTO calibrations (id, received_ns, text) VALUES (?, ?, ?) ON CONFLICT (id) DO NOTHING"
    )

    id: str
    received_ns: int
    text: str


@dataclass(frozen=True, slots=True)
class DeliveryRow:
    """How far an uplink has delivered: every estimate up to number ``seq``."""

    INSERT: ClassVar[str] = (
        "INSERT INTO uplinks (name, seq) VALUES (?, ?) ON CONFLICT (name) DO UPDATE SET seq = excluded.seq"
    )

    name: str
    seq: int


@dataclass(frozen=True, slots=True)
class EntryRow:
    """A load event or a trip in one revision, numbered in one row with the estimates; it takes the earlier's place."""

    INSERT: ClassVar[str] = (
        "INSERT INTO entries (seq, id, kind, t_end_ns, received_ns, text) VALUES (?, ?, ?, ?, ?, ?)"
        " ON CONFLICT (seq) DO NOTHING"
    )

    seq: int
    id: str
    kind: str
    t_end_ns: int
    received_ns: int
    text: str


Row = EstimateRow | EventRow | CalibrationRow | DeliveryRow | EntryRow


def bound(row: Row) -> tuple[Any, ...]:
    """The row's fields in the order of its INSERT."""
    return astuple(row)


class Chain:
    """Links estimates to the one before them; one that was there already and is not stored again is no link."""

    def __init__(self, known: "Chain | None" = None) -> None:
        """Go on from ``known``, which stays as it is."""
        self._skipped: dict[int, int] = {} if known is None else dict(known._skipped)

    def linked(self, row: EstimateRow) -> EstimateRow:
        """The row behind the last one that counts."""
        return replace(row, previous=self._skipped.pop(row.previous, row.previous))

    def skip(self, row: EstimateRow) -> None:
        """Whoever comes behind this row is linked to the one before it."""
        self._skipped[row.seq] = row.previous
