"""springscale calibration: look at calibration files, compare and check them; state known weights to a service."""

import math
import sys
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import click

from gateway.calibration.axle_weights import UNSPRUNG_SHARE, AxleWeights, Sprung, sprung_of
from gateway.calibration.campaign import load_campaign
from gateway.calibration.file.calibration_file import CalibrationFile, load_calibration
from gateway.calibration.file.comparison import (
    Check,
    CheckResult,
    Difference,
    FittedFigure,
    check_against_campaign,
    differences,
    figures_of,
)
from gateway.calibration.file.parts import ExpectedErrorsPart
from gateway.cli.known_weights import tare_commands, ticket_commands
from gateway.cli.options import FILE, NumberRange, Told, as_json, prints
from gateway.records import json_line
from gateway.stated.facts import DIVISION_KG
from gateway.words import in_sections


@click.group("calibration")
def calibration() -> None:
    """Look at calibration files, compare and check them; state known weights to a running service (tare, ticket)."""


calibration.add_command(tare_commands)
calibration.add_command(ticket_commands)


@calibration.command("show")
@click.argument("file", type=FILE)
@prints
def show(file: Path) -> Told:
    """The content of FILE: vehicle, ranges, parameters with their standard deviations, expected errors, provenance."""
    held = load_calibration(file)
    return {"id": held.id, **held.model_dump(mode="json")}, calibration_text(held)


@calibration.command("diff")
@click.argument("one", type=FILE)
@click.argument("other", type=FILE)
@prints
def diff(one: Path, other: Path) -> Told:
    """The differences between two files; fitted figures in combined standard deviations, the most different first."""
    ours, theirs = load_calibration(one), load_calibration(other)
    changes = differences(ours, theirs)
    listed = [asdict(each) | {"n_std": None if each.n_std == math.inf else each.n_std} for each in changes]
    identical = f"identical: {ours.id}" if ours.id == theirs.id else "identical but for the ids"
    record = {"ids": [ours.id, theirs.id], "is_identical": not changes, "differences": listed}
    return record, "\n".join(map(_difference, changes)) or identical


@calibration.command("verify")
@click.argument("file", type=FILE)
@click.option("--logs", "campaign", type=FILE, default=None, help="campaign file: check the logs it was made from")
@as_json
def verify(file: Path, campaign: Path | None, as_json: bool) -> None:
    """Check FILE: content against its id, shape, known model; with --logs also the logs it was made from.

    Exit codes: 0 good, 1 a log or load is not the one it was made from, 2 the file itself cannot be used.
    """
    held = load_calibration(file)
    held.for_core()  # raises where this springscale does not know the model
    checks = [*_own_checks(held), *(check_against_campaign(held, load_campaign(campaign)) if campaign else ())]
    is_good = all(check.verdict is not CheckResult.FAULT for check in checks)
    if as_json:
        click.echo(json_line({"id": held.id, "is_good": is_good, "checks": [asdict(check) for check in checks]}))
    else:
        click.echo("\n".join(f"{check.verdict:5}  {check.what}: {check.text}" for check in checks))
    sys.exit(0 if is_good else 1)


KILOGRAMS = NumberRange(0.0, 100_000.0, min_open=True)  # chosen: no road vehicle has more


@calibration.command("sprung")
@click.option("--front-axle-kg", type=KILOGRAMS, required=True, help="weight on the front axle, vehicle empty")
@click.option("--rear-axle-kg", type=KILOGRAMS, required=True, help="weight on the rear axle, vehicle empty")
@click.option("--unsprung-front-kg", type=KILOGRAMS, default=None, help="axle, wheels, brakes [default: estimated]")
@click.option("--unsprung-rear-kg", type=KILOGRAMS, default=None, help="the same at the rear [default: estimated]")
@click.option("--division-kg", type=KILOGRAMS, default=DIVISION_KG, show_default=True, help="step of the scales")
@prints
def sprung(
    front_axle_kg: float,
    rear_axle_kg: float,
    unsprung_front_kg: float | None,
    unsprung_rear_kg: float | None,
    division_kg: float,
) -> Told:
    """Sprung mass and front share from axle weights: a [vehicle] block for the campaign file.

    Weigh each axle of the empty vehicle, on level ground, with driver and tank as in service. docs/campaign.md has
    the formula.
    """
    body = sprung_of(AxleWeights(front_axle_kg, rear_axle_kg, unsprung_front_kg, unsprung_rear_kg), division_kg)
    record = {"vehicle": body.vehicle_keys(), **asdict(body)}
    del record["weights"]
    return record, vehicle_block(body)


