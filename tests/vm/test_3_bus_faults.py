"""Faults of a real interface, and how soon the service recovers from them."""

import time
from collections.abc import Callable
from datetime import datetime
from pathlib import Path
from typing import Any

import pytest
from vm.harness.drives import loaded_drive, log_of
from vm.harness.vehicle import PLAY, Answer, Vehicle

Recovered = Callable[[float], None]
WATCHDOG_S = 20.0
GUEST = Path(__file__).parent / "guest"


@pytest.fixture
def drive(vehicle: Vehicle, tmp_path: Path) -> str:
    """A log of 100 s in the guest."""
    return vehicle.put_log(log_of(loaded_drive(100.0, 3), tmp_path / "drive.log"))


def receiving_again(vehicle: Vehicle, drive: str) -> float:
    """Seconds from now, with frames on the bus again, until the service counts them."""
    vehicle.play(drive)
    return vehicle.wait_until(lambda status: status["bus"]["state"] == "receiving")


def in_reader_fault(vehicle: Vehicle, reason: str) -> None:
    """Wait until the status says so and why, and check that the service lives.

    The kernel takes an interface down before it removes it, so a removed one is told as down until it is opened again.
    """

    def is_told(status: dict[str, Any]) -> bool:
        bus = status["bus"]
        return bus["state"] == "reader_fault" and reason in bus["last_fault"]

    vehicle.wait_until(is_told)
    assert not vehicle.status()["is_ready"]


def test_interface_down_and_up(vehicle: Vehicle, drive: str, recovered: Recovered) -> None:
    vehicle.play(drive)
    vehicle.wait_until(lambda status: status["bus"]["state"] == "receiving")
    pid = vehicle.pid()
    vehicle.run("ip link set vcan0 down")
    in_reader_fault(vehicle, "ip link set vcan0 up")
    vehicle.stop_playing()
    vehicle.run("ip link set vcan0 up")
    recovered(receiving_again(vehicle, drive))
    assert vehicle.pid() == pid


def test_interface_deleted_and_made_again(vehicle: Vehicle, drive: str, recovered: Recovered) -> None:
    pid = vehicle.pid()
    vehicle.run("ip link delete vcan0")
    in_reader_fault(vehicle, "does not exist")
    vehicle.run("ip link add vcan0 type vcan && ip link set vcan0 up")
    recovered(receiving_again(vehicle, drive))
    assert vehicle.pid() == pid


def test_interface_absent_at_the_start(vehicle: Vehicle, drive: str, recovered: Recovered) -> None:
    vehicle.run("systemctl stop springscale; ip link delete vcan0")
    vehicle.run("systemctl start springscale", timeout_s=90.0)
    in_reader_fault(vehicle, "does not exist")
    vehicle.run("ip link add vcan0 type vcan && ip link set vcan0 up")
    recovered(receiving_again(vehicle, drive))
    assert vehicle.n_restarts() == 0


def test_a_silent_bus_is_no_fault_and_feeds_the_watchdog(vehicle: Vehicle) -> None:
    pid = vehicle.pid()
    vehicle.wait_until(lambda status: status["bus"]["state"] == "bus_silent")
    time.sleep(WATCHDOG_S + 5.0)
    status = vehicle.status()
    assert status["state"] == "waiting_for_bus"
    assert status["is_ready"]
    assert vehicle.pid() == pid


def test_a_sensor_set_to_another_identifier_is_silent_and_the_status_says_how_to_find_it(vehicle: Vehicle) -> None:
    """The kernel's filters keep it out."""
    vehicle.run("systemd-run --quiet --collect --unit stranger cangen vcan0 -g 10 -I 122 -L 8")
    try:
        vehicle.restart()
        vehicle.wait_until(lambda status: "springscale look" in status["state_in_words"])
    finally:
        vehicle.run("systemctl stop stranger")


def test_bus_off_is_reported_and_recovered_from(vehicle: Vehicle, drive: str, recovered: Recovered) -> None:
    vehicle.machine.write("/root/odd_frames.py", (GUEST / "odd_frames.py").read_bytes())
    vehicle.run("python3 /root/odd_frames.py 1 bus_off")
    in_reader_fault(vehicle, "bus-off")
    recovered(receiving_again(vehicle, drive))


def test_a_flood_is_survived_and_every_frame_accounted_for(vehicle: Vehicle, drive: str, recovered: Recovered) -> None:
    before, pid, n_sent = vehicle.status()["bus"], vehicle.pid(), 30_000
    vehicle.run(f"cangen vcan0 -g 0 -p 10 -n {n_sent} -I 120 -L 8 -D i", timeout_s=120.0)

    def n_accounted() -> int:
        bus = vehicle.status()["bus"]
        return int(sum(bus[key] - before[key] for key in ("n_frames", "n_kernel_dropped")))

    def all_accounted() -> bool:
        nonlocal n_sent
        # The kernel tells of what it dropped with the next frame that finds room, which may not be the first one sent.
        vehicle.run("cansend vcan0 120#0000000000000000; sleep 1.5")
        n_sent += 1
        return n_accounted() == n_sent

    vehicle.wait_for(all_accounted)
    recovered(receiving_again(vehicle, drive))
    assert vehicle.pid() == pid


def is_whole(record: Answer) -> bool:
    """Whether a batch spans a whole window."""
    begin, end = (datetime.fromisoformat(record[key]) for key in ("t_start", "t_end"))
    return abs((end - begin).total_seconds() - 20.0) < 0.001


def step_clock(vehicle: Vehicle, by_s: int) -> None:
    vehicle.run(f"date --set @$(( $(date +%s) + {by_s} ))")


@pytest.mark.parametrize("by_s", [3600, -3600])
def test_a_clock_step_ends_the_drive_and_nothing_else(
    by_s: int, vehicle: Vehicle, drive: str, recovered: Recovered
) -> None:
    pid, n_before = vehicle.pid(), len(vehicle.records())
    n_remainders = vehicle.status()["batches"]["n_remainders"]
    vehicle.play(drive)
    vehicle.wait_until(lambda status: status["bus"]["state"] == "receiving")
    time.sleep(3.0)
    step_clock(vehicle, by_s)
    vehicle.stop_playing()  # canplayer keeps time by the very clock that was stepped: it would burst or wait
    try:
        vehicle.play(drive)
        recovered(vehicle.wait_until(lambda status: status["batches"]["n_remainders"] > n_remainders))
        vehicle.wait_for(lambda: any(is_whole(record) for record in vehicle.records()[n_before:]))
    finally:
        step_clock(vehicle, -by_s)
    assert vehicle.pid() == pid


def test_estimates_from_before_the_clock_was_set_are_kept(vehicle: Vehicle, tmp_path: Path) -> None:
    """A box without a clock battery starts in 1970, drives, and learns the date later."""
    pulse = vehicle.put_log(log_of(loaded_drive(2.0, 4), tmp_path / "pulse.log"))
    today_s = int(vehicle.run("date +%s"))
    try:
        vehicle.run("date --set @86400")
        for _ in range(2):
            vehicle.run(f"{PLAY} {pulse}; sleep 3.5")
        vehicle.wait_for(lambda: any(record["t_end"].startswith("1970") for record in vehicle.stored()))
    finally:
        vehicle.run(f"date --set @{today_s + 30}")
    n_before = len(vehicle.stored())
    for _ in range(2):
        vehicle.run(f"{PLAY} {pulse}; sleep 3.5")
    vehicle.wait_for(lambda: len(vehicle.stored()) > n_before + 1)
    assert any(record["t_end"].startswith("1970") for record in vehicle.stored())
