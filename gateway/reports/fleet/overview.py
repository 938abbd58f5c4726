"""The overview page of the fleet: what needs attention, a row per vehicle, and the fleet by week."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import timedelta
from typing import Final

import numpy as np
import polars as pl

from gateway.archive.fleet.batches import DRIFTING, OF_VEHICLE
from gateway.archive.fleet.drift import FALSE_SHARE, Drift
from gateway.archive.fleet.fleet import FleetSummary, FleetVehicle
from gateway.reports.charts import Axis, Chart, ChartLink, LineMark, Mark, Panel, Points, Ribbon, Section, Table
from gateway.reports.fleet.text import (
    NAMES,
    day,
    drift_told,
    every_week,
    kg,
    over_limit,
    page_of,
    percent,
    reason_told,
    time_axis,
    trouble_told,
    whole,
)
from gateway.reports.fleet.vehicle_page import refusals_section
from gateway.words import NONE

SILENT_DAYS: Final = 28  # chosen: without a batch, before the last of the fleet's
LITTLE_ANSWERED: Final = 0.5  # chosen: of a vehicle's batches
MOST_SLOPES: Final = 400  # in a chart: the steepest either way
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
    return [_look_section(looks), _vehicles(fleet), _loads(fleet), refusals, _drift(fleet), *failed, _how()]


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


def _loads(fleet: FleetSummary) -> Section:
    mean = pl.col("payload_mean_kg")
    weeks = (
        pl.concat([vehicle.weeks.drop_nulls("payload_mean_kg") for vehicle in fleet.vehicles])
        .group_by("week")
        .agg(
            pl.len().alias("n").cast(pl.Float64),
            mean.quantile(0.25, "linear").alias("low"),
            mean.median().alias("middle"),
            mean.quantile(0.75, "linear").alias("high"),
        )
    )
    if weeks.is_empty():
        return Section("loads", "Loads over time", ("No batch was answered.",))
    shown = every_week(weeks)
    axis, x = time_axis(weeks["week"]), shown["week"].cast(float).to_numpy()
    n, low, middle, high = (shown[name].to_numpy() for name in ("n", "low", "middle", "high"))
    marks = (Ribbon(x, low, high, "middle half of the vehicles"), LineMark(x, middle, "median of the vehicles"))
    chart = Chart(
        "loads",
        f"Weekly mean loads of the vehicles, and how many vehicles had an answer that week ({min(weeks['n']):.0f} to "
        f"{max(weeks['n']):.0f} of {len(fleet.vehicles)}). {whole(fleet.n_answered)} batches.",
        "Median and middle half over the vehicles of each one's weekly mean load, and the number of vehicles by week.",
        (
            Panel(axis, Axis("load [kg]"), marks, "Weekly mean loads"),
            Panel(axis, Axis("vehicles"), (LineMark(x, n, "vehicles", 7),), "With an answer"),
        ),
    )
    return Section("loads", "Loads over time", (), (chart,))


def _drift(fleet: FleetSummary) -> Section:
    panels = tuple(panel for name in DRIFTING if (panel := _drift_panel(fleet, name)) is not None)
    n = sum(len(vehicle.drifts) for vehicle in fleet.vehicles)
    n_believed = sum(len(vehicle.believed_drifts) for vehicle in fleet.vehicles)
    if not panels:
        return Section("drift", "Drift", ("No vehicle has weeks enough since its calibration to tell a drift.",))
    text = (
        f"{whole(n)} slopes of {whole(len(fleet.vehicles))} vehicles, {whole(n_believed)} of them believed. At most "
        f"{100 * FALSE_SHARE:g} % of the believed are expected to be there by chance. With twenty vehicles or more "
        "the median movement of the fleet, such as the seasons make, is taken off first."
    )
    chart = Chart(
        "drift",
        f"Slope of each vehicle with its 95 % interval, in order; of more than {MOST_SLOPES} the steepest either way.",
        "Slopes of every parameter by vehicle in order of steepness, with intervals; believed ones stand out.",
        panels,
        2,
        260,
    )
    return Section("drift", "Drift", (text,), (chart,))


def _drift_panel(fleet: FleetSummary, name: str) -> Panel | None:
    told = sorted(
        ((vehicle.drifts[name], vehicle.name) for vehicle in fleet.vehicles if name in vehicle.drifts),
        key=lambda one: one[0].judged.slope,
    )
    if not told:
        return None
    half = MOST_SLOPES // 2
    shown = told if len(told) <= MOST_SLOPES else [*told[:half], *told[-half:]]
    marks: list[Mark] = []
    for is_believed, label, colour in ((False, "not believed", 7), (True, "believed", 1)):
        chosen = [(k, drift, vehicle) for k, (drift, vehicle) in enumerate(shown) if drift.is_believed is is_believed]
        if chosen:
            at = np.array([float(k) for k, _, _ in chosen])
            slopes, low, high = np.array([[d.judged.slope, d.judged.low, d.judged.high] for _, d, _ in chosen]).T
            marks.append(Points(at, slopes, label, colour, "circle", low, high))
    return Panel(Axis("vehicles"), Axis("a year"), tuple(marks), NAMES[name])


def _failed(fleet: FleetSummary) -> Section:
    rows = tuple((one.vehicle, one.month, one.log, one.reason) for one in fleet.failures[:MOST_FAILURES])
    more = len(fleet.failures) - len(rows)
    text = f"{whole(len(fleet.failures))} logs could not be read. No figure of this report holds them."
    paragraphs = (text, *((f"{whole(more)} more stand in report.json.",) if more else ()))
    table = Table("What could not be read", ("Vehicle", "month", "log", "why"), rows)
    return Section("failed", "Logs that failed", paragraphs, (), (table,))


def _how() -> Section:
    return Section(
        "how",
        "How to read it",
        (
            "Only what a receipt of the data set vouches for is counted. Unknown is a dash, never 0. Weeks are UTC and "
            "begin on Monday; every figure says of how many batches, weeks or vehicles it is.",
            "docs/archive.md tells how each figure is made.",
        ),
    )
