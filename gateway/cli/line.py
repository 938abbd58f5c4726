"""springscale line: a prior for the next vehicle from several vehicles of one line."""

from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

import click

from gateway.calibration.campaign import Campaign, file_sha256, load_campaign
from gateway.calibration.file.calibration_file import CalibrationFile, load_calibration
from gateway.calibration.file.line_file import LineFile, load_like
from gateway.calibration.known_run import KnownRun
from gateway.calibration.line.scatter import SCATTER_STD
from gateway.calibration.line_files import build_line
from gateway.cli.options import FILE, Told, batch_settings, prints, require_output_place
from gateway.cli.progress import Steps, counted
from gateway.core.cross_spectrum.model.parameters import is_positive
from gateway.errors import CampaignError, ConfigurationError
from gateway.files.whole import refusal_told, write_whole
from gateway.offline.campaigns import inspect
from gateway.words import in_sections


@click.group("line")
def line() -> None:
    """Build the line of several vehicles, for `calibrate --like`; show one."""


@line.command("build")
@click.argument("files", type=FILE, nargs=-1, required=True)
@click.option("--output", type=FILE, required=True, help="line file to write")
@click.option(
    "--logs",
    "campaigns",
    type=FILE,
    multiple=True,
    help="campaign that one of FILES was calibrated from; repeatable; each such vehicle is left out in turn",
)
@prints
def build(files: tuple[Path, ...], output: Path, campaigns: tuple[Path, ...]) -> Told:
    """Make the line of the calibrations FILES, sisters of one model.

    From three on, the scatter between vehicles is estimated. With --logs each vehicle of these campaigns is calibrated
    once more, from one empty drive and the other vehicles, and weighs its other loads: these errors set how far
    intervals are widened.
    """
    require_output_place(output)
    calibrations = [load_calibration(path) for path in files]
    with counted("reading drives") as on_step:
        runs = _runs(calibrations, [load_campaign(path) for path in campaigns], on_step)
    built = _build(calibrations, runs)
    with refusal_told(output, ConfigurationError):
        write_whole(output, built.to_json())
    record = {
        "line_id": built.id,
        "output": str(output),
        "members": list(built.line.members),
        "n_siblings": built.line.n_siblings,
        "expected_errors": built.expected_errors.model_dump(mode="json") if built.expected_errors else None,
        "warnings": list(built.warnings),
    }
    return record, f"{output}: {len(built.siblings)} vehicles\n{line_text(built)}"


@line.command("show")
@click.argument("file", type=FILE)
@prints
def show(file: Path) -> Told:
    """The content of the line FILE: its vehicles, the scatter between them, and how far intervals are widened."""
    held = load_like(file)
    if not isinstance(held, LineFile):
        raise ConfigurationError(f"{file}: is the calibration of one vehicle: see `springscale calibration show`")
    return {"id": held.id, **held.model_dump(mode="json")}, line_text(held)


def _build(calibrations: Sequence[CalibrationFile], runs: dict[str, tuple[KnownRun, ...]]) -> LineFile:
    """A progress bar of the vehicles left out."""
    done = 0
    with counted("leaving siblings out") as on_step:

        def on_sibling() -> None:
            nonlocal done
            done += 1
            on_step(done, len(runs))

        return build_line(calibrations, runs, on_sibling)


def _runs(
    calibrations: Sequence[CalibrationFile], campaigns: Sequence[Campaign], on_step: Steps
) -> dict[str, tuple[KnownRun, ...]]:
    runs = {}
    for done, campaign in enumerate(campaigns):
        made = _made_from(campaign, calibrations)
        numbers = [run.number for run in made.provenance.runs]
        inspection = inspect(campaign, batch_settings(None), numbers=numbers)
        runs[made.id] = tuple(one.identification for one in inspection.usable)
        on_step(done + 1, len(campaigns))
    return runs


def _made_from(campaign: Campaign, calibrations: Sequence[CalibrationFile]) -> CalibrationFile:
    sha256 = file_sha256(campaign.path)
    for one in calibrations:
        if one.provenance.campaign_sha256 == sha256:
            return one
    raise CampaignError(
        f"{campaign.path}: none of the calibrations was made from this campaign file as it is now: name the campaign "
        "of each, unchanged since, or leave --logs out"
    )


def line_text(held: LineFile) -> str:
    """The whole file but its arrays, in lines."""
    n = held.line.n_siblings
    scatter = f"estimated from {n} of them (default in brackets)" if n else "the defaults"
    sections: dict[str, Iterable[str]] = {
        "vehicles": _vehicles(held),
        "intervals": _limits(held),
        f"differences between two vehicles, standard deviations: {scatter}": _scatter(held),
        "warnings": held.warnings or ("none",),
    }
    return in_sections([f"id {held.id}"], sections)


def _vehicles(held: LineFile) -> Iterator[str]:
    for one in held.siblings:
        yield f"{one.name:28}{one.empty_mass_kg:7.0f} kg {one.n_runs:4} runs  {one.id}"


def _limits(held: LineFile) -> Iterator[str]:
    errors = held.expected_errors
    if errors is None or errors.payload_rms_kg is None or errors.front_share_rms_pct is None:
        yield "no sibling was left out: as wide as those of the widest member"
    else:
        share = f"{errors.front_share_rms_pct:.2f} percentage points rms"
        yield f"siblings left out: payload {errors.payload_rms_kg:.1f} kg rms, front share {share}"
    limits = held.line.limits
    payload_kg, share_pct, _ = limits.model_std
    yield f"{'error of the model':28}{payload_kg:.1f} kg, {share_pct:.2f} percentage points (standard deviations)"
    yield f"{'misfit believed up to':28}{limits.misfit_limit:.2f}"


def _scatter(held: LineFile) -> Iterator[str]:
    for name, std in held.line.scatter_std.items():
        default = f" ({_std(name, SCATTER_STD[name])})" if held.line.n_siblings and name in SCATTER_STD else ""
        yield f"{name:28}{_std(name, std):>8}{default}"


def _std(name: str, std: float) -> str:
    return f"{100.0 * std:.1f} %" if is_positive(name) else f"{std:.2g}"
