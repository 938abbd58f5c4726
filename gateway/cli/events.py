"""springscale events: logs to load events and trips, as the service reports them."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import click

from gateway.cli import options
from gateway.cli.estimate import half_width, prepared, tell, when_told
from gateway.cli.options import FILE, as_json, one_estimator, window
from gateway.core.events.entry import Entry, EntryKind
from gateway.estimates.as_json import without_dates
from gateway.offline.estimates import entries_of_logs, require_order
from gateway.records import json_line


@click.command("events")
@click.argument("logs", nargs=-1, required=True, type=FILE)
@options.config
@options.signals
@options.calibration
@one_estimator
@window
@as_json
def events(
    logs: tuple[Path, ...],
    config_path: Path | None,
    signals: str | None,
    calibration: Path | None,
    estimator: str | None,
    window_s: float | None,
    as_json: bool,
) -> None:
    """What was loaded and unloaded, and every trip, from the LOGs of one vehicle in order of time.

    One line each; with --json the objects that the service stores, in their last revision.
    """
    setup, settings = prepared(config_path, signals, calibration, estimator, window_s)
    require_order(logs, setup.signal_map)
    for entry in entries_of_logs(logs, setup, settings, on_read=tell):
        click.echo(json_line(without_dates(entry.record)) if as_json else entry_sentence(entry))


SURE = 0.99  # chosen: below it the probability is printed


def entry_sentence(entry: Entry) -> str:
    """One line a person can read; times are UTC."""
    told = without_dates(entry.record)
    return _event(told) if entry.kind is EntryKind.EVENT else _trip(told)


def _event(told: Mapping[str, Any]) -> str:
    change, half = told["change_kg"], half_width(told["change_interval95_kg"])
    what = f"{abs(change):.0f} kg {'loaded' if change >= 0.0 else 'unloaded'} (± {half:.0f} kg)"
    sure = "" if told["probability"] >= SURE else f", {told['probability']:.0%} probable"
    if told["is_withdrawn"]:
        what, sure = "withdrawn, nothing was loaded or unloaded after all", ""
    after = told["after"]
    place = told["place"]
    where = "" if place is None else f"; at {place['latitude_deg']}, {place['longitude_deg']}"
    return f"{_span(told)}  {what}{sure}; {after['payload_kg']:.0f} kg on board then{where}"


def _trip(told: Mapping[str, Any]) -> str:
    payload = told["payload_kg"]
    load = (
        "load unknown"
        if payload is None
        else f"{payload:.0f} kg (± {half_width(told['payload_interval95_kg']):.0f} kg)"
    )
    carried = "" if told["carried_tkm"] is None else f", {told['carried_tkm']:.2f} tonne-kilometres"
    going = "" if told["is_over"] else ", still going"
    return f"{_span(told)}  drove {told['distance_m'] / 1000.0:.1f} km with {load}{carried}{going}"


def _span(told: Mapping[str, Any]) -> str:
    """Begin and end in UTC, with the date of the end only if it differs; of a log without a date the times in it."""
    if told["t_start"] is None:
        return f"{when_told(told, 't_start')} to {when_told(told, 't_end').removeprefix('no date, ')}"
    (day, begun), (last_day, ended) = ((told[name][:10], told[name][11:16]) for name in ("t_start", "t_end"))
    return f"{day} {begun} to {ended if last_day == day else f'{last_day} {ended}'}"
