"""Recorded drives on a real vcan0: an outside client reads what `springscale estimate` makes of the same frames."""

import json
import math
import re
from collections.abc import Callable
from pathlib import Path

import pytest
from vm.harness.drives import faster, loaded_drive, log_of
from vm.harness.vehicle import CONFIG, HEARD, SETTINGS, Answer, Vehicle

from gateway.config import load_settings
from gateway.offline.estimates import estimates_of_logs, setup_of
from gateway.records import estimate_to_json

DRIVE_S = 45.0  # two batches of 20 s and a rest
GUEST = Path(__file__).parent / "guest"

# The kernel stamps a frame when it is sent to vcan0, microseconds to milliseconds after the log's time, so the uniform
# time line is filled from samples that lie a little elsewhere. candump writes the same stamps in whole microseconds.
SAME_STAMPS_KG, SAME_STAMPS_PP = 0.01, 0.001
NEW_STAMPS_KG, NEW_STAMPS_PP = 10.0, 0.5  # a quarter of the standard deviation of one 20 s batch (about 44 kg)


def of_guests_estimate(vehicle: Vehicle, log: str) -> list[Answer]:
    """Batches that count, by `springscale estimate` of the installed package on a log in the guest."""
    lines = vehicle.run(f"springscale estimate {log} --config {CONFIG} --window-s 20 --json", timeout_s=120.0)
    return [record for record in map(json.loads, lines.splitlines()) if not record["rejected"]]


def of_own_estimate(log: Path, signals: str, folder: Path) -> list[Answer]:
    """Batches that count, by the sources of this checkout on the log as it was before it met a kernel."""
    calibration = Path(__file__).parents[2] / "gateway/demo/paper_van.json"
    config = folder / "springscale.toml"
    config.write_text(
        SETTINGS.replace("vehicle.json", str(calibration)).replace("springscale:reference", f"springscale:{signals}")
    )
    settings = load_settings(config)
    found = estimates_of_logs([log], setup_of(settings), settings.batch.for_core())
    return [estimate_to_json(each) for each in found if each.counted]


def furthest_apart(ones: list[Answer], others: list[Answer]) -> tuple[float, float]:
    """Largest difference in payload (kg) and front share (percentage points) between paired batches."""
    assert len(ones) == len(others) > 0
    return tuple(
        max(abs(one[key] - other[key]) for one, other in zip(ones, others, strict=True))
        for key in ("payload_kg", "front_share_pct")
    )  # type: ignore[return-value]


@pytest.mark.parametrize("signals", ["reference", "j1939"])
def test_http_tells_what_estimate_tells_of_the_same_frames(
    signals: str, vehicle: Vehicle, tmp_path: Path, measured: Callable[..., None]
) -> None:
    vehicle.configure(SETTINGS.replace("springscale:reference", f"springscale:{signals}"))
    vehicle.restart()
    frames = loaded_drive(DRIVE_S, 1, signals)
    log = log_of(frames, tmp_path / "drive.log")
    n_before = len(vehicle.records())
    vehicle.listen()
    vehicle.play(vehicle.put_log(log))
    vehicle.wait_until(lambda status: status["bus"]["n_frames"] == len(frames))
    vehicle.stop_listening()
    told = [record for record in vehicle.records()[n_before:] if not record["rejected"]]
    assert len(told) == 2

    bus = vehicle.status()["bus"]
    assert (bus["n_kernel_dropped"], bus["n_inbox_dropped"], bus["n_error_frames"]) == (0, 0, 0)

    same_kg, same_pp = furthest_apart(told, of_guests_estimate(vehicle, HEARD))
    new_kg, new_pp = furthest_apart(told, of_own_estimate(log, signals, tmp_path))
    measured(
        **{
            f"{signals}_same_stamps_kg": same_kg,
            f"{signals}_same_stamps_pp": same_pp,
            f"{signals}_new_stamps_kg": new_kg,
            f"{signals}_new_stamps_pp": new_pp,
        }
    )
    assert same_kg < SAME_STAMPS_KG
    assert same_pp < SAME_STAMPS_PP
    assert new_kg < NEW_STAMPS_KG
    assert new_pp < NEW_STAMPS_PP
    assert all(record["payload_interval95_kg"][0] < 270.0 < record["payload_interval95_kg"][1] for record in told)


