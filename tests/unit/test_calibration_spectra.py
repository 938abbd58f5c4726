"""Spectra of a report: their level, and the limits of what so much driving can tell."""

import numpy as np
import pytest
from support.calibrated import ratio_index_calibration
from support.half_car_road import RATE_HZ, VAN, batch_of, batch_over_road

from gateway.calibration.half_car.fit import calibrate_cross_spectrum
from gateway.calibration.known_run import KnownRun
from gateway.core.ratio_index.index import Band
from gateway.records import Batch
from gateway.reports.calibration.half_car import fits_of
from gateway.reports.calibration.spectra import ACCELERATION, N_SEGMENT, PITCH_RATE, density_of, spectra_section
from gateway.reports.charts import LineMark, Ribbon, Span


def white(seed: int, n: int = 20_000) -> Batch:
    rng = np.random.default_rng(seed)
    return batch_of(rng.standard_normal(n), 0.1 * rng.standard_normal(n), np.full(n, 14.0))


def test_white_noise_has_the_density_of_its_variance() -> None:
    """Variance 1 over 25 Hz: 0.2 m/s2 per root hertz; a tenth of it for the pitch rate (Parseval)."""
    level = (1.0 / (RATE_HZ / 2.0)) ** 0.5
    a, g = density_of([white(1)], ACCELERATION), density_of([white(1)], PITCH_RATE)
    assert a is not None
    assert g is not None
    assert np.sqrt(np.mean(a.amplitude**2)) == pytest.approx(level, rel=0.02)
    assert np.sqrt(np.mean(g.amplitude**2)) == pytest.approx(0.1 * level, rel=0.02)


def test_limits_hold_the_true_density_95_times_in_100() -> None:
    level = (1.0 / (RATE_HZ / 2.0)) ** 0.5
    held = []
    for seed in range(40):
        found = density_of([white(seed, 10_000)], ACCELERATION)
        assert found is not None
        held.append(np.mean((found.low <= level) & (level <= found.high)))
    assert np.mean(held) == pytest.approx(0.95, abs=0.015)


def test_batches_of_a_load_are_joined_and_none_is_none() -> None:
    one, two = density_of([white(1)], ACCELERATION), density_of([white(1), white(2)], ACCELERATION)
    assert one is not None
    assert two is not None
    assert two.n_segments == 2 * one.n_segments
    assert np.all(two.high / two.low < one.high / one.low)
    assert density_of([white(1, N_SEGMENT - 1)], ACCELERATION) is None
    assert density_of([], ACCELERATION) is None


def known(number: int, payload_kg: float, share_pct: float) -> KnownRun:
    return KnownRun(
        number, f"{number}.log", payload_kg, share_pct, (batch_over_road(payload_kg, share_pct, number, 60.0),)
    )


def test_a_curve_for_every_load_and_the_bands_where_they_are() -> None:
    runs = [known(1, 0.0, 52.0), known(2, 200.0, 50.0), known(3, 200.0, 47.0)]
    section = spectra_section(runs, ratio_index_calibration())
    assert section is not None
    of_load, of_share = (chart.panels[0] for chart in section.charts)
    assert [mark.label for mark in of_load.marks if isinstance(mark, LineMark)] == ["0 kg", "200 kg"]
    assert [mark.label for mark in of_share.marks if isinstance(mark, LineMark)] == ["47.0 %", "50.0 %", "52.0 %"]
    assert sum(isinstance(mark, Ribbon) for mark in of_share.marks) == 3
    bands = ratio_index_calibration().acceleration_bands
    assert bands is not None
    spans = [mark for mark in of_load.marks if isinstance(mark, Span)]
    assert [Band((s.low + s.high) / 2.0, s.high - s.low) for s in spans] == [
        Band(pytest.approx(band.centre_hz), pytest.approx(band.width_hz)) for band in bands
    ]


def test_the_fitted_half_car_shows_what_was_measured() -> None:
    """Drives of a half-car: the one fitted to them explains their spectra, phase and coherence."""
    runs = [
        KnownRun(i, f"{i}.log", kg, pct, (batch_over_road(kg, pct, i, 200.0),))
        for i, (kg, pct) in enumerate([(0.0, 52.0), (300.0, 47.0)], 1)
    ]
    fits = fits_of(runs, calibrate_cross_spectrum(runs, VAN))
    assert [fit.run.number for fit in fits] == [1, 2]
    for fit in fits:
        at = np.searchsorted(fit.measured.freq_hz, fit.modelled.freq_hz)
        told = fit.measured.coherence[at] > 0.5
        phase = fit.modelled.phase_rad - fit.measured.phase_rad[at]
        assert np.median(np.abs(np.angle(np.exp(1j * phase[told])))) < 0.02
        assert np.median(np.abs(np.log(fit.modelled.pitch_rate / fit.measured.pitch_rate[at]))) < 0.1
