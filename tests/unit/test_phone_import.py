"""springscale import: made recordings of a phone in the apps' formats become logs that every command takes."""

import json
import math
import zipfile
from collections.abc import Callable
from dataclasses import replace
from fnmatch import fnmatch
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from support.commands import called, printed
from support.kept import kept_file

from gateway.bus.logs import motion_of_log
from gateway.bus.signals import load_signal_map
from gateway.errors import ConfigurationError, LogUnreadableError, SpringscaleError
from gateway.offline.phone import import_recording, imported, read_recording
from gateway.offline.phone.imported import Imported
from gateway.records import Motion, Signal, joined
from gateway.sim.drive import constant, rural, urban
from gateway.sim.obstacles import UnevenRoad
from gateway.sim.road import iso_road
from gateway.sim.scenario import simulate_drive
from gateway.sim.sensors import Gps, Mount, Recording
from gateway.sim.vans import PAPER_VAN
from gateway.units import NS_PER_S
from gateway.workbench.phones import APPS, PHONE, App, Lying, write_export

ROAD = UnevenRoad(iso_road("B"), stretch_m=600.0, spread=0.25)
LEVEL = replace(PHONE, mount=Mount(position_m=2.4, height_m=0.5))  # the phone's turn is added when it is exported


@cache
def driven(kind: str = "mixed", seed: int = 5) -> Recording:
    """What the phone felt, in the vehicle's axes."""
    rng = np.random.default_rng(seed)
    drive = constant(14.0, 200.0, rng) if kind == "steady" else urban(200.0, rng).then(rural(260.0, rng))
    return simulate_drive(PAPER_VAN, (), ROAD, drive, LEVEL, seed).recording


@cache
def exported(app: App = "sensor_logger_android", kind: str = "mixed", **lying: float) -> Path:
    """The zip of the app, the same file for every test that asks for it."""
    name = "_".join([app, kind, *(f"{how}={x:g}" for how, x in lying.items())])
    return kept_file(f"{name}.zip", lambda path: write_export(driven(kind), path, app, Lying(**lying)))


@cache
def taken(path: Path, forward: str | None = None) -> Imported:
    return imported(read_recording(path), forward)


def edited(folder: Path, path: Path, members: str, change: Callable[[str], str] | None) -> Path:
    """The same zip with the text of these members (a pattern) changed, or without them."""
    other = folder / "edited.zip"
    with zipfile.ZipFile(path) as old, zipfile.ZipFile(other, "w") as new:
        for name in old.namelist():
            if not fnmatch(name, members):
                new.writestr(name, old.read(name))
            elif change is not None:
                new.writestr(name, change(old.read(name).decode()))
    return other


def rows_of(log: Path) -> Motion:
    return joined(list(motion_of_log(log, load_signal_map(log.with_name("phone.toml")))[0]))


def codes(path: Path) -> list[str]:
    return [remark.code for remark in taken(path).remarks]


@pytest.mark.parametrize(
    ("app", "turned_deg", "tilted_deg"),
    [("sensor_logger_android", 130.0, 4.0), ("sensor_logger_ios", -75.0, 170.0), ("phyphox", 0.0, 0.0)],
)
def test_the_log_says_what_the_vehicle_did_however_the_phone_lay(
    app: App, turned_deg: float, tilted_deg: float, tmp_path: Path
) -> None:
    path = exported(app, turned_deg=turned_deg, tilted_deg=tilted_deg)
    import_recording(path, tmp_path / "drive.log")
    rows, true = rows_of(tmp_path / "drive.log"), driven()
    at_s = np.arange(60.0, 300.0, 0.05)
    origin = true.imu_t_ns[0]
    for signal, felt in (
        (Signal.VERTICAL_ACCELERATION, true.accel_mps2[:, 2]),
        (Signal.LONGITUDINAL_ACCELERATION, true.accel_mps2[:, 0]),
        (Signal.PITCH_RATE, true.gyro_radps[:, 1]),
        (Signal.ROLL_RATE, true.gyro_radps[:, 0]),
    ):
        t_ns, x = rows.of(signal)
        told = np.interp(at_s, (t_ns - origin) / NS_PER_S, x)
        expected = np.interp(at_s, (true.imu_t_ns - origin) / NS_PER_S, felt)
        assert np.corrcoef(told, expected)[0, 1] > 0.99, signal
        assert np.std(told) == pytest.approx(np.std(expected), rel=0.03), signal
    assert np.median(rows.of(Signal.VERTICAL_ACCELERATION)[1]) == pytest.approx(9.81, abs=0.3)
    assert len(rows.of(Signal.LATITUDE)[0]) == len(rows.of(Signal.SPEED)[0]) > 300


