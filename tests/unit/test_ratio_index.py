"""The band-pass (6), the ratio index (7), (8) and its static regression against closed forms."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats
from support.calibrated import ratio_index_calibration
from support.half_car_road import batch_of

from gateway.core.ratio_index.index import PAPER_BANDS, Band, band_pass_gain, indexes_of, mean_spectrum, ratio_index
from gateway.core.ratio_index.regression import RegressionModel, scaled_columns

bands = st.builds(Band, st.floats(0.5, 9.5), st.floats(0.05, 2.0))


@given(band=bands, freq_hz=st.floats(0.01, 25.0))
def test_gain_is_the_modulus_of_the_transfer_function(band: Band, freq_hz: float) -> None:
    s = 2j * np.pi * freq_hz
    w0, width = 2 * np.pi * band.centre_hz, 2 * np.pi * band.width_hz
    expected = abs(np.polyval([width, 0.0], s) / np.polyval([1.0, width, w0**2], s))
    assert band_pass_gain(np.array([freq_hz]), band)[0] == pytest.approx(expected, rel=1e-6)


def test_two_lines_give_the_ratio_of_their_heights() -> None:
    pair = PAPER_BANDS["acceleration"]
    freq_hz = np.arange(1, 201) * 0.05
    spectrum = np.zeros(200)
    spectrum[np.argmin(np.abs(freq_hz - 2.4))] = 3.0
    spectrum[np.argmin(np.abs(freq_hz - 3.25))] = 2.0
    leak = [band_pass_gain(np.array([2.4]), pair[1])[0], band_pass_gain(np.array([3.25]), pair[0])[0]]
    expected = (3.0 + leak[1] * 2.0) / (leak[0] * 3.0 + 2.0)
    assert ratio_index(freq_hz, spectrum, pair) == pytest.approx(expected, rel=1e-9)


@given(scale=st.floats(1e-6, 1e6), swap=st.booleans())
def test_the_index_knows_no_scale_and_swapped_bands_invert_it(scale: float, swap: bool) -> None:
    freq_hz = np.arange(1, 201) * 0.05
    spectrum = 1.0 / freq_hz
    pair = PAPER_BANDS["pitch_rate"]
    plain = ratio_index(freq_hz, spectrum, pair)
    other = ratio_index(freq_hz, scale * spectrum, pair[::-1] if swap else pair)
    assert other == pytest.approx(1.0 / plain if swap else plain, rel=1e-9)


def test_spectrum_needs_six_unbroken_segments() -> None:
    x = np.random.default_rng(1).standard_normal(1024 + 5 * 512)
    usable = np.ones(len(x), bool)
    seen = mean_spectrum(x, usable, 1024, 50.0)
    assert seen[0][0] > 0.0
    assert seen[0][-1] <= 10.0
    assert mean_spectrum(x[:-1], usable[:-1], 1024, 50.0) is None
    usable[1500] = False
    assert mean_spectrum(x, usable, 1024, 50.0) is None


def test_a_sensor_without_bands_or_without_samples_gives_no_index() -> None:
    calibration = replace(ratio_index_calibration(), pitch_rate_bands=None)
    rng, n = np.random.default_rng(2), 15_000
    batch = batch_of(rng.standard_normal(n), rng.standard_normal(n), speed_mps=15.0)
    ra, rg = indexes_of(batch, calibration)
    assert np.isfinite(ra)
    assert np.isnan(rg)
    silent = replace(batch, vertical_acceleration_mps2=np.full(n, np.nan))
    assert np.isnan(indexes_of(silent, calibration)).all()


def test_prediction_interval_is_the_textbook_one() -> None:
    """Simple regression y = a + b x: s^2 (1 + 1/n + (x0 - mean)^2 / Sxx), Student's t."""
    rng = np.random.default_rng(12)
    x = rng.uniform(0.5, 2.0, 20)
    y = 100.0 + 50.0 * x + 5.0 * rng.standard_normal(20)
    line = stats.linregress(x, y)
    s = np.sqrt(np.sum((y - line.intercept - line.slope * x) ** 2) / 18)
    lows, highs = np.array([x.min()]), np.array([x.max()])
    columns = scaled_columns(("ra",), x, x, lows, highs)
    gram_inverse = np.linalg.inv(columns.T @ columns)
    model = RegressionModel(("ra",), lows, highs, gram_inverse @ columns.T @ y, gram_inverse, float(s), 18.0)
    for x0 in (0.4, 1.2, 2.5):
        centre, std, (low, high) = model.predict(x0, np.nan)
        expected_std = s * np.sqrt(1.0 + 1.0 / 20 + (x0 - x.mean()) ** 2 / np.sum((x - x.mean()) ** 2))
        assert centre == pytest.approx(line.intercept + line.slope * x0, rel=1e-9)
        assert std == pytest.approx(expected_std, rel=1e-9)
        assert (low, high) == pytest.approx(stats.t.interval(0.95, 18, centre, expected_std), rel=1e-9)
