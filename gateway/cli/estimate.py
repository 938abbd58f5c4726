"""springscale estimate: logs to estimates, by the same pipeline as the service."""

import csv
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from datetime import timedelta
from functools import partial
from io import StringIO
from pathlib import Path
from typing import Any, Final

import click

from gateway.bus.logs import LogReport
from gateway.calibration.file import CalibrationFile
from gateway.cli import options
from gateway.cli.options import FILE, as_json, batch_settings, one_estimator, window
from gateway.config import load_settings
from gateway.core.batch_settings import BatchSettings
from gateway.core.vehicle import Vehicle
from gateway.errors import NothingWeighedError
from gateway.estimates.as_json import COLUMNS, estimate_to_json, table_row
from gateway.estimates.batch_estimate import Estimate
from gateway.estimates.field_kinds import without_dates
from gateway.estimates.quantity import half_width
from gateway.estimates.reasons import EXPLANATIONS
from gateway.offline.estimates import estimates_of_logs
from gateway.records import Why, json_line
from gateway.service.calibration_in_use import with_learnt
from gateway.setup import Setup, load_setup, setup_of
from gateway.units import NS_PER_S, si_factor


@click.command("estimate")
@click.argument("logs", nargs=-1, required=True, type=FILE)
@options.config
@options.signals
@options.calibration
@one_estimator
@window
@as_json
@click.option("--csv", "as_csv", is_flag=True, help="a table: one row a batch, the columns of the history's CSV")
def estimate(
    logs: tuple[Path, ...],
    config_path: Path | None,
    signals: str | None,
    calibration: Path | None,
    estimator: str | None,
    window_s: float | None,
    as_json: bool,
    as_csv: bool,
) -> None:
    """One line per batch of every LOG, rejected ones included with their reasons.

    With several logs each line names its log: in front of the line, as "log" in its JSON, or in a first column.
    If no batch could be weighed, it says why and what to do, and exits with 1; not so with --json and no
    calibration, which is how to get the spectra alone.
    """
    if as_json and as_csv:
        raise click.UsageError("give --json or --csv, not both")
    setup, settings = _prepared(config_path, signals, calibration, estimator, window_s)
    lines = partial(_csv, has_logs=len(logs) > 1) if as_csv else _json_lines if as_json else _sentences
    reasons, unlike, refused = Counter[Why | None](), Counter[Why](), list[str]()

    def on_read(report: LogReport) -> None:
        for remark in report.remarks():  # unreadable parts of the log and refused frames, beside the estimates
            click.echo(remark, err=True)
        refused.extend(f"{report.path}: {cause.text}" for cause in report.causes())

    def found() -> Found:
        for log in logs:
            for weighed in estimates_of_logs([log], setup, settings, on_read=on_read, with_remainders=True):
                reasons.update(weighed.rejected or [None])
                if setup.calibration is not None and _is_at_seen_speed(weighed, setup.calibration):
                    unlike.update(UNLIKE.intersection(weighed.rejected))
                if not weighed.is_remainder:
                    yield log if len(logs) > 1 else None, weighed

    for line in lines(found()):
        click.echo(line)
    is_for_spectra = as_json and setup.calibration is None
    if not reasons.pop(None, 0) and not is_for_spectra:
        # where the model fits, and only the load lies beyond those that taught, it is this vehicle
        is_unlike = 2 * unlike.total() > reasons.total() and unlike.keys() != {Why.OUT_OF_RANGE}
        other = [_other_vehicle(setup.calibration.vehicle)] if setup.calibration is not None and is_unlike else []
        raise NothingWeighedError("\n".join([_in_words(reasons, refused), *other]))


Found = Iterable[tuple[Path | None, Estimate]]  # the log, if there are several


def _in_words(reasons: Counter[Why | None], refused: Sequence[str]) -> str:
    """Why no batch was weighed, the most frequent reason first, and what to do about each.

    Frames that the decoder refused come first, and are the only advice: the rest may follow from them.
    """
    lines = ["nothing was weighed" + ("" if reasons else ": there is no batch in these logs")]
    lines += [f"  mend this first: {text}" for text in refused]
    for why, n in reasons.most_common():
        if why is not None:
            told = EXPLANATIONS[why]
            advice = "" if refused else f": {told.happened}. What to do: {told.advice}."
            lines.append(f"  {why} ({n} batch{'es' * (n > 1)}){advice}")
    return "\n".join(lines)


UNLIKE: Final = frozenset({Why.MODEL_MISFIT, Why.NO_SOLUTION, Why.AMBIGUOUS, Why.OUT_OF_RANGE, Why.SENSOR_CHANGED})
"""Reasons that the calibration of another vehicle gives for a drive at the speeds that it has seen."""

