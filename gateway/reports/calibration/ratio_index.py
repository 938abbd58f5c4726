"""The ratio index over load and share: its curves with the fitted model, its bands, and its regressions."""

from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np

from gateway.calibration.ratio_index.index_fit import RatioIndexFit
from gateway.calibration.ratio_index.spectra_table import IndexRows, index_rows
from gateway.calibration.stated_drive import StatedDrive
from gateway.core.ratio_index.index import RatioIndexCalibration
from gateway.core.ratio_index.regression import RegressionModel
from gateway.records import F64
from gateway.reports.charts import Axis, Chart, LineMark, Mark, Marker, Panel, Points, Ribbon, Section, Table
from gateway.words import NONE

N_ALONG: Final = 60  # chosen: points of a curve


def ratio_index_section(
    fit: RatioIndexFit, identification: Sequence[StatedDrive], validation: Sequence[StatedDrive]
) -> Section:
    """R_a and R_g of every batch, the bands and the regression through them, and its coefficients."""
    calibration = fit.calibration
    fitted, later = index_rows(identification, calibration), index_rows(validation, calibration)
    panels = []
    if calibration.acceleration_bands is not None:
        panels += _panels("R_a", fitted, later, calibration.payload)
    if calibration.pitch_rate_bands is not None:
        panels += _panels("R_g", fitted, later, calibration.front_share)
    chart = Chart(
        "ratio_index",
        "Ratio indexes R_a and R_g of every batch over the load and over the front share. Lines: the static regression "
        "that answers from both indexes, drawn along one of them with the other held; the ribbon is the 95 % interval "
        "of a new batch. Where points of one payload spread, it is the share (or the road) that moves them.",
        f"Ratio indexes over load and share. {len(fitted.run)} batches for fitting, {len(later.run)} for validation.",
        tuple(panels),
    )
    return Section("ratio-index", "Ratio index", (), (chart,), (_bands_table(calibration), *_model_tables(fit)))


def _panels(name: str, fitted: IndexRows, later: IndexRows, model: RegressionModel | None) -> list[Panel]:
    """The index over payload and over share, with the model of its own target."""
    is_a = name == "R_a"
    sets: list[tuple[IndexRows, str, int, Marker]] = [
        (fitted, "identification", 3, "circle"),
        (later, "validation", 1, "diamond"),
    ]
    panels = []
    for title, own, target in (("payload [kg]", is_a, "payload_kg"), ("front share [%]", not is_a, "front_share_pct")):
        points = [
            Points(rows.ra if is_a else rows.rg, getattr(rows, target), label, colour, marker)
            for rows, label, colour, marker in sets
            if len(rows.run)
        ]
        curves = _curves(is_a, fitted, model) if own and model is not None else []
        panels.append(Panel(Axis(name), Axis(title), (*curves, *points)))
    return panels


def _curves(is_a: bool, rows: IndexRows, model: RegressionModel) -> list[Mark]:
    """The model along one index, with the other at its median and, if that matters, at its quartiles."""
    own, other = (rows.ra, rows.rg) if is_a else (rows.rg, rows.ra)
    along = np.linspace(own.min(), own.max(), N_ALONG)
    lower, middle, upper = (
        _predicted(model, [(x, held) if is_a else (held, x) for x in along.tolist()])
        for held in np.quantile(other, (0.25, 0.5, 0.75)).tolist()
    )
    marks: list[Mark] = [
        Ribbon(along, middle[:, 1], middle[:, 2], "95 % interval of a new batch", 2),
        LineMark(along, middle[:, 0], "model, the other index at its median", 2),
    ]
    if np.isfinite(lower).all() and not np.allclose(lower, upper):
        quartiles = "model, the other index at its quartiles"
        marks += [LineMark(along, each[:, 0], quartiles, 2, "dot") for each in (lower, upper)]
    return marks


def _predicted(model: RegressionModel, indexes: list[tuple[float, float]]) -> F64:
    """Answer and 95 % limits (n, 3)."""
    predictions = (model.predict(a, g) for a, g in indexes)
    return np.array([(centre, *interval) for centre, _, interval in predictions])


def _bands_table(calibration: RatioIndexCalibration) -> Table:
    rows = [
        (index, *(f"{band.centre_hz:g} Hz, {band.width_hz:g} Hz wide" for band in bands or ()))
        for index, bands in (("R_a", calibration.acceleration_bands), ("R_g", calibration.pitch_rate_bands))
    ]
    padded = tuple((*row, *(NONE,) * (3 - len(row))) for row in rows)
    return Table("Bands: centre and width at -3 dB", ("Index", "numerator", "denominator"), padded)


def _model_tables(fit: RatioIndexFit) -> Iterator[Table]:
    """Coefficients with their jackknife standard deviations over runs."""
    models = (fit.calibration.payload, fit.calibration.front_share)
    for target, regression, held in zip(
        ("payload [kg]", "front share [%]"), fit.choice.regressions, models, strict=True
    ):
        if regression is None or held is None:
            continue
        model, stds = regression.model, np.sqrt(np.diag(regression.covariance))
        rows = tuple(
            (term, f"{coefficient:.4g}", f"{std:.3g}", f"{coefficient / std:.1f}" if std > 0.0 else NONE)
            for term, coefficient, std in zip(("constant", *model.terms), model.coefficients, stds, strict=True)
        )
        yield Table(
            f"Regression of {target}: terms scaled to -1..1 over what was seen, standard deviations by leaving runs "
            f"out. An answer scatters by {held.residual_std:.3g} and more ({held.dof:g} degrees of freedom)",
            ("Term", "coefficient", "standard deviation", "ratio"),
            rows,
        )
