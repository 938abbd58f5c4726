"""Where the spectra tell load from road: J over every band, the bands chosen, and the regressions tried on them."""

from collections.abc import Sequence
from typing import Final

import numpy as np

from gateway.calibration.ratio_index import BandMap, FamilyTrial, FittedRegression, RatioIndexFit, Selection, band_maps
from gateway.core.ratio_index.index import Band
from gateway.reports.calibration.text import NONE, decimal
from gateway.reports.charts import Axis, Cells, Chart, Marker, Panel, Points, Table

_NAMES: Final = (("J_L", "kg"), ("J_D", "% front"))  # of acceleration, of pitch rate
_MARKERS: Final[tuple[tuple[str, Marker], ...]] = (("numerator of the index", "circle"), ("denominator", "diamond"))


def band_chart(fit: RatioIndexFit) -> Chart | None:
    """(4) and (5) over the plane of centre and width; None where there is no map."""
    maps = band_maps(fit.table)
    if not maps:
        return None
    bands = (fit.calibration.acceleration_bands, fit.calibration.pitch_rate_bands)
    panels = [panel for one in maps for panel in _panels(one, bands[one.sensor])]
    return Chart(
        "bands",
        "Left: the difference J of the spectra at the two ends of what was driven, (4) and (5), for every band centre "
        "and width, in standard deviations of its own scatter. That scatter knows nothing of different roads; right: "
        "how the band's relative level follows the load (or the share) over all runs, the other taken out. Marks: the "
        "bands chosen; the wider a band the less it scatters, the narrower the more it may differ by chance.",
        "Maps of the significance of spectral differences and of their trend with the load over band centre and width. "
        + " ".join(_in_words(one) for one in maps),
        tuple(panels),
        row_height_px=300,
    )


def _panels(one: BandMap, chosen: tuple[Band, Band] | None) -> list[Panel]:
    name, unit = _NAMES[one.sensor]
    low, high = one.extremes
    places = np.arange(len(one.widths_hz), dtype=float)
    frequency = Axis("centre [Hz]")
    width = Axis("width [Hz]", places=tuple(f"{width_hz:g}" for width_hz in one.widths_hz))
    marks = _chosen(one, chosen)
    significance = Cells(one.centres_hz, places, one.z, f"{name} / its std", is_about_zero=True)
    trend = Cells(one.centres_hz, places, one.trend, "partial correlation", is_about_zero=True)
    return [
        Panel(frequency, width, (significance, *marks), f"{name}: {high:.3g} less {low:.3g} {unit}"),
        Panel(frequency, width, (trend, *marks), f"{name}: trend over all runs"),
    ]


def _chosen(one: BandMap, chosen: Sequence[Band] | None) -> list[Points]:
    """The two bands where their width stands on the map's axis."""
    marks = []
    for band, (label, marker) in zip(chosen or (), _MARKERS, strict=False):
        place = np.interp(np.log(band.width_hz), np.log(one.widths_hz), np.arange(len(one.widths_hz)))
        note = (f"{band.centre_hz:g} Hz, {band.width_hz:g} Hz wide",)
        marks.append(Points(np.array([band.centre_hz]), np.array([place]), label, 4, marker, notes=note))
    return marks


def _in_words(one: BandMap) -> str:
    if not np.isfinite(one.z).any():
        return ""
    row, column = np.unravel_index(int(np.nanargmax(np.abs(one.z))), one.z.shape)
    name = _NAMES[one.sensor][0]
    return (
        f"{name} is largest at {one.centres_hz[column]:.2f} Hz, {one.widths_hz[row]:g} Hz wide: "
        f"{one.z[row, column]:.1f} standard deviations."
    )


def trials_table(fit: RatioIndexFit) -> Table:
    """Every family of regressions with its errors on runs that took no part in any choice."""
    rows = tuple(
        (
            trial.choice.family + (" (chosen)" if trial is fit.chosen else ""),
            _pairs(trial),
            *(", ".join(one.model.terms) if one else NONE for one in trial.choice.regressions),
            *_rms(trial),
        )
        for trial in fit.trials
    )
    return Table(
        "Regressions tried: (9) and (10) single, both logarithms, (11) joint, and chosen stepwise. Errors are root "
        "mean squares over runs for which bands and terms were chosen anew without them",
        ("Family", "bands", "terms of payload", "terms of share", "payload", "share"),
        rows,
    )


def _pairs(trial: FamilyTrial) -> str:
    chosen = [pair for pair in trial.choice.pairs if pair is not None]
    return "; ".join(" over ".join(f"{band.centre_hz:g} Hz" for band in pair.bands) for pair in chosen)


def _rms(trial: FamilyTrial) -> tuple[str, str]:
    payload_kg, share_pct = (None if np.isnan(rms) else rms for rms in trial.nested_rms)
    return decimal(payload_kg, " kg", 1), decimal(share_pct, " pp")


def steps_table(target: str, selection: Selection) -> Table:
    """How a stepwise choice came about."""
    rows = tuple(
        (step.action, step.term, f"{step.test.statistic:.3g}", f"{step.test.p_value:.2g}", f"{step.held_out_rms:.3g}")
        for step in selection.steps
    )
    caption = (
        f"Stepwise choice for {target}: partial F-tests over run means. The smallest of many p-values is small by "
        "choice alone: they rank and stop, and prove nothing"
    )
    return Table(caption, ("Step", "term", "F", "p", "error on runs left out"), rows)


def model_table(target: str, regression: FittedRegression, residual_std: float, dof: float) -> Table:
    """Coefficients with their jackknife standard deviations over runs."""
    model, stds = regression.model, np.sqrt(np.diag(regression.covariance))
    rows = tuple(
        (term, f"{coefficient:.4g}", f"{std:.3g}", f"{coefficient / std:.1f}" if std > 0.0 else NONE)
        for term, coefficient, std in zip(("constant", *model.terms), model.coefficients, stds, strict=True)
    )
    return Table(
        f"Regression of {target}: terms scaled to -1..1 over what was seen, standard deviations by leaving runs out. "
        f"An answer scatters by {residual_std:.3g} and more ({dof:g} degrees of freedom)",
        ("Term", "coefficient", "standard deviation", "ratio"),
        rows,
    )