def test_all_apps_give_the_same_log_but_for_their_digits(tmp_path: Path) -> None:
    digits = {Signal.VERTICAL_ACCELERATION: 0.005, Signal.PITCH_RATE: math.radians(0.01), Signal.SPEED: 0.01}
    logs = []
    for app in APPS:
        (tmp_path / app).mkdir()
        import_recording(exported(app), tmp_path / app / "drive.log")
        logs.append(rows_of(tmp_path / app / "drive.log"))
    for other in logs[1:]:
        for signal, most in digits.items():
            (first_ns, first), (t_ns, told) = logs[0].of(signal), other.of(signal)
            assert len(t_ns) == len(first_ns)
            assert np.abs(t_ns - first_ns).max() < 1_000_000
            assert np.abs(told - first).max() < most, signal


def test_the_speed_is_put_where_it_was_true() -> None:
    found = taken(exported())
    assert found.axes.delay_s == pytest.approx(LEVEL.gps.latency_s, abs=0.15)
    assert found.axes.fit > 0.95


def test_metadata_tells_the_sign_and_the_course_does_where_there_is_none() -> None:
    android, ios, phyphox = (taken(exported(app)) for app in APPS)
    assert (android.sign_from, ios.sign_from, phyphox.sign_from) == ("metadata", "metadata", "course")


def test_a_sign_that_the_course_contradicts_is_not_believed(tmp_path: Path) -> None:
    path = exported("sensor_logger_ios")
    found = taken(edited(tmp_path, path, "Metadata.csv", lambda text: text.replace(",ios,", ",android,")))
    assert found.sign_from == "course"
    assert "sign" in [remark.code for remark in found.remarks]
    assert np.allclose(found.axes.to_vehicle, taken(path).axes.to_vehicle)


def test_standardised_recordings_of_ios_follow_android(tmp_path: Path) -> None:
    def standardised(text: str) -> str:
        return text.replace(",android,", ",ios,").replace(",false,", ",true,")

    found = taken(edited(tmp_path, exported(), "Metadata.csv", standardised))
    assert found.sign_from == "metadata"
    assert found.axes.compass > 0.5


def test_models_with_a_comma_do_not_shift_the_metadata() -> None:
    recording = read_recording(exported("sensor_logger_ios"))
    assert recording.device == "iPhone14,5 (ios)"
    assert recording.accel_sign == -1


def test_hands_before_and_after_the_drive_are_cut_off() -> None:
    found = taken(exported(handled_s=20.0))
    begin_ns, end_ns = driven().imu_t_ns[[0, -1]]
    assert (found.stretch[0] - begin_ns) / NS_PER_S == pytest.approx(30.0, abs=2.0)
    assert (end_ns - found.stretch[1]) / NS_PER_S == pytest.approx(30.0, abs=2.0)


def test_a_phone_that_moved_on_the_way_is_told_and_the_longer_part_taken() -> None:
    found = taken(exported(handled_s=0.0, moved_at_s=300.0))
    moved = [remark.text for remark in found.remarks if remark.code == "phone_moved"]
    assert moved in (["the phone moved at 00:04:59 UTC"], ["the phone moved at 00:05:00 UTC"])
    assert 270.0 < found.duration_s < 300.0


def test_a_drive_of_bends_to_both_sides_is_no_phone_that_moved() -> None:
    assert "phone_moved" not in codes(exported(handled_s=0.0))


def test_lost_fixes_are_told_with_their_length(tmp_path: Path) -> None:
    def without_forty(text: str) -> str:
        lines = text.splitlines()
        return "\n".join(lines[:100] + lines[140:])

    remarks = taken(edited(tmp_path, exported(), "Location.csv", without_forty)).remarks
    (told,) = [remark.text for remark in remarks if remark.code == "gps_lost"]
    assert "GPS was lost for 4" in told  # forty fixes a second apart, and the second to the next


def test_invalid_speeds_are_no_speeds(tmp_path: Path) -> None:
    """Negative values mean invalid in Sensor Logger, and empty cells nothing."""

    def with_invalid(text: str) -> str:
        header, *rows = [line.split(",") for line in text.splitlines()]
        at = header.index("speed")
        for i, row in enumerate(rows):
            row[at] = ("-1", "", row[at])[i % 3]
        return "\n".join(",".join(row) for row in (header, *rows))

    fixes = read_recording(edited(tmp_path, exported(), "Location.csv", with_invalid)).fixes
    assert np.mean(np.isfinite(fixes.speed_mps)) == pytest.approx(1 / 3, abs=0.02)
    assert np.nanmin(fixes.speed_mps) >= 0.0


