"""Whether the driving is sufficient: the accuracy reached compared with the goal, not the time driven."""

import math
from typing import Final

import numpy as np

from gateway.calibration.calibrate import Outcome
from gateway.calibration.commissioning.job import Learned
from gateway.calibration.plan.design import BATCH_S, Design
from gateway.calibration.plan.loads import empty, weighed_loads
from gateway.calibration.plan.plan import WORTH_DRIVING
from gateway.core.cargo import shape_prior
from gateway.core.cross_spectrum.model.parameters import PARAMETERS
from gateway.core.cross_spectrum.predicted import Drive, predicted
from gateway.core.vehicle import Vehicle
from gateway.errors import CalibrationImpossibleError
from gateway.posterior import FRONT_SHARE, PAYLOAD, Source

ANOTHER_DRIVE_S: Final = 3600.0  # chosen: further driving that a fitter might accept
EVERY: Final = 6  # chosen: every sixth possible load, enough for the mean of errors that driving does not reduce


def learned_by(outcome: Outcome, vehicle: Vehicle, goal_std_share: float) -> Learned:
    """The accuracy after the empty drives of ``outcome``, as the service will state it, and the accuracy needed.

    Needed is the goal, a share of the largest payload; or, if it is larger, the accuracy after another hour of the same
    driving plus a tenth: then only known loads would help, and driving on is in vain.
    """
    if outcome.cross_spectrum is None:
        raise CalibrationImpossibleError("the drives carry no cross-spectral calibration")
    known = outcome.cross_spectrum.calibration
    n = len(PARAMETERS)
    counted = [batch for run in outcome.split for batch in run.identification.batches if not batch.rejected]
    speed_mps = float(np.median([batch.mean_speed_mps for batch in counted]))
    loads = weighed_loads(vehicle)
    prior, drive = shape_prior(vehicle, *known.known_shape), Drive(BATCH_S, speed_mps)
    stated = [predicted(known, prior, load.load, drive).without(Source.CALIBRATION) for load in loads[::EVERY]]
    beside = np.sqrt(np.mean([np.diag(one.shared) for one in stated], axis=0))
    design = Design(vehicle, known.parameters, Drive(ANOTHER_DRIVE_S, speed_mps), loads)
    covariance = known.covariance[:n, :n]
    now = design.spread(covariance)
    later = design.spread(design.after(covariance, empty(vehicle)))
    return Learned(
        payload_std_kg=math.hypot(now.payload_std_kg, beside[PAYLOAD]),
        front_share_std_pct=math.hypot(now.front_share_std_pct, beside[FRONT_SHARE]),
        needed_std_kg=max(
            goal_std_share * vehicle.payload_range_kg[1],
            math.hypot(later.payload_std_kg, beside[PAYLOAD]) / (1.0 - WORTH_DRIVING),
        ),
    )
