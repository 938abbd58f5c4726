"""The search for bands, on made-up campaigns whose answer is known."""

from dataclasses import replace

import numpy as np
import pytest

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
