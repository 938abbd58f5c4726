"""A fleet's back-end without containers: what lies in deploy/fleet, on Debian's own mosquitto and PostgreSQL."""

import contextlib
import csv
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

from gateway.config import load_settings
from gateway.core.alarms.alarm import Alarm, AlarmKind, AlarmState, Cause, Figure, Step, alarm_to_json
from gateway.core.events import EntryKind
from gateway.core.events.entry import entry_id
from gateway.estimate import Estimate, Weight, Weights
from gateway.estimate_json import estimate_to_json
from gateway.records import iso_utc, json_line
from gateway.store import Store
from gateway.units import NS_PER_S
from gateway.uplink import Outbox, Uplink, uplink_settings
from gateway.uplink.back_off import BackOff
from support.broker import MOSQUITTO
from support.estimates import WINDOW_NS, make_estimate
from support.patience import PATIENCE_S, wait_until
from support.ports import free_port
from support.postgres import Postgres, running_postgres

FLEET = Path(__file__).parents[2] / "deploy/fleet"
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
    return subprocess.run(
        [sys.executable, FLEET / "provision.py", *asked.split()],
        cwd=folder,
        capture_output=True,
        text=True,
        check=True,
    )


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
        assert self._process is not None
        self._process.send_signal(signal.SIGHUP)

    def kill(self) -> None:
        """As the kernel does when memory is short: nothing is saved any more."""
        if self._process is not None:
            self._process.kill()
            self._process.wait(PATIENCE_S)
            self._process = None

    def forget(self) -> None:
        """As after a new disk."""
        (self._folder / "mosquitto.db").unlink(missing_ok=True)


class Subscriber:
    """deploy/fleet/subscriber/subscriber.py as a process."""

    def __init__(self, folder: Path, port: int, database: Postgres) -> None:
        self._log = folder / "subscriber.log"
        self._environment = {
            **os.environ,
            **database.environment,
            "MQTT_HOST": "127.0.0.1",
            "MQTT_PORT": str(port),
            "MQTT_CA": str(folder / "ca.pem"),
            "MQTT_PASSWORD_FILE": str(folder / "out/subscriber/broker-password"),
        }
        self._process: subprocess.Popen[bytes] | None = None

    def start(self) -> None:
        with self._log.open("ab") as log:
            self._process = subprocess.Popen(
                [sys.executable, FLEET / "subscriber/subscriber.py"], stderr=log, env=self._environment
            )

    def kill(self) -> None:
        if self._process is not None:
            self._process.kill()
            self._process.wait(PATIENCE_S)
            self._process = None

    def stop(self) -> None:
        """As systemd does; returns when it has gone."""
        assert self._process is not None
        self._process.terminate()
        assert self._process.wait(PATIENCE_S) == 0
        self._process = None

    @property
    def said(self) -> str:
        return self._log.read_text() if self._log.exists() else ""


class SimulatedVehicle:
    """The product's own store, outbox and uplink, from the settings that provision.py wrote; no bus and no pipeline."""

    def __init__(self, folder: Path) -> None:
        settings = load_settings(folder / "springscale.toml")
        self.id = settings.vehicle.id
        self.store = Store.open(folder / "state")
        self.n_estimates = self.n_entries = 0
        self._begun_ns = time.time_ns() // NS_PER_S * NS_PER_S - 86_400 * NS_PER_S
        wanted = uplink_settings(settings.uplink, settings.vehicle)
        assert wanted is not None
        outbox = Outbox(self.store.reader(), self.store, "fleet", repeat_s=wanted.repeat_s)
        birth = {"vehicle_id": self.id, "vin": settings.vehicle.vin, "version": "test", "calibration_id": "sha256:ab"}
        self.uplink = Uplink(wanted, outbox, birth, back_off=BackOff(0.05, 0.5))

    def drive(self, n: int) -> None:
        """``n`` more batches; with every tenth a load event, told again in a second revision, a trip and an alarm."""
        for _ in range(n):
            found = self._batch(self.n_estimates)
            self.store.write_estimate(estimate_to_json(found))
            if self.n_estimates % 10 == 0:
                for entry in _entries(found):
                    self.store.write_entry(entry["id"].partition("-")[0], entry["id"], found.t_end_ns, json_line(entry))
                self.n_entries += 3
            self.n_estimates += 1

    def _batch(self, n: int) -> Estimate:
        """The n-th since yesterday."""
        t_start_ns = self._begun_ns + n * WINDOW_NS
        found = replace(make_estimate(n), t_start_ns=t_start_ns, t_end_ns=t_start_ns + WINDOW_NS, vehicle_id=self.id)
        gross_kg = 1400.0 + found.payload.number
        axle = Weight(0.5 * gross_kg, 6.0, None, None)
        weights = Weights(gross=Weight(gross_kg, 8.0, 2000.0, None), front_axle=axle, rear_axle=axle)
        return replace(found, weights=weights)

    def stop(self) -> None:
        self.uplink.stop(PATIENCE_S)
        self.store.close()


