"""A fleet's back-end without containers: what lies in deploy/fleet, on Debian's own mosquitto and PostgreSQL."""

import contextlib
import csv
import json
import os
import re
import signal
import subprocess
import sys
import time
import urllib.error
import urllib.request
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from support.broker import MOSQUITTO
from support.commands import ended
from support.patience import PATIENCE_S, wait_until
from support.ports import free_port
from support.postgres import Postgres, running_postgres
from support.simulated_vehicles import SimulatedVehicles, VehicleProcesses

FLEET = Path(__file__).parents[2] / "deploy/fleet"
MISSING = re.search(r"```sql\n(.*?);\n```", (FLEET.parents[1] / "docs/fleet.md").read_text(), re.DOTALL)[1]
SAVES_EVERY_S = 1  # mosquitto.conf's 30 would make the test as long


def provisioned(folder: Path, names: list[str], broker: str) -> Path:
    """deploy/fleet/provision.py's output for vehicles of these names."""
    subprocess.run([FLEET / "make_certificates.sh", "127.0.0.1", folder], check=True, capture_output=True)
    write_table(folder / "fleet.csv", names)
    (folder / "settings.toml").write_text('signals = "springscale:reference"\n[web]\nport = 0\n')
    provision(folder, broker)
    return folder / "out"


def write_table(path: Path, names: list[str]) -> None:
    with path.open("w", newline="") as file:
        lines = csv.writer(file)
        lines.writerow(["id", "vin", "gross_limit_kg"])
        lines.writerows([name, f"WVWZZZ1KZAW{n:06}", "2000"] for n, name in enumerate(names))


def provision(folder: Path, broker: str) -> "subprocess.CompletedProcess[str]":
    asked = f"fleet.csv --settings settings.toml --broker {broker} --ca ca.pem --output out"
    return ended(sys.executable, FLEET / "provision.py", *asked.split(), cwd=folder)


class FleetBroker:
    """mosquitto with the shipped configuration and access list, its paths in a folder of the test's own."""

    def __init__(self, folder: Path, port: int) -> None:
        self.port = port
        self._folder = folder
        self._process: subprocess.Popen[bytes] | None = None
        text = (FLEET / "mosquitto/mosquitto.conf").read_text()
        for shipped, here in {
            "listener 8883": f"listener {port} 127.0.0.1",
            "/mosquitto/pki": str(folder),
            "/mosquitto/fleet/passwords": f"{folder}/out/passwords",
            "/mosquitto/config": str(FLEET / "mosquitto"),
            "/mosquitto/data": str(folder),
            "autosave_interval 30": f"autosave_interval {SAVES_EVERY_S}",
        }.items():
            assert shipped in text
            text = text.replace(shipped, here)
        (folder / "mosquitto.conf").write_text(f"{text}user root\n")

    def start(self) -> None:
        assert MOSQUITTO is not None
        log = (self._folder / "mosquitto.log").open("ab")
        with log:
            self._process = subprocess.Popen([MOSQUITTO, "-c", self._folder / "mosquitto.conf"], stderr=log)

    def reload(self) -> None:
        """Read passwords and access list anew."""
        self._process.send_signal(signal.SIGHUP)

    def kill(self) -> None:
        """Kills the process as the kernel does when memory is short: it saves nothing any more."""
        if self._process is not None:
            self._process.kill()
            self._process.wait(PATIENCE_S)
            self._process = None

    def forget(self) -> None:
        """Deletes the files, as a new disk does."""
        (self._folder / "mosquitto.db").unlink(missing_ok=True)


