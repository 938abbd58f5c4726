"""The page of one vehicle: its loads, rejections, parameters and sensors by week."""

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np

from gateway.archive.fleet.batches import DRIFTING
from gateway.archive.fleet.fleet import FleetVehicle
from gateway.archive.fleet.weeks import Weeks, known_reason
from gateway.estimates.reasons import EXPLANATIONS, Cause
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
    refusals = refusals_section(_named(vehicle, "refused"), [vehicle.weeks], [vehicle.n_refused], vehicle.n_answered)
    return [_loads(vehicle), refusals, _parameters(vehicle), _sensors(vehicle)]


def _named(vehicle: FleetVehicle, what: str) -> str:
    """The name of a chart: the figures of all vehicles lie in one folder."""
    return f"{page_of(vehicle.name).removesuffix('.html')}_{what}"


def _loads(vehicle: FleetVehicle) -> Section:
    weeks = vehicle.weeks
    x, known = weeks.number.astype(float), np.isfinite(weeks.payload_mean_kg)
    mean, low, high = weeks.payload_mean_kg, weeks.payload_low_kg, weeks.payload_high_kg
    lower, upper = weeks.payload_lower_quartile_kg, weeks.payload_upper_quartile_kg
    marks: list[Mark] = [
        *(Ribbon(x[run], lower[run], upper[run], "middle half") for run in runs_of(known, weeks.number)),
        Points(x[known], mean[known], "mean, 95 %", 0, "circle", low[known], high[known]),
    ]
    rows = tuple(
        (
            day(monday),
            whole(int(weeks.n[k])),
            whole(int(weeks.n_answered[k])),
            kg(mean[k], low[k], high[k]),
            f"{lower[k]:.0f} to {upper[k]:.0f} kg" if np.isfinite(lower[k]) else NONE,
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


def refusals_section(
    name: str,
    all_weeks: Sequence[Weeks],
    totals: Sequence[Mapping[str, int]],
    n_answered: int,
) -> Section:
    """The refused batches of one vehicle or of several, by week and cause, and by reason. ``name`` is the chart's."""
    by_week: dict[int, Counter[str]] = {}
    for weeks in all_weeks:
        for k, week in enumerate(weeks.number.tolist()):
            of_cause = {str(cause): int(numbers[k]) for cause, numbers in weeks.n_refused_by.items()}
            by_week.setdefault(week, Counter()).update(of_cause, n=int(weeks.n[k]))
    number = sorted(by_week)
    x, n = np.array(number, dtype=float), np.array([by_week[week]["n"] for week in number])
    share = {cause: 100.0 * np.array([by_week[week][cause] for week in number]) / n for cause in Cause}
    lines = tuple(Points(x, share[cause], str(cause), k) for k, cause in enumerate(Cause) if share[cause].any())
    n_batches = int(n.sum())
    chart = Chart(
        name,
        f"Share of each week's batches that were refused, by where the reason lies; {whole(n_batches)} batches.",
        "Share of all batches refused in each week, by cause; the table below holds the sums.",
        (Panel(time_axis(number), Axis("refused [%]"), lines),),
        1,
        _SHOWN,
    )
    total, vehicles = Counter[str](), Counter[str]()
    for refused in totals:
        total.update(refused)
        vehicles.update(reason for reason, times in refused.items() if times)
    has_several = len(totals) > 1
    rows = tuple(
        (
            reason,
            whole(times),
            percent(times, n_batches),
            *([whole(vehicles[reason])] if has_several else []),
            *reason_told(reason),
        )
        for reason, times in total.most_common()
    )
    columns = ("Reason", "batches", "share", *(["vehicles"] if has_several else []), "what happened", "what to do")
    n_refused = n_batches - n_answered
    text = (
        f"{whole(n_refused)} of {whole(n_batches)} batches were refused ({percent(n_refused, n_batches)}). A batch "
        "with several reasons stands with each of them."
    )
    table = (Table("Refused batches by reason", columns, rows),) if rows else ()
    return Section("refused", "Refusals", (text,), (chart,) if lines else (), table)


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


def runs_of(known: Bool, number: I64) -> list[slice]:
    """Runs of consecutive weeks with known values, so that a band does not span gaps."""
    at = np.flatnonzero(known)
    runs = np.split(at, np.flatnonzero(np.diff(at) + np.diff(number[at]) > 2) + 1)
    return [slice(int(run[0]), int(run[-1]) + 1) for run in runs if run.size]
