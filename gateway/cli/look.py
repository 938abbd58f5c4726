"""springscale look: from an unknown log to a first signal map."""

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import click

from gateway.bus.signals.dbc import DatabaseMessage
from gateway.cli.options import FILE, Told, prints
from gateway.offline.look.draft import write_draft
from gateway.offline.look.log_look import Described, Heard, Look, MapFit
from gateway.offline.look.log_look import look as look_at


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
    return record, "\n".join([look_text(seen, output), *(f"Written: {path}" for path in written)])


MOST_UNKNOWN = 12  # chosen: lines of identifiers that nothing describes


def look_text(seen: Look, written: Path | None = None) -> str:
    """Identifiers, maps, axes, the verdict and the next step; ``written`` is the signal map that was written."""
    return "\n".join([*_heard(seen), "", *_readings(seen), "", *_fits(seen), "", *_verdict(seen, written)])


def _heard(seen: Look) -> Iterator[str]:
    channels = sorted({one.channel for one in seen.heard if one.channel})
    on = f" on {', '.join(channels)}" if channels else ""
    yield f"{seen.log}: {seen.report.wanted} frames in {seen.report.span_s:.0f} s{on}"
    yield from (f"  {remark.removeprefix(f'{seen.log}: ')}" for remark in seen.report.remarks())
    yield from (f"  {one.text}" for one in seen.refused)
    yield ""
    yield f"{'channel':<8} {'identifier':<10} {'per s':>7}  {'bytes':<7} message"
    known = {id(one.heard): one for one in seen.described}
    unknown = [one for one in seen.heard if id(one) not in known]
    for one in seen.heard:
        if id(one) in known or one in unknown[:MOST_UNKNOWN]:
            lengths, message = ",".join(map(str, one.lengths)), _message(known.get(id(one)))
            yield f"{one.channel or '-':<8} {one.name:<10} {one.rate_hz:>7.1f}  {lengths:<7} {message}".rstrip()
    if len(unknown) > MOST_UNKNOWN:
        yield f"... and {len(unknown) - MOST_UNKNOWN} identifiers more that no database describes"
    yield from seen.faults


def _message(found: Described | None) -> str:
    if found is None:
        return ""
    other_length = "" if found.has_length else f", which has {found.message.length} bytes there"
    return f"{found.message.name} ({found.message.source.name}){other_length}"


def _readings(seen: Look) -> Iterator[str]:
    readings = [reading for reading in seen.readings if reading.quantity == "acceleration" and len(reading.x)]
    yield "Accelerations, usual reading:" if readings else "No acceleration: no database describes one."
    why = {id(found.reading): found.why for found in seen.found}
    for reading in readings:
        yield f"  {reading.name}: {reading.usual:+.2f} m/s2  {why.get(id(reading), '')}".rstrip()
    if math.isfinite(seen.tilt_deg):
        yield f"  the sensor leans by {seen.tilt_deg:.0f} degrees"
    for found in seen.found:
        if found.reading.quantity != "acceleration":
            role = found.role.replace("_", " ").capitalize()
            yield f"{role}: {found.reading.name}, sign {found.sign:+d}: {found.why}"


def _fits(seen: Look) -> Iterator[str]:
    none = "None of the signal maps that come with springscale fits."
    yield "Signal maps that come with springscale:" if seen.fits else none
    for fit in seen.fits:
        where = f" on {fit.channel}" if fit.channel else ""
        yield f"  springscale:{fit.name}{where}: {_fit(fit)}"


def _fit(fit: MapFit) -> str:
    if fit.is_whole:
        without = f", without {', '.join(fit.missing)}" if fit.missing else ""
        return f"fits{without}; its vertical axis reads {fit.gravity_mps2:+.2f} m/s2"
    told = f"has {', '.join(fit.found)}" + (f", lacks {', '.join(fit.missing)}" if fit.missing else "")
    if math.isfinite(fit.gravity_mps2):
        told += f"; its vertical axis reads {fit.gravity_mps2:+.2f} m/s2" + ("" if fit.has_gravity else " and not 9.8")
    return told


def _verdict(seen: Look, written: Path | None) -> Iterator[str]:
    if seen.lacking:
        yield "This cannot work yet:"
        yield from (f"  {what}" for what in (*seen.to_mend, *seen.lacking))
        return
    if seen.to_mend:
        yield "This can work, once the signal map says so or its database is right:"
        yield from (f"  {what}" for what in seen.to_mend)
        return
    if unsure := " and ".join(seen.unsure_databases):
        yield f"This can work, if {unsure} describes your device: only identifiers and lengths say so."
    else:
        yield "This can work."
    signals = f"springscale:{seen.shipped.name}" if seen.shipped else written or "signals.toml"
    if not seen.shipped and written is None:
        yield f"Next: write a signal map with `springscale look {seen.log} --output {signals}`, and check its signs."
    yield f'Next: `springscale run` with signals = "{signals}" in springscale.toml; its page /teach asks for the rest.'
    yield f"Or without a service: `springscale learn {seen.log} ... --signals {signals} --vehicle van.toml`."


def look_json(seen: Look) -> dict[str, Any]:
    """The findings as JSON for programs; numbers in SI."""
    known = {id(one.heard): one.message for one in seen.described}
    return {
        "identifiers": [_identifier(one, known.get(id(one))) for one in seen.heard],
        "tilt_deg": round(seen.tilt_deg, 1) if math.isfinite(seen.tilt_deg) else None,
        "signals": {
            str(found.role): {
                "name": found.reading.name,
                "sign": found.sign,
                "is_sure": found.is_sure,
                "why": found.why,
            }
            for found in seen.found
        },
        "left_out": seen.report.left_out,
        "maps": [
            {
                "name": f"springscale:{fit.name}",
                "channel": fit.channel,
                "fits": fit.is_whole,
                "missing": list(map(str, fit.missing)),
                "vertical_mps2": round(fit.gravity_mps2, 3) if math.isfinite(fit.gravity_mps2) else None,
            }
            for fit in seen.fits
        ],
        "refused": [one.text for one in seen.refused],
        "to_mend": list(seen.to_mend),
        "can_work": not seen.lacking,
        "unsure_databases": list(seen.unsure_databases),
        "lacking": list(seen.lacking),
    }


def _identifier(one: Heard, message: DatabaseMessage | None) -> dict[str, Any]:
    return {
        "channel": one.channel,
        "id": one.name,
        "n_frames": one.n_frames,
        "rate_hz": round(one.rate_hz, 2),
        "lengths": list(one.lengths),
        "message": message.name if message else None,
        "database": message.source.name if message else None,
    }
