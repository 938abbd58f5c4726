"""How well a vehicle would be weighed after its empty drive, and what driving on would gain.

A batch of load y has the covariance  own + moves C moves'  (core.cross_spectrum): its own noise, and the calibration's
uncertainty C. One more run adds its expected information I, C' = (C^-1 + I)^-1. It is a prediction of the model to
first order: errors of the model enter only through its slack and priors.
"""

import math
from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np

from gateway.calibration.calibrate import Outcome
from gateway.calibration.commissioning.job import Learned
from gateway.calibration.half_car.known_spectra import BAND_HZ, N_SEGMENT
from gateway.core.cargo import shape_prior
from gateway.core.cross_spectrum.likelihood import EVIDENCE_WEIGHT, Point, Whittle
from gateway.core.cross_spectrum.located import raw_moves
from gateway.core.cross_spectrum.model.parameters import PARAMETERS, Ground, upright
from gateway.core.cross_spectrum.model.reading import Reading
from gateway.core.cross_spectrum.predicted import Drive, expected_of, predicted, steady_spectra
from gateway.core.vehicle import Load, Vehicle, front_share_pct
from gateway.core.weights.on_the_road import weights_of
from gateway.errors import CalibrationImpossibleError
from gateway.estimate import Quantity
from gateway.posterior import FRONT_SHARE, PAYLOAD, Source, exactly
from gateway.records import F64

BATCH_S: Final = 300.0  # BatchSettings.window_s
ANOTHER_DRIVE_S: Final = 3600.0  # chosen: further driving that a fitter might accept
WORTH_DRIVING: Final = 0.1  # chosen: relative gain that is worth it
EVERY: Final = 6  # chosen: every sixth possible load, enough for the mean of errors that driving does not reduce
# chosen: an even grid of loads and places over the vehicle's range
PARTS: Final = tuple(np.linspace(0.05, 1.0, 6).tolist())
PLACES: Final = tuple(np.linspace(0.1, 1.0, 7).tolist())
_EVEN: Final = Quantity(0.5, 0.0)  # chosen: front axle's part of a roll moment, if unknown


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
    loads = tuple(carried_loads(vehicle))
    prior, drive = shape_prior(vehicle, *known.known_shape), Drive(BATCH_S, speed_mps)
    stated = [predicted(known, prior, load, drive).without(Source.CALIBRATION) for load in loads[::EVERY]]
    beside = np.sqrt(np.mean([np.diag(one.shared) for one in stated], axis=0))
    ahead = _Ahead(vehicle, known.parameters, speed_mps, loads)
    covariance = known.covariance[:n, :n]
    now = ahead.stds(covariance)
    later_kg, _ = ahead.stds(ahead.after_an_empty_drive(covariance))
    return Learned(
        payload_std_kg=math.hypot(now[0], beside[PAYLOAD]),
        front_share_std_pct=math.hypot(now[1], beside[FRONT_SHARE]),
        needed_std_kg=max(
            goal_std_share * vehicle.payload_range_kg[1],
            math.hypot(later_kg, beside[PAYLOAD]) / (1.0 - WORTH_DRIVING),
        ),
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


class _Ahead:
    """Batches of loads that a vehicle with parameters ``theta`` (p,) has not carried yet."""

    def __init__(self, vehicle: Vehicle, theta: F64, speed_mps: float, loads: Sequence[Load]) -> None:
        self._vehicle, self._theta, self._speed_mps = vehicle, upright(theta), speed_mps
        self._ground = Ground.of(vehicle)
        self._reading = Reading(vehicle.wheelbase_m, BAND_HZ, N_SEGMENT)
        weighed = [raw_moves(*self._seen(load, BATCH_S, 1.0)) for load in loads]
        self._own: F64 = np.array([np.diag(own) for own, _ in weighed], dtype=float)
        self._moves: F64 = np.array([moves for _, moves in weighed], dtype=float)

    def stds(self, covariance: F64) -> tuple[float, float]:
        """Root mean square standard deviation of payload (kg) and front share (%), with this covariance (p, p) of the
        parameters.
        """
        left_open = np.einsum("tij,jk,tik->ti", self._moves, covariance, self._moves)
        payload_var, share_var = (self._own + left_open).mean(axis=0)
        return float(np.sqrt(payload_var)), 100.0 * float(np.sqrt(share_var))

    def after_an_empty_drive(self, covariance: F64) -> F64:
        """Covariance (p, p) of the parameters after another empty drive."""
        whittle, point = self._seen(Load(0.0, self._vehicle.empty_front_share_pct), ANOTHER_DRIVE_S, EVIDENCE_WEIGHT)
        information = whittle.curvature(point, list(range(len(PARAMETERS)))).information
        return np.asarray(np.linalg.inv(np.linalg.inv(covariance) + information), float)

    def _seen(self, load: Load, duration_s: float, weight: float) -> tuple[Whittle, Point]:
        point = Point.of(self._theta, load)
        steady = steady_spectra(self._reading, Drive(duration_s, self._speed_mps))
        return Whittle(expected_of(steady, point, self._ground), self._ground, weight), point
