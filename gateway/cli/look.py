"""springscale look: from an unknown log to a first signal map."""

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import click

from gateway.bus.heard import Heard
from gateway.cli.options import FILE, Told, prints
from gateway.offline.look.draft import write_draft
from gateway.offline.look.look import Look, MapFit
from gateway.offline.look.look import look as look_at
from gateway.offline.look.readings import Described
from gateway.records import EXTENDED_ID, JOURNEY


@click.command("look")
@click.argument("log", type=FILE)
@click.option(
    "--dbc", "databases", type=FILE, multiple=True, help="database of a device, repeatable [default: those beside LOG]"
)
@click.option("--output", type=FILE, default=None, help="write a first signal map here")
@prints
def look(log: Path, databases: tuple[Path, ...], output: Path | None) -> Told:
    """The content of LOG: identifiers, the signal maps that fit, the axis that shows gravity, and whether that can
    work.

    Takes every kind of log that the other commands take.
    """
    seen = look_at(log, databases)
    written = write_draft(seen, output) if output else ()
    record = {**look_json(seen), "written": [str(path) for path in written]}
    return record, "\n".join([look_text(seen), *(f"Written: {path}" for path in written)])


MOST_UNKNOWN = 12  # chosen: lines of identifiers that nothing describes
MOST_FITS = 4  # chosen: signal maps that are listed, the best


def look_text(seen: Look) -> str:
    """Identifiers, maps, axes, and the verdict at the end."""
    return "\n".join([*_heard(seen), "", *_readings(seen), "", *_fits(seen), "", *_verdict(seen)])


def _heard(seen: Look) -> Iterator[str]:
    channels = sorted({one.channel for one in seen.heard if one.channel})
    on = f" on {', '.join(channels)}" if channels else ""
    yield f"{seen.log}: {seen.report.wanted} frames in {seen.duration_s:.0f} s{on}"
    if seen.report.n_rejected:
        yield f"  {seen.report.n_rejected} lines could not be read"
    if seen.report.ended_early:
        yield f"  the log ended early: {seen.report.ended_early}"
    yield ""
    yield f"{'channel':<8} {'identifier':<10} {'per s':>7}  {'bytes':<7} message"
    names = _names(seen)
    unknown = 0
    for one in seen.heard:
        message = names.get(id(one), "")
        unknown += not message
        if message or unknown <= MOST_UNKNOWN:
            lengths = ",".join(map(str, one.lengths))
            yield f"{one.channel or '-':<8} {one.name:<10} {one.rate_hz:>7.1f}  {lengths:<7} {message}".rstrip()
    if unknown > MOST_UNKNOWN:
        yield f"... and {unknown - MOST_UNKNOWN} identifiers more that no database describes"
    yield from seen.faults


def _names(seen: Look) -> dict[int, str]:
    """The probable meaning of each identifier, by identity."""
    told = {}
    for one in seen.described:
        other_length = "" if one.has_length else f", which has {one.message.length} bytes there"
        told[id(one.heard)] = f"{one.message.name} ({one.message.source.name}){other_length}"
    return told


def _readings(seen: Look) -> Iterator[str]:
    if not seen.accelerations:
        yield "No acceleration: no database describes one."
        return
    yield "Accelerations, usual reading:"
    why = {found.reading.name: found.why for found in seen.found}
    for reading in seen.accelerations:
        yield f"  {reading.name}: {reading.usual:+.2f} m/s2  {why.get(reading.name, '')}".rstrip()
    if math.isfinite(seen.tilt_deg):
        yield f"  the sensor leans by {seen.tilt_deg:.0f} degrees"
    for found in seen.found:
        if found.reading.quantity != "acceleration":
            sign = "" if found.role in JOURNEY else f", sign {found.sign:+d}"
            yield f"{found.role.replace('_', ' ').capitalize()}: {found.reading.name}{sign}: {found.why}"


def _fits(seen: Look) -> Iterator[str]:
    if not seen.fits:
        yield "None of the signal maps that come with springscale fits."
        return
    yield "Signal maps that come with springscale:"
    for fit in seen.fits[:MOST_FITS]:
        where = f" on {fit.channel}" if fit.channel else ""
        yield f"  springscale:{fit.name}{where}: {_fit(fit)}"


def _fit(fit: MapFit) -> str:
    if fit.is_whole:
        without = f", without {', '.join(fit.missing)}" if fit.missing else ""
        return f"fits{without}; its vertical axis reads {fit.gravity_mps2:+.2f} m/s2"
    told = f"has {', '.join(fit.found)}" + (f", lacks {', '.join(fit.missing)}" if fit.missing else "")
    if math.isfinite(fit.gravity_mps2):
        told += f"; its vertical axis reads {fit.gravity_mps2:+.2f} m/s2 and not 9.8"
    return told


def _verdict(seen: Look) -> Iterator[str]:
    if not seen.lacking:
        unsure = " and ".join(seen.unsure_databases)
        yield (
            f"This can work, if {unsure} describes your device: only identifiers and lengths say so."
            if unsure
            else ("This can work.")
        )
        if seen.shipped:
            yield f'Say signals = "springscale:{seen.shipped.name}", or write your own copy with --output.'
        return
    yield "This cannot work yet:"
    yield from (f"  {what}" for what in seen.lacking)


def look_json(seen: Look) -> dict[str, Any]:
    """The same for programs; numbers in SI."""
    names = {id(one.heard): one for one in seen.described}
    return {
        "log": str(seen.log),
        "duration_s": round(seen.duration_s, 3),
        "n_frames": seen.report.wanted,
        "identifiers": [_identifier(one, names.get(id(one))) for one in seen.heard],
        "accelerations": [
            {"name": r.name, "usual_mps2": round(r.usual, 3)} for r in seen.accelerations
        ],
        "tilt_deg": round(seen.tilt_deg, 1) if math.isfinite(seen.tilt_deg) else None,
        "signals": {
            str(found.role): {
                "message": found.reading.described.message.name,
                "signal": found.reading.signal.name,
                "sign": found.sign,
                "is_sure": found.is_sure,
                "why": found.why,
            }
            for found in seen.found
        },
        "maps": [
            {
                "name": f"springscale:{fit.name}",
                "channel": fit.channel,
                "fits": fit.is_whole,
                "found": list(map(str, fit.found)),
                "missing": list(map(str, fit.missing)),
                "vertical_mps2": round(fit.gravity_mps2, 3) if math.isfinite(fit.gravity_mps2) else None,
            }
            for fit in seen.fits
        ],
        "can_work": not seen.lacking,
        "unsure_databases": list(seen.unsure_databases),
        "lacking": list(seen.lacking),
    }  # fmt: skip


def _identifier(one: Heard, known: Described | None) -> dict[str, Any]:
    return {
        "channel": one.channel,
        "id": one.name,
        "is_extended": bool(one.can_id & EXTENDED_ID),
        "n_frames": one.n_frames,
        "rate_hz": round(one.rate_hz, 2),
        "lengths": list(one.lengths),
        "message": known.message.name if known else None,
        "database": known.message.source.name if known else None,
    }
