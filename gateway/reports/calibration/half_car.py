"""The fitted half-car against what was measured, run by run."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gateway.calibration.half_car import Inherited
from gateway.calibration.known_run import KnownRun
from gateway.core.cross_spectrum.calibration import CrossSpectrumCalibration
from gateway.core.cross_spectrum.displayed import Fitted, modelled_spectra
from gateway.core.cross_spectrum.likelihood import Point, Whittle
from gateway.core.cross_spectrum.measured import cross_spectra_of
from gateway.core.cross_spectrum.model.parameters import upright
from gateway.core.cross_spectrum.model.strokes import with_strokes
from gateway.core.spectrum import spectra_of
from gateway.core.vehicle import Vehicle
from gateway.records import F64, Spectra
from gateway.reports.calibration.knowledge import knowledge_chart, knowledge_of, knowledge_table, told
from gateway.reports.charts import Axis, Chart, LineMark, Panel, Section, Table


@dataclass(frozen=True, slots=True, eq=False)
class RunFit:
    """One run: its measurement, the model's prediction at its true load, and their agreement."""

    run: KnownRun
    measured: Spectra
    modelled: Spectra
    misfit: float

    @property
    def title(self) -> str:
        """The run in words."""
        return f"Run {self.run.number}: {self.run.payload_kg:g} kg at {self.run.front_share_pct:.1f} % front"


def fits_of(runs: Sequence[KnownRun], calibration: CrossSpectrumCalibration) -> list[RunFit]:
    """Every run with enough steady driving, at its true load, with the parameters of all runs together."""
    fits = []
    for run in runs:
        batches = [batch for batch in run.batches if not batch.rejected]
        cross = cross_spectra_of(batches, calibration.reading)
        measured = _joined([spectra for batch in batches if (spectra := spectra_of(batch)) is not None])
        if cross is None or measured is None:
            continue
        at_truth = Fitted(
            run.payload_kg,
            run.front_share_pct,
            cross.delay_mean_s,
            cross.delay_std_s,
            amplitude_ratio=math.exp(cross.log_amplitude_mean),
        )
        point = Point.of(upright(calibration.parameters), run.load)
        moving = with_strokes(cross.without_roll, point.theta, run.load, calibration.ground)
        misfit = Whittle(moving, calibration.ground).misfit(point)
        fits.append(RunFit(run, measured, modelled_spectra(measured, calibration, at_truth), misfit))
    return fits


def _joined(parts: Sequence[Spectra]) -> Spectra | None:
    """Mean powers and mean cross-spectrum of a run's batches, as one Spectra."""
    if not parts:
        return None
    s_aa = np.mean([part.vertical_acceleration**2 for part in parts], axis=0)
    s_gg = np.mean([part.pitch_rate**2 for part in parts], axis=0)
    s_ga = np.mean(
        [p.vertical_acceleration * p.pitch_rate * np.sqrt(p.coherence) * np.exp(1j * p.phase_rad) for p in parts],
        axis=0,
    )
    return Spectra(
        freq_hz=parts[0].freq_hz,
        vertical_acceleration=np.sqrt(s_aa),
        pitch_rate=np.sqrt(s_gg),
        coherence=np.abs(s_ga) ** 2 / (s_aa * s_gg),
        phase_rad=np.angle(s_ga),
    )


def half_car_section(
    runs: Sequence[KnownRun],
    calibration: CrossSpectrumCalibration,
    vehicle: Vehicle,
    inherited: Inherited | None = None,
) -> Section:
    """Identifiability, and every run's spectra beside the model's; the worst run first."""
    fits = sorted(fits_of(runs, calibration), key=lambda fit: -fit.misfit)
    known = knowledge_of(calibration, vehicle, inherited)
    charts = [_fit_chart(fit) for fit in fits]
    return Section(
        "half-car",
        "Half-car fitted to both sensors",
        (
            "Measured spectra of every run beside those of the one half-car fitted to all of them, each at its true "
            "load. The road's level is a straight line drawn through the spectra; everything else is the model's. "
            "Misfit is the likelihood ratio per degree of freedom: about 1 where the model is all there is to it.",
            told(known, "its line told" if inherited else "vehicles usually have"),
        ),
        (*charts[:1], knowledge_chart(known)),
        (_misfit_table(fits, calibration), knowledge_table(known)),
        tuple((fit.title, (chart,)) for fit, chart in zip(fits[1:], charts[1:], strict=True)),
    )


def _fit_chart(fit: RunFit) -> Chart:
    m, s = fit.measured, fit.modelled
    band = (m.freq_hz >= s.freq_hz[0]) & (m.freq_hz <= s.freq_hz[-1])

    def panel(title: str, measured: F64, modelled: F64, *, is_log: bool = False) -> Panel:
        marks = (
            LineMark(m.freq_hz[band], measured[band], "measured", 0),
            LineMark(s.freq_hz, modelled, "half-car", 2, "dash"),
        )
        return Panel(Axis("frequency [Hz]"), Axis(title, is_log=is_log), marks)

    return Chart(
        f"half_car_run_{fit.run.number:02d}",
        f"{fit.title}, misfit {fit.misfit:.2f}.",
        f"{fit.title}: spectra, phase and coherence measured and by the fitted half-car; misfit {fit.misfit:.2f}.",
        (
            panel("acceleration [m/s²/√Hz]", m.vertical_acceleration, s.vertical_acceleration, is_log=True),
            panel("pitch rate [rad/s/√Hz]", m.pitch_rate, s.pitch_rate, is_log=True),
            panel("phase of pitch rate [°]", _unbroken_deg(m.phase_rad), _unbroken_deg(s.phase_rad)),
            panel("coherence", m.coherence, s.coherence),
        ),
        row_height_px=250,
    )


def _unbroken_deg(phase_rad: F64) -> F64:
    """In degrees, with a gap where it wraps around."""
    degrees = np.degrees(phase_rad)
    leaps = np.abs(np.diff(degrees, append=degrees[-1])) > 180.0
    return np.where(leaps, np.nan, degrees)


def _misfit_table(fits: Sequence[RunFit], calibration: CrossSpectrumCalibration) -> Table:
    rows = tuple(
        (str(fit.run.number), f"{fit.run.payload_kg:g} kg", f"{fit.run.front_share_pct:.1f} %", f"{fit.misfit:.2f}")
        for fit in sorted(fits, key=lambda fit: fit.run.number)
    )
    caption = f"Misfit of every run; a batch beyond {calibration.misfit_limit:.2f} is not believed"
    return Table(caption, ("Run", "payload", "front share", "misfit"), rows)
