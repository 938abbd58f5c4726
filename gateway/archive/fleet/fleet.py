"""A data set of estimates, vehicle by vehicle: loads, refusals, drift, faulty sensors.

    fleet = fleet_of(place_of("DATASET"))

Only one vehicle's batches are in memory at a time; a few numbers per week are kept of it.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from datetime import date

import numpy as np

from gateway.archive.fleet.batches import Batches, by_vehicle, read_batches
from gateway.archive.fleet.drift import Drift, Series, drifts_of, series_of
from gateway.archive.fleet.faulty_sensors import Health, Trouble, troubles_of
from gateway.archive.fleet.weeks import DAY_NS, Weeks, date_of, weeks_of
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
    weeks: Weeks
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
    """A failed log, or with ``log`` None a failed job, and the reason."""

    vehicle: str
    month: str
    log: str | None
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
    jobs = list(by_vehicle(slots_done(dataset)))
    if not jobs:
        raise ConfigurationError(
            f"{dataset}: holds no receipt of `springscale reprocess`: name the folder that was its --output"
        )
    found: list[FleetVehicle] = []
    series: dict[str, Series] = {}
    for done, (name, slots) in enumerate(jobs):
        on_vehicle(done, len(jobs))
        batches = read_batches(dataset, slots)
        if len(batches):
            vehicle, series[name] = _vehicle(name, batches)
            found.append(vehicle)
    on_vehicle(len(jobs), len(jobs))
    if not found:
        raise ConfigurationError(f"{dataset}: its tables hold no batch at all: were the drives long enough for one?")
    drifts = drifts_of(series)
    failed = tuple(
        Failure(str(one.get("vehicle")), str(one.get("month")), one.get("log"), str(one.get("reason")))
        for one in failures(dataset)
    )
    vehicles = tuple(replace(one, drifts=drifts[one.name]) for one in found)
    named = {name for name, _ in jobs} | {failure.vehicle for failure in failed}
    return FleetSummary(vehicles, tuple(sorted(named - series.keys())), failed)


def _vehicle(name: str, batches: Batches) -> tuple[FleetVehicle, Series]:
    """The summary of a vehicle with its drifts still to be judged, and the series for that."""
    answered, ids = batches.is_answered, batches.calibration_id
    since = weeks_of(
        batches.rows(np.array([one == ids[-1] for one in ids]))
    )  # parameters are relative to a calibration
    first, last = (date_of(t // DAY_NS) for t in batches.t_end_ns[[0, -1]])
    vehicle = FleetVehicle(
        name,
        len(batches),
        int(answered.sum()),
        int((batches.is_over_limit & answered).sum()),
        first,
        last,
        weeks_of(batches),
        {reason: int(refused.sum()) for reason, refused in batches.rejected.items()},
        troubles_of(batches),
        tuple(dict.fromkeys(one for one in ids if one)),
        int(since.number[0]),
        {},
    )
    return vehicle, series_of(since)