NEW_SPEED: Final = 0.2  # chosen: relative, beyond the speeds of calibration; there the right vehicle is refused too


def _is_at_seen_speed(weighed: Estimate, calibration: CalibrationFile) -> bool:
    slowest_mps, fastest_mps = calibration.seen.speed_mps
    return slowest_mps / (1.0 + NEW_SPEED) <= weighed.mean_speed_mps <= fastest_mps * (1.0 + NEW_SPEED)


def _other_vehicle(vehicle: Vehicle) -> str:
    """The likely cause, if most batches look like another vehicle's."""
    return (
        f"  The likely cause: this is not the log of the vehicle that was calibrated, {vehicle.name} (wheelbase "
        f"{vehicle.wheelbase_m:g} m, {vehicle.empty_mass_kg:.0f} kg sprung), or its springs, tyres or sensor were "
        "changed since."
    )


def _sentences(found: Found) -> Iterator[str]:
    for log, weighed in found:
        text = sentence(without_dates(estimate_to_json(weighed)))
        yield text if log is None else f"{log}: {text}"


def _json_lines(found: Found) -> Iterator[str]:
    for log, weighed in found:
        record = without_dates(estimate_to_json(weighed))
        yield json_line(record if log is None else {"log": str(log), **record})


def _csv(found: Found, *, has_logs: bool) -> Iterator[str]:
    """The head line first; each row at once, so that a long log shows its estimates as they come."""
    text = StringIO()
    table = csv.DictWriter(text, ("log", *COLUMNS) if has_logs else COLUMNS, lineterminator="")
    table.writeheader()
    yield text.getvalue()
    for log, weighed in found:
        text.seek(0)
        text.truncate()
        table.writerow(table_row(weighed) | ({"log": str(log)} if has_logs else {}))
        yield text.getvalue()


def _prepared(
    config_path: Path | None,
    signals: str | None,
    calibration: Path | None,
    estimator: str | None,
    window_s: float | None,
) -> tuple[Setup, BatchSettings]:
    """The estimator and the batch settings; with settings, the calibration that their service uses, learnt or not."""
    if config_path is not None:
        if signals is not None:
            raise click.UsageError("give --config or --signals, not both")
        configured = with_learnt(load_settings(config_path))
        if calibration is not None:
            configured = configured.model_copy(update={"calibration": calibration})
        batch = replace(configured.batch.for_core(window_s=window_s), position_decimals=configured.position.decimals)
        return setup_of(configured, estimator), batch
    if signals is None:
        raise click.UsageError("give --config FILE, or --signals FILE (and --calibration FILE)")
    return load_setup(signals, calibration, estimator), batch_settings(window_s)


def sentence(record: Mapping[str, Any]) -> str:
    """One line of the object of ``estimate_to_json``: when, how much, with its interval; or why not."""
    when = _begun(record)
    if record["rejected"]:
        return f"{when}  no estimate: {', '.join(record['rejected'])}"
    payload = _told(record, "payload", "kg", "7.1f", "5.1f")
    front_share = _told(record, "front_share", "pct", "5.2f", "4.2f")
    speed_kmh = record["mean_speed_mps"] / si_factor("speed", "km/h")
    return f"{when}  {payload}   {front_share}   {_aside(record)}{speed_kmh:5.1f} km/h{_too_much(record)}"


def _begun(record: Mapping[str, Any]) -> str:
    """The start to the second: 2026-11-21T03:50:00Z, or the time in a log without a date."""
    if record["t_start"] is not None:
        return f"{record['t_start'][:19]}Z"
    return f"no date, {timedelta(seconds=record['t_start_ns'] // NS_PER_S)}"


def _told(record: Mapping[str, Any], name: str, unit: str, form: str, half_form: str) -> str:
    """A quantity and half its interval; a calibration may contain one of the two alone."""
    words, number = name.replace("_", " "), record[f"{name}_{unit}"]
    if number is None:
        return f"{words} unknown"
    half = half_width(record[f"{name}_interval95_{unit}"])
    return f"{words} {number:{form}} {'%' if unit == 'pct' else unit} ± {half:{half_form}} (95 %)"


def _aside(record: Mapping[str, Any]) -> str:
    """The lateral position of the sprung mass, if known."""
    if record["cg_left_m"] is None:
        return ""
    half_mm = 1000.0 * half_width(record["cg_left_interval95_m"])
    return f"{1000.0 * record['cg_left_m']:+5.0f} mm left ± {half_mm:3.0f} (95 %)   "


def _too_much(record: Mapping[str, Any]) -> str:
    over = [place.replace("_", " ") for place, weight in record["weights"].items() if weight["is_over_limit"]]
    return f"   over the limit: {', '.join(over)}" if over else ""
