"""springscale campaign: known-load drives as one archive to pass on."""

from pathlib import Path

import click

from gateway.cli.options import FILE, Told, prints
from gateway.cli.progress import counted
from gateway.offline.bundle import pack as pack_into
from gateway.words import known


@click.group("campaign")
def campaign() -> None:
    """Packs known-load drives into one archive, to pass on or to contribute."""


@campaign.command("pack")
@click.argument("folder", type=FILE)
@click.option("--output", type=FILE, required=True, help="archive to write (.zip)")
@click.option("--with-position", is_flag=True, help="keep latitude and longitude [default: left out]")
@prints
def pack(folder: Path, output: Path, with_position: bool) -> Told:
    """Pack FOLDER's campaign.toml, signal map, logs and contribution.toml into one archive.

    Only the frames that the signal map names are packed, nothing else of the bus. `calibrate` and `evaluate` take the
    archive in place of campaign.toml.
    """
    with counted("reading drives") as on_run:
        packed = pack_into(folder, output, with_position=with_position, on_run=on_run)
    runs = [
        f"{run.log}: {known(run.payload_kg, ' kg')}, {run.duration_s:.0f} s, {run.n_frames} frames"
        for run in packed.runs
    ]
    permission = packed.contribution.permission
    return packed.to_json(), "\n".join([*runs, f"Written: {output}, {permission.licence} by {permission.given_by}"])
