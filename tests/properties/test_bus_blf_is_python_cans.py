"""python-can is the truth for .blf: every frame the bulk reader gives is python-can's own, whatever is in the file."""

import tempfile
from itertools import pairwise
from pathlib import Path

import can
import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from support.blf import CLASSIC, CLASSIC2, ERROR_EXT, FD, FD64, TEXT, blf_object, classic, fd, fd64, write_blf

from gateway.bus.frames import frames_of, join
from gateway.bus.logs import open_whole_log
from gateway.bus.logs.blf import _apart, _objects

SIGNATURE = b"LOBJ"  # what begins an object may also stand in a payload
identifiers = st.one_of(st.integers(0, 0x7FF), st.integers(0, 0x1FFF_FFFF).map(lambda number: number | 0x8000_0000))
short = st.one_of(st.binary(max_size=8), st.just(SIGNATURE * 2))
long = st.one_of(st.binary(max_size=64), st.just(SIGNATURE * 16))
channels = st.integers(1, 3)


@st.composite
def blf_objects(draw):
    """One object of any kind and header."""
    kind = draw(st.sampled_from([CLASSIC, CLASSIC, CLASSIC2, FD, FD64, ERROR_EXT, TEXT]))
    channel, can_id = draw(channels), draw(identifiers)
    version = draw(st.sampled_from([1, 1, 2]))
    if kind in (CLASSIC, CLASSIC2):
        body = classic(channel, can_id, draw(short), flags=draw(st.sampled_from([0, 0, 1, 0x80])))
    elif kind == FD:
        body = fd(channel, can_id, draw(long))
    elif kind == FD64:
        payload = draw(long)
        extension = draw(st.sampled_from([b"", b"", b"extended"])) if version == 1 else b""
        body = fd64(channel, can_id, payload, n_kept=draw(st.integers(0, len(payload))), extension=extension)
    else:
        body = bytes([channel]) + draw(st.binary(min_size=40, max_size=60))
    ten = draw(st.booleans())
    stamp = draw(st.integers(0, 10**9)) * (1 if ten else 1000)
    return blf_object(kind, stamp, body, version=version, in_ten_microseconds=ten)


@settings(max_examples=200, deadline=None)
@given(st.lists(blf_objects(), min_size=1, max_size=12), st.lists(st.floats(0, 1), max_size=4), st.sampled_from([0, 2]))
def test_every_frame_is_the_one_python_can_gives(objects, cuts, method):
    content = b"".join(objects)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.blf"
        write_blf(path, content, [int(cut * len(content)) for cut in cuts], method=method)
        with can.BLFReader(path) as reader:
            messages = list(reader)
        chunks, report = open_whole_log(path)
        ours = join(list(chunks), 64)
    data = [message for message in messages if not message.is_error_frame and not message.is_remote_frame]
    truth = frames_of(data, 64)
    np.testing.assert_array_equal(ours.can_id, truth.can_id)
    np.testing.assert_array_equal(ours.length, truth.length)
    np.testing.assert_array_equal(ours.payload, truth.payload)
    np.testing.assert_array_equal(ours.t_ns, truth.t_ns)
    assert report.wanted == len(data)
    assert report.remote_frames == sum(message.is_remote_frame for message in messages)
    assert report.error_frames == sum(message.is_error_frame for message in messages)
    assert report.n_rejected == 0
    assert report.channels == {str(message.channel) for message in data}


@settings(max_examples=100, deadline=None)
@given(st.lists(blf_objects(), min_size=3, max_size=12), st.data())
def test_no_damage_ends_a_run_or_makes_up_a_frame_elsewhere(objects, draws):
    """Bytes overwritten anywhere: the objects that they do not touch are still read."""
    content = bytearray(b"".join(objects))
    begins = np.cumsum([0, *map(len, objects)])
    hit = draws.draw(st.integers(0, len(objects) - 1))
    at = draws.draw(st.integers(int(begins[hit]), int(begins[hit + 1]) - 1))
    content[at : at + 4] = draws.draw(st.sampled_from([b"\0\0\0\0", b"\xff\xff\xff\xff", b"LOBJ"]))[: len(content) - at]
    with tempfile.TemporaryDirectory() as folder:
        whole, damaged = Path(folder) / "whole.blf", Path(folder) / "damaged.blf"
        write_blf(whole, b"".join(objects[:hit]))
        write_blf(damaged, bytes(content))
        before = join(list(open_whole_log(whole)[0]), 64)
        found = join(list(open_whole_log(damaged)[0]), 64)
    n = len(before)
    np.testing.assert_array_equal(found.can_id[:n], before.can_id)
    np.testing.assert_array_equal(found.payload[:n], before.payload)
    assert len(found) <= sum(1 for _ in pairwise(begins))


pieces = st.one_of(
    st.builds(blf_object, st.sampled_from([CLASSIC, TEXT]), st.just(0), st.binary(max_size=20)),
    st.just(blf_object(TEXT, 0, b"..LOBJ" + bytes(16))),  # what looks like an object is payload
    st.binary(max_size=6),
)


@given(st.lists(pieces, max_size=12).map(b"".join), st.integers(0, 60))
def test_objects_are_found_wherever_they_begin(content, n_missing):
    """At multiples of four bytes, where they usually do, or elsewhere."""
    n = max(0, len(content) - n_missing)
    text = np.frombuffer(content + bytes(200), np.uint8)
    everywhere = np.array([at for at in range(n) if content.startswith(b"LOBJ", at)], np.int64)
    for found, expected in zip(_objects(text, n), _apart(text, n, everywhere), strict=True):
        assert found.tolist() == expected.tolist()
