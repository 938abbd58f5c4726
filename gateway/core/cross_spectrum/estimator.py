"""The cross-spectral estimator: payload and front share from both sensors together, phase included.

    by_cross_spectrum(batch, calibration, blank) -> Estimate

Both sensors ride on one vehicle over one road, so their ratio at each frequency and speed does not
depend on the road. The half-car calibrated by known-load drives is held against the batch's
cross-spectra; payload and share are what fits best, together with small changes of dampers and of
the wheelbase delay, and with how firmly the payload stands on the floor. The posterior gives the
interval, widened by what left-out runs showed in calibration and by how vehicles change from day to
day. docs/method.md has the derivation.
"""

import math
from dataclasses import replace
from typing import Final

import numpy as np

from gateway.core.cross_spectrum.calibration import CrossSpectrumCalibration
from gateway.core.cross_spectrum.drift import MOST_TENSION
from gateway.core.cross_spectrum.lateral.told import with_place
from gateway.core.cross_spectrum.located import Located, locate
from gateway.core.cross_spectrum.measured import CrossSpectra, cross_spectra_of, why_no_spectra
from gateway.core.cross_spectrum.model.parameters import INDEX
from gateway.core.cross_spectrum.reach import beyond
from gateway.core.cross_spectrum.sensor_change import MOST_GRAVITY_CHANGE_MPS2, gain_std
from gateway.core.fusion import CG_LEFT_OWN_STD_M, FRONT_SHARE_OWN_STD_PCT, PAYLOAD_OWN_STD_KG
from gateway.estimate import Estimate, Quantity
from gateway.records import F64, Batch, Why

COHERENCE_BAND_HZ: Final = (1.4, 4.5)
LEAST_COHERENCE: Final = 0.2
LEAST_POWER_SHARE: Final = 0.05  # of the calibrated amplitude
MOST_PAYLOAD_STD_SHARE: Final = 0.15  # of the empty mass; wider is no answer
# chosen, both; `benchmarks.accuracy sensitivity` tells what hangs on them
UNSEEN_SPEED_SCALE: Final = 0.5  # the natural logarithm of a speed ratio over which model error doubles its variance
UNSEEN_ROUGHNESS_SCALE: Final = 0.5  # likewise of a ratio of accelerations: friction damps more where less moves
MOST_LAG_CHANGE_S: Final = 0.002  # beyond it, roll is taken out once more, at the lag that was found
ZERO_POINT_SPEED_MARGIN: Final = 0.1  # how far beyond its own speeds a calibration from one load is believed


def by_cross_spectrum(batch: Batch, calibration: CrossSpectrumCalibration, blank: Estimate) -> Estimate:
    """``blank`` with payload, front share and diagnostics of the batch, or with the reason why not."""
    spectra = cross_spectra_of([batch], calibration.reading)
    why = _unfit(batch, spectra, calibration) or _off_its_speeds(batch, calibration) or _unlike(batch, calibration)
    if spectra is None or why is not None:
        return replace(blank, rejected=(why or Why.TOO_SHORT,))
    located = locate(spectra, calibration)
    lag_s = float(located.point.theta[INDEX["gyro_lag_s"]])
    if located.sideways is not None and abs(lag_s - calibration.parameters[INDEX["gyro_lag_s"]]) > MOST_LAG_CHANGE_S:
        spectra = cross_spectra_of([batch], calibration.reading.with_gyro_late_by(lag_s)) or spectra
        located = locate(spectra, calibration)
    inflation = _unseen_inflation(batch.mean_speed_mps, spectra.acceleration_rms_mps2, calibration)
    by_gain = located.gain_moves * gain_std(batch.gravity_mps2, calibration.gravity_mps2)
    return _judged(blank, spectra, located, inflation, by_gain, calibration)


def _unfit(batch: Batch, spectra: CrossSpectra | None, calibration: CrossSpectrumCalibration) -> Why | None:
    """Why there is no point in fitting, if so."""
    if spectra is None:
        return why_no_spectra(batch, calibration.reading)
    if (
        spectra.acceleration_rms_mps2 < LEAST_POWER_SHARE * calibration.acceleration_rms_mps2
        or spectra.pitch_rate_rms_radps < LEAST_POWER_SHARE * calibration.pitch_rate_rms_radps
    ):
        return Why.NOT_ENOUGH_EXCITATION
    freq_hz = spectra.freq_hz[1:-1]
    seen = (freq_hz >= COHERENCE_BAND_HZ[0]) & (freq_hz <= COHERENCE_BAND_HZ[1])
    return Why.SENSOR_DISAGREEMENT if float(np.mean(spectra.coherence[seen])) < LEAST_COHERENCE else None


def _off_its_speeds(batch: Batch, calibration: CrossSpectrumCalibration) -> Why | None:
    """A zero point drifts with speed as the model errs, and one load shows no error: stay near its speeds."""
    if calibration.payload_seen_kg[0] < calibration.payload_seen_kg[1]:
        return None
    slowest, fastest = calibration.speed_seen_mps
    margin = 1.0 + ZERO_POINT_SPEED_MARGIN
    return None if slowest / margin <= batch.mean_speed_mps <= fastest * margin else Why.SPEED_UNCALIBRATED


