"""What is assumed of a spring under load before the first drive: it does not soften."""

import pytest
from support.half_car_road import VAN

from gateway.calibration.prior import Prior
from gateway.model import fit
from gateway.model.table import INDEX
from gateway.records import F64

UPRIGHT = Prior.of_any(VAN, with_roll=False).upright(0)


def with_slopes(end: str, slope: float, **bends: float) -> F64:
    """The usual vehicle with this slope of one spring's rate at no load, and what the slope gains at its bends."""
    x = UPRIGHT.mean.copy()
    x[INDEX[f"spring_slope_{end}_per_kn"]] = slope
    for name, gained in bends.items():
        x[INDEX[f"spring_{name.replace('_', f'_{end}_')}_per_kn"]] = gained
    return x


def beyond_gaussian(x: F64) -> float:
    """By how much the prior believes these parameters less than the table's means and deviations alone do."""
    return UPRIGHT.cost(x) - fit.Gaussian(UPRIGHT.mean, UPRIGHT.precision).cost(x)


@pytest.mark.parametrize("end", ["front", "rear"])
def test_a_spring_that_softens_under_load_is_hardly_believed(end: str) -> None:
    assert beyond_gaussian(with_slopes(end, -1.0)) > 10.0
    assert beyond_gaussian(with_slopes(end, 0.1, bend_3=-2.0)) > 10.0


@pytest.mark.parametrize("end", ["front", "rear"])
def test_helper_springs_and_bump_stops_are_believed_as_before(end: str) -> None:
    assert beyond_gaussian(with_slopes(end, 0.02, bend_2=0.8, bend_3=-0.8)) == 0.0  # a second leaf takes its share
    assert beyond_gaussian(with_slopes(end, 0.02, bend_4=2.0)) == 0.0