class Subscriber:
    """gateway.fleet.subscriber as a process."""

    def __init__(self, folder: Path, port: int, database: Postgres) -> None:
        self._log = folder / "subscriber.log"
        page_port = free_port()
        self.page = f"http://127.0.0.1:{page_port}"
        self._environment = {
            **os.environ,
            **database.environment,
            "FLEET_DATABASE": "postgresql://",
            "FLEET_PORT": str(page_port),
            "MQTT_HOST": "127.0.0.1",
            "MQTT_PORT": str(port),
            "MQTT_CA": str(folder / "ca.pem"),
            "MQTT_PASSWORD_FILE": str(folder / "out/subscriber/broker-password"),
        }
        self._process: subprocess.Popen[bytes] | None = None

    def start(self, **other: str) -> None:
        """Starts the view, with ``other`` settings than PostgreSQL's if some are given."""
        with self._log.open("ab") as log:
            self._process = subprocess.Popen(
                [sys.executable, "-m", "gateway.fleet.subscriber"], stderr=log, env={**self._environment, **other}
            )

    def lines(self) -> dict[str, dict[str, Any]]:
        """The fleet as its page has it; empty while it does not answer."""
        told = self.told()
        return {line["vehicle_id"]: line for line in told["items"]} if told else {}

    def told(self) -> dict[str, Any] | None:
        """The answer of the page's API; None while there is none."""
        try:
            with urllib.request.urlopen(f"{self.page}/api/v1/fleet") as answer:
                return json.load(answer)
        except urllib.error.URLError:
            return None

    def kill(self) -> None:
        if self._process is not None:
            self._process.kill()
            self._process.wait(PATIENCE_S)
            self._process = None

    def stop(self) -> None:
        """Stops the process as systemd does, and waits for its end."""
        self._process.terminate()
        assert self._process.wait(PATIENCE_S) == 0
        self._process = None

    @property
    def said(self) -> str:
        return self._log.read_text() if self._log.exists() else ""


class FleetView:
    """Broker, database and subscriber, each of which can be killed and started again, and vehicles.

    The vehicles are in this process, where ``n_processes`` is 0.
    """

    def __init__(self, folder: Path, database: Postgres, n_vehicles: int, n_processes: int) -> None:
        self.folder = folder
        self.database = database
        names = [f"van-{n:02}" for n in range(n_vehicles)]
        port = free_port()
        self.output = provisioned(folder, names, f"127.0.0.1:{port}")
        self.broker = FleetBroker(folder, port)
        self.subscriber = Subscriber(folder, port, database)
        self.broker.start()
        self.subscriber.start()
        assert wait_until(lambda: '"connected"' in self.subscriber.said), self.subscriber.said
        assert wait_until(lambda: self.subscriber.told() is not None), self.subscriber.said
        time.sleep(2.0 * SAVES_EVERY_S)  # the broker has saved that somebody wants to hear
        folders = [self.output / "vehicles" / name for name in names]
        self.vehicles = VehicleProcesses(folders, n_processes) if n_processes else SimulatedVehicles(folders)

    def count(self, table: str) -> int:
        with self.database.connect() as connection:
            row = connection.execute(f"SELECT count(*) FROM {table}").fetchone()  # type: ignore[arg-type]  # a test's
        return int(str(row[0]))

    @property
    def n_estimates(self) -> int:
        return sum(vehicle.n_estimates for vehicle in self.vehicles.state())

    def has_all(self) -> bool:
        """Every estimate and entry, the latter in their last revision."""
        told = self.vehicles.state()
        n_entries = sum(vehicle.n_entries for vehicle in told)
        return (
            self.count("estimate") >= sum(vehicle.n_estimates for vehicle in told)
            and self.count("entry WHERE kind <> 'event' OR revision = 2") >= n_entries
        )

    def compare(self) -> None:
        """Checks that nothing was lost, doubled, or filed under another vehicle's name."""
        for vehicle, kept in zip(self.vehicles.state(), self.vehicles.kept(), strict=True):
            assert len(kept.estimates) == vehicle.n_estimates
            assert len(kept.entries) == vehicle.n_entries
            with self.database.connect() as connection:
                rows = connection.execute(
                    "SELECT id, record::json->>'vehicle_id' FROM estimate WHERE vehicle_id = %s ORDER BY number",
                    [vehicle.id],
                ).fetchall()
                told = connection.execute(
                    "SELECT id, revision FROM entry WHERE vehicle_id = %s ORDER BY id", [vehicle.id]
                ).fetchall()
            assert rows == [(name, vehicle.id) for name in kept.estimates]
            assert told == sorted(kept.entries)
        assert (self.count(f"({MISSING}) AS missing"), self.count("unreadable")) == (0, 0)

    def close(self) -> None:
        self.vehicles.stop()
        self.subscriber.kill()
        self.broker.kill()


@contextlib.contextmanager
def fleet_view(folder: Path, n_vehicles: int, n_processes: int = 0) -> Iterator[FleetView]:
    with running_postgres() as database:
        view = FleetView(folder, database, n_vehicles, n_processes)
        try:
            view.vehicles.start()
            yield view
        finally:
            view.close()
