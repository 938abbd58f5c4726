"""The band-pass (6) and the ratio index (7), (8) against their closed forms."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gateway.core.ratio_index.index import (
    PAPER_BANDS,
    Band,
    RatioIndexCalibration,
    band_pass_gain,
    indexes_of,
    mean_spectrum,
    ratio_index,
)
from gateway.core.ratio_index.regression import RegressionModel
from gateway.records import Batch

bands = st.builds(Band, st.floats(0.5, 9.5), st.floats(0.05, 2.0))


@given(band=bands, freq_hz=st.floats(0.01, 25.0))
def test_gain_is_the_modulus_of_the_transfer_function(band: Band, freq_hz: float) -> None:
    s = 2j * np.pi * freq_hz
    w0, width = 2 * np.pi * band.centre_hz, 2 * np.pi * band.width_hz
    expected = abs(np.polyval([width, 0.0], s) / np.polyval([1.0, width, w0**2], s))
    assert band_pass_gain(np.array([freq_hz]), band)[0] == pytest.approx(expected, rel=1e-6)


@given(band=bands)
def test_half_power_points_lie_the_width_apart_about_a_peak_of_one(band: Band) -> None:
    middle = np.hypot(band.centre_hz, band.width_hz / 2.0)
    low, high = middle - band.width_hz / 2.0, middle + band.width_hz / 2.0
    gains = band_pass_gain(np.array([band.centre_hz, low, high]), band)
    np.testing.assert_allclose(gains, [1.0, np.sqrt(0.5), np.sqrt(0.5)], rtol=1e-6)


def test_two_lines_give_the_ratio_of_their_heights() -> None:
    pair = PAPER_BANDS["acceleration"]
    freq_hz = np.arange(1, 201) * 0.05
    spectrum = np.zeros(200)
    spectrum[np.argmin(np.abs(freq_hz - 2.4))] = 3.0
    spectrum[np.argmin(np.abs(freq_hz - 3.25))] = 2.0
    leak = [band_pass_gain(np.array([2.4]), pair[1])[0], band_pass_gain(np.array([3.25]), pair[0])[0]]
    for kind, order in (("amplitude", 1), ("power", 2)):
        expected = (3.0 + leak[1] ** order * 2.0) / (leak[0] ** order * 3.0 + 2.0)
        assert ratio_index(freq_hz, spectrum, pair, kind) == pytest.approx(expected, rel=1e-9)


@given(scale=st.floats(1e-6, 1e6), swap=st.booleans())
def test_the_index_knows_no_scale_and_swapped_bands_invert_it(scale: float, swap: bool) -> None:
    freq_hz = np.arange(1, 201) * 0.05
    spectrum = 1.0 / freq_hz
    pair = PAPER_BANDS["pitch_rate"]
    plain = ratio_index(freq_hz, spectrum, pair, "amplitude")
    other = ratio_index(freq_hz, scale * spectrum, pair[::-1] if swap else pair, "amplitude")
    assert other == pytest.approx(1.0 / plain if swap else plain, rel=1e-9)


def test_integral_of_a_flat_power_spectrum_is_the_noise_bandwidth() -> None:
    # over all frequencies the square of (6) integrates to pi w / 2 whatever its centre: the ratio is that of the widths
    freq_hz = np.arange(1, 2_000_000) * 1e-4
    wide, narrow = Band(3.0, 0.5), Band(5.0, 0.1)
    assert np.sum(band_pass_gain(freq_hz, wide) ** 2) * 1e-4 == pytest.approx(np.pi * 0.5 / 2.0, rel=2e-3)
    assert ratio_index(freq_hz, np.ones_like(freq_hz), (wide, narrow), "power") == pytest.approx(5.0, rel=2e-3)


def test_spectrum_needs_six_unbroken_segments() -> None:
    x = np.random.default_rng(1).standard_normal(1024 + 5 * 512)
    usable = np.ones(len(x), bool)
    seen = mean_spectrum(x, usable, 1024, 50.0, "power")
    assert seen is not None
    assert seen[0][0] > 0.0
    assert seen[0][-1] <= 10.0
    assert mean_spectrum(x[:-1], usable[:-1], 1024, 50.0, "power") is None
    usable[1500] = False
    assert mean_spectrum(x, usable, 1024, 50.0, "power") is None


def test_a_sensor_without_bands_or_without_samples_gives_no_index() -> None:
    model = RegressionModel(("ra",), np.zeros(1), np.ones(1), np.zeros(2), np.eye(2), 1.0, 3.0)
    calibration = RatioIndexCalibration(
        "amplitude", 256, PAPER_BANDS["acceleration"], None, model, None, (14.0, 16.0), 1.0
    )
    rng, n = np.random.default_rng(2), 15_000
    batch = Batch(
        t_start_ns=0,
        t_end_ns=300_000_000_000,
        drive_start_ns=0,
        rate_hz=50.0,
        vertical_acceleration_mps2=rng.standard_normal(n),
        pitch_rate_radps=rng.standard_normal(n),
        speed_mps=np.full(n, 15.0),
        usable=np.ones(n, bool),
        gravity_mps2=9.81,
        gap_share=0.0,
        shares={},
    )
    ra, rg = indexes_of(batch, calibration)
    assert np.isfinite(ra)
    assert np.isnan(rg)
    silent = replace(batch, vertical_acceleration_mps2=np.full(n, np.nan))
    assert np.isnan(indexes_of(silent, calibration)).all()
