"""The map of J over bands, and what it says of made-up campaigns whose answer is known."""

from dataclasses import replace

import numpy as np
import pytest

from gateway.calibration.ratio_index.band_map import BandMap, band_maps, rectangle_weights
from gateway.calibration.ratio_index.bands import candidate_pairs, rank_correlations
from gateway.calibration.ratio_index.table import SpectrumTable
from gateway.records import F64

FREQ_HZ = np.arange(1, 205) * (50.0 / 1024)
LOADS_KG = np.array([0.0, 100.0, 200.0, 300.0, 400.0, 250.0])
SHARES_PCT = np.array([50.0, 45.0, 56.0, 41.0, 52.0, 48.0])


def line(centre_hz: float) -> F64:
    return np.exp(-0.5 * ((FREQ_HZ - centre_hz) / 0.2) ** 2)


def table_of(roughness: F64) -> SpectrumTable:
    """Load lifts the acceleration at 2 Hz and lowers it at 4; share lifts the pitch rate at 3 Hz and lowers it at 6."""
    run = np.arange(len(LOADS_KG))
    by_load, by_share = LOADS_KG[:, None] / 400.0, (SHARES_PCT[:, None] - 50.0) / 20.0
    return SpectrumTable(
        run=run,
        number=run + 1,
        targets=(LOADS_KG, SHARES_PCT),
        freq_hz=FREQ_HZ,
        spectra=(
            roughness[:, None] * (1.0 + 0.8 * by_load * line(2.0) - 0.5 * by_load * line(4.0)),
            0.1 * roughness[:, None] * (1.0 + by_share * line(3.0) - by_share * line(6.0)),
        ),
        n_segments=np.full(len(run), 28.0),
    )


@pytest.fixture
def maps() -> tuple[BandMap, BandMap]:
    of_a, of_g = band_maps(table_of(np.ones(len(LOADS_KG))))
    return of_a, of_g


def test_weights_average_a_straight_line_to_its_value_in_the_middle() -> None:
    for width_hz in (0.05, 0.17, 1.0):
        weights = rectangle_weights(FREQ_HZ, np.array([2.0, 5.03]), width_hz)
        np.testing.assert_allclose(weights.sum(axis=1), 1.0, rtol=1e-9)
        np.testing.assert_allclose(weights @ FREQ_HZ, [2.0, 5.03], atol=0.03)
    assert np.isnan(rectangle_weights(FREQ_HZ, np.array([9.8, 0.6]), 0.5)).all()


def test_j_is_largest_where_the_load_tells(maps: tuple[BandMap, BandMap]) -> None:
    for found, extremes, rising_hz, falling_hz in (
        (maps[0], (0.0, 400.0), 2.0, 4.0),
        (maps[1], (41.0, 56.0), 3.0, 6.0),
    ):
        assert found.extremes == extremes
        for row in range(len(found.widths_hz)):
            assert found.centres_hz[np.nanargmax(found.z[row])] == pytest.approx(rising_hz, abs=0.05)
            assert found.centres_hz[np.nanargmin(found.z[row])] == pytest.approx(falling_hz, abs=0.05)
    assert maps[0].difference[0, np.argmin(np.abs(maps[0].centres_hz - 2.0))] == pytest.approx(0.8, rel=0.02)


def test_a_wider_band_differs_less_but_scatters_less_still(maps: tuple[BandMap, BandMap]) -> None:
    """(4) is always largest at the least width; over its own scatter it is not."""
    at = np.argmin(np.abs(maps[0].centres_hz - 2.0))
    widths = list(maps[0].widths_hz)
    narrow, wide = widths.index(0.05), widths.index(0.5)
    assert maps[0].difference[narrow, at] > maps[0].difference[wide, at]
    assert maps[0].z[narrow, at] < maps[0].z[wide, at]


def test_a_rough_road_shows_in_j_but_not_in_the_trend(maps: tuple[BandMap, BandMap]) -> None:
    rough = band_maps(table_of(np.array([1.0, 3.0, 0.5, 2.0, 4.0, 1.5])))[0]
    np.testing.assert_allclose(rough.trend, maps[0].trend, atol=1e-9)
    assert np.nanmin(rough.difference) > 0.9  # the rougher road of the full vehicle, at every frequency
    assert np.nanmax(rough.trend[2]) > 0.95
    assert np.nanmin(rough.trend[2]) < -0.95


def test_bands_are_taken_where_the_load_tells_whatever_the_road() -> None:
    table = table_of(np.array([1.0, 3.0, 0.5, 2.0, 4.0, 1.5]))
    for sensor, over_hz, under_hz in ((0, 2.0, 4.0), (1, 3.0, 6.0)):
        best = candidate_pairs(table, sensor, 0.5, 5)[0]
        over, under = best.bands
        assert (over.centre_hz, under.centre_hz) == pytest.approx((over_hz, under_hz), abs=1.3)
        assert best.monotonicity > 0.9


def test_significance_does_not_believe_a_residual_below_the_scatter_of_spectra() -> None:
    """The same spectra from a hundredth of the driving: as good a fit, but less to be believed."""
    long = table_of(np.ones(len(LOADS_KG)))
    short = replace(long, n_segments=long.n_segments / 100.0)
    one, other = (candidate_pairs(table, 0, 0.5, 1)[0] for table in (long, short))
    assert other.significance < 0.9 * one.significance


def test_rank_correlation_knows_order_only() -> None:
    x = np.array([1.0, 2.0, 3.0, 4.0])
    found = rank_correlations(np.column_stack([np.exp(x), -(x**3), np.ones(4)]), x)
    np.testing.assert_allclose(found, [1.0, -1.0, 0.0], atol=1e-12)


def test_without_different_shares_there_is_no_map_of_the_pitch_rate() -> None:
    table = replace(table_of(np.ones(len(LOADS_KG))), targets=(LOADS_KG, np.full(len(LOADS_KG), 50.0)))
    assert [found.sensor for found in band_maps(table)] == [0]
