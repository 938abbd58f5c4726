"""springscale feed against a fake sysfs tree with a FIFO, and a receiver that speaks as gpsd does."""

import json
import socket
import struct
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import pairwise
from pathlib import Path

import can
import numpy as np
import pytest
from support.commands import called, run
from support.iio import ACCEL_SCALE, GYRO_SCALE, FakeIio, Scan
from support.patience import PATIENCE_S, wait_until

from gateway.bus.feeder import AXES, Feeder, Gpsd, IioDevice, Numbering, find_devices, turned
from gateway.bus.frames import frames_of
from gateway.bus.signals import Decoder, load_signal_map
from gateway.errors import BusError, ConfigurationError
from gateway.records import Motion, Signal
from gateway.units import NS_PER_S

BEGIN_NS = 1_800_000_000 * NS_PER_S
LEVEL = turned("x", "z")


def level_device(folder: Path) -> tuple[FakeIio, IioDevice]:
    fake = FakeIio(folder)
    return fake, IioDevice(fake.sysfs / "iio:device0", LEVEL, 100.0, fake.nodes)


def at_rest(i: int) -> Scan:
    return (0, 0, round(9.81 / ACCEL_SCALE)), (0, 0, 0), BEGIN_NS + i * 10_000_000


@contextmanager
def listening(channel: str) -> Iterator[list[can.Message]]:
    """The frames that arrive on an in-process channel."""
    heard: list[can.Message] = []
    with can.Bus(interface="virtual", channel=channel, preserve_timestamps=True) as bus:
        notifier = can.Notifier(bus, [heard.append])
        try:
            yield heard
        finally:
            notifier.stop()


@contextmanager
def feeding(channel: str, devices: list[IioDevice], gps: Gpsd | None = None) -> Iterator[tuple[Feeder, list[str]]]:
    said: list[str] = []
    feeder = Feeder("virtual", channel, devices, gps, said.append)
    thread = threading.Thread(target=feeder.run)
    thread.start()
    try:
        yield feeder, said
    finally:
        feeder.stop()
        thread.join(PATIENCE_S)
        assert not thread.is_alive()


class FakeGpsd:
    """One connection at a time, which says what it is given."""

    def __init__(self) -> None:
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.port = self._listener.getsockname()[1]

    def accept(self) -> socket.socket:
        connection, _ = self._listener.accept()
        assert connection.recv(100).startswith(b'?WATCH={"enable":true,"json":true}')
        connection.sendall(b'{"class":"VERSION","release":"3.22","proto_major":3,"proto_minor":14}\r\n')
        return connection

    def close(self) -> None:
        self._listener.close()


def decoded(heard: list[can.Message]) -> Motion:
    return Decoder(load_signal_map("springscale:reference")).decode(frames_of(list(heard), 8))


def test_samples_arrive_in_vehicle_axes_and_si(tmp_path: Path) -> None:
    fake = FakeIio(tmp_path)
    device = IioDevice(fake.sysfs / "iio:device0", turned("-y", "z"), 100.0, fake.nodes)

    def scan(i: int) -> Scan:
        return (100, -200, round(9.81 / ACCEL_SCALE)), (300, -400, 500), BEGIN_NS + i * 10_000_000

    with listening("feed-si") as heard, fake.sampling(100.0, scan), feeding("feed-si", [device]):
        assert wait_until(lambda: len(heard) >= 60)
    rows = decoded(heard)
    for signal, expected in (
        (Signal.VERTICAL_ACCELERATION, 9.81),
        (Signal.LONGITUDINAL_ACCELERATION, 200 * ACCEL_SCALE),  # forward is -y
        (Signal.ROLL_RATE, 400 * GYRO_SCALE),
        (Signal.PITCH_RATE, 300 * GYRO_SCALE),  # left is +x: up x forward
    ):
        assert rows.of(signal)[1] == pytest.approx(expected, abs=1e-3), signal
    assert fake.text("buffer/enable") == "0"  # off again
    assert fake.text("sampling_frequency") == "100"
    assert fake.text("current_timestamp_clock") == "realtime"
    assert fake.text("scan_elements/in_temp_en") == "0"