def _own_checks(held: CalibrationFile) -> tuple[Check, ...]:
    """Checks that reading the file has already made."""
    return (
        Check("content", CheckResult.GOOD, f"matches its id {held.id}"),
        Check("shape", CheckResult.GOOD, f"version {held.version}"),
        Check("model", CheckResult.GOOD, f"known to this springscale: {', '.join(held.estimators) or 'no estimator'}"),
    )


def _difference(difference: Difference) -> str:
    apart = "" if difference.n_std is None else f"   ({difference.n_std:.2g} standard deviations)"
    return f"{difference.where}: {_plain(difference.one)} -> {_plain(difference.other)}{apart}"


def _plain(fact: Any) -> str:
    if isinstance(fact, list):
        return f"[{', '.join(map(_plain, fact))}]"
    return f"{fact:.6g}" if isinstance(fact, float) else "absent" if fact is None else str(fact)


def vehicle_block(sprung: Sprung) -> str:
    """The table with a comment on the source of its figures. The keys that a tape measures are named, not made up."""
    head = [
        "[vehicle]",
        f"# unsprung masses: front {_unsprung(sprung.unsprung_front_kg, sprung.weights.unsprung_front_kg)},",
        f"#                   rear {_unsprung(sprung.unsprung_rear_kg, sprung.weights.unsprung_rear_kg)}",
        f"# standard deviation of empty_mass_kg: {sprung.mass_std_kg:.0f} kg",
    ]
    keys = [f"{name} = {number}" for name, number in sprung.vehicle_keys().items()]
    return "\n".join([*head, *keys, "# still to be given: name, wheelbase_m, sensor_position_m"])


def _unsprung(kg: float, given_kg: float | None) -> str:
    told = "as given" if given_kg is not None else f"estimated, {100.0 * UNSPRUNG_SHARE:.1f} % of the sprung mass"
    return f"{kg:.1f} kg ({told})"


def calibration_text(held: CalibrationFile) -> str:
    """The whole file but its arrays, in lines."""
    sections: dict[str, Iterable[str]] = {
        "vehicle (as the campaign stated it)": _vehicle(held),
        "calibrated for": _ranges(held),
        "expected errors (runs left out of the fit)": _expected(held),
        **({"prior from its sister": (held.sister_id,)} if held.sister_id else {}),
        **{
            f"{part}: {len(figures)} parameters ± their standard deviations": _figures(figures)
            for part, figures in figures_of(held).items()
        },
        "warnings": held.warnings or ("none",),
        "made by": _provenance(held),
    }
    estimators = ", ".join(held.estimators) or "none"
    return in_sections([held.id, f"version {held.version}", f"estimators: {estimators}"], sections)


def _vehicle(held: CalibrationFile) -> Iterator[str]:
    for name, stated in asdict(held.vehicle).items():
        if stated is not None:
            yield f"{name:28}{_stated(stated)}"


def _stated(stated: object) -> str:
    if isinstance(stated, tuple):
        return " to ".join(map(_stated, stated))
    return f"{stated:g}" if isinstance(stated, float) else str(stated)


def _ranges(held: CalibrationFile) -> Iterator[str]:
    for name, span in held.seen.model_dump().items():
        yield f"{name:28}{'unknown' if span is None else f'{span[0]:.4g} to {span[1]:.4g}'}"


def _expected(held: CalibrationFile) -> Iterator[str]:
    for estimator in held.estimators:
        errors = held.expected_errors.get(estimator)
        running = "; the service runs this one by default" if estimator == held.estimators[0] else ""
        yield f"{estimator:28}{'unknown' if errors is None else _errors(errors)}{running}"


def _errors(errors: ExpectedErrorsPart) -> str:
    payload, share = errors.payload_rms_kg, errors.front_share_rms_pct
    parts = ["payload unknown" if payload is None else f"payload {payload:.1f} kg rms"]
    parts.append("front share unknown" if share is None else f"front share {share:.2f} percentage points rms")
    return ", ".join(parts)


def _figures(figures: Sequence[FittedFigure]) -> Iterator[str]:
    for figure in figures:
        yield f"{figure.name:28}{figure.centre:>12.5g} ± {figure.std:.2g}"


def _provenance(held: CalibrationFile) -> Iterator[str]:
    made = held.provenance
    yield made.software
    yield made.command
    yield f"campaign sha256 {made.campaign_sha256}"
    for run in made.runs:
        yield (
            f"run {run.number:<3} {run.payload_kg:7.1f} kg {run.front_share_pct:6.2f} %  {run.n_batches:3} batches  "
            f"{run.log}  sha256 {run.sha256[:12]}..."
        )
