"""Axes, signs, units and positions of the two inertial sensors, from the correlation of their signals.

A usual vehicle of this size (the middle of the priors, nothing fitted) predicts the phase and the size of the pitch
rate relative to the vertical acceleration, for a sensor anywhere along the vehicle. Its agreement with the measured
cross-spectra is their normalised inner product,

    Re sum n S_ga conj(M_ga) / sqrt(sum n |S_ga|^2 sum n |M_ga|^2),

over groups of segments and frequencies, S and M each divided by the square root of its two auto-spectra: 1 for the same
phases, -1 for opposite ones. The rear axle follows the front, so a sensor turned over at the rear is not the same as
one at the front.
"""

from dataclasses import dataclass, replace
from typing import Final, NamedTuple

import numpy as np

from gateway.calibration.as_stated import StatedRun, fitted
from gateway.calibration.read_drive import BAND_HZ, N_SEGMENT
from gateway.core.vehicle import Load, Vehicle
from gateway.model import fit
from gateway.model.car import Ground
from gateway.model.expected import Expected, Groups
from gateway.model.spectra import CrossSpectra, Reading
from gateway.model.table import INDEX, UPRIGHT, prior_of
from gateway.records import C128

REVERSED_BY: Final = 0.1  # chosen: gain of agreement that proves a reversed sign
BEYOND_AXLES_M: Final = 1.5  # chosen: longest overhang with a sensor
STEP_M: Final = 0.25  # chosen: grid of sensor positions
LOOSE_STD_M: Final = 1.0  # chosen: prior of the sensor's place in the fit of one run
_SENSOR: Final = INDEX["sensor_position_m"]


def reading_of(vehicle: Vehicle, speed_misread: float = 1.0) -> Reading:
    """Settings of the spectra; a speed that reads ``speed_misread`` times too high has its delays corrected."""
    return Reading(vehicle.wheelbase_m * speed_misread, BAND_HZ, N_SEGMENT, with_roll=True)


class Agreement(NamedTuple):
    """The best agreement (-1..1) over all sensor positions, its position, and the size of the pitch rate there: the
    measured one over the usual vehicle's, both beside the vertical acceleration.
    """

    best: float
    position_m: float
    scale: float


@dataclass(frozen=True, slots=True)
class Phases:
    """Agreement of the phases with the pitch rate as it is, and with it inverted."""

    upright: Agreement
    turned: Agreement

    @property
    def best(self) -> float:
        """The better of the two agreements."""
        return max(self.upright.best, self.turned.best)

    @property
    def likely(self) -> Agreement:
        """With the sign that the data support."""
        return self.turned if self.is_turned else self.upright

    @property
    def is_turned(self) -> bool:
        """True if the pitch rate fits only when inverted."""
        return self.turned.best > self.upright.best + REVERSED_BY


def phases(spectra: CrossSpectra, load: Load, vehicle: Vehicle) -> Phases:
    """Both signs of the pitch rate compared with the usual vehicle.

    It carries the stated load or none, whichever explains more: a wrongly stated load must not look like a wrong axis.
    """
    loads = dict.fromkeys([load, Load(0.0, vehicle.empty_front_share_pct)])
    likeliest = []
    for each in zip(*(agreements(spectra, one, vehicle) for one in loads), strict=True):
        usual = min((one.scale for one in each), key=lambda scale: abs(np.log(scale)))
        likeliest.append(max(each, key=lambda one: one.best)._replace(scale=usual))
    return Phases(*likeliest)


def agreements(spectra: CrossSpectra, load: Load, vehicle: Vehicle) -> tuple[Agreement, Agreement]:
    """The best over sensor positions from 1.5 m ahead of the front axle to 1.5 m behind the rear one; then with the
    pitch rate inverted. The usual vehicle carries ``load``.
    """
    spectra = spectra.without_roll
    positions_m = np.arange(-BEYOND_AXLES_M, vehicle.wheelbase_m + BEYOND_AXLES_M + STEP_M / 2.0, STEP_M)
    theta = np.repeat(prior_of(UPRIGHT, vehicle)[0][None], len(positions_m), axis=0)
    theta[:, _SENSOR] = positions_m
    loaded = np.repeat([[load.payload_kg], [load.front_share]], len(positions_m), axis=1)
    m_aa, m_gg, real, imaginary = Expected(theta, loaded, Groups(spectra, Ground.of(vehicle))).parts
    n = spectra.n_segments
    seen: C128 = spectra.cross / np.sqrt(spectra.acceleration * spectra.pitch_rate)
    expected: C128 = (real + 1j * imaginary) / np.sqrt(m_aa * m_gg)
    inner = np.sum(n * np.real(seen * np.conj(expected)), axis=(1, 2))
    inner /= np.sqrt(np.sum(n * np.abs(expected) ** 2, axis=(1, 2)) * np.sum(n * np.abs(seen) ** 2))

    def at(i: int, sign: float) -> Agreement:
        log_ratio = 0.5 * np.log(spectra.pitch_rate / spectra.acceleration * m_aa[i] / m_gg[i])
        scale = float(np.exp(np.sum(n * log_ratio) / (np.sum(n) * log_ratio.shape[1])))
        return Agreement(sign * float(inner[i]), float(positions_m[i]), scale)

    return at(int(np.argmax(inner)), 1.0), at(int(np.argmin(inner)), -1.0)


def fitted_position_m(one: StatedRun, vehicle: Vehicle) -> tuple[float, float]:
    """The most probable sensor position of one run and its standard deviation, the rest of the vehicle unknown too."""
    start_m = agreements(one.whittle.spectra, one.load, vehicle)[0].position_m
    mean, std = prior_of(UPRIGHT, replace(vehicle, sensor_position_m=start_m, sensor_position_std_m=LOOSE_STD_M))
    found = fitted([one], fit.Gaussian.of(mean, np.diag(std**2)), mean)
    return float(found.common[_SENSOR]), float(np.sqrt(found.covariance[_SENSOR, _SENSOR]))
