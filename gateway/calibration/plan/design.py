"""The most informative known-load run: optimal design on the half-car's posterior.

    design = Design(vehicle, theta, drive, targets)
    design.spread(covariance)             accuracy of estimates, given the covariance of the parameters
    design.after(covariance, load)        that covariance after one more known-load run

One more run adds its expected information I, C' = (C^-1 + I)^-1. A batch of load y has the covariance  own + moves C
moves'  (core.cross_spectrum): its own noise, and the calibration's uncertainty. The best next run minimises the mean of
that variance over the loads that the vehicle carries (I-optimality; G. E. P. Box and N. R. Draper, "A basis for the
selection of a response surface design", J. Am. Stat. Assoc. 54, 1959). It is a prediction of the model to first order:
errors of the model enter only through its slack and priors.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gateway.calibration.half_car.known_spectra import BAND_HZ, N_SEGMENT
from gateway.calibration.plan.loads import PlacedLoad
from gateway.core.cross_spectrum.likelihood import EVIDENCE_WEIGHT, Point, Whittle
from gateway.core.cross_spectrum.located import raw_moves
from gateway.core.cross_spectrum.model.parameters import PARAMETERS, Ground, upright
from gateway.core.cross_spectrum.model.reading import Reading
from gateway.core.cross_spectrum.predicted import Drive, expected_of, steady_spectra
from gateway.core.vehicle import Vehicle
from gateway.records import F64

BATCH_S = 300.0  # BatchSettings.window_s


@dataclass(frozen=True, slots=True)
class Spread:
    """Root mean square standard deviation of an estimate over the loads a vehicle carries."""

    payload_std_kg: float
    front_share_std_pct: float


class Design:
    """The expected information of runs of a vehicle with parameters ``theta`` (p,), each driven as ``drive``."""

    def __init__(self, vehicle: Vehicle, theta: F64, drive: Drive, targets: Sequence[PlacedLoad]) -> None:
        self._theta = upright(theta)
        self._ground = Ground.of(vehicle)
        self._reading = Reading(vehicle.wheelbase_m, BAND_HZ, N_SEGMENT)
        self._drive = drive
        self._information: dict[PlacedLoad, F64] = {}
        span_kg = vehicle.payload_range_kg[1] - vehicle.payload_range_kg[0]
        span_share = (vehicle.front_share_range_pct[1] - vehicle.front_share_range_pct[0]) / 100.0
        self._spans: F64 = np.array([span_kg, span_share], dtype=float)
        weighed = [self._weighed(load) for load in targets]
        self._own: F64 = np.array([own for own, _ in weighed], dtype=float)
        self._moves: F64 = np.array([moves for _, moves in weighed], dtype=float)

    def after(self, covariance: F64, load: PlacedLoad) -> F64:
        """Covariance (p, p) of the parameters after one more run with ``load``, from ``covariance`` before it."""
        if load not in self._information:
            whittle, point = self._seen(load, self._drive, EVIDENCE_WEIGHT)
            everything = list(range(len(PARAMETERS)))
            self._information[load] = whittle.curvature(point, everything).information
        return np.asarray(np.linalg.inv(np.linalg.inv(covariance) + self._information[load]), float)

    def spread(self, covariance: F64) -> Spread:
        """Accuracy of the targets in batches of five minutes, from the batch and the calibration alone."""
        payload_var, share_var = self._variances(covariance).mean(axis=0)
        return Spread(float(np.sqrt(payload_var)), 100.0 * float(np.sqrt(share_var)))

    def loss(self, covariance: F64) -> float:
        """Mean variance of payload and front share over the targets, each in its range (12)."""
        return float(np.sum(self._variances(covariance).mean(axis=0) / self._spans**2))

    def best(self, covariance: F64, loads: Sequence[PlacedLoad]) -> PlacedLoad:
        """The one of ``loads`` with the least loss after it; the first of equals."""
        return min(loads, key=lambda load: self.loss(self.after(covariance, load)))

    def worst(self, covariance: F64, loads: Sequence[PlacedLoad]) -> PlacedLoad:
        """The one of ``loads`` with the most loss after it; the first of equals."""
        return max(loads, key=lambda load: self.loss(self.after(covariance, load)))

    def _variances(self, covariance: F64) -> F64:
        """Variances (t, 2) of payload (kg) and front share (0..1) at each target."""
        left_open = np.einsum("tij,jk,tik->ti", self._moves, covariance, self._moves)
        variances: F64 = self._own + left_open
        return variances

    def _weighed(self, load: PlacedLoad) -> tuple[F64, F64]:
        """A batch's own variances (2,), and the derivative (2, p) of payload and share by each parameter."""
        whittle, point = self._seen(load, Drive(BATCH_S, self._drive.speed_mps), 1.0)
        own, moves = raw_moves(whittle, point)
        return np.diag(own), moves

    def _seen(self, load: PlacedLoad, drive: Drive, weight: float) -> tuple[Whittle, Point]:
        point = Point.of(self._theta, load.load)
        spectra = expected_of(steady_spectra(self._reading, drive), point, self._ground)
        return Whittle(spectra, self._ground, weight), point
