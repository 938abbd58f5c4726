"""A disk that is full, read-only or damaged, under the real service and its sandbox."""

import time
from collections.abc import Callable, Iterator

import pytest
from vm.harness.drives import loaded_drive, log_of
from vm.harness.vehicle import SETTINGS, STATE, Vehicle

Recovered = Callable[[float], None]


@pytest.fixture(scope="module")
def small_disk(installed: Vehicle, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Vehicle]:
    """The service on a disk of 4 MB: one window is driven again and again, a record or two every 20 s. Each test leaves
    it well.
    """
    vehicle = installed
    vehicle.configure(SETTINGS.replace("silence_s = 3.0", "silence_s = 0.5"))
    vehicle.run(
        f"systemctl stop springscale; cp -p {STATE}/tokens.json /root/;"
        f"mount -t tmpfs -o size=4m,mode=0750,uid=springscale,gid=springscale small {STATE};"
        f"cp -p /root/tokens.json {STATE}/; systemctl start springscale",
        timeout_s=120.0,
    )
    pulse = vehicle.put_log(log_of(loaded_drive(20.5, 4), tmp_path_factory.mktemp("pulse") / "pulse.log"))
    vehicle.play_pulses(pulse, pause_s=0.8)
    vehicle.wait_until(lambda status: status["store"]["n_written"] > 2)
    yield vehicle
    vehicle.stop_playing()
    vehicle.run(f"systemctl stop springscale; umount {STATE}")
    vehicle.restore()


def degraded(vehicle: Vehicle) -> None:
    """Wait until records are held in memory, and see that they are told all the same."""
    vehicle.wait_until(lambda status: status["store"]["n_held"] > 1)
    assert vehicle.status()["store"]["state"] == "degraded"
    assert len(vehicle.records()) > len(vehicle.stored("estimate", "rejection"))


def on_disk_again(vehicle: Vehicle) -> float:
    """Seconds until all that was held is stored; nothing was lost and nothing came twice."""
    seconds = vehicle.wait_until(lambda status: status["store"]["state"] == "ok" and status["store"]["n_held"] == 0)
    assert vehicle.status()["store"]["n_dropped"] == 0
    told = [record["id"] for record in vehicle.records()]
    stored = [record["id"] for record in vehicle.stored("estimate", "rejection")]
    assert stored[: len(told)] == told
    assert len(set(stored)) == len(stored)
    return seconds


def test_a_full_disk_is_bridged_from_memory(small_disk: Vehicle, recovered: Recovered) -> None:
    small_disk.run(f"dd if=/dev/zero of={STATE}/filler bs=4k 2>/dev/null || true")
    degraded(small_disk)
    small_disk.run(f"rm {STATE}/filler")
    recovered(on_disk_again(small_disk))


def test_a_read_only_disk_is_bridged_from_memory(small_disk: Vehicle, recovered: Recovered) -> None:
    small_disk.run(f"systemctl stop springscale; rm -f {STATE}/springscale.db-wal {STATE}/springscale.db-shm")
    # The file system read-only, its mount not: as after an error on the disk. A read-only mount flag would stay in the
    # service's own copy of the mounts.
    small_disk.run(f"mount -o remount,ro {STATE} && mount -o remount,bind,rw {STATE}")
    small_disk.run("systemctl start springscale", timeout_s=120.0)
    small_disk.wait_until(lambda status: status["store"]["state"] == "degraded" and status["store"]["n_held"] > 1)
    small_disk.run(f"mount -o remount,rw {STATE}")
    recovered(on_disk_again(small_disk))


def test_a_damaged_database_is_replaced(small_disk: Vehicle, recovered: Recovered) -> None:
    small_disk.run(
        f"systemctl stop springscale; dd if=/dev/urandom of={STATE}/springscale.db bs=4k count=4 conv=notrunc"
    )
    small_disk.run("systemctl start springscale", timeout_s=120.0)
    recovered(small_disk.wait_until(lambda status: status["store"]["n_written"] > 0))
    store = small_disk.status()["store"]
    assert store["state"] == "ok"
    assert store["set_aside"].startswith("springscale.db.damaged-")
    assert small_disk.machine.succeeds(f"test -e {STATE}/{store['set_aside']}")
    assert "is damaged" in small_disk.journal(100)
    time.sleep(3.0)
    assert small_disk.stored()
