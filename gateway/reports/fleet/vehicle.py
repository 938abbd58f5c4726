"""The page of one vehicle: its loads, rejections, parameters and sensors by week."""

from collections.abc import Iterator
from typing import Final

import numpy as np

from gateway.archive.fleet.batches import DRIFTING
from gateway.archive.fleet.fleet import FleetVehicle
from gateway.archive.fleet.weeks import known_reason
from gateway.reasons import EXPLANATIONS, Cause
from gateway.records import I64, Bool
from gateway.reports.charts import Axis, Chart, LineMark, Mark, Panel, Points, Ribbon, Rule, Section, Table
from gateway.reports.fleet.text import (
    NAMES,
    NONE,
    day,
    drift_told,
    kg,
    over_limit,
    page_of,
    percent,
    share,
    slope,
    time_axis,
    trouble_told,
    whole,
)

WEEKS_PER_YEAR: Final = 365.25 / 7.0  # Julian year
_SHOWN: Final = 250  # px a row of panels


def vehicle_sections(vehicle: FleetVehicle) -> list[Section]:
    """All sections of the page; every figure states its number of batches."""
    return [_loads(vehicle), _refusals(vehicle), _parameters(vehicle), _sensors(vehicle)]


def _named(vehicle: FleetVehicle, what: str) -> str:
    """The name of a chart: the figures of all vehicles lie in one folder."""
    return f"{page_of(vehicle.name).removesuffix('.html')}_{what}"


def _loads(vehicle: FleetVehicle) -> Section:
    weeks = vehicle.weeks
    x = weeks.number.astype(float)
    known = np.isfinite(weeks.payload_mean_kg)
    marks: list[Mark] = [
        *(
            Ribbon(x[run], weeks.payload_lower_quartile_kg[run], weeks.payload_upper_quartile_kg[run], "middle half")
            for run in runs_of(known, weeks.number)
        ),
        Points(
            x[known],
            weeks.payload_mean_kg[known],
            "mean, 95 %",
            0,
            "circle",
            weeks.payload_low_kg[known],
            weeks.payload_high_kg[known],
        ),
    ]
    rows = tuple(
        (
            day(monday),
            whole(int(weeks.n[k])),
            whole(int(weeks.n_answered[k])),
            kg(weeks.payload_mean_kg[k], weeks.payload_low_kg[k], weeks.payload_high_kg[k]),
            _span(weeks.payload_lower_quartile_kg[k], weeks.payload_upper_quartile_kg[k]),
            over_limit(int(weeks.n_over_limit[k]), int(weeks.n_answered[k])),
        )
        for k, monday in enumerate(weeks.mondays)
    )
    columns = ("Week of", "batches", "answered", "mean load (95 %)", "middle half", "over a limit")
    chart = Chart(
        _named(vehicle, "loads"),
        f"Load by week: the mean over the answered batches with its 95 % interval, and the middle half of what was "
        f"carried. {whole(vehicle.n_answered)} batches of {whole(vehicle.n)}.",
        "Mean load of each week with its interval; the table below holds the numbers.",
        (Panel(time_axis(weeks.number.tolist()), Axis("load [kg]"), tuple(marks)),),
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


def _refusals(vehicle: FleetVehicle) -> Section:
    weeks = vehicle.weeks
    x, causes = weeks.number.astype(float), [cause for cause in Cause if weeks.n_refused_by[cause].any()]
    lines = tuple(
        Points(x, 100.0 * weeks.n_refused_by[cause] / weeks.n, str(cause), k) for k, cause in enumerate(causes)
    )
    chart = Chart(
        _named(vehicle, "refused"),
        f"Share of each week's batches that were refused, by where the reason lies; {whole(vehicle.n)} batches.",
        "Share of batches refused in each week by cause; the table below holds the sums.",
        (Panel(time_axis(weeks.number.tolist()), Axis("refused [%]", limits=(0.0, 105.0)), lines),),
        1,
        _SHOWN,
    )
    rows = tuple(
        (reason, whole(n), percent(n, vehicle.n), *reason_told(reason))
        for reason, n in sorted(vehicle.n_refused.items(), key=lambda one: -one[1])
    )
    n_refused = vehicle.n - vehicle.n_answered
    text = (
        f"{whole(n_refused)} of {whole(vehicle.n)} batches were refused ({percent(n_refused, vehicle.n)}). A batch "
        "with several reasons stands with each of them."
    )
    table = Table("Refused batches by reason", ("Reason", "batches", "share", "what happened", "what to do"), rows)
    return Section("refused", "Refusals", (text,), (chart,) if causes else (), (table,) if rows else ())


def _parameters(vehicle: FleetVehicle) -> Section:
    weeks = vehicle.weeks
    shown = [name for name in DRIFTING if np.isfinite(weeks.medians[name]).any()]
    panels = tuple(_parameter_panel(vehicle, name) for name in shown)
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
    weeks = vehicle.weeks
    medians, known = weeks.medians[name], np.isfinite(weeks.medians[name])
    x = weeks.number.astype(float)
    marks: list[Mark] = [Points(x[known], medians[known], "weekly median", 0)]
    if (drift := vehicle.drifts.get(name)) is not None:
        judged = known & (weeks.number >= vehicle.calibrated_week)
        ends = x[judged][[0, -1]]
        line = np.median(medians[judged]) + drift.found.slope * (ends - np.median(x[judged])) / WEEKS_PER_YEAR
        label, colour = ("slope, believed", 1) if drift.is_believed else ("slope", 7)
        marks.append(LineMark(ends, line, label, colour, "solid" if drift.is_believed else "dash"))
    if vehicle.calibrated_week > weeks.number[0]:
        marks.append(Rule(float(vehicle.calibrated_week), is_vertical=True, label="last calibration", dash="dot"))
    return Panel(time_axis(weeks.number.tolist()), Axis(""), tuple(marks), NAMES[name])


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


def reason_told(reason: str) -> tuple[str, str]:
    """The cause and the remedy in words; dashes for a reason unknown to this version."""
    why = known_reason(reason)
    if why is None:
        return NONE, NONE
    return EXPLANATIONS[why].happened.replace("`", ""), EXPLANATIONS[why].advice.replace("`", "")


def runs_of(known: Bool, number: I64) -> Iterator[slice]:
    """Runs of consecutive weeks with known values, so that a band does not span gaps."""
    begin = None
    for k in range(len(known) + 1):
        goes_on = k < len(known) and known[k] and (begin is None or number[k] == number[k - 1] + 1)
        if begin is not None and not goes_on:
            yield slice(begin, k)
            begin = None
        if begin is None and k < len(known) and known[k]:
            begin = k


def _span(low: float, high: float) -> str:
    return f"{low:.0f} to {high:.0f} kg" if np.isfinite(low) else NONE
