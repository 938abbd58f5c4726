"""The report of a fleet: report.html, a page for each vehicle in vehicles/, and report.json.

    write_fleet_report(DIR, fleet, "DATASET")               springscale fleet-report DATASET --output DIR

The pages are self-contained: they load nothing from other hosts and can be read without scripts.
"""

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from gateway.archive.fleet.drift import Drift, DriftTrend
from gateway.archive.fleet.faulty_sensors import Share, Trouble
from gateway.archive.fleet.fleet import FleetSummary, FleetVehicle
from gateway.reports.charts import Section
from gateway.reports.charts.html import (
    Page,
    made_folder,
    prose,
    sections_html,
    write_page,
    write_report,
)
from gateway.reports.fleet.overview import Look, fleet_sections, looks_of
from gateway.reports.fleet.text import page_of, percent, whole
from gateway.reports.fleet.vehicle_page import vehicle_sections
from gateway.words import counted

OnPage = Callable[[int, int], None]  # (pages written, pages in all)


def write_fleet_report(
    directory: Path, fleet: FleetSummary, source: str, on_page: OnPage = lambda done, of: None
) -> Path:
    """Write every page and report.json; return the path of report.html. Raises ConfigurationError if writing fails."""
    made_folder(directory / "vehicles")
    for done, vehicle in enumerate(fleet.vehicles):
        on_page(done, len(fleet.vehicles) + 1)
        sections = vehicle_sections(vehicle)
        write_page(directory / "vehicles" / page_of(vehicle.name), _vehicle_page(vehicle, sections), sections)
    looks = looks_of(fleet)
    sections = fleet_sections(fleet, looks)
    in_short = (
        f"{fleet.first} to {fleet.last}: {whole(fleet.n)} batches, {percent(fleet.n_answered, fleet.n)} of them "
        f"answered. {counted(len(looks), 'thing') if looks else 'Nothing'} to look at. From {source}."
    )
    overview = _page(counted(len(fleet.vehicles), "vehicle"), f"<p>{prose(in_short)}</p>", sections, "look")
    report = write_report(directory, overview, sections, fleet_json(fleet, looks, source))
    on_page(len(fleet.vehicles) + 1, len(fleet.vehicles) + 1)
    return report


def _vehicle_page(vehicle: FleetVehicle, sections: Sequence[Section]) -> Page:
    calibrated = ", ".join(vehicle.calibrations) or "without a calibration"
    text = (
        f"{vehicle.first} to {vehicle.last}: {whole(vehicle.n)} batches, {percent(vehicle.n_answered, vehicle.n)} of "
        f"them answered. Calibration: {calibrated}."
    )
    head = f'<p><a href="../report.html">The fleet</a></p><p>{prose(text)}</p>'
    return _page(vehicle.name, head, sections, "loads")


def _page(title: str, head: str, sections: Sequence[Section], first: str) -> Page:
    heading = next(section.heading for section in sections if section.anchor == first)
    return Page(title, head, sections_html(sections), (first, f"Skip to: {heading}"))


def fleet_json(fleet: FleetSummary, looks: Sequence[Look], source: str) -> dict[str, Any]:
    return {
        "dataset": source,
        "from": str(fleet.first),
        "to": str(fleet.last),
        "n": fleet.n,
        "n_answered": fleet.n_answered,
        "look": [
            {"vehicle": look.vehicle, "what": look.what, "told": look.told, "advice": look.advice} for look in looks
        ],
        "vehicles": [_vehicle(vehicle) for vehicle in fleet.vehicles],
        "without_batches": list(fleet.without_batches),
        "failures": [
            {"vehicle": one.vehicle, "month": one.month, "log": one.log, "reason": one.reason} for one in fleet.failures
        ],
    }


def _vehicle(vehicle: FleetVehicle) -> dict[str, Any]:
    return {
        "vehicle": vehicle.name,
        "page": f"vehicles/{page_of(vehicle.name)}",
        "from": str(vehicle.first),
        "to": str(vehicle.last),
        "n": vehicle.n,
        "n_answered": vehicle.n_answered,
        "n_over_limit": vehicle.n_over_limit,
        "n_refused": dict(vehicle.n_refused),
        "calibrations": list(vehicle.calibrations),
        "weeks": _weeks(vehicle),
        "drifts": {name: _drift(drift) for name, drift in vehicle.drifts.items()},
        "sensors": [_trouble(trouble) for trouble in vehicle.troubles],
    }


def _weeks(vehicle: FleetVehicle) -> list[dict[str, Any]]:
    weeks = vehicle.weeks
    return [
        {
            "monday": str(monday),
            "n": int(weeks.n[k]),
            "n_answered": int(weeks.n_answered[k]),
            "n_over_limit": int(weeks.n_over_limit[k]),
            "payload_mean_kg": _known(weeks.payload_mean_kg[k]),
            "payload_mean_interval95_kg": _pair(weeks.payload_low_kg[k], weeks.payload_high_kg[k]),
            "payload_middle_half_kg": _pair(weeks.payload_lower_quartile_kg[k], weeks.payload_upper_quartile_kg[k]),
            "medians": {name: _known(medians[k]) for name, medians in weeks.medians.items()},
        }
        for k, monday in enumerate(weeks.mondays)
    ]


def _drift(drift: Drift) -> dict[str, Any]:
    return {
        "found": _trend(drift.found),
        "beyond_the_fleet": _trend(drift.beyond) if drift.beyond else None,
        "is_believed": drift.is_believed,
    }


def _trend(trend: DriftTrend) -> dict[str, Any]:
    interval = [_known(trend.low), _known(trend.high)]
    return {"per_year": _known(trend.slope), "interval95": interval, "p": _known(trend.p), "n_weeks": trend.n}


def _trouble(trouble: Trouble) -> dict[str, Any]:
    return {
        "reason": trouble.reason,
        "state": str(trouble.health),
        "n_batches": trouble.n_batches,
        "bad_days": _share(trouble.days),
        "recent_bad_days": _share(trouble.recent),
        "first": str(trouble.first),
        "last": str(trouble.last),
        "since": None if trouble.since is None else str(trouble.since),
    }


def _share(share: Share) -> dict[str, Any]:
    return {"n_bad": share.n_bad, "n": share.n, "interval95": [_known(end) for end in share.interval95]}


def _pair(low: float, high: float) -> list[float | None] | None:
    return [_known(low), _known(high)] if math.isfinite(low) else None


def _known(number: float) -> float | None:
    return float(f"{number:.6g}") if math.isfinite(number) else None
