"""springscale learn: ordinary drives, and what is said of their loads, to a calibration file."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final
from zoneinfo import ZoneInfo

import click

from gateway.bus.signals import load_signal_map
from gateway.calibration.assigned import Assigned, moments
from gateway.calibration.campaign_file import Campaign, load_campaign
from gateway.calibration.file import load_calibration
from gateway.calibration.judgement.advice import Verdict
from gateway.calibration.learning.from_pieces import Learnt, matched
from gateway.calibration.learning.from_pieces import learn as learnt_from
from gateway.calibration.learning.spans import rows_record, rows_told, standing
from gateway.calibration.learning.told import drives_record, learning_record, statements_record
from gateway.calibration.statements_csv import ToldRow, ToldRows, read_statements
from gateway.cli import options
from gateway.cli.calibrate import require_places, tell_doubts, written_and_judged
from gateway.cli.options import FILE, ZONE, as_json, batch_settings, window
from gateway.cli.progress import counted, on_share
from gateway.errors import ConfigurationError
from gateway.estimates.field_kinds import without_dates
from gateway.offline.drives_of_logs import Drives, read_drives
from gateway.records import json_line, rounded
from gateway.stated.statement import StatementRecord
from gateway.words import counted as n_of
from gateway.words import one_or_more

Record = dict[str, Any]


@click.command("learn")
@click.argument("logs", nargs=-1, required=True, type=FILE)
@click.option("--vehicle", "vehicle_path", type=FILE, required=True, help="[vehicle] as in a campaign file")
@options.signals
@click.option("--statements", type=FILE, default=None, help="what is said of the loads: CSV or JSON")
@click.option("--timezone", "zone", type=ZONE, default=None, help="of times without one [default: UTC]")
@click.option("--output", type=FILE, default=None, help="calibration file to write; not needed with --dry-run")
@click.option("--like", type=FILE, default=None, help="calibration of a vehicle of the same model, as the prior")
@click.option("--dry-run", "only_matches", is_flag=True, help="say which rows match a drive, and write nothing")
@click.option("--report", type=FILE, default=None, help="directory to write a report into: report.html, figures")
@window
@as_json
def learn(
    logs: tuple[Path, ...],
    vehicle_path: Path,
    signals: str | None,
    statements: Path | None,
    zone: ZoneInfo | None,
    output: Path | None,
    like: Path | None,
    only_matches: bool,
    report: Path | None,
    window_s: float | None,
    as_json: bool,
) -> None:
    """Learn a vehicle from the LOGS of its ordinary drives and from statements about their loads.

    Drives of which nothing is said teach too. Each statement is tested on its drive before it teaches.
    """
    if output is None and not only_matches:
        raise click.UsageError("name the calibration file to write with --output, or ask with --dry-run")
    require_places(output, report)
    campaign = load_campaign(vehicle_path, is_draft=True)
    signal_map = load_signal_map(_signals(signals, campaign))
    sister = load_calibration(like) if like else None
    tell_doubts(campaign, sister)
    told = ToldRows((), {}, ()) if statements is None else _read(statements, zone)
    rows = [row for row in told.rows if row.is_of(campaign.vehicle.name)]
    numbers = {row.record.id: row.number for row in rows}
    records = standing(row.record for row in rows)
    settings = batch_settings(window_s)
    with counted("reading logs") as on_log:
        drives = read_drives(logs, signal_map, campaign.vehicle, moments(records), settings, on_log)
    assigned = matched(records, drives.driven, campaign.vehicle)
    record = _logs_record(drives) | _rows_record(told, rows, records, assigned, campaign.vehicle.name)
    if not as_json:
        click.echo("\n".join([*_logs_told(record), *_rows_told(record)]))
    elif only_matches:
        click.echo(json_line(record))
    if only_matches:
        return
    with counted("learning") as on_step:
        found = learnt_from(
            campaign.vehicle,
            drives.driven,
            assigned,
            settings,
            like=sister,
            on_fit=on_share(on_step, ("cross_spectrum",)),
        )
    verdict = written_and_judged(found.outcome, output, report)
    record |= {"drives": without_dates(drives_record(found)), "n_drives_unneeded": found.n_unneeded}
    of_rows = [{"row": numbers[one["id"]], **one} for one in statements_record(records, assigned, found)]
    record |= {"statements": sorted(of_rows, key=lambda one: one["row"]), "looks_empty": list(found.looking_empty())}
    record |= _verdict_record(found, verdict, output)
    click.echo(json_line(record) if as_json else "\n".join([*_drives_told(record), *_asked(record), verdict.text]))


def _signals(signals: str | None, campaign: Campaign) -> str:
    if signals or campaign.signals:
        return signals or campaign.signals
    raise click.UsageError(f"name the signal map with --signals, or as signals = ... in {campaign.path}")


def _read(statements: Path, zone: ZoneInfo | None) -> ToldRows:
    try:
        content = statements.read_bytes()
    except OSError as fault:
        raise ConfigurationError(f"{statements}: cannot be read: {fault.strerror or fault}") from None
    return read_statements(content, str(statements), zone)


# -- the answer as an object --


def _logs_record(drives: Drives) -> Record:
    """What became of the logs."""
    left_out = {log: [why.removeprefix(f"{log}: ")] for log, why in drives.unreadable.items()}
    left_out |= {
        log: [f"of the same driving as {first}, which counts once: if it is another drive, record both with their date"]
        for log, first in drives.repeated.items()
    }
    left_out |= {
        log: [f"{one.kind}: {one.text}: {one.advice}" for one in found] for log, found in drives.faulty.items()
    }
    return {
        "n_logs": drives.n_logs,
        "n_drives": len(drives.driven),
        "driven_s": rounded(sum(one.usable_s for one in drives.driven), 1),
        "n_short_drives": drives.pieces.n_short,
        "short_s": rounded(drives.pieces.short_s, 1),
        "left_out": {str(log): why for log, why in left_out.items()},
        "findings": {
            str(log): [f"{one.severity} {one.kind}: {one.text}: {one.advice}" for one in found]
            for log, found in drives.findings.items()
        },
        "remarks": {
            str(log): [one.removeprefix(f"{log}: ") for one in remarks]
            for log, remarks in drives.remarks.items()
            if remarks
        },
    }


def _rows_record(
    told: ToldRows, rows: Sequence[ToldRow], records: Sequence[StatementRecord], assigned: Assigned, name: str
) -> Record:
    """What became of the rows before the fit."""
    fates = {one.id: (fate, why) for one, fate, why in zip(records, assigned.fates, assigned.reasons, strict=True)}
    return rows_record(told, rows, fates, name)


def _verdict_record(found: Learnt, verdict: Verdict, output: Path | None) -> Record:
    """The file and how good it is."""
    file = found.outcome.file
    return {
        "calibration_id": file.id,
        "output": str(output) if output else None,
        "warnings": list(file.warnings),
        "learning": learning_record(found, verdict),
        "verdict": verdict.to_json(),
    }


# -- the same in words --


def _logs_told(record: Record) -> Iterator[str]:
    left_out = record["left_out"]
    lost = f", {n_of(len(left_out), 'log')} left out" if left_out else ""
    hours = record["driven_s"] / 3600.0
    yield f"{n_of(record['n_logs'], 'log')}: {n_of(record['n_drives'], 'drive')} with {hours:.1f} h of driving{lost}"
    for log, reasons in left_out.items():
        yield from (f"  {log}: left out: {why}" for why in reasons)
    logs_of: dict[str, list[str]] = {}
    for log, texts in (*record["findings"].items(), *record["remarks"].items()):
        for text in texts:
            logs_of.setdefault(text, []).append(log)
    for text, logs in logs_of.items():
        others = f" and {n_of(len(logs) - 1, 'other log')}" if len(logs) > 1 else ""
        yield f"  {logs[0]}{others}: {text}"
    if n := record["n_short_drives"]:
        what = one_or_more(n, "drive", "drives")
        yield f"  {what} without a minute of steady driving ({record['short_s']:.0f} s in all) can teach nothing"


def _rows_told(record: Record) -> Iterator[str]:
    """ "38 rows: 31 match a drive, 4 wait, 2 overlap (rows 9, 10), 1 unknown vehicle (row 12)", and each problem."""
    if not record["n_rows"] and not record["notes"]:
        return
    yield rows_told(record["n_rows"], record["n_match"], record["problems"])
    yield from (f"  {note}" for note in record["notes"])
    yield from (f"  row {one['row']}: {one['text']}" for one in record["problems"])


def _drives_told(record: Record) -> Iterator[str]:
    """A line for each drive."""
    yield f"{'drive':>5}  {'log':28}  {'from':16}  {'stated':>17}  {'found without it':>17}"
    for one in record["drives"]:
        name = one["log"] if len(one["log"]) <= 28 else f"…{one['log'][-27:]}"
        found = one["found_without_statement"] or one["found"]
        shown = _kg_told(found) if found else "too little driving"
        stated = _kg_told(one["stated"]) if one["stated"] else "nothing"
        begun = one["t_start"][:16].replace("T", " ") if one["t_start"] else "no date"
        line = f"{one['number']:>5}  {name:28}  {begun:16}  {stated:>17}  {shown:>17}  {one['state'] or ''}"
        yield line.rstrip()
    if n := record["n_drives_unneeded"]:
        yield f"{n_of(n, 'drive')} of unknown load were not used: those above teach as much"


def _kg_told(weight: Mapping[str, float]) -> str:
    return f"{weight['payload_kg']:.0f} ± {weight['plus_minus_kg']:.0f} kg"


_DONE: Final = {
    "held": "nothing was learnt from it: correct it, leave it out, or add confirmed = true",
    "weak": "it counts less",
}


def _asked(record: Record) -> Iterator[str]:
    """What is asked about statements and drives, and the file."""
    for one in record["statements"]:
        named = f"row {one['row']}" + (f" ({one['ref']})" if one["ref"] else "")
        if one["question"]:
            yield f"{named}: {one['question']} ({_DONE[one['state']]})"
        elif one["state"] == "checked":
            yield f"{named}: checked: {_kg_told(one['found'])} found of drive {one['drives'][0]}"
    yield from record["learning"]["findings"]
    if numbers := record["looks_empty"]:
        drives = [record["drives"][number - 1] for number in numbers]
        named = f"drive{'s' * (len(numbers) > 1)} {', '.join(map(str, numbers))}"
        looks = "looks" if len(numbers) == 1 else "look"
        dated = [one for one in drives if one["t_start"]]
        asked = "Is that right? Then add to the statements:" if dated else "A statement needs a log with dates."
        yield f"{named} of unknown load {looks} empty. {asked}"
        yield from ["    from;until;source"] * bool(dated)
        yield from (f"    {one['t_start'][:19]}Z;{one['t_end'][:19]}Z;empty" for one in dated)
    yield f"{record['output'] or 'no file written'}: id {record['calibration_id']}"
    yield from (f"warning: {one}" for one in record["warnings"] if ": load" not in one)
