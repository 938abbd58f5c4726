"""Vehicles that write batches and forward them; in this process or, where there are many, in some of their own."""

import json
import time
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from multiprocessing import get_context
from pathlib import Path
from typing import Any

from gateway.config import load_settings
from gateway.core.alarms.alarm import Alarm, AlarmCause, AlarmFigure, AlarmKind, alarm_to_json
from gateway.core.events.entry import EntryKind, entry_id
from gateway.estimates.as_json import estimate_to_json
from gateway.estimates.batch_estimate import Estimate, Weight, Weights
from gateway.part import BackOff
from gateway.records import iso_utc, json_line
from gateway.store import Store
from gateway.units import NS_PER_S
from gateway.uplink.outbox import Outbox
from gateway.uplink.settings import uplink_settings
from gateway.uplink.uplink import Uplink
from support.estimates import WINDOW_NS, make_estimate
from support.patience import PATIENCE_S


@dataclass(frozen=True, slots=True)
class Told:
    """The number of records that a vehicle has written, and the state of its uplink."""

    id: str
    n_estimates: int
    n_entries: int
    n_delivered: int
    n_connections: int


@dataclass(frozen=True, slots=True)
class Kept:
    """The content of a vehicle's store: estimates by their ids, oldest first; entries by id and revision."""

    estimates: list[str]
    entries: list[tuple[str, int]]


class SimulatedVehicle:
    """The product's own store, outbox and uplink, from the settings that provision.py wrote; no bus and no pipeline."""

    def __init__(self, folder: Path) -> None:
        settings = load_settings(folder / "springscale.toml")
        self.id = settings.vehicle.id
        self.store = Store.open(folder / "state")
        self.n_estimates = self.n_entries = 0
        self._begun_ns = time.time_ns() // NS_PER_S * NS_PER_S - 86_400 * NS_PER_S
        wanted = uplink_settings(settings.uplink, settings.vehicle)
        outbox = Outbox(self.store, "fleet", repeat_s=wanted.repeat_s)
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

    def state(self) -> "Told":
        done = self.uplink.report()
        return Told(self.id, self.n_estimates, self.n_entries, done.n_delivered, done.n_connections)

    def kept(self) -> "Kept":
        estimates = (json.loads(text)["id"] for text in self.store.reader().estimates(limit=10_000).items)
        entries = map(json.loads, self.store.reader().entries(limit=10_000).items)
        return Kept(list(estimates), [(entry["id"], entry["revision"]) for entry in entries])

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
    figure = AlarmFigure(2050.0, 8.0, 2000.0, 0.99)
    yield alarm_to_json(Alarm(AlarmCause(AlarmKind.OVERLOAD, "gross"), found.vehicle_id, found.t_end_ns, figure))


class SimulatedVehicles(list[SimulatedVehicle]):
    """Vehicles in this process."""

    def __init__(self, folders: Iterable[Path] = ()) -> None:
        super().__init__(map(SimulatedVehicle, folders))

    def start(self) -> None:
        for vehicle in self:
            vehicle.uplink.start()

    def drive(self, n: int) -> None:
        for vehicle in self:
            vehicle.drive(n)

    def state(self) -> list[Told]:
        return [vehicle.state() for vehicle in self]

    def kept(self) -> list[Kept]:
        return [vehicle.kept() for vehicle in self]

    def stop(self) -> None:
        for vehicle in self:
            vehicle.stop()


class VehicleProcesses:
    """Vehicles in ``n`` processes: in one process, hundreds would wait for each other's turn at Python."""

    def __init__(self, folders: Sequence[Path], n: int) -> None:
        spawn = get_context("spawn")
        self._processes = [ProcessPoolExecutor(1, spawn, _take, (folders[i::n],)) for i in range(n)]

    def start(self) -> None:
        self._ask("start")

    def drive(self, n: int) -> None:
        """All processes at once."""
        self._ask("drive", n)

    def state(self) -> list[Told]:
        return [one for each in self._ask("state") for one in each]

    def kept(self) -> list[Kept]:
        return [one for each in self._ask("kept") for one in each]

    def stop(self) -> None:
        self._ask("stop")
        for process in self._processes:
            process.shutdown()

    def _ask(self, name: str, *arguments: int) -> list[Any]:
        asked = [process.submit(_do, name, *arguments) for process in self._processes]
        return [answer.result() for answer in asked]


_HERE = SimulatedVehicles()  # those of a process that VehicleProcesses started


def _take(folders: Sequence[Path]) -> None:
    _HERE.extend(SimulatedVehicles(folders))


def _do(name: str, *arguments: int) -> Any:
    return getattr(_HERE, name)(*arguments)
