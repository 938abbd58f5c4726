"""A number with its interval, and what another independent error makes of it."""

import pytest

from gateway.quantity import Z95, Quantity


def test_a_normal_interval_is_widened_in_quadrature() -> None:
    assert Quantity.normal(100.0, 3.0).widened(4.0).interval95 == pytest.approx((100.0 - 5.0 * Z95, 100.0 + 5.0 * Z95))
    assert Quantity.normal(100.0, 3.0).widened(4.0).std == pytest.approx(5.0)


def test_a_skewed_interval_stays_skewed() -> None:
    wide = Quantity(100.0, 10.0, (90.0, 130.0)).widened(8.0 / Z95)
    assert (100.0 - wide.interval95[0], wide.interval95[1] - 100.0) == pytest.approx((164.0**0.5, 964.0**0.5))
    assert wide.number == 100.0
