"""One stored batch as bytes: a line of JSON, its arrays, and the SHA-256 of both.

Numbers are read back bit for bit. The bytes of an array are sorted by their place in a number before compression: signs
and exponents are similar from sample to sample, mantissas are noise.
"""

import hashlib
import zlib
from dataclasses import dataclass
from typing import Any, Final, Literal, get_type_hints

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError, create_model

from gateway.calibration.inspection.facts import RowFacts, row_facts
from gateway.core.batch import Traits
from gateway.errors import KeptBatchError
from gateway.records import Batch, Motion

VERSION: Final = 5  # of the format
MOST_SAMPLES: Final = 1_000_000  # chosen: an hour at 200 Hz has 720 000
_FLOATS: Final = ("vertical_acceleration_mps2", "pitch_rate_radps", "speed_mps", "roll_rate_radps")
_DIGEST_BYTES: Final = 32  # of SHA-256
_FASTEST: Final = 1  # zlib level; the best one saves 2 % more at many times the cost
_JSON: Final = ConfigDict(extra="forbid", ser_json_inf_nan="constants")
_FIELDS: Final[dict[str, Any]] = {
    name: (hint, ...) for name, hint in get_type_hints(Batch).items() if name not in (*_FLOATS, "usable")
}
_Numbers: Final = create_model("_Numbers", __config__=_JSON, **_FIELDS)


class _Header(BaseModel):
    model_config = _JSON

    format: Literal["springscale-batch"] = "springscale-batch"
    version: Literal[5] = VERSION
    n: int = Field(ge=0, le=MOST_SAMPLES)
    has_roll: bool
    batch: _Numbers
    facts: RowFacts


@dataclass(frozen=True, slots=True)
class KeptBatch:
    """A batch and the facts of its rows."""

    batch: Batch
    facts: RowFacts


def kept_batch_of(batch: Batch, rows: Motion, traits: Traits) -> KeptBatch:
    """``rows`` are those of the batch's window, possibly with some before and after it."""
    inside = (rows.t_ns >= batch.t_start_ns) & (rows.t_ns < batch.t_end_ns)
    return KeptBatch(batch, row_facts(rows.rows(inside), traits))


def packed(kept: KeptBatch) -> bytes:
    """The file's content."""
    batch = kept.batch
    arrays = [array for name in _FLOATS if (array := getattr(batch, name)) is not None]
    header = _Header.model_construct(
        n=len(batch.usable),
        has_roll=batch.roll_rate_radps is not None,
        batch=_Numbers.model_construct(**{name: getattr(batch, name) for name in _Numbers.model_fields}),
        facts=kept.facts,
    )
    by_place = [np.frombuffer(array.astype("<f8").tobytes(), np.uint8).reshape(-1, 8).T.tobytes() for array in arrays]
    body = zlib.compress(b"".join([*by_place, np.packbits(batch.usable).tobytes()]), _FASTEST)
    content = header.model_dump_json().encode() + b"\n" + body
    return content + hashlib.sha256(content).digest()


def unpacked(content: bytes) -> KeptBatch:
    """Raises KeptBatchError for bytes that :func:`packed` did not write, or that changed since."""
    content, digest = content[:-_DIGEST_BYTES], content[-_DIGEST_BYTES:]
    if hashlib.sha256(content).digest() != digest:
        raise KeptBatchError("is damaged: its content does not match its sum")
    line, _, body = content.partition(b"\n")
    try:
        header = _Header.model_validate_json(line)
        names = _FLOATS if header.has_roll else _FLOATS[:-1]
        n_floats, n_bits = 8 * header.n * len(names), (header.n + 7) // 8
        raw = zlib.decompressobj().decompress(body, n_floats + n_bits + 1)
    except (ValidationError, zlib.error) as fault:
        raise KeptBatchError(f"is no kept batch: {fault}") from None
    if len(raw) != n_floats + n_bits:
        raise KeptBatchError(f"is no kept batch: {len(raw)} bytes of arrays")
    by_place = np.frombuffer(raw[:n_floats], np.uint8).reshape(len(names), 8, header.n)
    arrays = by_place.transpose(0, 2, 1).copy().view("<f8")[..., 0].astype(np.float64)
    usable = np.unpackbits(np.frombuffer(raw[n_floats:], np.uint8), count=header.n).astype(bool)
    numbers = {name: getattr(header.batch, name) for name in _Numbers.model_fields}
    batch = Batch(usable=usable, **numbers, **dict(zip(names, arrays, strict=True)))
    return KeptBatch(batch, header.facts)
