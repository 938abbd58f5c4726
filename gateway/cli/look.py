"""springscale look: from an unknown log to a first signal map."""

from pathlib import Path

import click

from gateway.cli.options import FILE, as_json
from gateway.cli.text.look import look_json, look_text
from gateway.offline.look import look as look_at
from gateway.offline.look import write_draft
from gateway.records import json_line


@click.command("look")
@click.argument("log", type=FILE)
@click.option(
    "--dbc", "databases", type=FILE, multiple=True, help="database of a device, repeatable [default: those beside LOG]"
)
@click.option("--output", type=FILE, default=None, help="write a first signal map here")
@as_json
def look(log: Path, databases: tuple[Path, ...], output: Path | None, as_json: bool) -> None:
    """The content of LOG: identifiers, the signal maps that fit, the axis that shows gravity, and whether that can
    work.

    Takes every kind of log that the other commands take.
    """
    seen = look_at(log, databases)
    written = write_draft(seen, output) if output else ()
    if as_json:
        click.echo(json_line({**look_json(seen), "written": [str(path) for path in written]}))
        return
    click.echo(look_text(seen))
    for path in written:
        click.echo(f"Written: {path}")
