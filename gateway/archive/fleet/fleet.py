"""A data set of estimates, vehicle by vehicle: loads, refusals, drift, faulty sensors.

    fleet = fleet_of(place_of("DATASET"))

Only one vehicle's batches are in memory at a time; a few numbers per week are kept of it.
"""

from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from datetime import date
from itertools import groupby

import polars as pl

from gateway.archive.fleet.batches import DRIFTING, read_batches
from gateway.archive.fleet.drift import Drift, drifts_of, medians_of
from gateway.archive.fleet.faulty_sensors import Health, Trouble, date_of, troubles_of
from gateway.archive.fleet.weeks import weeks_of
from gateway.archive.places import Location
from gateway.archive.receipts import failures, slots_done
from gateway.errors import ConfigurationError

OnVehicle = Callable[[int, int], None]  # (vehicles done, vehicles in all)


@dataclass(frozen=True, slots=True, eq=False)
class FleetVehicle:
    """One vehicle of a data set. ``n_refused`` counts a batch for each of its reasons.

    ``drifts`` are of the weeks from number ``calibrated_week`` on, the first of its last calibration.
    """

    name: str
    n: int
    n_answered: int
    n_over_limit: int
    first: date
    last: date
    weeks: pl.DataFrame
    n_refused: Mapping[str, int]
    troubles: tuple[Trouble, ...]
    calibrations: tuple[str, ...]
    calibrated_week: int
    drifts: Mapping[str, Drift]

    @property
    def bad_sensors(self) -> tuple[Trouble, ...]:
        return tuple(trouble for trouble in self.troubles if trouble.health is Health.BAD)

    @property
    def believed_drifts(self) -> dict[str, Drift]:
        return {name: drift for name, drift in self.drifts.items() if drift.is_believed}


@dataclass(frozen=True, slots=True)
class Failure:
    """A log that could not be read, and the reason."""

    vehicle: str
    month: str
    log: str
    reason: str


@dataclass(frozen=True, slots=True, eq=False)
class FleetSummary:
    """Every vehicle of a data set, by name; vehicles without any batch; and the failures."""

    vehicles: tuple[FleetVehicle, ...]
    without_batches: tuple[str, ...]
    failures: tuple[Failure, ...]

    @property
    def n(self) -> int:
        return sum(vehicle.n for vehicle in self.vehicles)

    @property
    def n_answered(self) -> int:
        return sum(vehicle.n_answered for vehicle in self.vehicles)

    @property
    def first(self) -> date:
        return min(vehicle.first for vehicle in self.vehicles)

    @property
    def last(self) -> date:
        return max(vehicle.last for vehicle in self.vehicles)


def fleet_of(dataset: Location, on_vehicle: OnVehicle = lambda done, of: None) -> FleetSummary:
    """The analysis of everything that a data set's receipts cover.

    Raises ConfigurationError if there is nothing, or it is invalid; PlaceError if it cannot be read.
    """
    jobs = [(vehicle, list(slots)) for vehicle, slots in groupby(slots_done(dataset), lambda slot: slot.vehicle)]
    if not jobs:
        raise ConfigurationError(
            f"{dataset}: holds no receipt of `springscale reprocess`: name the folder that was its --output"
        )
    found: list[FleetVehicle] = []
    medians: list[pl.DataFrame] = []
    for done, (name, slots) in enumerate(jobs):
        on_vehicle(done, len(jobs))
        batches = read_batches(dataset, slots)
        if len(batches):
            last = batches["calibration_id"][-1]  # parameters are relative to it
            since = batches.filter(pl.col("calibration_id").eq_missing(last))
            found.append(_vehicle(name, batches, since))
            medians.append(medians_of(since).with_columns(vehicle=pl.lit(name)))
    on_vehicle(len(jobs), len(jobs))
    if not found:
        raise ConfigurationError(f"{dataset}: its tables hold no batch at all: were the drives long enough for one?")
    drifts = drifts_of(pl.concat(medians))
    failed = tuple(Failure(one["vehicle"], one["month"], one["log"], one["reason"]) for one in failures(dataset))
    vehicles = tuple(
        replace(one, drifts={name: drifts[one.name, name] for name in DRIFTING if (one.name, name) in drifts})
        for one in found
    )
    return FleetSummary(vehicles, tuple(sorted({name for name, _ in jobs} - {one.name for one in found})), failed)


def _vehicle(name: str, batches: pl.DataFrame, since: pl.DataFrame) -> FleetVehicle:
    """The summary of a vehicle, its drifts still to be judged; ``since`` are its batches since it was calibrated."""
    weeks = weeks_of(batches)
    return FleetVehicle(
        name,
        len(batches),
        int(weeks["n_answered"].sum()),
        int(weeks["n_over_limit"].sum()),
        date_of(batches["day"][0]),
        date_of(batches["day"][-1]),
        weeks,
        Counter(batches["rejected"].explode().drop_nulls()),
        troubles_of(batches),
        tuple(batches["calibration_id"].drop_nulls().unique(maintain_order=True)),
        since["week"][0],
        {},
    )