def test_other_frames_on_the_bus_do_no_harm_and_are_counted(vehicle: Vehicle, tmp_path: Path) -> None:
    """CAN FD, remote, error and short frames among a drive: the drive's own frames are weighed all the same."""
    frames = loaded_drive(25.0, 2)
    n_before = len(vehicle.records())
    vehicle.machine.write("/root/odd_frames.py", (GUEST / "odd_frames.py").read_bytes())
    vehicle.play(vehicle.put_log(log_of(frames, tmp_path / "mixed.log")))
    vehicle.run("python3 /root/odd_frames.py 50 error remote fd_other fd_mapped short")
    of_mapped_ids = len(frames) + 2 * 50  # fd_mapped and short come through the filter and fail at decoding
    vehicle.wait_until(lambda status: status["bus"]["n_frames"] == of_mapped_ids)
    status = vehicle.status()
    assert status["bus"]["n_error_frames"] == 50
    wrong_length = {c["signal"]: c["n"] for c in status["decode"] if c["reason"] == "wrong_length"}
    assert wrong_length.pop("vertical_acceleration") == 100, status["decode"]
    assert not wrong_length
    told = vehicle.records()[n_before:]
    assert [record["rejected"] for record in told] == [[]]
    assert math.isclose(told[0]["payload_kg"], 270.0, abs_tol=3 * told[0]["payload_std_kg"])


def filter_matches(vehicle: Vehicle) -> dict[str, int]:
    """Frames that each of the kernel's own CAN filters let through, by identifier."""
    lists = vehicle.run("cat /proc/net/can/rcvlist_sff /proc/net/can/rcvlist_fil")
    rows = re.findall(r"^\s*vcan0\s+([0-9a-f]+)\s+[0-9a-f]+\s+\S+\s+\S+\s+(\d+)\s+raw", lists, re.MULTILINE)
    return {identifier: int(n) for identifier, n in rows}


def test_frames_it_did_not_ask_for_never_reach_it(vehicle: Vehicle, tmp_path: Path) -> None:
    before = filter_matches(vehicle)
    assert before, vehicle.run("cat /proc/net/can/rcvlist_sff /proc/net/can/rcvlist_fil")
    vehicle.run("cangen vcan0 -g 0 -p 10 -n 2000 -I 5A5 -L 8 -D i")
    vehicle.run("cangen vcan0 -g 0 -p 10 -n 500 -e -I 120 -L 8 -D i")  # the same number with 29 bits is another id
    vehicle.run("cansend vcan0 120#0000000000000000")
    vehicle.wait_until(lambda status: status["bus"]["n_frames"] == 1)
    after = filter_matches(vehicle)
    assert sum(after.values()) - sum(before.values()) == 1


def test_it_keeps_up_as_long_as_candump_does(vehicle: Vehicle, tmp_path: Path, measured: Callable[..., None]) -> None:
    """Ever faster replays: wherever candump misses nothing, the service misses nothing."""
    sustained_hz = 0
    for rate_hz in (1000, 2000, 4000, 8000):
        drive = loaded_drive(190.0, 3)
        drive_rate_hz = len(drive) / 190.0
        frames = faster(drive, rate_hz / drive_rate_hz)
        log = vehicle.put_log(log_of(frames, tmp_path / f"fast-{rate_hz}.log"))
        vehicle.restart()
        vehicle.listen()
        vehicle.run(f"canplayer -I {log}; sleep 2", timeout_s=180.0)
        vehicle.stop_listening()
        if int(vehicle.run(f"wc -l < {HEARD}")) != len(frames):
            break
        n = len(frames)
        vehicle.wait_until(lambda status, n=n: status["bus"]["n_frames"] == n, timeout_s=20.0)
        bus = vehicle.status()["bus"]
        assert (bus["n_kernel_dropped"], bus["n_inbox_dropped"]) == (0, 0)
        sustained_hz = rate_hz
    measured(sustained_frames_per_s=sustained_hz)
    assert sustained_hz >= 1000