def test_frames_carry_the_kernels_stamps_and_counters_that_skip_what_was_lost(tmp_path: Path) -> None:
    fake, device = level_device(tmp_path)
    with (
        listening("feed-lost") as heard,
        fake.sampling(400.0, lambda i: None if 150 <= i < 157 else at_rest(i)),
        feeding("feed-lost", [device]),
    ):
        assert wait_until(lambda: len(heard) >= 600)
        assert device.numbering.n_lost == 7
    accel = [message for message in heard if message.arbitration_id == 0x120]
    counters = [message.data[6] for message in accel]
    steps = [(after - before) % 256 for before, after in pairwise(counters)]
    assert sorted(steps)[-2:] == [1, 8]
    stamps = frames_of(accel, 8).t_ns
    assert {int(wait) for wait in np.diff(stamps)} == {10_000_000, 80_000_000}


def test_a_real_receivers_reports_become_speed_and_place() -> None:
    fake = FakeGpsd()
    with listening("feed-gps") as heard, feeding("feed-gps", [], Gpsd("127.0.0.1", fake.port)) as (feeder, said):
        connection = fake.accept()
        connection.sendall(b'{"class":"SKY","uSat":11}\n{"class":"TPV","mode":3,"lat":45.5,"lon":-122.25,"speed":13.')
        connection.sendall(b'894}\n{"class":"TPV","mode":1}\nnonsense\n{"class":"TPV","mode":2,"speed":1.0}\n')
        assert wait_until(lambda: len(heard) >= 6)
        connection.close()  # gpsd is restarted
        assert wait_until(lambda: bool(said))
        again = fake.accept()
        again.sendall(b'{"class":"TPV","mode":3,"speed":7.0}\n')
        assert wait_until(lambda: len(heard) >= 8)
        assert wait_until(lambda: len(said) >= 2)
        again.close()
    fake.close()
    rows = decoded(heard)
    assert rows.of(Signal.SPEED)[1] == pytest.approx([13.894, 7.0], abs=0.001)  # Fix = 3 alone counts
    assert rows.of(Signal.LATITUDE)[1] == pytest.approx([45.5])
    assert feeder.n_fixes == 3
    assert said[0].endswith("hung up")
    assert "works again" in said[1]


def report(device: str, speed_mps: float | None, uSat: int = 9) -> bytes:
    """A second of a receiver behind gpsd; None: no fix."""
    fix = {"mode": 1} if speed_mps is None else {"mode": 3, "speed": speed_mps}
    reports = ({"class": "SKY", "device": device, "uSat": uSat}, {"class": "TPV", "device": device, **fix})
    return b"".join(json.dumps(one).encode() + b"\n" for one in reports)


ONE, OTHER = "/dev/ttyUSB0", "/dev/ttyACM0"
RECEIVERS = {  # --gps-device, seconds as (device, speed), speeds that count, receivers left out
    "the first with a speed": (None, [(OTHER, None), (ONE, 14.0), (OTHER, 0.0)] * 3, [14.0] * 3, {OTHER}),
    "the chosen one": (OTHER, [(ONE, 14.0), (OTHER, 3.0)] * 3, [3.0] * 3, {ONE}),
    "one alone": (None, [(ONE, 14.0)] * 3, [14.0] * 3, set()),
    "one without a name": (None, [("", 14.0)] * 3, [14.0] * 3, set()),
    "a chosen one that is not there": ("/dev/ttyS9", [(ONE, 14.0)] * 3, [], {ONE}),
}


@pytest.mark.parametrize("case", RECEIVERS)
def test_one_receiver_of_several_counts(case: str) -> None:
    device, seconds, speeds_mps, left_out = RECEIVERS[case]
    gps = Gpsd("127.0.0.1", 1, device)
    found = [gps.fix_of(line) for second in seconds for line in report(*second).splitlines()]
    fixes = [one["GPS_SPEED"] for one in found if one is not None and one["GPS_SPEED"]["Fix"]]
    assert [one["Speed"] for one in fixes] == speeds_mps
    assert gps.left_out == left_out


