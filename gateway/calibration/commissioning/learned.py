"""How well a vehicle would be weighed after its empty drive, and what driving on would gain."""

from collections.abc import Iterator
from typing import Final

from gateway.calibration.ahead import Ahead
from gateway.calibration.calibrate import Outcome
from gateway.calibration.commissioning.job import Learned
from gateway.calibration.statements import empty
from gateway.core.vehicle import Load, Vehicle, front_share_pct
from gateway.core.weights.on_the_road import weights_of
from gateway.errors import CalibrationImpossibleError
from gateway.estimate import Quantity
from gateway.posterior import exactly

ANOTHER_DRIVE_S: Final = 3600.0  # chosen: further driving that a fitter might accept
WORTH_DRIVING: Final = 0.1  # chosen: relative gain that is worth it
# chosen: an even grid of loads and places over the vehicle's range
PARTS: Final = (0.25, 0.6, 1.0)
PLACES: Final = (0.25, 0.6, 0.95)
_EVEN: Final = Quantity(0.5, 0.0)  # chosen: front axle's part of a roll moment, if unknown


def learned_by(outcome: Outcome, vehicle: Vehicle, goal_std_share: float) -> Learned:
    """The accuracy after the empty drives of ``outcome``, as the service will state it, and the accuracy needed.

    Needed is the goal, a share of the largest payload; or, if it is larger, the accuracy after another hour of the same
    driving plus a tenth: then only known loads would help, and driving on is in vain.
    """
    if outcome.cross_spectrum is None:
        raise CalibrationImpossibleError("the drives carry no cross-spectral calibration")
    model = outcome.cross_spectrum.model
    ahead = Ahead(model, vehicle, tuple(carried_loads(vehicle)))
    payload_std_kg, front_share_std_pct = ahead.stds(model.covariance)
    later = ahead.after(empty(), Load(0.0, vehicle.empty_front_share_pct), ANOTHER_DRIVE_S)
    return Learned(
        payload_std_kg=payload_std_kg,
        front_share_std_pct=front_share_std_pct,
        needed_std_kg=max(goal_std_share * vehicle.payload_range_kg[1], ahead.stds(later)[0] / (1.0 - WORTH_DRIVING)),
    )


def carried_loads(vehicle: Vehicle) -> Iterator[Load]:
    """The empty vehicle and a grid of the loads that it may carry, within the limits of its axles."""
    yield Load(0.0, vehicle.empty_front_share_pct)
    for part in PARTS:
        for place in PLACES:
            payload_kg = part * vehicle.payload_range_kg[1]
            share_pct = front_share_pct(vehicle, payload_kg, place * vehicle.wheelbase_m)
            weights = weights_of(vehicle, exactly(payload_kg, share_pct), _EVEN)
            if not any(weight.is_over_limit for _, weight in weights.items()):
                yield Load(payload_kg, share_pct)
