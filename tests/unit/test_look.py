"""From an unknown log to a first signal map: what is heard, what fits, what points up, and why a sensor is silent."""

import json
import resource
import time
from collections.abc import Callable
from pathlib import Path

import can
import numpy as np
import pytest
from support.bus_drive import bus_drive
from support.commands import called, printed
from support.half_car_road import VAN
from support.spoiled import limits

from gateway.bus.frames import merge_frames, message_of, take
from gateway.bus.logs import write_candump
from gateway.bus.signals import load_signal_map
from gateway.calibration.inspection.facts import InspectedRun, LogFacts, row_facts
from gateway.calibration.inspection.finding import Kind, Severity
from gateway.calibration.inspection.run_checks import inspect_run
from gateway.calibration.stated_drive import known_drive
from gateway.core.batch_settings import BatchSettings
from gateway.errors import ConfigurationError
from gateway.offline.campaigns import _silent, read_whole_log
from gateway.offline.look import heard as heard_module
from gateway.offline.look.heard import MOST_IDENTIFIERS
from gateway.offline.look.roles import axis_of
from gateway.records import EXTENDED_ID, Frames, Signal

T0_NS = 1_790_000_000_000_000_000
DBC = """VERSION ""
NS_ :
BS_:
BU_: A
BO_ 512 BOX: 8 A
 SG_ AccX : 0|12@1- (0.01,0) [0|0] "m/s^2" A
 SG_ AccY : 12|12@1- (0.01,0) [0|0] "m/s^2" A
 SG_ AccZ : 24|12@1- (0.01,0) [0|0] "m/s^2" A
 SG_ Count : 36|4@1+ (1,0) [0|15] "" A
BO_ 513 TURN: 6 A
 SG_ GyroX : 0|16@1- (0.01,0) [0|0] "deg/s" A
 SG_ GyroY : 16|16@1- (0.01,0) [0|0] "deg/s" A
 SG_ GyroZ : 32|16@1- (0.01,0) [0|0] "deg/s" A
BO_ 514 GPS: 3 A
 SG_ Speed : 0|16@1+ (0.01,0) [0|0] "km/h" A
 SG_ SpeedValid : 16|1@1+ (1,0) [0|1] "" A
"""
N = 12_000


def run(*arguments: object) -> str:
    return printed("look", *arguments)


def seen(*arguments: object) -> dict[str, object]:
    return json.loads(run(*arguments, "--json"))


def packed(can_id: int, length: int, t_ns: np.ndarray, *fields: tuple[int, int, np.ndarray]) -> Frames:
    """Frames whose little-endian fields (start bit, bits, raw numbers) are these."""
    whole = np.zeros(len(t_ns), np.uint64)
    for start, n_bits, raw in fields:
        whole |= (np.rint(raw).astype(np.int64).astype(np.uint64) & np.uint64((1 << n_bits) - 1)) << np.uint64(start)
    payload = whole.view(np.uint8).reshape(-1, 8)
    return Frames(t_ns, np.full(len(t_ns), can_id, np.uint32), np.full(len(t_ns), length, np.uint8), payload.copy())


