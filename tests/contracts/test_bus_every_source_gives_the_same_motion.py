"""One suite over every way in: the same frames as .log, .log.zst, .asc, .blf, .mf4, .trc, .db or on a bus."""

import gzip
import itertools
import lzma
import os
import sys
import time
from dataclasses import replace

import can
import numpy as np
import pytest
from support.encoded import encode_signals
from support.patience import PATIENCE_S

from gateway.bus.frames import join, merge_frames, message_of
from gateway.bus.listen import LiveSource
from gateway.bus.logs import mf4, write_candump
from gateway.bus.logs.open import open_log
from gateway.bus.logs.packed import zstd
from gateway.bus.signals import Decoder, load_signal_map, shipped_map
from gateway.bus.sink import BusSink, replay
from gateway.errors import LogUnreadableError
from gateway.records import EXTENDED_ID, Frames, Motion, Signal, joined

START_NS = 1_760_146_908_000_000_000
CHANNELS = itertools.count()
TEXT_FORMATS = (".asc", ".trc")
PACK = {".gz": gzip.compress, ".zst": zstd.compress, ".xz": lzma.compress}
WRITERS = {".asc": can.ASCWriter, ".blf": can.BLFWriter, ".trc": can.TRCWriter}


@pytest.fixture(autouse=True)
def utc(monkeypatch):
    """.asc files tell local time: let it be UTC here."""
    monkeypatch.setenv("TZ", "UTC")
    time.tzset()
    yield
    monkeypatch.undo()
    time.tzset()


@pytest.fixture(scope="module")
def signal_map():
    return load_signal_map("springscale:reference")


@pytest.fixture(scope="module")
def drive(signal_map) -> Frames:
    """Two seconds of our sensors with jitter to the millisecond, between frames of others."""
    rng = np.random.default_rng(11)
    imu_ns = START_NS + np.arange(200) * 10_000_000 + rng.integers(0, 3, 200) * 1_000_000
    gps_ns = START_NS + 1_000_000 + np.arange(10) * 200_000_000
    t_ns = {
        Signal.VERTICAL_ACCELERATION: imu_ns,
        Signal.LONGITUDINAL_ACCELERATION: imu_ns,
        Signal.PITCH_RATE: imu_ns + 1_000_000,
        Signal.SPEED: gps_ns,
    }
    samples = {
        Signal.VERTICAL_ACCELERATION: 9.81 + rng.normal(0, 1, 200),
        Signal.LONGITUDINAL_ACCELERATION: rng.normal(0, 1, 200),
        Signal.PITCH_RATE: rng.normal(0, 0.05, 200),
        Signal.SPEED: 14 + rng.normal(0, 0.1, 10),
    }
    ours = encode_signals(signal_map, t_ns, samples)
    n = 300
    ids = rng.choice(np.array([0x7E8, 0x200, 0x18FEF100 | EXTENDED_ID], np.uint32), n)
    others = Frames(
        START_NS + np.sort(rng.integers(0, 2000, n)) * 1_000_000,
        ids,
        np.full(n, 8, np.uint8),
        rng.integers(0, 256, (n, 8), np.uint8),
    )
    return merge_frames([ours, others])


@pytest.fixture(scope="module")
def truth(signal_map, drive) -> Motion:
    return Decoder(signal_map).decode(drive)


def write_log(frames, path):
    suffix = "".join(path.suffixes)
    if suffix in (".log", ".log.gz"):
        write_candump(frames, "can0", path)
        return
    if path.suffix in PACK:
        write_log(frames, path.with_suffix(""))
        path.write_bytes(PACK[path.suffix](path.with_suffix("").read_bytes()))
        return
    if suffix == ".mf4":
        files = pytest.importorskip("support.mf4", reason="asammdf is not installed")
        files.write_mf4(path, START_NS, [files.can_group(frames, START_NS)], compression=2)
        return
    with WRITERS[path.suffix](path) as writer:
        for row in range(len(frames)):
            message = message_of(frames, row)
            message.channel = 0
            message.timestamp = float(message.timestamp)
            writer.on_message_received(message)


def read(path, signal_map):
    chunks, report = open_log(path, signal_map)
    return Decoder(signal_map).decode(join(list(chunks), 8)), report


def assert_same(motion: Motion, truth: Motion, *, stamp_tolerance_ns: int = 0) -> None:
    assert motion.signals == truth.signals
    np.testing.assert_array_equal(motion.columns, truth.columns)
    for signal in truth.counters:
        np.testing.assert_array_equal(motion.counters[signal], truth.counters[signal])
    assert np.abs(motion.t_ns - truth.t_ns).max() <= stamp_tolerance_ns


