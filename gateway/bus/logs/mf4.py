"""Bulk reader of ASAM's measurement files (.mf4) with bus frames, by asammdf: the extra springscale[mdf]."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import closing, suppress
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from gateway.bus.frames import LAST_SECOND, join, payload_rows, take
from gateway.bus.logs.packed import unpacked_path
from gateway.bus.logs.report import LogReject, Selection
from gateway.errors import LogUnreadableError, ReaderMissingError
from gateway.records import EXTENDED_ID, I64, U8, U32, Bool, Frames
from gateway.units import NS_PER_S

if TYPE_CHECKING:
    from asammdf import MDF

CHUNK_RECORDS: Final = 262_144  # chosen: of all groups together, read at once: asammdf's own cost is per call
LEAST_RECORDS: Final = 16_384  # chosen: of each group, however many there are
DATA, REMOTE, ERROR = "CAN_DataFrame", "CAN_RemoteFrame", "CAN_ErrorFrame"  # ASAM MDF bus logging, 2.1
_LENGTHS: Final = np.array([0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 16, 20, 24, 32, 48, 64], np.uint8)  # by DLC, ISO 11898-1


def read_mf4(selection: Selection) -> Iterator[Frames]:
    """The selected frames in order of time, in chunks, stamps to the microsecond as every other format's.

    A damaged file is read up to the damage, and the report says so. Raises LogUnreadableError if not even the beginning
    can be read, or asammdf is not installed.
    """
    path, until_damage = selection.path, selection.report.until_damage
    try:
        open_mdf = _asammdf()
    except ImportError:
        raise ReaderMissingError(f'{path}: reading .mf4 needs asammdf: pip install "springscale[mdf]"') from None
    with until_damage(".mf4"), unpacked_path(path) as unpacked, closing(open_mdf(unpacked)) as mdf:
        yield from selection.given_out(_in_order_of_time(_groups(mdf, selection), selection.width), 1)


@cache
def _asammdf() -> "Callable[[Path], MDF]":
    """The library, imported at its first use: that takes two seconds. Raises ImportError."""
    from asammdf import MDF  # noqa: PLC0415 # an extra
    from asammdf.blocks.mdf_v4 import MDF4  # noqa: PLC0415

    destroy = MDF4.__del__

    def destroy_quietly(mdf: MDF4) -> None:
        with suppress(AttributeError):
            destroy(mdf)

    MDF4.__del__ = destroy_quietly  # type: ignore[method-assign] # it prints a traceback for a file it could not open
    # else it reads the whole file while it is opened
    return partial(MDF, process_bus_logging=False)  # type: ignore[call-arg] # documented, not in its types


@dataclass(frozen=True, slots=True)
class _Group:
    """One table of bus events of the file."""

    mdf: "MDF"
    number: int
    name: str
    n_records: int

    def records(self, n_at_once: int) -> Iterator[tuple[NDArray[np.float64], NDArray[Any]]]:
        """Seconds since the measurement's start (n,) and the records (n,), piece by piece."""
        for first in range(0, self.n_records, n_at_once):
            yield from self._piece(first, min(n_at_once, self.n_records - first))

    def _piece(self, first: int, n: int) -> Iterator[tuple[NDArray[np.float64], NDArray[Any]]]:
        """Some records; if they cannot be read at once, those before the damage, then its exception."""
        try:
            signal = self.mdf.get(self.name, self.number, record_offset=first, record_count=n, raw=True)
        except Exception:
            if n == 1:
                raise
            yield from self._piece(first, n // 2)
            yield from self._piece(first + n // 2, n - n // 2)
        else:
            yield signal.timestamps, signal.samples


def _groups(mdf: "MDF", selection: Selection) -> list[Iterator[Frames]]:
    """The wanted data frames of each group that has any; remote and error frames are counted."""
    start_ns = round(mdf.header.start_time.timestamp() * 1e6) * 1000
    groups = [group for i in range(len(mdf.groups)) if (group := _group(mdf, i)) is not None]
    n_at_once = max(LEAST_RECORDS, CHUNK_RECORDS // max(1, len(groups)))
    for group in groups:
        if group.name == ERROR:
            selection.report.error_frames += group.n_records
        elif group.name == REMOTE:
            for _, records in group.records(n_at_once):
                fields = _Fields(records, group.name)
                selection.rows(fields.can_id, fields.channel, np.ones(len(records), np.bool_))
    return [_data_frames(group, n_at_once, start_ns, selection) for group in groups if group.name == DATA]


def _group(mdf: "MDF", number: int) -> _Group | None:
    """The group's CAN frames, None for a group of another kind."""
    from asammdf.blocks.v4_constants import BUS_TYPE_CAN  # noqa: PLC0415 # as above

    group = mdf.groups[number].channel_group
    names = {channel.name for channel in mdf.groups[number].channels}
    name = next((name for name in (DATA, REMOTE, ERROR) if name in names), None)
    is_can = group.acq_source is not None and group.acq_source.bus_type == BUS_TYPE_CAN
    return _Group(mdf, number, name, int(group.cycles_nr)) if name and is_can and group.cycles_nr else None


class _Fields:
    """The columns of records, as far as a tool has written them."""

    def __init__(self, records: NDArray[Any], name: str) -> None:
        self._records = records
        self._name = name
        self._names = frozenset(records.dtype.names or ())

    def get(self, field: str) -> NDArray[Any] | None:
        full = f"{self._name}.{field}"
        return self._records[full] if full in self._names else None

    @property
    def can_id(self) -> U32:
        """Identifiers with EXTENDED_ID; without that information, those beyond 11 bits are 29-bit ones."""
        column = self.get("ID")
        if column is None:
            raise LogUnreadableError("its frames have no identifiers")
        raw = column.astype(np.uint32)
        ide = self.get("IDE")
        is_extended = (raw & np.uint32(EXTENDED_ID)) | (raw > 0x7FF) if ide is None else ide
        return (raw & np.uint32(0x1FFF_FFFF)) | np.where(is_extended, np.uint32(EXTENDED_ID), np.uint32(0))

    @property
    def channel(self) -> I64 | None:
        column = self.get("BusChannel")
        return None if column is None else column.astype(np.int64)

    def payload(self, rows: I64, width: int) -> tuple[U8, U8]:
        """Lengths (m,) and payloads (m, width) of some rows."""
        data, lengths = self.get("DataBytes"), self.get("DataLength")
        codes = self.get("DLC") if lengths is None else lengths
        if data is None or codes is None:
            raise LogUnreadableError("its frames have no payload")
        data = data[rows].reshape(len(rows), -1)
        n_bytes = _LENGTHS[np.minimum(codes[rows], 15)] if lengths is None else lengths[rows]
        n_bytes = np.minimum(n_bytes, data.shape[1]).astype(np.uint8)
        return n_bytes, payload_rows(data, n_bytes, width)


def _data_frames(group: _Group, n_at_once: int, start_ns: int, selection: Selection) -> Iterator[Frames]:
    for seconds, records in group.records(n_at_once):
        fields = _Fields(records, group.name)
        can_id = fields.can_id
        rows = selection.rows(can_id, fields.channel)
        is_sound: Bool = np.abs(seconds[rows] + start_ns / NS_PER_S) < LAST_SECOND
        selection.report.reject(LogReject.BAD_TIME, n=int(np.count_nonzero(~is_sound)))
        rows = rows[is_sound]
        t_ns = start_ns + np.round(seconds[rows] * 1e6).astype(np.int64) * 1000
        yield Frames(t_ns, can_id[rows], *fields.payload(rows, selection.width))


def _in_order_of_time(sources: Sequence[Iterator[Frames]], width: int) -> Iterator[Frames]:
    """The frames of all sources, each of which is in order of time itself, merged piece by piece."""
    if len(sources) == 1:
        yield from sources[0]
        return
    waiting = [(source, frames) for source in sources if (frames := _next_frames(source)) is not None]
    while waiting:
        known_ns = min(int(frames.t_ns.max()) for _, frames in waiting)  # no source has an earlier frame left
        parts, still_waiting = [], []
        for source, frames in waiting:
            is_known = frames.t_ns <= known_ns
            parts.append(take(frames, is_known))
            left = take(frames, ~is_known)
            frames_left = left if len(left) else _next_frames(source)
            if frames_left is not None:
                still_waiting.append((source, frames_left))
        waiting = still_waiting
        merged = join(parts, width)
        yield take(merged, np.argsort(merged.t_ns, kind="stable"))


def _next_frames(source: Iterator[Frames]) -> Frames | None:
    return next((frames for frames in source if len(frames)), None)
