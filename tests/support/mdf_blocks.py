"""A measurement file made block by block after ASAM MDF 4.1, with payloads of any length apart from the records.

Loggers of CAN FD keep payloads so (VLSD: a record holds where in the signal data its bytes begin); asammdf never writes
bus events that way, so it has no part in this file.
"""

import struct
from collections.abc import Sequence
from pathlib import Path

RECORD = struct.Struct("<dIBBBQ")  # time, identifier, 29 bits, bytes, channel, where the payload begins
CHANNEL_FIELDS = {"ID": (8, 32), "IDE": (12, 8), "DataLength": (13, 8), "BusChannel": (14, 8)}
TIME, PLAIN, VARIABLE = 2, 0, 1
UNSIGNED, REAL, BYTES = 0, 4, 10


class _Blocks:
    """Blocks one behind the other; each knows where those it points to begin, so the last come first."""

    def __init__(self) -> None:
        self.content = bytearray(64 + 104)  # the file's own head comes last

    def add(self, kind: str, links: Sequence[int], body: bytes) -> int:
        at = len(self.content)
        self.content += _block(kind, links, body)
        self.content += bytes(-len(self.content) % 8)
        return at


def _block(kind: str, links: Sequence[int], body: bytes) -> bytes:
    length = 24 + 8 * len(links) + len(body)
    return struct.pack(f"<4s4xQQ{len(links)}Q", b"##" + kind.encode(), length, len(links), *links) + body


def write_variable_mf4(path: Path, start_ns: int, frames: Sequence[tuple[float, int, bool, bytes]]) -> None:
    """Frames (seconds, identifier, whether it has 29 bits, payload) of bus channel 1."""
    blocks = _Blocks()
    records, signal_data = bytearray(), bytearray()
    for seconds, can_id, is_extended, payload in frames:
        records += RECORD.pack(seconds, can_id, is_extended, len(payload), 1, len(signal_data))
        signal_data += struct.pack("<I", len(payload)) + payload
    kept = blocks.add("SD", [], bytes(signal_data))
    following = _channel(blocks, "CAN_DataFrame.DataBytes", 0, VARIABLE, BYTES, 15, 64, data=kept)
    for name, (byte, bits) in CHANNEL_FIELDS.items():
        following = _channel(blocks, f"CAN_DataFrame.{name}", following, PLAIN, UNSIGNED, byte, bits)
    frame_bits = 8 * (RECORD.size - 8)
    frame = _channel(blocks, "CAN_DataFrame", 0, PLAIN, BYTES, 8, frame_bits, component=following)
    time = _channel(blocks, "t", frame, TIME, REAL, 0, 64)
    source = blocks.add("SI", [0, 0, 0], struct.pack("<BBB5x", 2, 2, 0))  # a bus: CAN
    group_body = struct.pack("<QQHH4xII", 0, len(frames), 6, ord("."), RECORD.size, 0)  # 6: bus events, plain ones
    group = blocks.add("CG", [0, time, 0, source, 0, 0], group_body)
    data = blocks.add("DT", [], bytes(records))
    groups = blocks.add("DG", [0, group, data, 0], bytes(8))
    history = blocks.add("FH", [0, 0], struct.pack("<QhhB3x", start_ns, 0, 0, 0))
    head = b"MDF     4.10    by hand " + struct.pack("<4xH30xHH", 410, 0, 0)
    header = _block("HD", [groups, history, 0, 0, 0, 0], struct.pack("<QhhBBBxdd", start_ns, 0, 0, 0, 0, 0, 0.0, 0.0))
    blocks.content[: 64 + 104] = head + header
    path.write_bytes(blocks.content)


def _channel(
    blocks: _Blocks,
    name: str,
    following: int,
    kind: int,
    coding: int,
    byte: int,
    bits: int,
    *,
    component: int = 0,
    data: int = 0,
) -> int:
    text = name.encode() + b"\0"
    called = blocks.add("TX", [], text + bytes(-len(text) % 8))
    body = struct.pack("<BBBBIIIIBxH6d", kind, kind == TIME, coding, 0, byte, bits, 0, 0, 0, 0, *[0.0] * 6)
    return blocks.add("CN", [following, component, called, 0, 0, data, 0, 0], body)