@pytest.mark.parametrize(
    "suffix",
    [*(kind + packing for kind in (".log", ".asc", ".blf") for packing in ("", *PACK)),
     ".mf4", ".mf4.zst", ".trc"],
)  # fmt: skip
def test_every_log_format_gives_the_same_motion(suffix, tmp_path, drive, truth, signal_map):
    path = tmp_path / f"drive{suffix}"
    write_log(drive, path)
    motion, report = read(path, signal_map)
    begun_ns = motion.t_ns[0] - truth.t_ns[0] if suffix == ".trc" else 0  # its date is good to a second only
    assert_same(replace(motion, t_ns=motion.t_ns - begun_ns), truth)
    assert (report.frames, report.wanted, report.n_rejected, report.ended_early) == (len(drive), len(truth), 0, None)


@pytest.mark.parametrize("suffix", [".log", ".log.xz", ".asc", ".blf", ".mf4"])
def test_can_fd_frames_give_the_same_motion(suffix, tmp_path):
    (tmp_path / "wide.dbc").write_text(
        'VERSION ""\nBU_: A\nBO_ 768 WIDE: 64 A\n SG_ Accel : 320|16@1- (0.001,0) [-30|30] "m/s^2" A\n'
    )
    (tmp_path / "map.toml").write_text(
        'dbc = ["wide.dbc"]\n[signals.vertical_acceleration]\nmessage = "WIDE"\nsignal = "Accel"\n'
    )
    wide_map = load_signal_map(tmp_path / "map.toml")
    rng = np.random.default_rng(2)
    n = 60
    length = np.where(np.arange(n) % 4, 64, 8).astype(np.uint8)  # classic frames of another message between
    can_id = np.where(length == 64, 0x300, 0x301).astype(np.uint32)
    payload = np.where(np.arange(64) < length[:, None], rng.integers(0, 256, (n, 64)), 0).astype(np.uint8)
    drive = Frames(START_NS + np.arange(n) * 10_000_000, can_id, length, payload)
    path = tmp_path / f"drive{suffix}"
    write_log(drive, path)
    chunks, report = open_log(path, wide_map)
    assert_same(Decoder(wide_map).decode(join(list(chunks), 64)), Decoder(wide_map).decode(drive))
    assert (report.wanted, report.n_rejected) == (np.count_nonzero(length == 64), 0)


def test_an_in_process_bus_gives_the_same_motion_and_stamps(drive, truth, signal_map):
    exact = Frames(drive.t_ns + 1, drive.can_id, drive.length, drive.payload)  # not even a nanosecond is lost
    channel = f"contract-{next(CHANNELS)}"
    source = LiveSource("virtual", channel, signal_map)
    source.start()
    with BusSink("virtual", channel) as sink:
        sink.send(exact)
    motion = collect(source, len(truth), signal_map)
    assert_same(motion, replace(truth, t_ns=truth.t_ns + 1))
    assert source.counts().dropped_inbox == 0


@pytest.mark.parametrize("suffix", [".log.gz", ".blf"])
def test_a_replayed_log_gives_the_same_motion(suffix, tmp_path, drive, truth, signal_map):
    path = tmp_path / f"drive{suffix}"
    write_log(drive, path)
    channel = f"contract-{next(CHANNELS)}"
    source = LiveSource("virtual", channel, signal_map, inbox_frames=64)  # the sender waits: nothing is dropped
    source.start()
    report = replay(path, "virtual", channel, from_channel="can0", speed="max")
    assert_same(collect(source, len(truth), signal_map), truth)
    assert report.wanted == len(drive)


def collect(source, n_rows, signal_map) -> Motion:
    """Drain until the expected rows are there (or patience ends), then stop."""
    decoder, parts, n = Decoder(signal_map), [], 0
    deadline = time.monotonic() + PATIENCE_S
    while n < n_rows and time.monotonic() < deadline:
        frames = source.inbox.drain(0.2)
        if frames is not None:
            parts.append(decoder.decode(frames))
            n += len(parts[-1])
    source.stop()
    return joined(parts)


def garbled(whole):
    """One line more, in the middle, that is no frame."""
    lines = whole.splitlines(keepends=True)
    middle = len(lines) // 2
    return b"".join([*lines[:middle], lines[middle].replace(b"0", b"?").replace(b"1", b"\0"), *lines[middle:]])


