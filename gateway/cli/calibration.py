"""springscale calibration show: the content of a calibration file."""

import math
from collections.abc import Iterable, Iterator
from dataclasses import asdict
from pathlib import Path

import click
import numpy as np

from gateway.calibration.file import CalibrationFile, ExpectedErrorsPart, load_calibration
from gateway.cli.options import FILE, Told, prints
from gateway.core.ratio_index.regression import RegressionModel
from gateway.estimates.quantity import Z95
from gateway.model.table import LOG, ROWS
from gateway.model.vehicle_model import VehicleModel
from gateway.words import in_sections, known


@click.group("calibration")
def calibration() -> None:
    """Show a calibration file."""


@calibration.command("show")
@click.argument("file", type=FILE)
@prints
def show(file: Path) -> Told:
    """The content of FILE: vehicle, ranges, parameters with their standard deviations, expected errors, provenance."""
    held = load_calibration(file)
    return {"id": held.id, **held.model_dump(mode="json")}, calibration_text(held)


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


Figures = list[tuple[str, float, float]]  # name, value, standard deviation


def figures_of(file: CalibrationFile) -> dict[str, Figures]:
    """The figures of each part of the file: the vehicle's parameters of cross_spectrum, and the ratio index's fits."""
    figures = {}
    if file.cross_spectrum is not None:
        figures["cross_spectrum"] = _parameters(file.cross_spectrum)
    if file.ratio_index is not None:
        models = {"payload": file.ratio_index.payload, "front_share": file.ratio_index.front_share}
        figures |= {f"ratio_index.{target}": _regression(model) for target, model in models.items() if model}
    return figures


def _parameters(part: VehicleModel) -> Figures:
    """A parameter stored as a logarithm has its standard deviation to first order."""
    stds = np.sqrt(np.diag(part.covariance)).tolist()
    is_log = {row.name: row.scale == LOG for row in ROWS}
    rows = zip(part.names, part.parameters.tolist(), stds, strict=True)
    return [(name, math.exp(x), math.exp(x) * std) if is_log[name] else (name, x, std) for name, x, std in rows]


def _regression(part: RegressionModel) -> Figures:
    """Constant and coefficients of the unscaled terms, in the target's unit: comparable whatever the scaling.

    The file has them of columns scaled to [-1, 1] by lows l and highs h:
    b_0 + sum b_i (2 x_i - h_i - l_i) / (h_i - l_i). With T for the step from these b to those of x, Var = s^2 T
    (X'X)^-1 T'.
    """
    span = part.highs - part.lows
    to_raw = np.diag(np.r_[1.0, 2.0 / span])
    to_raw[0, 1:] = -(part.highs + part.lows) / span
    stds = part.residual_std * np.sqrt(np.diag(to_raw @ part.gram_inverse @ to_raw.T))
    return list(zip(("constant", *part.terms), (to_raw @ part.coefficients).tolist(), stds.tolist(), strict=True))


def _figures(figures: Figures) -> Iterator[str]:
    for name, centre, std in figures:
        yield f"{name:28}{centre:>12.5g} ± {std:.2g}"


def _provenance(held: CalibrationFile) -> Iterator[str]:
    made = held.provenance
    yield made.software
    yield made.command
    yield f"campaign sha256 {made.campaign_sha256}"
    for drive in made.drives:
        said = drive.statement
        stated = f"{known(said.payload_kg, ' kg', '.1f'):>10} {known(said.front_share_pct, ' %', '.2f'):>8}"
        yield f"run {drive.number:<3}{stated}  {drive.n_batches:3} batches  {drive.log}  sha256 {drive.sha256[:12]}..."
        if drive.found is not None:
            note = "; the statement disagrees and taught nothing" if drive.found.is_held else ""
            yield f"       found {drive.found.payload_kg:.1f} ± {Z95 * drive.found.payload_std_kg:.1f} kg{note}"
