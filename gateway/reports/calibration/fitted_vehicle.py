"""The fitted vehicle against what was measured, run by run, and what the data told of each of its parameters."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from gateway.calibration.found import FoundLoad, Taught
from gateway.calibration.stated_drive import StatedDrive
from gateway.core.vehicle import Load, Vehicle
from gateway.model.expected import with_strokes
from gateway.model.spectra import CrossSpectra, cross_spectra_of
from gateway.model.table import LOG, ROWS, UPRIGHT, of_drive, prior_of
from gateway.model.vehicle_model import VehicleModel
from gateway.model.whittle import Point, Whittle
from gateway.records import F64, Spectra
from gateway.reports.charts import Axis, Chart, LineMark, Panel, Section, Table


@dataclass(frozen=True, slots=True, eq=False)
class RunFit:
    """One run: its measurement, the model's prediction at its load, known or found, and their agreement."""

    run: StatedDrive
    load: Load
    measured: Spectra
    modelled: Spectra
    misfit: float

    @property
    def title(self) -> str:
        return f"Run {self.run.number}: {self.run.described}"


def fits_of(runs: Sequence[StatedDrive], model: VehicleModel, found: Sequence[FoundLoad]) -> list[RunFit]:
    """Every run with enough steady driving, at its load and with its deviations from the vehicle; where a drive is not
    among the found ones, at the stated load and without.

    Nothing is fitted but the road's level: a straight line in logarithms of level and frequency (ISO 8608).
    """
    fits, by_name = [], {one.name: one for one in found}
    for run in runs:
        cross = cross_spectra_of([batch for batch in run.batches if not batch.rejected], model.reading)
        if cross is None:
            continue
        drive_found = by_name.get(run.name)
        load, theta = run.load, model.parameters[: len(UPRIGHT)]
        if drive_found is not None:
            load, theta = drive_found.load, of_drive(theta, drive_found.deviations)
        drive, point = with_strokes(cross.without_roll, theta, load, model.ground), Point.of(theta, load)
        whittle = Whittle(drive, model.ground)
        freq_hz, expected = drive.freq_hz[1:-1], whittle.expected(point)
        measured = _mean(drive, drive.parts)
        modelled = _mean(drive, expected * (_power(drive.parts) / _power(expected)))
        modelled *= _road_level(freq_hz, measured, modelled)
        seen, shown = (_spectra(freq_hz, parts) for parts in (measured, modelled))
        fits.append(RunFit(run, load, seen, shown, whittle.misfit(point)))
    return fits


def _road_level(freq_hz: F64, measured: F64, modelled: F64) -> F64:
    """(m,) the line in logarithms that brings the model's parts (4, m) closest to both sensors' powers."""
    log_level, log_f = 0.5 * np.log(measured[:2] / modelled[:2]).sum(axis=0), np.log(freq_hz)
    return np.asarray(np.exp(np.polyval(np.polyfit(log_f, log_level, 1), log_f)))


def _power(parts: F64) -> F64:
    """(b, 1) power of each group of segments, by which segments are divided."""
    return np.asarray(np.sqrt(parts[0].mean(axis=-1) * parts[1].mean(axis=-1))[:, None])


def _mean(drive: CrossSpectra, parts: F64) -> F64:
    """(4, m) mean over the drive's groups of parts (4, b, m), in units of the sensors again."""
    return np.asarray(np.sum(drive.n_segments / drive.inverse_power * parts, axis=1) / drive.n_total)


def _spectra(freq_hz: F64, parts: F64) -> Spectra:
    a, g, real, imaginary = parts
    return Spectra(
        freq_hz=freq_hz,
        vertical_acceleration=np.sqrt(a),
        pitch_rate=np.sqrt(g),
        coherence=(real**2 + imaginary**2) / (a * g),
        phase_rad=np.arctan2(imaginary, real),
    )


def fitted_vehicle_section(
    runs: Sequence[StatedDrive],
    taught: Taught,
    vehicle: Vehicle,
) -> Section:
    """Identifiability, every run's misfit, and the spectra of the worst run beside the model's."""
    fits = fits_of(runs, taught.model, taught.loads)
    worst = sorted(fits, key=lambda fit: -fit.misfit)[:1]
    known = knowledge_of(taught.model, vehicle)
    return Section(
        "half-car",
        "Half-car fitted to both sensors",
        (
            "Measured spectra of the run that fits worst, beside those of the vehicle fitted to all runs, with the "
            "load that was found of this one, and as far as springs, dampers, tyres and goods deviated on it. The "
            "road's level is a straight line drawn through the spectra; everything else is the model's. Misfit is the "
            "likelihood ratio over what chance gives: about 1 if the model explains everything.",
            told(known),
        ),
        tuple(map(_fit_chart, worst)),
        (_misfit_table(fits), knowledge_table(known)),
    )


