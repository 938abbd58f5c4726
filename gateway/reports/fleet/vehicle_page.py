"""The page of one vehicle: its loads, rejections, parameters and sensors by week."""

from collections import Counter
from collections.abc import Sequence
from typing import Final

import numpy as np
import polars as pl

from gateway.archive.fleet.batches import DRIFTING
from gateway.archive.fleet.drift import WEEKS_PER_YEAR
from gateway.archive.fleet.fleet import FleetVehicle
from gateway.estimates.reasons import Cause
from gateway.reports.charts import Axis, Chart, LineMark, Mark, Panel, Points, Ribbon, Rule, Section, Table
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
    share,
    slope,
    time_axis,
    trouble_told,
    whole,
)
from gateway.words import NONE

_SHOWN: Final = 250  # px a row of panels
_PAYLOAD: Final = (
    "payload_mean_kg", "payload_low_kg", "payload_high_kg", "payload_lower_quartile_kg", "payload_upper_quartile_kg",
)  # fmt: skip


def vehicle_sections(vehicle: FleetVehicle) -> list[Section]:
    """All sections of the page; every figure states its number of batches."""
    return [
        _loads(vehicle),
        refusals_section(_named(vehicle, "refused"), [vehicle]),
        _parameters(vehicle),
        _sensors(vehicle),
    ]


def _named(vehicle: FleetVehicle, what: str) -> str:
    """The name of a chart: the figures of all vehicles lie in one folder."""
    return f"{page_of(vehicle.name).removesuffix('.html')}_{what}"


def _loads(vehicle: FleetVehicle) -> Section:
    weeks = every_week(vehicle.weeks)
    x = weeks["week"].cast(float).to_numpy()
    mean, low, high, lower, upper = (weeks[name].to_numpy() for name in _PAYLOAD)
    marks = (Ribbon(x, lower, upper, "middle half"), Points(x, mean, "mean, 95 %", 0, "circle", low, high))
    rows = tuple(
        (
            day(week["monday"]),
            whole(week["n"]),
            whole(week["n_answered"]),
            kg(*(week[name] for name in _PAYLOAD[:3])),
            NONE if week[_PAYLOAD[3]] is None else f"{week[_PAYLOAD[3]]:.0f} to {week[_PAYLOAD[4]]:.0f} kg",
            over_limit(week["n_over_limit"], week["n_answered"]),
        )
        for week in vehicle.weeks.iter_rows(named=True)
    )
    columns = ("Week of", "batches", "answered", "mean load (95 %)", "middle half", "over a limit")
    chart = Chart(
        _named(vehicle, "loads"),
        f"Load by week: the mean over the answered batches with its 95 % interval, and the middle half of what was "
        f"carried. {whole(vehicle.n_answered)} batches of {whole(vehicle.n)}.",
        "Mean load of each week with its interval; the table below holds the numbers.",
        (Panel(time_axis(weeks["week"]), Axis("load [kg]"), marks),),
        1,
    )
    text = (
        "A week's interval counts in full the error that its batches have in common (calibration, changes of the "
        "vehicle since), and lets what each batch has for itself shrink with their number. Batches that were refused "
        "are in no mean: if some loads are refused more often than others, the mean tells less of these. A dash under "
        "limits: none was over one, or no limit is known."
    )
    table = Table("Loads by week, UTC, from Monday", columns, rows)
    return Section("loads", "Loads over time", (text,), (chart,), (), (("The numbers", (table,)),))