def damaged_in_the_middle(packed):
    return packed[: len(packed) // 2] + bytes(200) + packed[len(packed) // 2 + 200 :]


SPOILED = {  # ending of the name, what spoils the content, the least and the most rows that are read, how it ended
    "a garbled line": ("", garbled, 410, 410, None),
    "cut at a half": ("", lambda whole: whole[: len(whole) // 2], 190, 230, None),
    "cut near the end": ("", lambda whole: whole[: len(whole) * 99 // 100], 376, 410, None),
    "cut gzip": (".gz", lambda whole: gzip.compress(whole)[:-1000], 100, 409, "the gzip stream is cut off"),
    "damaged gzip": (
        ".gz",
        lambda whole: damaged_in_the_middle(gzip.compress(whole)),
        0,
        409,
        "the gzip stream is dam",
    ),
}


@pytest.mark.parametrize("suffix", TEXT_FORMATS)
@pytest.mark.parametrize("fault", SPOILED)
def test_a_spoiled_text_log_gives_what_was_readable_and_says_so(suffix, fault, tmp_path, drive, truth, signal_map):
    ending, spoil, least, most, ended = SPOILED[fault]
    path = tmp_path / f"drive{suffix}"
    write_log(drive, path)
    spoiled = tmp_path / f"spoiled{suffix}{ending}"
    spoiled.write_bytes(spoil(path.read_bytes()))
    motion, report = read(spoiled, signal_map)
    assert least <= len(motion) <= most
    if ended is None:
        np.testing.assert_array_equal(motion.columns[:-1], truth.columns[: len(motion) - 1])  # the last may be cut
        assert report.ended_early is None
    else:
        assert report.ended_early.startswith(ended)


SPOILED_BLF = {  # of the content and the place of an object in its middle
    "cut": (lambda content, middle: content[: middle - 9], "the last object is cut off"),
    "cut gzip": (lambda content, middle: gzip.compress(content, 0)[:middle], "the gzip stream is cut off"),
    "damaged": (lambda content, middle: content[:middle] + b"JUNK" + content[middle + 4 :], "the file is damaged: "),
}


@pytest.mark.parametrize("how", SPOILED_BLF)
def test_a_spoiled_blf_gives_what_lies_before_and_says_so(how, tmp_path, drive, signal_map, monkeypatch):
    monkeypatch.setattr(can.BLFWriter, "max_container_size", 4096)
    path, (spoil, ended) = tmp_path / "drive.blf", SPOILED_BLF[how]
    write_log(drive, path)
    content = path.read_bytes()
    path.write_bytes(spoil(content, content.index(b"LOBJ", len(content) // 2)))
    motion, report = read(path, signal_map)
    assert 50 < len(motion) < 400
    assert report.ended_early.startswith(ended)


@pytest.mark.parametrize("year", [1, 9999])
def test_a_blf_that_starts_beyond_all_time_has_no_date(year, tmp_path, drive, truth, signal_map):
    path = tmp_path / "drive.blf"
    write_log(drive, path)
    content = path.read_bytes()
    path.write_bytes(content[:40] + year.to_bytes(2, "little") + content[42:])
    _, report = read(path, signal_map)
    assert (report.wanted, report.n_rejected, report.is_dated) == (len(truth), 0, False)
    assert 0.0 <= report.span_ns[0] < 1e9
    assert any("cannot be right" in remark for remark in report.remarks())


def test_an_unknown_kind_of_log_names_the_known(tmp_path, signal_map):
    (tmp_path / "a.pcap").write_bytes(b"")
    with pytest.raises(LogUnreadableError, match=r"'\.pcap'; known are \.log .*\.asc .*\.blf"):
        open_log(tmp_path / "a.pcap", signal_map)


def test_the_maps_channel_filters_numbered_channels_too(tmp_path, drive, truth):
    (tmp_path / "s.toml").write_text(reference_with_channel("can1"))
    path = tmp_path / "drive.blf"
    write_log(drive, path)
    _, report = read(path, load_signal_map(tmp_path / "s.toml"))
    assert (report.wanted, report.other_channel) == (0, len(truth))
    (tmp_path / "s.toml").write_text(reference_with_channel("can0"))
    _, report = read(path, load_signal_map(tmp_path / "s.toml"))
    assert (report.wanted, report.other_channel) == (len(truth), 0)


def reference_with_channel(channel):
    path = shipped_map("reference")
    shown = os.fspath(path.with_name("springscale_reference.dbc"))
    return f'channel = "{channel}"\n' + path.read_text().replace("springscale_reference.dbc", shown)


def test_mf4_without_its_library_says_what_to_install(tmp_path, signal_map, monkeypatch):
    monkeypatch.setitem(sys.modules, "asammdf", None)
    mf4._asammdf.cache_clear()
    (tmp_path / "a.mf4").write_bytes(b"MDF     4.10    ")
    with pytest.raises(LogUnreadableError, match=r'pip install "springscale\[mdf\]"'):
        read(tmp_path / "a.mf4", signal_map)
