"""springscale verification: known loads compared with the estimates of a running service, as dated records."""

from pathlib import Path
from typing import Any, Final

import click

from gateway.cli.options import FILE, LoadArgument
from gateway.cli.service import Answer, Service, asks_service, only_one, prints_answer
from gateway.errors import SpringscaleError
from gateway.estimate import Z95
from gateway.files.whole import refusal_told, written_whole
from gateway.words import one_or_more

PATH: Final = "/api/v1/calibration/verifications"


def _state_text(state: Answer) -> str:
    rule, due = state["rule"], state["due"]
    loads = one_or_more(rule["loads"], "load", "loads")
    lines = [f"rule: error at most {rule['permitted_error_pct']:g} % of the gross weight, {loads} or more"]
    if due["due_at"] is not None:
        lines.append(f"due {'since' if due['is_due'] else 'on'} {due['due_at'][:10]}")
    return "\n".join([*lines, *(_record_text(entry) for entry in state["history"])])


def _record_text(entry: Answer) -> str:
    note = f" ({entry['note']})" if entry["note"] else ""
    lines = [f"{entry['id'][:19]} {entry['at'][:19]}Z by {entry['by']}{note}: {entry['verdict']}"]
    return "\n".join([*lines, *(f"  {_load_text(load)}" for load in entry["loads"])])


def _load_text(load: Answer) -> str:
    weighed = f"{load['payload_kg']:.1f} ± {Z95 * load['payload_std_kg']:.1f} kg (95 %)"
    error = f"{load['error_kg']:+.1f} kg, {load['error_pct']:+.2f} % of the gross weight"
    axles = [
        f"{name} axle {axle['error_kg']:+.1f} kg, {axle['error_pct']:+.2f} %"
        for name, axle in (("front", load["front_axle"]), ("rear", load["rear_axle"]))
        if axle
    ]
    return "; ".join([f"payload {load['known_payload_kg']:.1f} kg known, {weighed} weighed: {error}", *axles])


@click.group("verification")
def verification() -> None:
    """Compare known loads with the estimates of a running service: a dated record with errors and a verdict."""


@verification.command("show")
@prints_answer(_state_text)
def show(service: Service) -> Answer:
    """The requirements, when a verification is due, and the records."""
    return service.ask(PATH)


@verification.command("record")
@click.option(
    "--load",
    "loads",
    type=LoadArgument(),
    multiple=True,
    required=True,
    help="a known load, such as gross_kg=1890,at=2026-11-21T04:10:00Z,drive=before; once for each",
)
@click.option("--note", default=None, help="kept with the record: scales used, place")
@prints_answer(_record_text)
def record(service: Service, loads: tuple[dict[str, Any], ...], note: str | None) -> Answer:
    """Compare known loads with their estimates, and keep the record. The calibration does not change."""
    return service.ask(PATH, "POST", {"loads": list(loads)} | ({} if note is None else {"note": note}))


@verification.command("export")
@click.argument("record_id")
@click.option("--output", type=FILE, required=True, help="the page to write, such as verification.html")
@asks_service
def export(service: Service, record_id: str, output: Path) -> None:
    """Write one record as a page to print: RECORD_ID as `show` prints it, or its first letters."""
    ids = [entry["id"] for entry in service.ask(PATH)["history"]]
    found = only_one(ids, record_id, "records", "springscale verification show")
    page = service.page(f"{PATH}/{found}")
    with refusal_told(output, SpringscaleError), written_whole(output) as file:
        file.write(page)
    click.echo(f"{output}: record {found[:19]}")