def refusals_section(name: str, vehicles: Sequence[FleetVehicle]) -> Section:
    """The refused batches of one vehicle or of several, by week and cause, and by reason. ``name`` is the chart's."""
    weeks = pl.concat([one.weeks for one in vehicles]).group_by("week").agg(pl.col("n", *map(str, Cause)).sum())
    weeks = weeks.sort("week")
    x = weeks["week"].cast(float).to_numpy()
    shares = {cause: (100.0 * weeks[str(cause)] / weeks["n"]).to_numpy() for cause in Cause}
    lines = tuple(Points(x, shares[cause], str(cause), k) for k, cause in enumerate(Cause) if shares[cause].any())
    n_batches = sum(one.n for one in vehicles)
    chart = Chart(
        name,
        f"Share of each week's batches that were refused, by where the reason lies; {whole(n_batches)} batches.",
        "Share of all batches refused in each week, by cause; the table below holds the sums.",
        (Panel(time_axis(weeks["week"]), Axis("refused [%]"), lines),),
        1,
        _SHOWN,
    )
    total = sum((Counter(one.n_refused) for one in vehicles), Counter[str]())
    has_several = len(vehicles) > 1
    rows = tuple(
        (
            reason,
            whole(times),
            percent(times, n_batches),
            *([whole(sum(reason in one.n_refused for one in vehicles))] if has_several else []),
            *reason_told(reason),
        )
        for reason, times in total.most_common()
    )
    columns = ("Reason", "batches", "share", *(["vehicles"] if has_several else []), "what happened", "what to do")
    n_refused = n_batches - sum(one.n_answered for one in vehicles)
    text = (
        f"{whole(n_refused)} of {whole(n_batches)} batches were refused ({percent(n_refused, n_batches)}). A batch "
        "with several reasons stands with each of them."
    )
    table = (Table("Refused batches by reason", columns, rows),) if rows else ()
    return Section("refused", "Refusals", (text,), (chart,) if lines else (), table)


def _parameters(vehicle: FleetVehicle) -> Section:
    panels = tuple(_parameter_panel(vehicle, name) for name in DRIFTING if vehicle.weeks[name].count())
    rows = tuple(
        (
            NAMES[name],
            slope(drift.found),
            slope(drift.beyond) if drift.beyond else NONE,
            str(drift.judged.n),
            "yes" if drift.is_believed else "no",
        )
        for name, drift in vehicle.drifts.items()
    )
    text = (
        "What the estimator found of the vehicle and its sensors, batch by batch; points are a week's median over "
        "every batch that has the number. A slope is since the last calibration, because parameters are "
        "relative to it. It is believed if it is significant among all vehicles and parameters of the report.",
        *(f"{NAMES[name]}: {drift_told(drift)}." for name, drift in vehicle.believed_drifts.items()),
    )
    chart = Chart(
        _named(vehicle, "parameters"),
        "Weekly medians, and the slope since the last calibration where there are weeks enough.",
        "Weekly medians of each parameter; the table below holds the slopes.",
        panels,
        2,
        _SHOWN,
    )
    columns = ("Parameter", "slope (95 %)", "without the fleet's", "weeks", "believed")
    table = Table("Drift of parameters", columns, rows)
    unknown = ("No parameter has weeks enough to tell a drift.",) if not rows else ()
    return Section("drift", "Drift", (*text, *unknown), (chart,) if panels else (), (table,) if rows else ())


def _parameter_panel(vehicle: FleetVehicle, name: str) -> Panel:
    weeks = vehicle.weeks.drop_nulls(name)
    x, medians = weeks["week"].cast(float).to_numpy(), weeks[name].to_numpy()
    marks: list[Mark] = [Points(x, medians, "weekly median", 0)]
    if (drift := vehicle.drifts.get(name)) is not None:
        judged = x >= vehicle.calibrated_week
        ends = x[judged][[0, -1]]
        line = np.median(medians[judged]) + drift.found.slope * (ends - np.median(x[judged])) / WEEKS_PER_YEAR
        label, colour = ("slope, believed", 1) if drift.is_believed else ("slope", 7)
        marks.append(LineMark(ends, line, label, colour, "solid" if drift.is_believed else "dash"))
    if vehicle.calibrated_week > vehicle.weeks["week"][0]:
        marks.append(Rule(float(vehicle.calibrated_week), is_vertical=True, label="last calibration", dash="dot"))
    return Panel(time_axis(vehicle.weeks["week"]), Axis(""), tuple(marks), NAMES[name])


def _sensors(vehicle: FleetVehicle) -> Section:
    rows = tuple(
        (
            trouble.reason,
            str(trouble.health),
            whole(trouble.n_batches),
            share(trouble.days),
            trouble_told(trouble),
            f"{day(trouble.first)} to {day(trouble.last)}",
            reason_told(trouble.reason)[1],
        )
        for trouble in vehicle.troubles
    )
    text = (
        "A bad day is one on which a reason of the sensors refused at least half of the batches. Bad now: the 95 % "
        "interval of the share of bad days among the last 14 days driven lies above 20 %."
    )
    columns = ("Reason", "state", "batches", "bad days", "lately", "met", "what to do")
    table = Table("What the sensors were refused for", columns, rows)
    none = () if rows else ("No batch was refused because of a sensor.",)
    return Section("sensors", "Sensors", (text, *none), (), (table,) if rows else ())