def _entries(found: Estimate) -> Iterator[dict[str, Any]]:
    """A load event in two revisions, a trip, and an alarm."""
    t_start, t_end = iso_utc(found.t_start_ns), iso_utc(found.t_end_ns)
    shared = {"vehicle_id": found.vehicle_id, "t_start": t_start, "t_end": t_end}
    for revision in (1, 2):
        change = {"change_kg": 120.0 + revision, "change_std_kg": 8.0, "probability": 0.99, "is_withdrawn": False}
        yield {
            "id": entry_id(EntryKind.EVENT, found.vehicle_id, found.t_end_ns),
            "revision": revision,
            **shared,
            **change,
        }
    way = {"distance_m": 12_000.0, "carried_tkm": 2.4, "empty_share": 0.5, "overloaded_share": 0.0}
    yield {"id": entry_id(EntryKind.TRIP, found.vehicle_id, found.t_end_ns), "revision": 1, **shared, **way}
    step = Step(AlarmState.FINAL, found.t_end_ns, Figure(2050.0, 8.0, 2000.0, "kg", 0.99))
    yield alarm_to_json(Alarm.begun(Cause(AlarmKind.OVERLOAD, "gross"), found.vehicle_id, step), "50 kg too much")


class FleetView:
    """Broker, database, subscriber and vehicles, each of which can be killed and started again."""

    def __init__(self, folder: Path, database: Postgres, n_vehicles: int) -> None:
        self.folder = folder
        self.database = database
        names = [f"van-{n:02}" for n in range(n_vehicles)]
        port = free_port()
        self.output = provisioned(folder, names, f"127.0.0.1:{port}")
        self.broker = FleetBroker(folder, port)
        self.subscriber = Subscriber(folder, port, database)
        with database.connect() as connection:
            connection.execute((FLEET / "database/schema.sql").read_text())
        self.broker.start()
        self.subscriber.start()
        assert wait_until(lambda: '"connected"' in self.subscriber.said), self.subscriber.said
        time.sleep(2.0 * SAVES_EVERY_S)  # the broker has saved that somebody wants to hear
        self.vehicles = [SimulatedVehicle(self.output / "vehicles" / name) for name in names]

    def count(self, table: str) -> int:
        with self.database.connect() as connection:
            row = connection.execute(f"SELECT count(*) FROM {table}").fetchone()  # type: ignore[arg-type]  # a test's
        assert row is not None
        return int(str(row[0]))

    @property
    def n_estimates(self) -> int:
        return sum(vehicle.n_estimates for vehicle in self.vehicles)

    def has_all(self) -> bool:
        """Every estimate and entry, the latter in their last revision."""
        n_entries = sum(vehicle.n_entries for vehicle in self.vehicles)
        return (
            self.count("estimate") >= self.n_estimates
            and self.count("entry WHERE kind <> 'event' OR revision = 2") >= n_entries
        )

    def compare(self) -> None:
        """Nothing lost, nothing doubled, nothing of one vehicle under the name of another."""
        for vehicle in self.vehicles:
            ids = [json.loads(text)["id"] for text in vehicle.store.reader().estimates(limit=10_000).items]
            entries = [json.loads(text) for text in vehicle.store.reader().entries(limit=10_000).items]
            assert len(ids) == vehicle.n_estimates
            assert len(entries) == vehicle.n_entries
            with self.database.connect() as connection:
                rows = connection.execute(
                    "SELECT id, record->>'vehicle_id' FROM estimate WHERE vehicle_id = %s ORDER BY number", [vehicle.id]
                ).fetchall()
                told = connection.execute(
                    "SELECT id, revision FROM entry WHERE vehicle_id = %s ORDER BY id", [vehicle.id]
                ).fetchall()
            assert rows == [(name, vehicle.id) for name in ids]
            assert told == sorted((one["id"], one["revision"]) for one in entries)
        assert (self.count("missing"), self.count("unreadable")) == (0, 0)

    def close(self) -> None:
        for vehicle in self.vehicles:
            vehicle.stop()
        self.subscriber.kill()
        self.broker.kill()


@contextlib.contextmanager
def fleet_view(folder: Path, n_vehicles: int) -> Iterator[FleetView]:
    with running_postgres() as database:
        view = FleetView(folder, database, n_vehicles)
        try:
            for vehicle in view.vehicles:
                vehicle.uplink.start()
            yield view
        finally:
            view.close()
