"""Power cuts: the machine's plug is pulled while records are being committed."""

import os
import random
import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

import pytest
from vm.harness.drives import loaded_drive, log_of
from vm.harness.state_disk import StateDisk
from vm.harness.vehicle import SETTINGS, Vehicle

N_CUTS = int(os.environ.get("SPRINGSCALE_POWER_CUTS", "3"))


@pytest.fixture
def state_disk(vehicle: Vehicle) -> Iterator[StateDisk]:
    """The service with its state on a disk of its own, each drive of a second a record."""
    vehicle.configure(SETTINGS.replace("silence_s = 3.0", "silence_s = 0.5"))
    disk = StateDisk(vehicle)
    disk.attach()
    yield disk
    vehicle.stop_playing()
    disk.detach()


def committed(vehicle: Vehicle) -> list[str]:
    """Identifiers in the database, none of which may come twice."""
    found = [record["id"] for record in vehicle.stored()]
    assert len(found) == len(set(found))
    return found


def has_committed_more(vehicle: Vehicle, n: int) -> bool:
    return len(committed(vehicle)) > n


def test_no_power_cut_loses_or_doubles_a_committed_record(
    vehicle: Vehicle,
    state_disk: StateDisk,
    tmp_path: Path,
    recovered: Callable[[float], None],
    measured: Callable[..., None],
) -> None:
    """At every second cut the disk also loses or tears what no flush had made it keep."""
    moments, slowest_s, started_s, n_lost = random.Random(6), 0.0, 0.0, 0
    pulse = vehicle.put_log(log_of(loaded_drive(1.0, 4), tmp_path / "pulse.log"))
    vehicle.run("sync")
    kept: list[str] = []
    for i in range(N_CUTS):
        vehicle.play_pulses(pulse, pause_s=0.8)
        n_before = len(committed(vehicle))
        vehicle.wait_for(partial(has_committed_more, vehicle, n_before + 1))
        before = committed(vehicle)
        state_disk.mark("committed")
        time.sleep(moments.uniform(2.0, 4.0))
        vehicle.wait_for(partial(state_disk.may_lose_writes, "committed"))
        state_disk.mark("cut")
        vehicle.machine.cut_power()
        if i % 2 == 0:
            n_lost += state_disk.lose_writes("committed", moments).n_lost
        state_disk.begin_log_anew()
        begun_s = time.monotonic()
        vehicle.machine.boot()
        vehicle.wait_until(lambda status: True)
        slowest_s, started_s = max(slowest_s, time.monotonic() - begun_s), vehicle.machine.boot_s
        kept = committed(vehicle)
        assert kept[: len(before)] == before
        assert vehicle.status()["store"]["set_aside"] is None
    recovered(slowest_s)
    measured(boot_after_power_cut_s=round(started_s, 1))
    measured(power_cuts=N_CUTS, sectors_lost_at_power_cuts=n_lost, records_after_power_cuts=len(kept))
    assert n_lost > 0
