"""Whether enough was driven: what is known of the vehicle against what is needed, not how long it took."""

from typing import Final

import numpy as np

from gateway.calibration.calibrate import Outcome
from gateway.calibration.commissioning.job import Learned
from gateway.calibration.plan.design import Design, Spread
from gateway.calibration.plan.loads import empty, weighed_loads
from gateway.calibration.plan.plan import WORTH_DRIVING
from gateway.core.cross_spectrum.ideal_drive import Drive
from gateway.core.cross_spectrum.model.parameters import PARAMETERS
from gateway.core.vehicle import Vehicle
from gateway.errors import CalibrationImpossibleError

ANOTHER_DRIVE_S: Final = 3600.0  # after which nobody would go on in any case


def learned_by(outcome: Outcome, vehicle: Vehicle, goal_std_share: float) -> Learned:
    """What the empty drives of ``outcome`` taught, and what is needed.

    Needed is the goal, a share of the largest payload; or what another hour of the same would leave, less a tenth:
    where that is more, only loads would help, and driving on is in vain.
    """
    if outcome.cross_spectrum is None:
        raise CalibrationImpossibleError("the drives carry no cross-spectral calibration")
    known = outcome.cross_spectrum.calibration
    n = len(PARAMETERS)
    counted = [batch for run in outcome.split for batch in run.identification.batches if not batch.rejected]
    speed_mps = float(np.median([batch.mean_speed_mps for batch in counted]))
    design = Design(vehicle, known.parameters, Drive(ANOTHER_DRIVE_S, speed_mps), weighed_loads(vehicle))
    covariance = known.covariance[:n, :n]
    now = design.spread(covariance)
    later = design.spread(design.after(covariance, empty(vehicle)))
    return Learned(
        payload_std_kg=_inflated(now, known.payload_inflation),
        front_share_std_pct=known.front_share_inflation * now.front_share_std_pct,
        needed_std_kg=max(
            goal_std_share * vehicle.payload_range_kg[1],
            _inflated(later, known.payload_inflation) / (1.0 - WORTH_DRIVING),
        ),
    )


def _inflated(spread: Spread, inflation: float) -> float:
    """As the service would state it."""
    return inflation * spread.payload_std_kg