def test_a_phone_on_a_cushion_is_told_to_lie_on_the_floor(tmp_path: Path) -> None:
    """A cushion as a second-order low-pass at 0.8 Hz and a holder's buzz at 15 Hz."""
    felt = driven()
    t_s = (felt.imu_t_ns - felt.imu_t_ns[0]) / NS_PER_S
    accel = felt.accel_mps2.copy()
    smooth = np.exp(-2.0 * math.pi * 0.8 / 100.0)
    for _ in range(2):
        for i in range(1, len(accel)):
            accel[i, 2] = smooth * accel[i - 1, 2] + (1.0 - smooth) * accel[i, 2]
    accel[:, 2] += 0.6 * np.sin(2.0 * math.pi * 15.0 * t_s)
    write_export(replace(felt, accel_mps2=accel), tmp_path / "soft.zip", "sensor_logger_android", Lying(handled_s=0.0))
    assert "little_ride" in codes(tmp_path / "soft.zip")
    assert "little_ride" not in codes(exported())


def test_a_phone_that_is_read_too_seldom_is_told_so(tmp_path: Path) -> None:
    felt = driven()
    slow = replace(felt, imu_t_ns=felt.imu_t_ns[::5], accel_mps2=felt.accel_mps2[::5], gyro_radps=felt.gyro_radps[::5])
    write_export(slow, tmp_path / "slow.zip", "phyphox", Lying(handled_s=0.0))
    assert codes(tmp_path / "slow.zip").count("sample_rate") == 2


def test_uneven_rates_of_the_two_sensors_do_not_matter(tmp_path: Path) -> None:
    """A Pixel's gyroscope is read at another rate than its accelerometer, each at its own times."""
    path = exported(handled_s=0.0)

    def thinned(text: str) -> str:
        return "\n".join(line for i, line in enumerate(text.splitlines()) if i % 4 != 1)

    found = taken(edited(tmp_path, path, "Gyroscope.csv", thinned))
    assert np.allclose(found.axes.to_vehicle, taken(path).axes.to_vehicle, atol=0.01)


def test_forward_is_named_where_no_braking_and_no_bend_shows_it() -> None:
    path = exported(kind="steady", turned_deg=0.0, tilted_deg=0.0, handled_s=0.0)
    with pytest.raises(SpringscaleError, match="--forward"):
        taken(path)
    assert taken(path, "x").axes.to_vehicle == pytest.approx(np.eye(3), abs=0.05)
    with pytest.raises(SpringscaleError, match="--forward"):
        taken(path, "z")  # that one is up


def test_a_phone_that_never_lies_still_is_refused() -> None:
    with pytest.raises(SpringscaleError, match="fix it to the floor"):
        taken(exported(handled_s=220.0))


def test_phyphox_goes_on_after_a_pause_by_the_system_time(tmp_path: Path) -> None:
    path = exported("phyphox")
    begin_s = driven().imu_t_ns[0] / NS_PER_S
    clock = (
        '"event","experiment time","system time","system time text"\n'
        f'"START",0.000000000E0,{begin_s:.3f},"x"\n"PAUSE",2.000000000E2,{begin_s + 200:.3f},"x"\n'
        f'"START",2.000000000E2,{begin_s + 500:.3f},"x"\n'
    )
    t_ns = read_recording(edited(tmp_path, path, "meta/time.csv", lambda _: clock)).accel.t_ns
    waits_s = np.diff(t_ns) / NS_PER_S
    assert waits_s.max() == pytest.approx(300.0, abs=0.1)
    assert t_ns[0] == pytest.approx(driven().imu_t_ns[0], abs=2e6)


@pytest.mark.parametrize(("separator", "point"), [(";", "."), ("\t", "."), (";", ","), ("\t", ",")])
def test_every_separator_that_phyphox_offers(separator: str, point: str, tmp_path: Path) -> None:
    path = exported("phyphox")
    other = edited(tmp_path, path, "*", lambda text: text.replace(",", separator).replace(".", point))
    plain, changed = read_recording(path), read_recording(other)
    assert np.array_equal(plain.accel.xyz, changed.accel.xyz)
    assert np.array_equal(plain.accel.t_ns, changed.accel.t_ns)
    assert np.array_equal(plain.fixes.speed_mps, changed.fixes.speed_mps)


def test_an_unpacked_folder_is_as_good_as_the_zip(tmp_path: Path) -> None:
    path = exported()
    with zipfile.ZipFile(path) as archive:
        archive.extractall(tmp_path / "unpacked")
    assert np.array_equal(read_recording(tmp_path / "unpacked").gyro.xyz, read_recording(path).gyro.xyz)


