"""Checks that refuse a batch, before it is weighed and after. The second list is a table of rows."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np

from gateway.core.reach import beyond
from gateway.core.vehicle import Load
from gateway.model.spectra import CrossSpectra, why_no_spectra
from gateway.model.table import INDEX, UPRIGHT
from gateway.model.vehicle_model import VehicleModel
from gateway.records import F64, Batch, Why

COHERENCE_BAND_HZ: Final = (1.4, 4.5)  # chosen: where heave and pitch of the body resonate
LEAST_COHERENCE: Final = 0.2  # chosen: mean over that band
LEAST_POWER_SHARE: Final = 0.05  # chosen: of the calibrated amplitude
MOST_PAYLOAD_STD_SHARE: Final = 0.15  # chosen: of the empty mass; wider is no answer
UNSEEN_SPEED_SCALE: Final = 0.5  # chosen: logarithm of a speed ratio over which the model error doubles its variance
UNSEEN_ROUGHNESS_SCALE: Final = 0.5  # chosen: likewise of accelerations: friction damps more where less moves
UNSEEN_LOAD_SCALE: Final = 0.25  # chosen: likewise of loads beyond those seen, in empty masses
MISFIT_ON_OTHER_ROADS: Final = 0.15
"""Standard deviation of the logarithm of a healthy batch's misfit between roads, speeds and loads; away from those that
taught the vehicle it grows as the model's error does. Four simulated vans showed 0.12; chosen.
"""
MISFIT_QUANTILE: Final = 3.09  # of the normal distribution: one healthy batch in a thousand is refused; chosen
MOST_POSITION: Final = 6.0  # chosen: standard deviations of the sensor's place along the vehicle
MOST_NOISE: Final = 6.0  # chosen: standard deviations of the acceleration's own noise
MOST_TENSION: Final = 60.0
"""Chosen: chi-squared of the vehicle's parameters about their prior. One healthy simulated batch in a hundred exceeds
39.
"""
MOST_GYRO_NOISE: Final = math.log(3.0)
"""Chosen: largest increase of the pitch rate's noise (logarithm of its power) while the floor above the vehicle's
frequencies is quiet: roll that leaks into a turned gyro is limited to the vehicle's frequencies.
"""
QUIET: Final = 2.0**0.5  # chosen: loudness above which the floor shows that the gyro itself has become noisier
MOST_LAG_CHANGE_S: Final = 0.03  # chosen: largest change of the gyro's lag; a later one hides the load behind noise
MOST_RIVALRY: Final = 1.0  # chosen: variance between peaks over all other; above it the peaks make the answer uncertain

VEHICLE_ROWS: Final = [
    i
    for i, row in enumerate(UPRIGHT)
    if not row.name.startswith(("slack_", "noise_", "gyro_", "payload_", "delay_", "track_", "driveline_", "accel"))
]


def why_not(batch: Batch, spectra: CrossSpectra | None, model: VehicleModel) -> Why | None:
    """The reason why a fit makes no sense; None if it does."""
    if spectra is None:
        return why_no_spectra(batch, model.reading)
    if (
        spectra.acceleration_rms_mps2 < LEAST_POWER_SHARE * model.acceleration_rms_mps2
        or spectra.pitch_rate_rms_radps < LEAST_POWER_SHARE * model.pitch_rate_rms_radps
    ):
        return Why.NOT_ENOUGH_EXCITATION
    freq_hz = spectra.freq_hz[1:-1]
    seen = (freq_hz >= COHERENCE_BAND_HZ[0]) & (freq_hz <= COHERENCE_BAND_HZ[1])
    return None if float(np.mean(spectra.coherence[seen])) >= LEAST_COHERENCE else Why.SENSOR_DISAGREEMENT


def unseen_of(speed_mps: float, shaken_mps2: float, reach: float, model: VehicleModel) -> float:
    """Factor (1 or more) of the model error away from what taught the vehicle: its speeds, roads and loads.

    ``shaken_mps2`` is the batch's vertical acceleration (root mean square within the band).
    """
    slowest, fastest = model.speed_seen_mps
    faster = max(0.0, math.log(slowest / speed_mps), math.log(speed_mps / fastest))
    rougher = math.log(shaken_mps2 / model.acceleration_rms_mps2)
    return math.hypot(1.0, faster / UNSEEN_SPEED_SCALE, rougher / UNSEEN_ROUGHNESS_SCALE, reach / UNSEEN_LOAD_SCALE)


def reach_of(load: Load, model: VehicleModel) -> float:
    """Distance of a load beyond those that taught the vehicle, in empty masses."""
    return beyond(load, model.taught_loads, model.empty_mass_kg)


@dataclass(frozen=True, slots=True, eq=False)
class Signs:
    """The signs by which the checks judge an answer.

    off (N,) are the deviations of the parameters from the calibration, deviations (N,) the same in standard deviations,
    tension their chi-squared. If the misfit exceeds its limit, off and deviations are of a fit that follows the batch
    as far as the parameters may, and followed is the misfit of that fit; else followed is the misfit. is_settled: the
    lag at which roll was removed equals the lag found, and the searches converged. rivalry is the variance between
    peaks over all other.
    """

    model: VehicleModel
    misfit: float
    followed: float
    unseen: float
    reach: float
    is_reversed: bool
    off: F64
    deviations: F64
    tension: float
    loudness: F64
    is_mount_changed: bool
    is_settled: bool
    payload_std_kg: float
    rivalry: float

    def deviation(self, name: str) -> float:
        """The deviation of one parameter, in standard deviations."""
        return float(self.deviations[INDEX[name]])

    def changed(self, name: str) -> float:
        """The found value of one parameter, in its unit or as a logarithm."""
        return float(self.off[INDEX[name]])


def most_misfit_at(misfit_limit: float, unseen: float) -> float:
    """The misfit above which an answer is not believed so far from what taught the vehicle."""
    return misfit_limit * math.exp(MISFIT_QUANTILE * MISFIT_ON_OTHER_ROADS * (min(unseen, 4.0) - 1.0))


def fits(misfit: float, model: VehicleModel, unseen: float) -> bool:
    """Whether a misfit is small enough for an answer to be believed; False for NaN."""
    return misfit <= most_misfit_at(model.misfit_limit, unseen)


def _is_explained(signs: Signs) -> bool:
    """Whether a changed sensor may explain the batch: with parameters that follow it, the model fits."""
    return fits(signs.followed, signs.model, signs.unseen)


def _is_gyro_late(signs: Signs) -> bool:
    return _is_explained(signs) and abs(signs.changed("gyro_lag_s")) > MOST_LAG_CHANGE_S


def _is_moved(signs: Signs) -> bool:
    return _is_explained(signs) and abs(signs.deviation("sensor_position_m")) > MOST_POSITION


def _is_louder(signs: Signs) -> bool:
    return _is_explained(signs) and signs.deviation("noise_acceleration_m2ps3") > MOST_NOISE


def _is_gyro_turned(signs: Signs) -> bool:
    return signs.changed("noise_pitch_rate_rad2ps") > MOST_GYRO_NOISE and not np.any(signs.loudness[1:2] > QUIET)


def _is_too_wide(signs: Signs) -> bool:
    return signs.payload_std_kg > MOST_PAYLOAD_STD_SHARE * signs.model.empty_mass_kg


@dataclass(frozen=True, slots=True)
class Check:
    """A sign that makes an answer unbelievable, and the reason that is reported.

    ``of_sensor``: a sign of a changed sensor, which proves nothing beyond the loads that taught the vehicle.
    """

    name: str
    fails: Callable[[Signs], bool]
    why: Why
    of_sensor: bool = False


CHECKS: Final = (
    Check("the pitch rate's sign", lambda s: s.is_reversed, Why.WRONG_SIGN),
    Check("the gyro's lag", _is_gyro_late, Why.SENSOR_CHANGED),
    Check("the sensor's place", _is_moved, Why.SENSOR_CHANGED, of_sensor=True),
    Check("the accelerometer's noise", _is_louder, Why.SENSOR_CHANGED, of_sensor=True),
    Check("misfit", lambda s: not fits(s.misfit, s.model, s.unseen), Why.MODEL_MISFIT),
    Check("the sensor's mount", lambda s: s.is_mount_changed, Why.SENSOR_CHANGED),
    Check("the gyro's yaw", _is_gyro_turned, Why.SENSOR_CHANGED),
    Check("tension", lambda s: s.tension > MOST_TENSION, Why.MODEL_MISFIT),
    Check("convergence", lambda s: not s.is_settled, Why.NO_SOLUTION),
    Check("rival peaks", lambda s: _is_too_wide(s) and s.rivalry > MOST_RIVALRY, Why.AMBIGUOUS),
    Check("width", _is_too_wide, Why.TOO_UNCERTAIN),
)


def disbelieved(signs: Signs) -> Why | None:
    """Why an answer is not accepted: the first check that fails; None if none does."""
    for check in CHECKS:
        if check.fails(signs):
            return Why.MODEL_MISFIT if check.of_sensor and signs.reach > 0.0 else check.why
    return None