def _fit_chart(fit: RunFit) -> Chart:
    m, s = fit.measured, fit.modelled

    def panel(title: str, measured: F64, modelled: F64, *, is_log: bool = False) -> Panel:
        marks = LineMark(m.freq_hz, measured, "measured", 0), LineMark(s.freq_hz, modelled, "model", 2, "dash")
        return Panel(Axis("frequency [Hz]"), Axis(title, is_log=is_log), marks)

    return Chart(
        f"fit_run_{fit.run.number:02d}",
        f"{fit.title}, misfit {fit.misfit:.2f}.",
        f"{fit.title}: spectra, phase and coherence measured and by the fitted vehicle; misfit {fit.misfit:.2f}.",
        (
            panel("acceleration [m/s²/√Hz]", m.vertical_acceleration, s.vertical_acceleration, is_log=True),
            panel("pitch rate [rad/s/√Hz]", m.pitch_rate, s.pitch_rate, is_log=True),
            panel("phase of pitch rate [°]", _unbroken_deg(m.phase_rad), _unbroken_deg(s.phase_rad)),
            panel("coherence", m.coherence, s.coherence),
        ),
        row_height_px=250,
    )


def _unbroken_deg(phase_rad: F64) -> F64:
    """A phase in degrees, with a gap where it wraps around."""
    degrees = np.degrees(phase_rad)
    leaps = np.abs(np.diff(degrees, append=degrees[-1])) > 180.0
    return np.where(leaps, np.nan, degrees)


def _misfit_table(fits: Sequence[RunFit]) -> Table:
    rows = tuple(
        (str(fit.run.number), f"{fit.load.payload_kg:.0f} kg", f"{fit.load.front_share_pct:.1f} %", f"{fit.misfit:.2f}")
        for fit in sorted(fits, key=lambda fit: fit.run.number)
    )
    return Table("Misfit of every run, at the load that was found", ("Run", "payload", "front share", "misfit"), rows)


UNTOLD_SHARE: Final = 0.9  # chosen: of the prior's standard deviation; with more remaining the data told little


@dataclass(frozen=True, slots=True)
class Known:
    """One parameter before and after: in its unit, and the remaining share of the prior's standard deviation."""

    name: str
    prior: float
    posterior: float
    spread: str
    left_over: float
    is_slack: bool


def knowledge_of(model: VehicleModel, vehicle: Vehicle) -> list[Known]:
    """The posterior of each parameter against the prior of any vehicle, in the order of the parameters."""
    rows = ROWS if model.has_roll else UPRIGHT
    row_of = {row.name: row for row in rows}
    means, before_stds = prior_of([row_of[name] for name in model.names], vehicle)
    stds = np.sqrt(np.diag(model.covariance)).tolist()
    known = []
    for i, name in enumerate(model.names):
        before, after, std = float(means[i]), float(model.parameters[i]), stds[i]
        spread = f"{std:.3g}"
        if row_of[name].scale == LOG:
            before, after, spread = math.exp(before), math.exp(after), f"{100.0 * std:.1f} %"
        known.append(Known(name, before, after, spread, std / float(before_stds[i]), name.startswith("slack_")))
    return known


def told(known: Sequence[Known]) -> str:
    """The parameters with little information in the data, which stay as vehicles usually are, in words."""
    untold = [one.name for one in known if one.left_over > UNTOLD_SHARE and not one.is_slack]
    if not untold:
        return "The data told something of every parameter of the vehicle."
    return (
        f"What the data could not tell ({len(untold)} of {sum(not one.is_slack for one in known)} parameters keep more "
        f"than {100.0 * UNTOLD_SHARE:.0f} % of their prior's spread): {', '.join(untold)}. These stay at what "
        "vehicles usually have; loads that depend on them are weighed with that uncertainty."
    )


def knowledge_table(known: Sequence[Known]) -> Table:
    """Every parameter of the vehicle before and after."""
    rows = tuple(
        (one.name, f"{one.prior:.4g}", f"{one.posterior:.4g}", one.spread, f"{100.0 * one.left_over:.0f} %")
        for one in known
        if not one.is_slack
    )
    columns = ("Parameter", "before", "after", "standard deviation", "of the prior's")
    return Table("Parameters of the vehicle, in the unit that ends their name", columns, rows)
