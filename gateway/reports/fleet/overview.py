"""The overview page of the fleet: what needs attention, a row per vehicle, and the fleet by week."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import timedelta
from typing import Final

import polars as pl

from gateway.archive.fleet.batches import OF_VEHICLE
from gateway.archive.fleet.drift import FALSE_SHARE, Drift
from gateway.archive.fleet.fleet import FleetSummary, FleetVehicle
from gateway.reports.charts import ChartLink, Section, Table
from gateway.reports.fleet.text import (
    NAMES,
    day,
    drift_told,
    kg,
    over_limit,
    page_of,
    percent,
    reason_told,
    trouble_told,
    whole,
)
from gateway.reports.fleet.vehicle_page import refusals_section
from gateway.words import NONE

SILENT_DAYS: Final = 28  # chosen: without a batch, before the last of the fleet's
LITTLE_ANSWERED: Final = 0.5  # chosen: of a vehicle's batches
MOST_FAILURES: Final = 200  # in the table; all are in report.json


@dataclass(frozen=True, slots=True)
class Look:
    """A finding about one vehicle that a person should check."""

    vehicle: str
    what: str
    told: str
    advice: str
    has_page: bool = True


def looks_of(fleet: FleetSummary) -> list[Look]:
    """The findings in order of urgency: overloads, bad sensors, drift, no data, few estimates, failed logs."""
    drifts = [_drifting(one, name, drift) for one in fleet.vehicles for name, drift in one.believed_drifts.items()]
    silent_since = fleet.last - timedelta(days=SILENT_DAYS)
    n_failed = sorted(Counter(failure.vehicle for failure in fleet.failures).items())
    with_page = {vehicle.name for vehicle in fleet.vehicles}
    return [
        *(_overloaded(one) for one in fleet.vehicles if one.n_over_limit),
        *(Look(one.name, f"sensor: {bad.reason}", trouble_told(bad), reason_told(bad.reason)[1])
          for one in fleet.vehicles for bad in one.bad_sensors),
        *sorted(drifts, key=lambda look: look.what),
        *(Look(name, "no batch", "the data set has no batch of it", "see the logs that failed", False)
          for name in fleet.without_batches),
        *(Look(one.name, "silent", f"its last batch is of {one.last}", "is it parked, or its logs lost?")
          for one in fleet.vehicles if one.last < silent_since),
        *(_little_answered(one) for one in fleet.vehicles if one.n_answered < LITTLE_ANSWERED * one.n),
        *(Look(name, "logs failed", f"{whole(n)}, listed below", "mend or remove them", name in with_page)
          for name, n in n_failed),
    ]  # fmt: skip


def fleet_sections(fleet: FleetSummary, looks: Sequence[Look]) -> list[Section]:
    refusals = refusals_section("refused", fleet.vehicles)
    failed = [_failed(fleet)] if fleet.failures else []
    return [_look_section(looks), _vehicles(fleet), refusals, *failed, _how(fleet)]


def _drifting(vehicle: FleetVehicle, name: str, drift: Drift) -> Look:
    advice = (
        "look for wear; calibrate again where it is repaired"
        if name in OF_VEHICLE
        else "look for a changed tyre, spring or sensor mount; calibrate again"
    )
    return Look(vehicle.name, f"drift: {NAMES[name]}", drift_told(drift), advice)


def _overloaded(vehicle: FleetVehicle) -> Look:
    told = f"{percent(vehicle.n_over_limit, vehicle.n_answered)} of {whole(vehicle.n_answered)} answered batches"
    return Look(vehicle.name, "over a limit", told, "load less, or place it otherwise: its page has the weeks")


def _little_answered(vehicle: FleetVehicle) -> Look:
    reason, n = max(vehicle.n_refused.items(), key=lambda one: one[1])
    told = f"{percent(vehicle.n_answered, vehicle.n)} of {whole(vehicle.n)} batches; {whole(n)} were {reason}"
    return Look(vehicle.name, "few answers", told, reason_told(reason)[1])


def _look_section(looks: Sequence[Look]) -> Section:
    rows = tuple((_name(look.vehicle, look.has_page), look.what, look.told, look.advice) for look in looks)
    table = Table("Needs attention", ("Vehicle", "what", "as found", "what to do"), rows)
    words = () if rows else ("Nothing needs attention.",)
    return Section("look", "Needs attention", words, (), (table,) if rows else ())


def _name(vehicle: str, has_page: bool = True) -> ChartLink | str:
    return ChartLink(vehicle, f"vehicles/{page_of(vehicle)}") if has_page else vehicle


def _vehicles(fleet: FleetSummary) -> Section:
    rows = tuple(_vehicle_row(vehicle) for vehicle in fleet.vehicles)
    columns = ("Vehicle", "batches", "answered", "last answered week: mean load (95 %)", "over a limit",
               "refused most for", "drifts", "bad sensors", "from", "to")  # fmt: skip
    text = (
        "Batches are all that the data set holds; a vehicle's page has its weeks, reasons and parameters. A dash under "
        "limits: none was over one, or no limit is known."
    )
    return Section("vehicles", "Vehicles", (text,), (), (Table("Every vehicle", columns, rows),))


def _vehicle_row(vehicle: FleetVehicle) -> tuple[ChartLink | str, ...]:
    most = max(vehicle.n_refused.items(), key=lambda one: one[1], default=None)
    last = NONE
    for week in vehicle.weeks.filter(pl.col("n_answered") > 0).tail(1).iter_rows(named=True):
        load = kg(week["payload_mean_kg"], week["payload_low_kg"], week["payload_high_kg"])
        last = f"{load}, n = {whole(week['n_answered'])}"
    return (
        _name(vehicle.name),
        whole(vehicle.n),
        percent(vehicle.n_answered, vehicle.n),
        last,
        over_limit(vehicle.n_over_limit, vehicle.n_answered),
        f"{most[0]}, n = {whole(most[1])}" if most else NONE,
        str(len(vehicle.believed_drifts)),
        str(len(vehicle.bad_sensors)),
        day(vehicle.first),
        day(vehicle.last),
    )


def _failed(fleet: FleetSummary) -> Section:
    rows = tuple((one.vehicle, one.month, one.log, one.reason) for one in fleet.failures[:MOST_FAILURES])
    more = len(fleet.failures) - len(rows)
    text = f"{whole(len(fleet.failures))} logs could not be read. No figure of this report holds them."
    paragraphs = (text, *((f"{whole(more)} more stand in report.json.",) if more else ()))
    table = Table("What could not be read", ("Vehicle", "month", "log", "why"), rows)
    return Section("failed", "Logs that failed", paragraphs, (), (table,))


def _how(fleet: FleetSummary) -> Section:
    n = sum(len(vehicle.drifts) for vehicle in fleet.vehicles)
    n_believed = sum(len(vehicle.believed_drifts) for vehicle in fleet.vehicles)
    return Section(
        "how",
        "How to read it",
        (
            "Only what a receipt of the data set vouches for is counted. Unknown is a dash, never 0. Weeks are UTC and "
            "begin on Monday; every figure says of how many batches, weeks or vehicles it is.",
            f"A drift is a slope of a parameter since the vehicle's last calibration. Of {whole(n)} slopes "
            f"{whole(n_believed)} are believed; at most {100 * FALSE_SHARE:g} % of the believed are expected to be "
            "there by chance. With twenty vehicles or more the median movement of the fleet, such as the seasons make, "
            "is taken off first. A vehicle's page shows its slopes.",
            "docs/archive.md tells how each figure is made.",
        ),
    )
