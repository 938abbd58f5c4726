"""One light and one sentence on the weight of a vehicle."""

from itertools import product
from typing import Any

import pytest

from gateway.core.weights.limits import Light
from gateway.core.weights.verdict import Says, Verdict, verdict_of
from gateway.estimates.batch_estimate import Weight, Weights

LIGHT, NEAR, HEAVY = (
    Weight(900.0, 10.0, 950.0, None),
    Weight(940.0, 14.0, 950.0, None),
    Weight(961.0, 14.0, 950.0, None),
)
UNKNOWN, UNLIMITED = Weight(limit_kg=950.0), Weight(900.0, 10.0, None, None)


def said(weights: Weights, **how: Any) -> Verdict:
    """What is said of a calibrated vehicle that was weighed, unless ``how`` says otherwise."""
    usual = {"is_calibrated": True, "is_weighed": True, "is_doubted": False, "is_vague": False}
    return verdict_of(weights, **usual | how)


@pytest.mark.parametrize(
    ("weights", "light", "says", "about"),
    [
        (Weights(rear_axle=LIGHT), Light.GO, Says.GO, ()),
        (Weights(rear_axle=NEAR), Light.NEAR, Says.NEAR, ("rear_axle",)),
        (Weights(rear_axle=HEAVY), Light.OVER, Says.OVER, ("rear_axle",)),
        (Weights(gross=LIGHT, rear_left=HEAVY), Light.OVER, Says.UNEVEN, ("rear_left",)),
        (Weights(gross=UNKNOWN), Light.UNKNOWN, Says.WEIGHT_UNKNOWN, ()),
        (Weights(gross=UNLIMITED), Light.UNKNOWN, Says.NO_LIMIT, ()),
    ],
)
def test_each_weight_has_its_light_and_sentence(
    weights: Weights, light: Light, says: Says, about: tuple[str, ...]
) -> None:
    """961 +- 28 of 950 kg is too heavy on every page: it is more probable than not."""
    found = said(weights)
    assert (found.light, found.says, found.about) == (light, says, about)


@pytest.mark.parametrize(("is_calibrated", "is_weighed", "is_doubted"), list(product([True, False], repeat=3)))
@pytest.mark.parametrize("weight", [LIGHT, NEAR, HEAVY, UNKNOWN, UNLIMITED])
def test_green_never_stands_beside_an_active_overload_alarm(
    weight: Weight, is_calibrated: bool, is_weighed: bool, is_doubted: bool
) -> None:
    known = {"is_calibrated": is_calibrated, "is_weighed": is_weighed, "is_doubted": is_doubted}
    found = said(Weights(gross=weight), **known, alarmed=("gross",))
    assert found.light is not Light.GO
    assert (found.light is Light.OVER) == (found.says is Says.OVER)
