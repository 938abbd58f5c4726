"""The report of a fleet: report.html, a page for each vehicle in vehicles/, and report.json.

    write_fleet_report(DIR, fleet, "DATASET")               springscale fleet-report DATASET --output DIR

The pages are self-contained: they load nothing from other hosts and can be read without scripts.
"""

import json
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

from gateway.archive.fleet import FleetSummary, FleetVehicle
from gateway.reports.charts import Chart, Section
from gateway.reports.charts.html import PLOTLY_FILE, Page, contents_html, document, prose, section_html
from gateway.reports.charts.live import plotly_json, plotly_script
from gateway.reports.charts.still import save_still
from gateway.reports.fleet.figures import fleet_json
from gateway.reports.fleet.overview import fleet_sections, looks_of
from gateway.reports.fleet.text import page_of, percent, whole
from gateway.reports.fleet.vehicle import vehicle_sections
from gateway.reports.folder import made_folder
from gateway.words import counted

OnPage = Callable[[int, int], None]  # (pages written, pages in all)


def write_fleet_report(
    directory: Path, fleet: FleetSummary, source: str, on_page: OnPage = lambda done, of: None
) -> Path:
    """Write every page and report.json; return the path of report.html. Raises ConfigurationError if writing fails."""
    made_folder(directory / "vehicles")
    (directory / PLOTLY_FILE).write_text(plotly_script(), encoding="utf-8")
    for done, vehicle in enumerate(fleet.vehicles):
        on_page(done, len(fleet.vehicles) + 1)
        page = directory / "vehicles" / page_of(vehicle.name)
        page.write_text(_vehicle_page(vehicle), encoding="utf-8")
    looks = looks_of(fleet)
    sections = fleet_sections(fleet, looks)
    for chart in _charts(sections):
        save_still(chart, directory / "figures")
    text = json.dumps(fleet_json(fleet, looks, source), indent=1, allow_nan=False, ensure_ascii=False)
    (directory / "report.json").write_text(text + "\n", encoding="utf-8")
    report = directory / "report.html"
    head = f"<p>{prose(_in_short(fleet, source, len(looks)))}</p>"
    report.write_text(
        _page(counted(len(fleet.vehicles), "vehicle"), head, sections, "look", PLOTLY_FILE), encoding="utf-8"
    )
    on_page(len(fleet.vehicles) + 1, len(fleet.vehicles) + 1)
    return report


def _in_short(fleet: FleetSummary, source: str, n_looks: int) -> str:
    return (
        f"{fleet.first} to {fleet.last}: {whole(fleet.n)} batches, {percent(fleet.n_answered, fleet.n)} of them "
        f"answered. {counted(n_looks, 'thing') if n_looks else 'Nothing'} to look at. From {source}."
    )


def _vehicle_page(vehicle: FleetVehicle) -> str:
    calibrated = ", ".join(vehicle.calibrations) or "without a calibration"
    text = (
        f"{vehicle.first} to {vehicle.last}: {whole(vehicle.n)} batches, {percent(vehicle.n_answered, vehicle.n)} of "
        f"them answered. Calibration: {calibrated}."
    )
    head = f'<p><a href="../report.html">The fleet</a></p><p>{prose(text)}</p>'
    return _page(vehicle.name, head, vehicle_sections(vehicle), "loads", f"../{PLOTLY_FILE}")


def _page(title: str, head: str, sections: Sequence[Section], first: str, plotly: str) -> str:
    live = {chart.name: plotly_json(chart) for chart in _charts(sections)}
    main = contents_html(sections) + "".join(section_html(section, live) for section in sections)
    heading = next(section.heading for section in sections if section.anchor == first)
    return document(Page(title, head, main, (first, f"Skip to: {heading}"), plotly))


def _charts(sections: Sequence[Section]) -> Iterator[Chart]:
    for section in sections:
        yield from section.charts
