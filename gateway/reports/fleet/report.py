"""The report of a fleet: report.html, a page for each vehicle in vehicles/, and report.json.

    write_fleet_report(DIR, fleet, "DATASET")               springscale fleet-report DATASET --output DIR

The pages are self-contained: they load nothing from other hosts and can be read without scripts.
"""

from collections.abc import Callable
from pathlib import Path

from gateway.archive.fleet.fleet import FleetSummary, FleetVehicle
from gateway.reports.charts.html import (
    Page,
    made_folder,
    prose,
    write_page,
    write_report,
)
from gateway.reports.fleet.overview import fleet_sections, looks_of
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
        write_page(directory / "vehicles" / page_of(vehicle.name), _vehicle_page(vehicle), sections)
    looks = looks_of(fleet)
    sections = fleet_sections(fleet, looks)
    in_short = (
        f"{fleet.first} to {fleet.last}: {whole(fleet.n)} batches, {percent(fleet.n_answered, fleet.n)} of them "
        f"answered. {counted(len(looks), 'thing') if looks else 'Nothing'} to look at. From {source}."
    )
    overview = Page(counted(len(fleet.vehicles), "vehicle"), f"<p>{prose(in_short)}</p>", skip_to="look")
    numbers = {
        "dataset": source,
        "from": fleet.first,
        "to": fleet.last,
        "n": fleet.n,
        "n_answered": fleet.n_answered,
        "look": looks,
        "vehicles": fleet.vehicles,
        "without_batches": fleet.without_batches,
        "failures": fleet.failures,
    }
    report = write_report(directory, overview, sections, numbers)
    on_page(len(fleet.vehicles) + 1, len(fleet.vehicles) + 1)
    return report


def _vehicle_page(vehicle: FleetVehicle) -> Page:
    calibrated = ", ".join(vehicle.calibrations) or "without a calibration"
    text = (
        f"{vehicle.first} to {vehicle.last}: {whole(vehicle.n)} batches, {percent(vehicle.n_answered, vehicle.n)} of "
        f"them answered. Calibration: {calibrated}."
    )
    head = f'<p><a href="../report.html">The fleet</a></p><p>{prose(text)}</p>'
    return Page(vehicle.name, head, skip_to="loads")
