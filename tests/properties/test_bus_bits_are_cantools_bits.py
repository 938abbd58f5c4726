"""cantools is the truth for the bits: every number the decoder gives is cantools' own, to the last bit."""

import math
import tempfile
from itertools import pairwise
from pathlib import Path

import cantools
import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from support.encoded import frames_of

from gateway.bus.signals import Decoder, Encoder, SignalMap, load_signal_map
from gateway.records import Frames, Signal

MAP = 'dbc = ["one.dbc"]\n[signals.ignition]\nmessage = "M"\nsignal = "S"\nunit = "1"\n'


@st.composite
def dbc_signals(draw):
    """A DBC with one message of one signal, anywhere in it, and the message's length."""
    n_bytes = draw(st.sampled_from([1, 2, 3, 5, 7, 8, 12, 64]))
    value_type = draw(st.sampled_from([0, 0, 0, 1, 2]))
    if n_bytes < (0, 4, 8)[value_type]:
        value_type = 0
    length = (draw(st.integers(1, min(64, 8 * n_bytes))), 32, 64)[value_type]
    first = draw(st.integers(0, 8 * n_bytes - length))  # counted from the end that the byte order begins at
    is_big_endian = draw(st.booleans())
    start = 8 * (first // 8) + 7 - first % 8 if is_big_endian else first
    scale = draw(st.sampled_from([1.0, 0.1, -0.001, 0.0078125, 3.0, 1e-6, 250.5]))
    offset = draw(st.sampled_from([0.0, -40.0, 0.3, 1e6, -250.0]))
    if length > 40:  # integer arithmetic beyond 2^53 is refused when the map is read
        scale, offset = 0.1, 0.3
    sign = draw(st.sampled_from("+-")) if value_type == 0 else "-"
    lines = [
        'VERSION ""',
        "NS_ :",
        "BS_:",
        "BU_: A",
        f"BO_ 291 M: {n_bytes} A",
        f' SG_ S : {start}|{length}@{0 if is_big_endian else 1}{sign} ({scale},{offset}) [0|0] "" A',
        "",
        *([f"SIG_VALTYPE_ 291 S : {value_type};"] if value_type else []),
    ]
    return "\n".join(lines) + "\n", n_bytes


def read_map(dbc: str) -> SignalMap:
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "one.dbc").write_text(dbc)
        (Path(folder) / "map.toml").write_text(MAP)
        return load_signal_map(Path(folder) / "map.toml")


def of_payloads(payloads: list[bytes], width: int) -> Frames:
    return frames_of([(n, 291, payload) for n, payload in enumerate(payloads)], width)


@settings(max_examples=150)
@given(dbc_signals(), st.data())
def test_every_number_is_the_one_cantools_gives(signal, draws):
    dbc, n_bytes = signal
    payloads = draws.draw(st.lists(st.binary(min_size=n_bytes, max_size=n_bytes), min_size=1, max_size=6))
    signal_map = read_map(dbc)
    motion = Decoder(signal_map).decode(of_payloads(payloads, signal_map.payload_width))
    message = cantools.database.load_string(dbc, "dbc").get_message_by_name("M")
    truth = [float(message.decode(payload)["S"]) for payload in payloads]
    finite = [number if math.isfinite(number) else math.nan for number in truth]
    np.testing.assert_array_equal(motion.columns[:, 0], finite)


@settings(max_examples=150)
@given(dbc_signals(), st.data())
def test_what_the_encoder_writes_cantools_would_write(signal, draws):
    dbc, n_bytes = signal
    payloads = draws.draw(st.lists(st.binary(min_size=n_bytes, max_size=n_bytes), min_size=1, max_size=6))
    signal_map = read_map(dbc)
    message = cantools.database.load_string(dbc, "dbc").get_message_by_name("M")
    physical = np.array([float(message.decode(payload)["S"]) for payload in payloads])
    t_ns = np.arange(len(payloads), dtype=np.int64)
    frames = Encoder(signal_map).encode("M", t_ns, {"S": physical})
    for row, sample in enumerate(physical):
        if math.isfinite(sample):
            written = frames.payload[row, :n_bytes].tobytes()
            assert written == message.encode({"S": float(sample)}, strict=False)


@given(st.lists(st.binary(min_size=8, max_size=8), min_size=1, max_size=20), st.lists(st.integers(0, 20), max_size=5))
def test_how_frames_are_chunked_leaves_no_trace(payloads, cuts):
    signal_map = load_signal_map("springscale:canmod_gps")
    frames = of_payloads(payloads, 8)
    frames.can_id[:] = 9
    whole = Decoder(signal_map)
    motion = whole.decode(frames)
    piecewise = Decoder(signal_map)
    bounds = [0, *sorted(min(cut, len(payloads)) for cut in cuts), len(payloads)]
    parts = [
        piecewise.decode(Frames(frames.t_ns[a:b], frames.can_id[a:b], frames.length[a:b], frames.payload[a:b]))
        for a, b in pairwise(bounds)
    ]
    np.testing.assert_array_equal(np.concatenate([part.columns for part in parts]), motion.columns)
    assert piecewise.counts == whole.counts
    assert Signal.PITCH_RATE in motion.signals