def test_a_reconnected_receiver_replaces_the_lost_one(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = [100.0]
    monkeypatch.setattr("gateway.bus.feeder.time.monotonic", lambda: clock[0])
    gps = Gpsd("127.0.0.1", 1)
    speeds = []
    for device, speed_mps, pause_s in ((ONE, 14.0, 1.0), (OTHER, 13.0, 58.0), (OTHER, 12.0, 3.0), (ONE, 11.0, 1.0)):
        clock[0] += pause_s
        found = [gps.fix_of(line) for line in report(device, speed_mps).splitlines()]
        speeds += [one["GPS_SPEED"]["Speed"] for one in found if one is not None]
    assert speeds == [14.0, 12.0]
    assert gps.left_out == {OTHER, ONE}


def test_another_receiver_is_named_once_and_counted() -> None:
    fake = FakeGpsd()
    with listening("feed-two") as heard, feeding("feed-two", [], Gpsd("127.0.0.1", fake.port)) as (_, said):
        connection = fake.accept()
        connection.sendall((report(ONE, 14.0, 11) + report(OTHER, 0.0, 3)) * 4)
        assert wait_until(lambda: len(heard) >= 8 and bool(said))
        connection.close()
    fake.close()
    assert decoded(heard).of(Signal.SPEED)[1] == pytest.approx([14.0] * 4, abs=0.001)
    assert {message.data[2] for message in heard if message.arbitration_id == 0x130} == {11}  # satellites, of the same
    naming = [text for text in said if OTHER in text]
    assert len(naming) == 1
    assert f"{OTHER} is left out: {ONE} counts; choose one by --gps-device" in naming[0]


def test_a_missing_gpsd_is_reported_once_and_retried(tmp_path: Path) -> None:
    fake, device = level_device(tmp_path)
    with (
        listening("feed-none") as heard,
        fake.sampling(100.0, at_rest),
        feeding("feed-none", [device], Gpsd("127.0.0.1", 1)) as (_, said),
    ):
        assert wait_until(lambda: len(heard) >= 500)  # the IMU goes on
    assert len(said) == 1
    assert "gpsd 127.0.0.1:1" in said[0]


def test_a_device_that_is_gone_ends_the_feed(tmp_path: Path) -> None:
    fake, device = level_device(tmp_path)
    feeder = Feeder("virtual", "feed-gone", [device], None, print)
    ended: list[BusError] = []

    def run() -> None:
        try:
            feeder.run()
        except BusError as fault:
            ended.append(fault)

    thread = threading.Thread(target=run)
    with fake.sampling(100.0, at_rest):
        thread.start()
        assert wait_until(lambda: device.n_samples > 10)
    thread.join(PATIENCE_S)  # the writer has closed the FIFO, as a driver that is unloaded ends its device
    assert "gone" in str(ended[0])


def test_an_absent_bus_is_retried_and_dropped_frames_are_counted(tmp_path: Path) -> None:
    fake, device = level_device(tmp_path)
    said: list[str] = []
    feeder = Feeder("socketcan", "no-such-can", [device], None, said.append)
    with fake.sampling(1000.0, at_rest):
        threading.Timer(4.0, feeder.stop).start()
        feeder.run()
    assert len(said) == 1
    assert "no-such-can" in said[0]
    assert feeder.n_sent == 0
    assert feeder.n_dropped > 0


def test_mount_matrices_of_the_driver_are_applied_before_the_named_axes(tmp_path: Path) -> None:
    fake = FakeIio(tmp_path)
    (fake.device / "in_mount_matrix").write_text("0, 1, 0; -1, 0, 0; 0, 0, 1\n")  # the chip is turned on its board
    device = IioDevice(fake.sysfs / "iio:device0", LEVEL, 100.0, fake.nodes)
    device.open()
    samples = device.samples(fake.packed(((100, -200, 300), (0, 0, 0), BEGIN_NS)))
    device.close()
    assert samples[2]["accel"][0] == pytest.approx(np.array([-200, -100, 300]) * ACCEL_SCALE)


@pytest.mark.parametrize("text", ["1, 0; 0, 1", "a, b, c", "1, 0, 0; 0, 1, 0; 0, 0"])
def test_an_invalid_mount_matrix_is_reported_when_the_device_is_opened(text: str, tmp_path: Path) -> None:
    fake = FakeIio(tmp_path)
    (fake.device / "in_mount_matrix").write_text(text)
    with pytest.raises(ConfigurationError, match=r"mount matrix is .* no 3 by 3 numbers"):
        IioDevice(fake.sysfs / "iio:device0", LEVEL, 100.0, fake.nodes).open()


@pytest.mark.parametrize("host", ["x..y", "a" * 300])
def test_a_host_that_no_name_service_can_know_is_a_fault_of_gpsd(host: str) -> None:
    with pytest.raises(BusError, match="gpsd"):
        Gpsd(host, 2947).read()


def test_a_line_that_no_parser_takes_is_no_fix() -> None:
    assert Gpsd("127.0.0.1", 2947).fix_of(b"[" * 60_000) is None


@pytest.mark.parametrize(
    ("kind", "word", "expected"),
    [
        ("le:s12/16>>4", struct.pack("<H", 0x8010), -2047),  # the twelve high bits
        ("be:s16/16>>0", struct.pack(">h", -5), -5),
        ("le:u16/16>>0", struct.pack("<H", 0xFFFE), 0xFFFE),
        ("le:s20/32>>4", struct.pack("<I", 0xFFFFF << 4), -1),
        ("be:u24/32>>8", struct.pack(">I", 0xABCDEF << 8), 0xABCDEF),
    ],
)
def test_every_form_of_a_channel_is_read_as_the_kernel_describes_it(
    kind: str, word: bytes, expected: int, tmp_path: Path
) -> None:
    fake = FakeIio(tmp_path, has_gyro=False)
    for axis in "xyz":
        (fake.device / f"scan_elements/in_accel_{axis}_type").write_text(kind)
    (fake.device / "in_accel_scale").write_text("1.0")
    device = IioDevice(fake.sysfs / "iio:device0", LEVEL, 100.0, fake.nodes)
    device.open()
    samples = device.samples((word * 3).ljust(-(-len(word) * 3 // 8) * 8 + 8, b"\0"))
    device.close()
    assert samples[2]["accel"][0].tolist() == [expected] * 3


def test_numbers_follow_a_rate_that_is_not_the_one_asked_for() -> None:
    """A chip that says 100 Hz and samples at 96 loses nothing by that."""
    numbering = Numbering(100.0)
    t_ns = (np.arange(5000) * NS_PER_S / 96.0).astype(np.int64)
    assert numbering.of(t_ns).tolist() == list(range(5000))
    assert numbering.n_lost == 0


def test_axes_are_right_handed_and_one_line_is_refused() -> None:
    for forward in AXES:
        for up in AXES:
            if forward.strip("-") == up.strip("-"):
                with pytest.raises(ConfigurationError, match="one line"):
                    turned(forward, up)
            else:
                assert np.linalg.det(turned(forward, up)) == pytest.approx(1.0)


def test_devices_are_found_and_other_folders_refused(tmp_path: Path) -> None:
    fake = FakeIio(tmp_path)
    light = fake.sysfs / "iio:device1"
    light.mkdir()
    (light / "name").write_text("tsl2561")
    assert [device.name for device in find_devices(LEVEL, 100.0, fake.sysfs, fake.nodes)] == ["mpu6050"]
    with pytest.raises(ConfigurationError, match="no buffered accelerometer"):
        IioDevice(light, LEVEL, 100.0, fake.nodes)


def test_the_command_reports_its_work_and_a_wrong_vertical_axis(tmp_path: Path) -> None:
    fake = FakeIio(tmp_path)
    options = ["--interface", "virtual", "--channel", "feed-cli", "--gpsd", "", "--up", "y", "--forward", "x"]
    options += ["--sysfs", str(fake.sysfs), "--nodes", str(fake.nodes), "--for-s", "4", "--json"]
    with fake.sampling(500.0, at_rest):
        result = run("feed", *options)
    told = json.loads(result.stdout)
    assert told["sent"] >= 2 * 1000
    assert told["gravity_mps2"] == pytest.approx(0.0, abs=0.1)
    assert "name it by --up" in result.stderr
    empty = called("feed", *options[:6], "--sysfs", tmp_path / "none")
    assert "nothing to send" in str(empty.exception)
