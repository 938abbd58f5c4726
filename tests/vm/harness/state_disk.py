"""The service's state on a disk of its own, whose writes are logged, so that a power cut can lose and tear them."""

import random
import subprocess
import time
from pathlib import Path
from typing import Final

from vm.harness.vehicle import STATE, Vehicle
from vm.harness.write_log import Damage, cut, entries_of, has_moments

SCRIPT: Final = Path(__file__).parents[1] / "guest/state_disk.sh"
UNIT: Final = """\
[Unit]
Before=springscale.service
[Service]
Type=oneshot
RemainAfterExit=yes
ExecStart=/bin/sh /usr/local/sbin/state_disk.sh {disk} {log}
ExecStop=/bin/sh -c 'umount {state}; dmsetup remove state'
[Install]
RequiredBy=springscale.service
"""
COMPLETE: Final = "lazy_itable_init=0,lazy_journal_init=0"  # nothing left to write in the background
LOGGED_S: Final = 30.0
MOST_DRAWS: Final = 100


class StateDisk:
    """Between :meth:`attach` and :meth:`detach` the service keeps its state there; power cuts and boots in between."""

    def __init__(self, vehicle: Vehicle) -> None:
        self._vehicle, self._machine = vehicle, vehicle.machine
        self._disk, self._log = self._machine.further_disks
        self._before = self._disk.with_suffix(".before")

    def attach(self) -> None:
        """Stop the service, give it the empty disk with its tokens, start it."""
        run = self._vehicle.run
        disk, log = self._machine.backend.further_disks
        self._machine.write("/usr/local/sbin/state_disk.sh", SCRIPT.read_bytes())
        self._machine.write("/etc/systemd/system/state-disk.service", UNIT.format(disk=disk, log=log, state=STATE))
        subprocess.run(["mke2fs", "-q", "-F", "-t", "ext4", "-E", COMPLETE, self._disk], check=True)
        self._keep_a_copy()
        run(f"systemctl stop springscale; cp -p {STATE}/tokens.json /root/")
        run(f"systemctl daemon-reload; systemctl enable --now state-disk; cp -p /root/tokens.json {STATE}/")
        run("sync; systemctl start springscale", timeout_s=90.0)

    def detach(self) -> None:
        """The service stopped and its state where it was before."""
        self._vehicle.run("systemctl stop springscale; systemctl disable --now state-disk; systemctl daemon-reload")

    def mark(self, name: str) -> None:
        """Write a mark into the log; returns once it stands there, and with it all that was stable before."""
        self._vehicle.run(f"dmsetup message state 0 mark {name}")
        begun_s = time.monotonic()
        while all(entry.mark != name for entry in entries_of(self._log)):
            if time.monotonic() - begun_s > LOGGED_S:
                raise TimeoutError(f"the mark {name} has not come into the log")
            time.sleep(0.05)

    def lose_writes(self, since: str, moments: random.Random) -> Damage:
        """While the power is off: set the disk back to a moment after a mark, unflushed writes lost or torn.

        Writes may also be kept, by chance all of them: then it is drawn again, so that each call does damage.
        """
        for _ in range(MOST_DRAWS):
            _copy(self._before, self._disk)
            if (damage := cut(self._disk, self._log, since, moments)).n_lost:
                return damage
        raise AssertionError(f"{MOST_DRAWS} draws lost nothing")

    def may_lose_writes(self, since: str) -> bool:
        """Whether, since a mark, anything was written that waited for its flush."""
        return has_moments(self._log, since)

    def begin_log_anew(self) -> None:
        """While the power is off: keep the disk as it is now, and forget what was logged."""
        self._keep_a_copy()
        size = self._log.stat().st_size
        with self._log.open("r+b") as log:
            log.truncate(0)
            log.truncate(size)

    def _keep_a_copy(self) -> None:
        _copy(self._disk, self._before)


def _copy(disk: Path, to: Path) -> None:
    subprocess.run(["cp", "--sparse=always", disk, to], check=True)
