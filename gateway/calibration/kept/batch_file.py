"""One stored batch as bytes: a line of JSON, its arrays, and the SHA-256 of both.

Numbers are read back bit for bit. The bytes of an array are sorted by their place in a number before compression: signs
and exponents are similar from sample to sample, mantissas are noise.
"""

import hashlib
import json
import math
import zlib
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any, Final

import numpy as np

from gateway.calibration.inspection.rows import RowFacts, Stream, row_facts
from gateway.core.batch import Traits
from gateway.errors import KeptBatchError
from gateway.records import F64, Batch, Motion, Signal, Why

FORMAT: Final = "springscale-batch"
VERSION: Final = 3  # of the format
MOST_SAMPLES: Final = 1_000_000  # chosen: an hour at 200 Hz has 720 000
_FLOATS: Final = ("vertical_acceleration_mps2", "pitch_rate_radps", "speed_mps")
_FIELDS: Final = ("t_start_ns", "t_end_ns", "drive_start_ns", "rate_hz", "gravity_mps2", "gap_share", "shares",
                  "longest_stop_s", "rejected", "is_provisional", "sensor_rate_hz", "gyro_gain")  # fmt: skip
_DIGEST_BYTES: Final = 32  # of SHA-256
_FASTEST: Final = 1  # zlib level; the best one saves 2 % more at many times the cost


@dataclass(frozen=True, slots=True)
class KeptBatch:
    """A batch, the id of its estimate, the facts of its rows, and the id of their signal map."""

    id: str
    signals_id: str
    batch: Batch
    facts: RowFacts


def kept_batch_of(signals_id: str, batch: Batch, rows: Motion, traits: Traits) -> KeptBatch:
    """Named by its time. ``rows`` are those of the batch's window, possibly with some before and after it."""
    inside = (rows.t_ns >= batch.t_start_ns) & (rows.t_ns < batch.t_end_ns)
    name = f"{batch.t_end_ns}-{batch.t_start_ns:012x}"
    return KeptBatch(name, signals_id, batch, row_facts(rows.rows(inside), traits))


def packed(kept: KeptBatch) -> bytes:
    """The file's content."""
    batch = kept.batch
    arrays = [getattr(batch, name) for name in _FLOATS]
    if batch.roll_rate_radps is not None:
        arrays.append(batch.roll_rate_radps)
    header = {
        "format": FORMAT,
        "version": VERSION,
        "id": kept.id,
        "signals_id": kept.signals_id,
        "n": len(batch.usable),
        "has_roll": batch.roll_rate_radps is not None,
        "batch": {name: _json(getattr(batch, name)) for name in _FIELDS},
        "facts": {
            "duration_s": kept.facts.duration_s,
            "streams": {
                str(signal): {key: _json(number) for key, number in asdict(stream).items()}
                for signal, stream in kept.facts.streams.items()
            },
        },
    }
    line = json.dumps(header, separators=(",", ":"), allow_nan=False).encode() + b"\n"
    content = line + zlib.compress(b"".join([*map(_sorted, arrays), np.packbits(batch.usable).tobytes()]), _FASTEST)
    return content + hashlib.sha256(content).digest()


def unpacked(content: bytes) -> KeptBatch:
    """Raises KeptBatchError for bytes that :func:`packed` did not write, or that changed since."""
    content, digest = content[:-_DIGEST_BYTES], content[-_DIGEST_BYTES:]
    if hashlib.sha256(content).digest() != digest:
        raise KeptBatchError("is damaged: its content does not match its sum")
    try:
        return _unpacked(content)
    except (KeyError, TypeError, ValueError, AttributeError, zlib.error) as fault:
        raise KeptBatchError(f"is no kept batch: {fault}") from None


def _unpacked(content: bytes) -> KeptBatch:
    line, _, body = content.partition(b"\n")
    header = json.loads(line)
    if (header["format"], header["version"]) != (FORMAT, VERSION):
        raise ValueError(f"format {header['format']!r}, version {header['version']!r}")
    n, n_floats = int(header["n"]), len(_FLOATS) + bool(header["has_roll"])
    if not 0 <= n <= MOST_SAMPLES:
        raise ValueError(f"{n} samples")
    n_bytes, n_masked = 8 * n, (n + 7) // 8
    inflating = zlib.decompressobj()
    raw = inflating.decompress(body, n_floats * n_bytes + n_masked + 1)
    if len(raw) != n_floats * n_bytes + n_masked:
        raise ValueError(f"{len(raw)} bytes of arrays")
    arrays = [_from_sorted(raw[i * n_bytes : (i + 1) * n_bytes], n) for i in range(n_floats)]
    usable = np.unpackbits(np.frombuffer(raw[n_floats * n_bytes :], np.uint8), count=n).astype(bool)
    return KeptBatch(header["id"], header["signals_id"], _batch(header, arrays, usable), _facts(header["facts"]))


def _batch(header: Mapping[str, Any], arrays: list[F64], usable: np.typing.NDArray[np.bool_]) -> Batch:
    told = dict(header["batch"])
    for name in ("gravity_mps2", "sensor_rate_hz"):
        told[name] = _nan_if_none(told[name])
    told["shares"] = {Why(why): share for why, share in told["shares"].items()}
    told["rejected"] = tuple(map(Why, told["rejected"]))
    told["gyro_gain"] = None if told["gyro_gain"] is None else tuple(told["gyro_gain"])
    told |= zip((*_FLOATS, "roll_rate_radps"), arrays, strict=False)
    return Batch(usable=usable, **told)


def _facts(told: Mapping[str, Any]) -> RowFacts:
    streams: dict[Signal, Stream] = {}
    for signal, stream in told["streams"].items():
        numbers: dict[str, Any] = {key: _nan_if_none(number) for key, number in stream.items()}
        streams[Signal(signal)] = Stream(**numbers)
    return RowFacts(told["duration_s"], streams)


def _sorted(x: F64) -> bytes:
    """The first bytes of all numbers, then the second bytes, and so on."""
    return np.ascontiguousarray(np.frombuffer(x.astype("<f8").tobytes(), np.uint8).reshape(-1, 8).T).tobytes()


def _from_sorted(raw: bytes, n: int) -> F64:
    numbers = np.ascontiguousarray(np.frombuffer(raw, np.uint8).reshape(8, n).T).reshape(-1).view("<f8")
    return numbers.astype(np.float64)


def _json(figure: Any) -> Any:
    """A figure in JSON, which lacks NaN: None stands for it."""
    return None if isinstance(figure, float) and not math.isfinite(figure) else figure


def _nan_if_none(number: float | None) -> float:
    return math.nan if number is None else number
