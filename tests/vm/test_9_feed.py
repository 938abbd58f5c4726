"""The feed's unit as it is shipped, in its sandbox, beside the service: an inertial unit of files and a FIFO."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from vm.harness.vehicle import Vehicle

ROOT = Path(__file__).parents[2]
GUEST = Path(__file__).parent / "guest"
UNIT = "springscale-feed"
FOLDER = "/dev/shm/unit"  # which the sandbox leaves writable, as it leaves /sys


def n_samples(vehicle: Vehicle) -> int:
    """Vertical accelerations that the service took from the bus."""
    rows = vehicle.status()["decode"]
    return sum(row["n"] for row in rows if (row["signal"], row["reason"]) == ("vertical_acceleration", "ok"))


def start_sensor(vehicle: Vehicle) -> None:
    vehicle.run(f"systemd-run --quiet --collect --unit sensor python3 /root/fake_unit.py {FOLDER}")
    vehicle.wait_for(lambda: vehicle.machine.succeeds(f"test -p {FOLDER}/dev/iio:device0"))


@pytest.fixture
def feed(vehicle: Vehicle) -> Iterator[Vehicle]:
    machine = vehicle.machine
    machine.write("/root/fake_unit.py", (GUEST / "fake_unit.py").read_bytes())
    machine.write(f"/etc/systemd/system/{UNIT}.service", (ROOT / f"deploy/{UNIT}.service").read_bytes())
    machine.write(f"/etc/default/{UNIT}", f"FEED_OPTIONS=--sysfs {FOLDER}/sys --nodes {FOLDER}/dev --up z\n")
    start_sensor(vehicle)
    vehicle.run(f"systemctl daemon-reload && systemctl start {UNIT}", timeout_s=90.0)
    yield vehicle
    vehicle.run(f"systemctl stop {UNIT} sensor; rm -rf {FOLDER} /etc/systemd/system/{UNIT}.service /etc/default/{UNIT}")
    vehicle.run("systemctl daemon-reload", timeout_s=90.0)


def test_measurements_of_the_unit_reach_the_service_over_vcan0(feed: Vehicle) -> None:
    before = n_samples(feed)
    feed.wait_for(lambda: n_samples(feed) > before + 100)
    told = feed.run(f"journalctl --unit {UNIT} --no-pager --output cat")
    assert "should be up" not in told  # it carries gravity
    assert "Permission denied" not in told
    assert float(feed.run(f"systemctl show --property NRestarts --value {UNIT}")) == 0


def test_a_reconnected_unit_is_used_again(feed: Vehicle) -> None:
    feed.wait_for(lambda: n_samples(feed) > 0)
    feed.run("systemctl stop sensor")
    feed.wait_for(lambda: "the device is gone" in feed.run(f"journalctl --unit {UNIT} --no-pager --output cat"))
    start_sensor(feed)
    before = n_samples(feed)
    feed.wait_for(lambda: n_samples(feed) > before + 20)