def box_on_its_side(mps2: float = 9.8) -> Frames:
    """A box whose y axis points down and whose z axis points rearward, in a car that brakes now and then."""
    rng = np.random.default_rng(1)
    t_s = np.arange(N) / 100.0
    speed_mps = 14.0 + 5.0 * np.sin(2.0 * np.pi * t_s / 30.0)
    ahead_mps2 = np.gradient(speed_mps, t_s)
    noise = rng.standard_normal((3, N)) * 0.3
    t_ns, gps_ns = T0_NS + np.arange(N) * 10_000_000, T0_NS + np.arange(N // 20) * 200_000_000
    accelerations = [100.0 * x for x in (noise[0], noise[1] - mps2, noise[2] - ahead_mps2)]
    return merge_frames(
        [
            packed(512, 8, t_ns, *[(12 * i, 12, x) for i, x in enumerate(accelerations)], (36, 4, np.arange(N) % 16)),
            packed(513, 6, t_ns + 1, *[(16 * i, 16, 20.0 * rng.standard_normal(N)) for i in range(3)]),
            packed(514, 3, gps_ns, (0, 16, 360.0 * speed_mps[::20]), (16, 1, np.ones(N // 20))),
            packed(0x7E8, 8, T0_NS + np.arange(60) * 1_000_000_000),
        ]
    )


@pytest.fixture(scope="module")
def box(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("box")
    (folder / "box.dbc").write_text(DBC)
    write_candump(box_on_its_side(), "can3", folder / "drive.log.gz")
    return folder / "drive.log.gz"


def test_a_box_on_its_side_is_mapped_by_gravity_and_braking(box: Path, tmp_path: Path) -> None:
    output = box.parent / "signals.toml"
    told = run(box, "--output", output)
    assert "BOX.AccY: -9.80 m/s2  vertical_acceleration, sign -1: reads -9.80 m/s2: this axis is vertical" in told
    assert "BOX.AccZ: +0." in told or "BOX.AccZ: -0." in told
    assert "points rearward: goes with the change of speed" in told
    assert "This can work." in told
    assert f'Next: `springscale run` with signals = "{output}"' in told
    mapped = {m.signal: m for message in load_signal_map(output).messages for m in message.signals}
    # up = -y, forward = -z, left = up x forward = y x z = x
    assert (mapped[Signal.VERTICAL_ACCELERATION].dbc_signal, mapped[Signal.VERTICAL_ACCELERATION].to_si) == ("AccY", -1)
    assert mapped[Signal.PITCH_RATE].dbc_signal == "GyroX"
    assert mapped[Signal.PITCH_RATE].to_si == pytest.approx(np.pi / 180.0)
    # the rate about +z is positive right side up where z points rearward
    assert mapped[Signal.ROLL_RATE].dbc_signal == "GyroZ"
    assert mapped[Signal.ROLL_RATE].to_si == pytest.approx(-np.pi / 180.0)
    assert mapped[Signal.LONGITUDINAL_ACCELERATION].dbc_signal == "AccZ"
    assert mapped[Signal.LONGITUDINAL_ACCELERATION].to_si == -1
    assert mapped[Signal.VERTICAL_ACCELERATION].counter is not None
    assert len(mapped[Signal.SPEED].valid_when) == 1
    assert "signals" not in {path.name for path in tmp_path.iterdir()}


def test_a_lean_along_and_across_counts_both_where_they_read_alike(tmp_path: Path) -> None:
    (tmp_path / "box.dbc").write_text(DBC)
    t_ns, reads = T0_NS + np.arange(N) * 10_000_000, (2.0, 2.0, 9.4)
    write_candump(
        packed(512, 8, t_ns, *[(12 * i, 12, np.full(N, 100.0 * x)) for i, x in enumerate(reads)]),
        "can0",
        tmp_path / "a.log",
    )
    assert seen(tmp_path / "a.log")["tilt_deg"] == pytest.approx(16.7, abs=0.05)  # atan(2 sqrt 2 / 9.4)


def test_messages_are_listed_with_rate_and_length(box: Path) -> None:
    heard = {one["id"]: one for one in seen(box)["identifiers"]}
    assert {name: (one["lengths"], one["message"]) for name, one in heard.items()} == {
        "200": ([8], "BOX"), "201": ([6], "TURN"), "202": ([3], "GPS"), "7E8": ([8], None)
    }  # fmt: skip
    assert [heard[name]["rate_hz"] for name in ("200", "202", "7E8")] == pytest.approx([100.0, 5.0, 1.0], abs=0.05)
    assert {one["channel"] for one in heard.values()} == {"can3"}


def test_more_identifiers_than_a_bus_has_are_counted_and_left_out(tmp_path: Path) -> None:
    """A million and a half of them took two gigabytes and a minute."""
    n, seconds = 300_000, 60.0
    step_ns = round(seconds * 1e9 / n)
    at = np.arange(n)
    can_id = (0x8000_0000 | (at % 200_000)).astype(np.uint32)
    payload = np.zeros((n, 8), np.uint8)
    frames = Frames(T0_NS + step_ns * at, can_id, np.full(n, 8, np.uint8), payload)
    write_candump(frames, "can0", tmp_path / "a.log")
    begun_s = time.process_time()
    with limits():
        told = run(tmp_path / "a.log")
    assert time.process_time() - begun_s < 10.0
    n_kept = sum(1 for one in at if one % 200_000 < MOST_IDENTIFIERS)
    assert f"300000 frames in 60 s on can0\n  {n - n_kept} frames are under further identifiers" in told
    assert f"... and {MOST_IDENTIFIERS - 12} identifiers more that no database describes" in told


def test_the_frames_kept_of_a_long_log_are_bounded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of 2 GB of other traffic 5 GB were kept; the counts are of all."""
    t_ns = T0_NS + np.arange(40_000) * 1_000_000
    frames = merge_frames([packed(0x6A0 + n, 8, t_ns + n) for n in range(5)])
    write_candump(frames, "can0", tmp_path / "a.log")
    monkeypatch.setattr(heard_module, "MOST_KEPT", 1000)
    heard, _ = heard_module.heard_in(tmp_path / "a.log")
    assert [one.n_frames for one in heard] == [40_000] * 5
    assert [len(one.frames) for one in heard[1:]] == [heard_module.FIRST_FRAMES] * 4


def test_a_map_is_not_written_over(box: Path) -> None:
    mine = box.parent / "mine.toml"
    mine.write_text("mine")
    found = called("look", box, "--output", mine)
    assert isinstance(found.exception, Exception)
    assert "is there already" in str(found.exception)
    assert mine.read_text() == "mine"


@pytest.mark.parametrize("shipped", [False, True], ids=["the map", "a database beside it"])
def test_a_disk_that_is_full_leaves_no_half_draft(shipped: bool, box: Path, tmp_path: Path) -> None:
    """As a kill in the middle would: each file has its name once it is whole."""
    log, output = box, tmp_path / "signals.toml"
    if shipped:
        log = tmp_path / "drive.log"
        write_candump(bus_drive(30.0, seed=3), "can0", log)
    before = set(tmp_path.iterdir())
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (100, limits[1]))
    try:
        found = called("look", log, "--output", output)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert isinstance(found.exception, ConfigurationError)
    assert str(found.exception) == f"{output}: cannot be written: File too large"
    assert set(tmp_path.iterdir()) == before


@pytest.mark.parametrize("suffix", [".log", ".blf"])
def test_a_fitting_shipped_map_is_named_and_copied_for_every_log_format(suffix: str, tmp_path: Path) -> None:
    log, frames = tmp_path / f"drive{suffix}", bus_drive(30.0, seed=3)
    if suffix == ".log":
        write_candump(frames, "can0", log)
    else:
        with can.Logger(log) as writer:
            for row in range(len(frames)):
                message = message_of(frames, row)
                message.channel, message.timestamp = 1, float(message.timestamp)
                writer.on_message_received(message)
    told = seen(log, "--output", tmp_path / "signals.toml")
    fits = [one for one in told["maps"] if one["fits"]]
    assert [one["name"] for one in fits] == ["springscale:reference"]
    assert fits[0]["vertical_mps2"] == pytest.approx(9.81, abs=0.05)
    assert told["can_work"]
    assert load_signal_map(tmp_path / "signals.toml").signals == load_signal_map("springscale:reference").signals
    assert [Path(path).name for path in told["written"]] == ["signals.toml", "springscale_reference.dbc"]


def test_a_j1939_device_is_found_whatever_its_address(tmp_path: Path) -> None:
    drive = bus_drive(30.0, seed=3, signals="springscale:j1939")
    moved = Frames(drive.t_ns, (drive.can_id & ~np.uint32(0xFF)) | np.uint32(0x55), drive.length, drive.payload)
    write_candump(moved, "can0", tmp_path / "drive.log")
    told = seen(tmp_path / "drive.log")
    assert "springscale:j1939" in [one["name"] for one in told["maps"] if one["fits"]]
    assert all(one["database"] == "j1939.dbc" for one in told["identifiers"])


def test_two_channels_are_two(tmp_path: Path) -> None:
    first, second = bus_drive(20.0, seed=3), bus_drive(20.0, seed=4)
    write_candump(first, "can0", tmp_path / "a.log")
    write_candump(second, "can1", tmp_path / "b.log")
    lines = [*(tmp_path / "a.log").read_text().splitlines(), *(tmp_path / "b.log").read_text().splitlines()]
    (tmp_path / "both.log").write_text("\n".join(sorted(lines)) + "\n")
    heard = seen(tmp_path / "both.log")["identifiers"]
    assert [(one["channel"], one["id"]) for one in heard] == [
        (channel, name) for channel in ("can0", "can1") for name in ("120", "121", "130")
    ]


NO_DATABASE = "no database describes one in {}: give that of the sensor by --dbc"
UNKNOWN = f"no acceleration reads 9.8 m/s2: {NO_DATABASE.format('m/s^2, m/s2, m/s², m/s/s, g, mg')}"
RATES = "rad/s, deg/s, deg/sec, degrees/s, °/s, º/s, dps, mrad/s"
NO_GRAVITY = "no acceleration reads 9.8 m/s2: the sensor is not in this log, or takes gravity off"
NO_RATE = f"no pitch rate could be told: {NO_DATABASE.format(RATES)}"
NO_SPEED = "no speed: add [signals.speed] from a GNSS receiver or the vehicle"


@pytest.mark.parametrize(
    ("frames", "dbc", "lacking"),
    [
        (box_on_its_side(0.0), DBC, [NO_GRAVITY]),
        (take(whole := box_on_its_side(), whole.t_ns % 50_000_000 < 2), DBC,
         [f"{name} comes 20 times a second; 40 are needed" for name in ("BOX.AccY", "TURN.GyroX")]),
        (packed(0x321, 8, T0_NS + np.arange(500) * 10_000_000), "", [UNKNOWN, NO_SPEED]),
        (packed(512, 8, T0_NS + np.arange(500) * 10_000_000), DBC.replace('"m/s^2"', '"m/s**2"'), [UNKNOWN, NO_SPEED]),
        (box_on_its_side(), DBC.replace('"deg/s"', '"Unit_DegreePerSecond"'), [NO_RATE]),
    ],
    ids=["no gravity", "slow", "no database", "an unknown unit", "an unknown unit of the rates"],
)  # fmt: skip
def test_obstacles_are_reported(frames: Frames, dbc: str, lacking: list[str], tmp_path: Path) -> None:
    if dbc:
        (tmp_path / "box.dbc").write_text(dbc)
    write_candump(frames, "can0", tmp_path / "drive.log")
    told = seen(tmp_path / "drive.log")
    assert (told["can_work"], told["lacking"]) == (False, lacking)
    assert "This cannot work yet:\n  " + "\n  ".join(lacking) in run(tmp_path / "drive.log")


@pytest.mark.parametrize(
    ("unit_and_factor", "kmh"),
    [('(0.01,0) [0|0] "m/s"', 246), ('(0.002,0) [0|0] "km/h"', 14), ('(1,0) [0|0] "km/h"', 6840)],
)
def test_a_speed_at_which_nothing_is_weighed_is_doubted(unit_and_factor: str, kmh: int, tmp_path: Path) -> None:
    (tmp_path / "box.dbc").write_text(DBC.replace('(0.01,0) [0|0] "km/h"', unit_and_factor))
    write_candump(box_on_its_side(), "can3", tmp_path / "drive.log")
    doubt = f"up to {kmh} km/h: if it drove otherwise, correct unit or factor of the speed in the database"
    assert seen(tmp_path / "drive.log", "--output", tmp_path / "signals.toml")["to_mend"] == [
        f"GPS.Speed reads {doubt}"
    ]
    assert f"[signals.speed] # CHECK: {doubt}" in (tmp_path / "signals.toml").read_text()


def test_a_database_of_another_device_is_no_certainty(tmp_path: Path) -> None:
    """The shipped reference layout with its valid flags down: who knows whose frames these are?"""
    drive = bus_drive(30.0, seed=3)
    payload = drive.payload.copy()
    payload[drive.can_id < 0x130, 7] = 0
    write_candump(Frames(drive.t_ns, drive.can_id, drive.length, payload), "can0", tmp_path / "drive.log")
    told = run(tmp_path / "drive.log")
    assert "is springscale_reference.dbc the database of this device?" in told
    assert "has no sample of pitch_rate: of 3,000 frames of IMU_GYRO (121), 3,000 do not meet valid_when" in told


def test_a_receiver_without_a_fix_is_no_missing_speed(tmp_path: Path) -> None:
    drive = bus_drive(30.0, seed=3)
    payload = drive.payload.copy()
    payload[drive.can_id == 0x130, 3] = 0
    write_candump(Frames(drive.t_ns, drive.can_id, drive.length, payload), "can0", tmp_path / "drive.log")
    told = run(tmp_path / "drive.log")
    assert "has no sample of speed: of 150 frames of GPS_SPEED (130), 150 do not meet valid_when" in told
    assert "no speed: frames or values that would show it are refused, as told above" in told


@pytest.mark.parametrize(
    ("name", "axis"),
    [
        ("AccelX", "x"), ("AngularRateZ", "z"), ("acc_y", "y"), ("ACC_Z", "z"), ("GYROY", "y"),
        ("VerticalAcceleration", "z"), ("LateralAcceleration", "y"), ("RateY2", "y"), ("Energy", ""), ("Speed", ""),
    ],
)  # fmt: skip
def test_axes_are_recognised_by_their_names(name: str, axis: str) -> None:
    assert axis_of(name) == axis


REFERENCE = load_signal_map("springscale:reference")
GYRO = 0x121
Alter = Callable[[Frames], Frames]


def renumbered(to: int) -> Alter:
    def altered(frames: Frames) -> Frames:
        can_id = np.where(frames.can_id == GYRO, np.uint32(to), frames.can_id)
        return Frames(frames.t_ns, can_id, frames.length, frames.payload)

    return altered


def never_valid(frames: Frames) -> Frames:
    payload = frames.payload.copy()
    payload[frames.can_id == GYRO, 7] = 0
    return Frames(frames.t_ns, frames.can_id, frames.length, payload)


def cut_short(frames: Frames) -> Frames:
    length = np.where(frames.can_id == GYRO, np.uint8(7), frames.length)
    return Frames(frames.t_ns, frames.can_id, length, frames.payload)


@pytest.mark.parametrize(
    ("alter", "words"),
    [
        (renumbered(0x125), "nothing of IMU_GYRO (121) came; springscale look shows what did"),
        (renumbered(0x121 | EXTENDED_ID), "nothing of IMU_GYRO (121) came; springscale look shows what did"),
        (never_valid, "2000 frames of IMU_GYRO (121) came, none valid: 2000 invalid"),
        (cut_short, "2000 frames of IMU_GYRO (121) came, none valid: 2000 wrong length"),
    ],
)
def test_a_silent_sensor_has_a_reason(alter: Alter, words: str, tmp_path: Path) -> None:
    log = tmp_path / "drive.log"
    write_candump(alter(bus_drive(20.0, seed=3)), "can0", log)
    silent = (Signal.PITCH_RATE, Signal.ROLL_RATE)  # both come in one message
    motion, report = read_whole_log(log, REFERENCE)
    why = _silent(report.decoder, motion, REFERENCE)
    assert why == dict.fromkeys(silent, words)
    nothing = known_drive(1, "drive.log", 0.0, 50.0, ())
    split = InspectedRun(nothing, facts=row_facts(motion, REFERENCE.traits), log=LogFacts(silent=why))
    pitch, roll = inspect_run(split, VAN, BatchSettings(), (Kind.SENSOR_SILENT,))
    assert pitch.text == f"pitch_rate has 0 samples in the whole run: {words}"
    assert (pitch.severity, roll.severity) == (Severity.FAULT, Severity.WARNING)
    assert roll.text == f"roll_rate has 0 samples in the whole run: {words}"