def _unlike(batch: Batch, calibration: CrossSpectrumCalibration) -> Why | None:
    """Gravity tells a gain that changed, or an axis that was tilted."""
    usual_mps2 = calibration.gravity_mps2
    if usual_mps2 is None or abs(batch.gravity_mps2 - usual_mps2) <= MOST_GRAVITY_CHANGE_MPS2:
        return None
    return Why.SENSOR_CHANGED


def _judged(
    blank: Estimate,
    spectra: CrossSpectra,
    located: Located,
    unseen: float,
    by_gain: F64,
    calibration: CrossSpectrumCalibration,
) -> Estimate:
    """``unseen`` widens what is away from the calibration's speeds and roads; ``by_gain`` (2,) is of the sensor."""
    load = located.point.load
    reach = beyond(load, calibration.known_loads, calibration.empty_mass_kg)
    of_payload = calibration.payload_inflation * (1.0 + calibration.payload_inflation_per_reach * reach)
    of_share = calibration.front_share_inflation * (1.0 + calibration.front_share_inflation_per_reach * reach)
    wider = np.array([of_payload, of_share])
    covariance = wider[:, None] * (unseen**2 * located.load_covariance + located.rival_covariance) * wider
    not_inflated = located.drift_covariance + np.outer(by_gain, by_gain)
    covariance += not_inflated
    payload_std_kg, share_std = (float(std) for std in np.sqrt(np.diag(covariance)))
    own_payload_std_kg, own_share_std = (float(std) for std in np.sqrt(np.diag(located.own_covariance)))
    diagnostics = {
        "reach": reach,
        "misfit": located.misfit,
        "n_segments": float(spectra.n_total),
        "amplitude_ratio": math.exp(spectra.log_amplitude_mean),
        "damper_front_ratio": _ratio(located, calibration, "damper_front_nspm"),
        "damper_rear_ratio": _ratio(located, calibration, "damper_rear_nspm"),
        "delay_scale": float(located.point.theta[INDEX["delay_scale"]]),
        "payload_drift_std_kg": math.sqrt(not_inflated[0, 0]),
        "front_share_drift_std_pct": 100.0 * math.sqrt(not_inflated[1, 1]),
        PAYLOAD_OWN_STD_KG: own_payload_std_kg,
        FRONT_SHARE_OWN_STD_PCT: 100.0 * own_share_std,
        "tension": located.tension,
        "sensor_position_score": located.scores.position,
        "sensor_noise_score": located.scores.noise,
        "payload_mode_hz": math.exp(located.point.theta[INDEX["payload_mode_hz"]]),
        "payload_damping_ratio": math.exp(located.point.theta[INDEX["payload_damping_ratio"]]),
        "delay_s": spectra.delay_mean_s,
        "delay_std_s": spectra.delay_std_s,
    }
    if located.sideways is not None:
        diagnostics[CG_LEFT_OWN_STD_M] = math.sqrt(located.sideways.own_variance)
    why = _disbelieved(located, payload_std_kg, reach, calibration)
    if why is not None:
        return replace(blank, rejected=(why,), diagnostics=diagnostics)
    answer = replace(
        blank,
        payload=Quantity.normal(load.payload_kg, payload_std_kg),
        front_share=Quantity.normal(load.front_share_pct, 100.0 * share_std),
        correlation=float(covariance[0, 1]) / (payload_std_kg * share_std),
        diagnostics=diagnostics,
    )
    return with_place(answer, located.point, located.sideways, covariance, calibration) if located.sideways else answer


def _disbelieved(
    located: Located, payload_std_kg: float, reach: float, calibration: CrossSpectrumCalibration
) -> Why | None:
    """Beyond the known loads the half-car itself errs: what looks like another sensor there is no proof of one."""
    if located.is_reversed:
        return Why.WRONG_SIGN
    if not located.misfit <= calibration.misfit_limit:
        return Why.MODEL_MISFIT
    is_moved = located.sideways is not None and located.sideways.is_mount_changed
    if is_moved or located.scores.is_changed(calibration):
        return Why.SENSOR_CHANGED if is_moved or reach == 0.0 else Why.MODEL_MISFIT
    if located.tension > MOST_TENSION:
        return Why.MODEL_MISFIT
    if not payload_std_kg <= MOST_PAYLOAD_STD_SHARE * calibration.empty_mass_kg:
        return Why.AMBIGUOUS if located.is_ambiguous else Why.TOO_UNCERTAIN
    return None


def _unseen_inflation(speed_mps: float, shaken_mps2: float, calibration: CrossSpectrumCalibration) -> float:
    """How much wider an interval gets away from what calibration saw; 1 within its speeds on roads as rough.

    ``shaken_mps2`` is the batch's vertical acceleration (root mean square within the band).
    """
    slowest, fastest = calibration.speed_seen_mps
    faster = max(0.0, math.log(slowest / speed_mps), math.log(speed_mps / fastest))
    rougher = math.log(shaken_mps2 / calibration.acceleration_rms_mps2)
    return math.hypot(1.0, faster / UNSEEN_SPEED_SCALE, rougher / UNSEEN_ROUGHNESS_SCALE)


def _ratio(located: Located, calibration: CrossSpectrumCalibration, name: str) -> float:
    return math.exp(located.point.theta[INDEX[name]] - calibration.parameters[INDEX[name]])
