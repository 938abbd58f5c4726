"""Bus logs as ASAM measurement files, written by asammdf; tests that use them skip where it is not installed."""

from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest

from gateway.records import EXTENDED_ID, Frames

asammdf = pytest.importorskip("asammdf", reason="asammdf (springscale[mdf]) is not installed")
FIELDS = ("BusChannel", "ID", "IDE", "DLC", "DataLength", "DataBytes", "EDL")


def can_group(
    frames: Frames,
    start_ns: int,
    *,
    name: str = "CAN_DataFrame",
    channel: int | Sequence[int] = 0,
    without: Sequence[str] = (),
    bus_type: int = 2,
):
    """The frames as one table of bus events; 2 is CAN."""
    from asammdf.blocks.v4_blocks import SourceInformation

    n, width = frames.payload.shape
    kinds = {"ID": "<u4", "DataBytes": f"({width},)u1"}
    kept = [field for field in FIELDS if field not in without]
    records = np.zeros(n, np.dtype([(f"{name}.{field}", kinds.get(field, "u1")) for field in kept]))
    longer = np.searchsorted([12, 16, 20, 24, 32, 48, 64], frames.length) + 9
    columns = {
        "BusChannel": channel,
        "ID": frames.can_id & ~np.uint32(EXTENDED_ID),
        "IDE": frames.can_id >> 31,
        "DLC": np.where(frames.length > 8, longer, frames.length),
        "DataLength": frames.length,
        "DataBytes": frames.payload,
        "EDL": frames.length > 8,
    }
    for field in kept:
        records[f"{name}.{field}"] = columns[field]
    source = SourceInformation(source_type=2, bus_type=bus_type)
    return asammdf.Signal(name=name, samples=records, timestamps=(frames.t_ns - start_ns) / 1e9, source=source)


def write_mf4(path: Path, start_ns: int, groups: Sequence[object], *, compression: int = 0) -> None:
    """A file of such tables. Compression: 0 none, 1 deflate, 2 transposed and deflated."""
    with asammdf.MDF(version="4.10") as mdf:
        mdf.header.start_time = datetime.fromtimestamp(start_ns / 1e9, UTC)
        for group in groups:
            mdf.append(group)
        mdf.save(path, overwrite=True, compression=compression)
