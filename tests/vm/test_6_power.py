"""Power cuts: the machine's plug is pulled while records are being committed."""

import os
import random
import time
from collections.abc import Callable
from pathlib import Path

from vm.harness.drives import loaded_drive, log_of
from vm.harness.vehicle import SETTINGS, Vehicle

N_CUTS = int(os.environ.get("SPRINGSCALE_POWER_CUTS", "3"))


def test_no_power_cut_loses_or_doubles_a_committed_record(
    vehicle: Vehicle, tmp_path: Path, recovered: Callable[[float], None], measured: Callable[..., None]
) -> None:
    moments, slowest_s, started = random.Random(6), 0.0, 0.0
    vehicle.configure(SETTINGS.replace("silence_s = 3.0", "silence_s = 0.5"))
    pulse = vehicle.put_log(log_of(loaded_drive(1.0, 4), tmp_path / "pulse.log"))
    vehicle.run("sync")
    vehicle.restart()
    for _ in range(N_CUTS):
        vehicle.play_pulses(pulse, pause_s=0.8)
        n_before = len(vehicle.stored())
        vehicle.wait_for(lambda n=n_before: len(vehicle.stored()) > n + 1)  # type: ignore[misc]
        time.sleep(moments.uniform(0.0, 2.0))
        committed = [record["id"] for record in vehicle.stored()]
        vehicle.machine.cut_power()
        begun_s = time.monotonic()
        vehicle.machine.boot()
        vehicle.wait_until(lambda status: True)
        slowest_s, started = max(slowest_s, time.monotonic() - begun_s), vehicle.machine.boot_s
        kept = [record["id"] for record in vehicle.stored()]
        assert kept[: len(committed)] == committed
        assert len(set(kept)) == len(kept)
    recovered(slowest_s)
    measured(boot_after_power_cut_s=round(started, 1))
