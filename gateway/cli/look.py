"""springscale look: from an unknown log to a first signal map."""

from collections.abc import Iterator
from pathlib import Path
from typing import Final

import click

from gateway.bus.signals.mapping import id_name
from gateway.cli.options import FILE, Told, prints
from gateway.offline.look.heard import Heard
from gateway.offline.look.log_look import Look, MapFit
from gateway.units import STANDARD_GRAVITY_MPS2
from gateway.words import some

MOST_UNKNOWN: Final = 12  # chosen: lines of identifiers that nothing describes


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
    seen = Look(log, databases)
    written = [str(path) for path in seen.write_draft(output)] if output else []
    return {**seen.to_json(), "written": written}, "\n".join([*look_lines(seen, written)])


def look_lines(seen: Look, written: list[str]) -> Iterator[str]:
    """Identifiers, maps, axes, the verdict and the next step; ``written`` are the files of a draft, the map first."""
    channels = sorted({one.channel for one in seen.heard if one.channel})
    on = f" on {', '.join(channels)}" if channels else ""
    yield f"{seen.log}: {seen.report.wanted} frames in {seen.report.span_s:.0f} s{on}"
    yield from (f"  {remark.removeprefix(f'{seen.log}: ')}" for remark in seen.report.remarks())
    yield from (f"  {text}" for text in seen.refused)
    yield f"\n{'channel':<8} {'identifier':<10} {'per s':>7}  {'bytes':<7} message"
    unknown = [one for one in seen.heard if one.message is None]
    yield from (_identifier(one) for one in seen.heard if one.message or one in unknown[:MOST_UNKNOWN])
    if len(unknown) > MOST_UNKNOWN:
        yield f"... and {len(unknown) - MOST_UNKNOWN} identifiers more that no database describes"
    yield from some(seen.faults, "")
    yield "\nAccelerations, usual reading, and signals with a role:"
    roles = {id(found.reading): f"  {found.role}, sign {found.sign:+d}: {found.why}" for found in seen.found}
    for each in seen.readings:
        if len(each.x) and (each.quantity == "acceleration" or id(each) in roles):
            usual = f": {each.usual:+.2f} m/s2" if each.quantity == "acceleration" else ""
            yield f"  {each.name}{usual}{roles.get(id(each), '')}"
    yield "\nSignal maps that come with springscale:" if seen.fits else "\nNo map that comes with springscale fits."
    yield from map(_fit, seen.fits)
    yield ""
    yield from _verdict(seen, written)


def _identifier(one: Heard) -> str:
    lengths, message = ",".join(map(str, one.lengths)), ""
    if one.message:
        is_other = one.message.length not in one.lengths
        other = f", which has {one.message.length} bytes there" if is_other else ""
        message = f"{one.message.name} ({one.message.source.name}){other}"
    return f"{one.channel or '-':<8} {id_name(one.can_id):<10} {one.rate_hz:>7.1f}  {lengths:<7} {message}".rstrip()


def _fit(fit: MapFit) -> str:
    told = "fits" if fit.fits else f"does not fit: has {', '.join(fit.found)}"
    told += f", lacks {', '.join(fit.missing)}" if fit.missing else ""
    if fit.vertical_mps2 is not None:
        told += f"; its vertical axis reads {fit.vertical_mps2:+.2f} m/s2"
        told += "" if fit.has_gravity else f", where gravity is {STANDARD_GRAVITY_MPS2:+.2f}"
    told = "; ".join((told, *(each.text for each in fit.silent)))
    return f"  {fit.name}{f' on {fit.channel}' if fit.channel else ''}: {told}"


def _verdict(seen: Look, written: list[str]) -> Iterator[str]:
    if seen.lacking or seen.to_mend:
        once = "This can work, once the signal map says so or its database is right:"
        yield "This cannot work yet:" if seen.lacking else once
        yield from (f"  {what}" for what in (*seen.to_mend, *seen.lacking))
    else:
        steps = ", but not across the steps in its stamps (see above)" if seen.report.has_several_zeros else ""
        yield f"This can work{steps}."
    if not seen.lacking:
        is_shipped = len(seen.whole) == 1
        signals = seen.whole[0].name if is_shipped else written[0] if written else "signals.toml"
        if not written and not is_shipped:
            yield f"Next: write a signal map: `springscale look {seen.log} --output {signals}`, and check its signs."
        yield f'Next: `springscale run` with signals = "{signals}"; its page /teach asks for the rest.'
        yield f"Or without a service: `springscale learn {seen.log} ... --signals {signals} --vehicle van.toml`."
    yield from (f"Written: {path}" for path in written)