def test_torn_and_doubled_rows_are_counted_and_left_out(tmp_path: Path) -> None:
    def torn(text: str) -> str:
        lines = text.splitlines()
        return "\n".join([*lines[:2000], lines[1999], "not,a,row", *lines[2000:], lines[-1][:20]])

    recording = read_recording(edited(tmp_path, exported(), "Gyroscope.csv", torn))
    assert recording.n_unusable == 3
    assert len(recording.gyro.t_ns) == len(driven().imu_t_ns)


@pytest.mark.parametrize(
    ("member", "text", "match"),
    [
        ("Gyroscope.csv", None, "switch the gyroscope on"),
        ("Location.csv", None, "switch the location on"),
        ("TotalAcceleration.csv", None, "acceleration with gravity"),
        ("Gyroscope.csv", "time,seconds_elapsed,z,y,x\n", "Gyroscope.csv: has no row of numbers"),
        ("Gyroscope.csv", "seconds_elapsed,z,y,x\n1,2,3,4\n", "has no column 'time'"),
    ],
)
def test_what_a_recording_lacks_is_named(member: str, text: str | None, match: str, tmp_path: Path) -> None:
    with pytest.raises(LogUnreadableError, match=match):
        read_recording(edited(tmp_path, exported(), member, None if text is None else lambda _: text))


def test_what_is_no_recording_is_refused_with_what_it_is(tmp_path: Path) -> None:
    (tmp_path / "no.zip").write_bytes(b"PK but not really")
    with pytest.raises(LogUnreadableError, match="cannot be unpacked"):
        read_recording(tmp_path / "no.zip")
    with zipfile.ZipFile(tmp_path / "other.zip", "w") as archive:
        archive.writestr("notes.csv", "a,b\n1,2\n")
    with pytest.raises(LogUnreadableError, match=r"no export of Sensor Logger.*notes\.csv"):
        read_recording(tmp_path / "other.zip")
    with pytest.raises(LogUnreadableError, match="no such file"):
        read_recording(tmp_path / "absent.zip")


def test_the_command_writes_a_log_with_its_map_and_look_takes_it(tmp_path: Path) -> None:
    path = exported()
    log = tmp_path / "out" / "drive.log"
    log.parent.mkdir()
    told = json.loads(printed("import", path, log, "--json"))
    assert [Path(each).name for each in told["written"]] == ["drive.log", "phone.toml", "phone.dbc"]
    assert told["accelerometer_hz"] == pytest.approx(100.1, abs=0.1)
    seen = json.loads(printed("look", log, "--json"))
    assert "springscale:phone" in [fit["name"] for fit in seen["maps"] if fit["fits"]]
    text = called("import", path, tmp_path / "out" / "second.log.gz")
    assert text.exit_code == 0
    assert "points ahead" in text.stdout


def test_positions_are_left_out_where_asked(tmp_path: Path) -> None:
    import_recording(exported(), tmp_path / "drive.log", with_position=False)
    rows = rows_of(tmp_path / "drive.log")
    assert not len(rows.of(Signal.LATITUDE)[0])
    assert len(rows.of(Signal.SPEED)[0])


def test_nothing_is_written_over(tmp_path: Path) -> None:
    path = exported()
    (tmp_path / "drive.log").write_text("mine")
    with pytest.raises(ConfigurationError, match="is there already"):
        import_recording(path, tmp_path / "drive.log")
    (tmp_path / "phone.toml").write_text("mine")
    with pytest.raises(ConfigurationError, match="another"):
        import_recording(path, tmp_path / "other.log")
    assert (tmp_path / "drive.log").read_text() == "mine"


def test_no_fix_at_all_is_refused(tmp_path: Path) -> None:
    felt = driven()
    blind = replace(felt, gps_fix=np.zeros(len(felt.gps_fix), bool))
    write_export(blind, tmp_path / "blind.zip", "phyphox", Lying(handled_s=0.0))
    with pytest.raises(LogUnreadableError, match="has no row of numbers"):
        read_recording(tmp_path / "blind.zip")


def test_a_rare_fix_is_enough_for_the_axes(tmp_path: Path) -> None:
    """Some iPhones give a fix every two seconds."""
    rare = replace(LEVEL, gps=Gps(0.5, latency_s=0.4, noise_std_mps=0.1))
    rng = np.random.default_rng(6)
    felt = simulate_drive(PAPER_VAN, (), ROAD, urban(200.0, rng).then(rural(260.0, rng)), rare, 6).recording
    write_export(felt, tmp_path / "rare.zip", "sensor_logger_ios", Lying(turned_deg=40.0))
    assert taken(tmp_path / "rare.zip").axes.fit > 0.8
