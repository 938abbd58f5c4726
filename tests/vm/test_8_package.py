"""The package's own life: upgraded with everything kept, removed, purged without a trace."""

import subprocess
from collections.abc import Callable
from pathlib import Path

from vm.harness.vehicle import CONFIG, STATE, Vehicle


def newer(package: Path, folder: Path) -> Path:
    """The package under a higher version."""
    root, made = folder / "root", folder / "newer.deb"
    subprocess.run(["dpkg-deb", "-R", str(package), str(root)], check=True)
    control = root / "DEBIAN/control"
    control.write_text(control.read_text().replace("\nVersion: ", "\nVersion: 9999+", 1))
    subprocess.run(["dpkg-deb", "--root-owner-group", "-Znone", "-b", str(root), str(made)], check=True)
    return made


def test_upgrade_remove_and_purge(
    installed: Vehicle, package: Path, tmp_path: Path, recovered: Callable[[float], None]
) -> None:
    vehicle = installed  # as it is: after the purge there is nothing to restore, and the next test installs it again
    kept = f"sha256sum {CONFIG} /etc/springscale/vehicle.json {STATE}/tokens.json"
    before, sums, pid = vehicle.stored(), vehicle.run(kept), vehicle.pid()
    vehicle.machine.write("/root/newer.deb", newer(package, tmp_path).read_bytes())
    vehicle.run("dpkg --install --force-confold /root/newer.deb", timeout_s=300.0)
    recovered(vehicle.wait_until(lambda status: True))
    assert "9999+" in vehicle.run("dpkg-query --show springscale")
    assert vehicle.run(kept) == sums
    assert vehicle.pid() != pid
    assert vehicle.stored()[: len(before)] == before

    vehicle.run("dpkg --remove springscale", timeout_s=120.0)
    assert not vehicle.machine.succeeds("test -e /usr/lib/springscale || test -e /usr/bin/springscale")
    assert not vehicle.machine.succeeds("systemctl cat springscale")
    assert vehicle.run(kept) == sums
    assert vehicle.stored()[: len(before)] == before

    vehicle.run("dpkg --purge springscale", timeout_s=120.0)
    left = vehicle.run("find / -xdev -path /proc -prune -o -path /root -prune -o -name '*springscale*' -print").split()
    assert left == [], left
    assert "springscale" not in vehicle.run("systemctl list-unit-files --no-legend | grep -i springscale || true")
