"""Reader of ASAM's measurement files (.mf4) with bus frames, by asammdf: the extra springscale[mdf]."""

import logging
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing, suppress
from functools import cache, partial
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from gateway.bus.frames import LAST_SECOND, join, take
from gateway.bus.logs.log_report import LogReject, Selection
from gateway.bus.logs.packed import unpacked_path
from gateway.errors import LogUnreadableError, ReaderMissingError
from gateway.records import EXTENDED_ID, Frames
from gateway.units import NS_PER_S

if TYPE_CHECKING:
    from asammdf import MDF

PIECE_RECORDS: Final = 65_536  # chosen: of one table, read at once: asammdf's own cost is per call
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
        yield from selection.given_out(_in_order_of_time(_tables(mdf, selection), selection.width), 1)


@cache
def _asammdf() -> "Callable[[Path], MDF]":
    """The library, imported at its first use: that takes two seconds. Raises ImportError."""
    from asammdf import MDF  # noqa: PLC0415 # an extra
    from asammdf.blocks.mdf_v4 import MDF4  # noqa: PLC0415

    logging.getLogger("asammdf").setLevel(logging.CRITICAL)  # its faults come as exceptions too, which we tell once
    destroy = MDF4.__del__

    def destroy_quietly(mdf: MDF4) -> None:
        with suppress(AttributeError):
            destroy(mdf)

    MDF4.__del__ = destroy_quietly  # type: ignore[method-assign] # it prints a traceback for a file it could not open
    # else it reads the whole file while it is opened
    return partial(MDF, process_bus_logging=False)  # type: ignore[call-arg] # documented, not in its types


def _tables(mdf: "MDF", selection: Selection) -> list[Iterator[Frames]]:
    """The wanted data frames of each table of CAN frames; remote and error frames are counted."""
    from asammdf.blocks.v4_constants import BUS_TYPE_CAN  # noqa: PLC0415 # as above

    date = mdf.header.start_time  # naive if the file states no zone
    start_ns = selection.report.begin_at(date, selection.zone, str(date)) if mdf.header.abs_time else 0
    found = []
    for number in range(len(mdf.groups)):
        group = mdf.groups[number]
        n, source = int(group.channel_group.cycles_nr), group.channel_group.acq_source
        name = next((c.name for c in group.channels if c.name in (DATA, REMOTE, ERROR)), None)
        if not n or name is None or source is None or source.bus_type != BUS_TYPE_CAN:
            continue
        if name == ERROR:
            selection.report.error_frames += n
            continue
        frames = _frames(mdf, number, name, n, start_ns, selection)
        if name == DATA:
            found.append(frames)
        else:
            for _ in frames:
                """Every remote frame is counted as it is read."""
    return found


def _frames(
    mdf: "MDF", number: int, name: str, n_records: int, start_ns: int, selection: Selection
) -> Iterator[Frames]:
    """The wanted data frames of one table, piece by piece, with the columns that its tool has written."""
    for first in range(0, n_records, PIECE_RECORDS):
        n = min(PIECE_RECORDS, n_records - first)
        piece = mdf.get(name, number, record_offset=first, record_count=n, raw=True)
        columns = {field.removeprefix(f"{name}."): piece.samples[field] for field in piece.samples.dtype.names or ()}
        if not {"ID", "DataBytes"} <= columns.keys() or not {"DataLength", "DLC"} & columns.keys():
            raise LogUnreadableError("its frames have no identifiers or no payload")
        raw = columns["ID"].astype(np.uint32)
        # without that information, identifiers beyond 11 bits have 29
        is_extended = columns.get("IDE", (raw & np.uint32(EXTENDED_ID)) | (raw > 0x7FF)) != 0
        can_id = (raw & np.uint32(0x1FFF_FFFF)) | np.where(is_extended, np.uint32(EXTENDED_ID), np.uint32(0))
        channel = columns["BusChannel"].astype(np.int64) if "BusChannel" in columns else None
        rows = selection.rows(can_id, channel, np.full(len(raw), name == REMOTE))
        seconds = piece.timestamps[rows]
        is_sound = np.abs(seconds + start_ns / NS_PER_S) < LAST_SECOND
        selection.report.reject(LogReject.BAD_TIME, n=int(np.count_nonzero(~is_sound)))
        if not is_sound.any():
            continue
        rows, t_ns = rows[is_sound], start_ns + np.round(seconds[is_sound] * 1e6).astype(np.int64) * 1000
        data = columns["DataBytes"][rows].reshape(len(rows), -1)
        length = (
            columns["DataLength"][rows] if "DataLength" in columns else _LENGTHS[np.minimum(columns["DLC"][rows], 15)]
        )
        length = np.minimum(length, data.shape[1]).astype(np.uint8)
        payload, kept = np.zeros((len(rows), selection.width), np.uint8), min(selection.width, data.shape[1])
        np.copyto(payload[:, :kept], data[:, :kept], where=np.arange(kept) < length[:, None])
        yield Frames(t_ns, can_id[rows], length, payload)


def _in_order_of_time(tables: Sequence[Iterator[Frames]], width: int) -> Iterator[Frames]:
    """The frames of all tables, each of which is in order of time itself, merged piece by piece."""
    waiting = [(table, frames) for table in tables if (frames := _next_frames(table)) is not None]
    while waiting:
        known_ns = min(int(frames.t_ns.max()) for _, frames in waiting)  # no table has an earlier frame left
        merged = join([take(frames, frames.t_ns <= known_ns) for _, frames in waiting], width)
        left = [(table, take(frames, frames.t_ns > known_ns)) for table, frames in waiting]
        waiting = [
            (table, further)
            for table, frames in left
            if (further := frames if len(frames) else _next_frames(table)) is not None
        ]
        yield merged if len(tables) == 1 else take(merged, np.argsort(merged.t_ns, kind="stable"))


def _next_frames(table: Iterator[Frames]) -> Frames | None:
    return next((frames for frames in table if len(frames)), None)
