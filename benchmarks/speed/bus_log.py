"""Logs to read: a bus of 500 kbit/s (2500 frames/s, 60 identifiers, a fifth of them 29-bit, three of them ours)."""

import lzma
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final

import numpy as np
from isal import igzip

from gateway.bus.frames import join, merge_frames
from gateway.bus.logs import open_whole_log
from gateway.bus.logs.candump_write import append_candump
from gateway.bus.logs.packed import zstd
from gateway.records import EXTENDED_ID, Frames

FRAMES_PER_S: Final = 2500  # chosen: a bus of 500 kbit/s, well used
N_IDS: Final = 60  # chosen
START_NS: Final = 1_760_146_908_000_000_000  # arbitrary, in 2025
FORMATS: Final = (".log", ".log.gz", ".log.zst", ".log.xz", ".mf4")  # the others are read by python-can itself


def make_log(path: Path, minutes: float) -> int:
    """Write the log; return its number of frames."""
    rng = np.random.default_rng(20261121)
    n_others = N_IDS - 3
    ids = rng.choice(np.arange(0x200, 0x7FF), n_others, replace=False).astype(np.uint32)
    ids[: N_IDS // 5] = rng.choice(1 << 28, N_IDS // 5).astype(np.uint32) | np.uint32(EXTENDED_ID)
    ours_per_s = 100 + 100 + 10
    n_total = 0
    with path.open("wb") as file:
        for second in range(round(60 * minutes)):
            begin_ns = START_NS + second * 1_000_000_000
            n = FRAMES_PER_S - ours_per_s
            others = Frames(
                begin_ns + np.arange(n) * (1_000_000_000 // n) // 1000 * 1000,
                rng.choice(ids, n),
                np.full(n, 8, np.uint8),
                rng.integers(0, 256, (n, 8), np.uint8),
            )
            ours = [_ours(rng, begin_ns, *m) for m in ((0x120, 8, 100, 10), (0x121, 8, 100, 10), (0x130, 4, 10, 100))]
            append_candump(merge_frames([others, *ours]), "can0", file)
            n_total += FRAMES_PER_S
    return n_total


def _ours(rng: np.random.Generator, begin_ns: int, can_id: int, length: int, n: int, every_ms: int) -> Frames:
    payload = np.zeros((n, 8), np.uint8)
    payload[:, :length] = rng.integers(0, 100, (n, length), np.uint8)
    payload[:, length - 1] = 3 if can_id == 0x130 else 1  # Fix, or the valid bit
    t_ns = begin_ns + 137_000 + np.arange(n) * every_ms * 1_000_000
    return Frames(t_ns, np.full(n, can_id, np.uint32), np.full(n, length, np.uint8), payload)


def write_as(log: Path, suffix: str) -> Path:
    """Convert a candump log to another of FORMATS beside it. Raises ModuleNotFoundError if a library is missing."""
    path = log.with_suffix(suffix)
    packers: dict[str, Any] = {".gz": igzip.compress, ".zst": zstd.compress, ".xz": lzma.compress}
    if suffix == ".log":
        return log
    if path.suffix in packers:
        path.write_bytes(packers[path.suffix](log.read_bytes()))
        return path
    frames = join(list(open_whole_log(log)[0]), 64)
    _write_mf4(frames, path)
    return path


def _write_mf4(frames: Frames, path: Path) -> None:
    """One table of classic frames, deflated, as loggers write it."""
    from asammdf import MDF, Signal  # noqa: PLC0415 # an extra
    from asammdf.blocks.v4_blocks import SourceInformation  # noqa: PLC0415

    name = "CAN_DataFrame"
    kinds = {"BusChannel": "u1", "ID": "<u4", "IDE": "u1", "DLC": "u1", "DataLength": "u1", "DataBytes": "(8,)u1"}
    records = np.zeros(len(frames), np.dtype([(f"{name}.{field}", kind) for field, kind in kinds.items()]))
    records[f"{name}.ID"] = frames.can_id & ~np.uint32(EXTENDED_ID)
    records[f"{name}.IDE"] = frames.can_id >> 31
    records[f"{name}.DLC"] = records[f"{name}.DataLength"] = frames.length
    records[f"{name}.DataBytes"] = frames.payload[:, :8]
    start_ns = int(frames.t_ns[0])
    source = SourceInformation(source_type=2, bus_type=2)  # a bus, CAN
    with MDF(version="4.10") as mdf:
        mdf.header.start_time = datetime.fromtimestamp(start_ns / 1e9, UTC)
        mdf.append(Signal(name=name, samples=records, timestamps=(frames.t_ns - start_ns) / 1e9, source=source))
        mdf.save(path, overwrite=True, compression=1)
