"""The cross-spectral estimator: payload and front share from both sensors together, phase included.

    by_cross_spectrum(batch, calibration, prior, blank) -> Estimate

Both sensors are on one vehicle on one road, so the ratio of their signals at each frequency and speed does not depend
on the road. The calibrated half-car is fitted to the batch's cross-spectra; free are payload and front share, small
changes of dampers and of the wheelbase delay, and the stiffness of the load's packing. Several shapes of the load are
tried. The posterior carries its error by source (gateway.posterior). docs/method.md has the derivation.
"""

import math
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from gateway.core.cargo import ShapePrior
from gateway.core.cross_spectrum.calibration import CrossSpectrumCalibration
from gateway.core.cross_spectrum.drift import MOST_TENSION, wear_of
from gateway.core.cross_spectrum.floor import SENSOR_OF, as_read, expected_floor, floor_of, noise_over
from gateway.core.cross_spectrum.lateral import with_roll_share
from gateway.core.cross_spectrum.located import Located, locate
from gateway.core.cross_spectrum.measured import CrossSpectra, cross_spectra_of, why_no_spectra
from gateway.core.cross_spectrum.model.parameters import INDEX
from gateway.core.cross_spectrum.sensor_change import (
    MOST_GRAVITY_CHANGE_MPS2,
    gain_of,
    gyro_gain_ratio,
    is_gyro_gain_changed,
    is_gyro_late,
    is_gyro_turned,
    off_calibration,
)
from gateway.core.reach import beyond
from gateway.estimate import Estimate
from gateway.posterior import PAYLOAD, Posterior, Source
from gateway.records import F64, Batch, Why

COHERENCE_BAND_HZ: Final = (1.4, 4.5)  # chosen: where heave and pitch of the body resonate
LEAST_COHERENCE: Final = 0.2  # chosen: mean over that band
LEAST_POWER_SHARE: Final = 0.05  # chosen: of the calibrated amplitude
MOST_PAYLOAD_STD_SHARE: Final = 0.15  # chosen: of the empty mass; wider is no answer
# chosen, both
UNSEEN_SPEED_SCALE: Final = 0.5  # the natural logarithm of a speed ratio over which model error doubles its variance
UNSEEN_ROUGHNESS_SCALE: Final = 0.5  # likewise of a ratio of accelerations: friction damps more where less moves
UNSEEN_PLACE_PART: Final = 0.2
"""Chosen: part of that growth (of standard deviations) which the lateral place shows. In 16 simulated vans the place
erred by 0.5 cm where payload and share were expected to err as in calibration, and by 0.8 to 1.0 cm where their model
error was taken five to seven times as large.
"""
MISFIT_ON_OTHER_ROADS: Final = 0.15
"""Standard deviation of the logarithm of a healthy batch's misfit between roads, speeds and loads; away from those of
calibration it grows as the model's error does (`_unseen`). Four simulated vans showed 0.12, and 0.07 to 0.18 each
(docs/method.md); chosen.
"""
MISFIT_QUANTILE: Final = 3.09  # of the normal distribution: one healthy batch in a thousand is refused; chosen
MOST_LAG_LEFT_S: Final = 0.002  # beyond it, roll is taken out again, at the lag that was found
MOST_LAGS: Final = 4  # tried; a lag that still moves has no fixed point
_BY_NOISE: Final = (
    Why.SENSOR_DISAGREEMENT,
    Why.WRONG_SIGN,
    Why.MODEL_MISFIT,
    Why.TOO_UNCERTAIN,
    Why.AMBIGUOUS,
    Why.NO_SOLUTION,
)
"""Reasons that a noisy sensor can cause."""
FREED: Final = ("damper_front_freed_ratio", "damper_rear_freed_ratio")
ZERO_POINT_SPEED_MARGIN: Final = (
    0.1  # chosen: share of speed beyond its own range for which a calibration from one load holds
)


@dataclass(frozen=True, slots=True)
class Weighed:
    """The result of a batch's spectra: the most probable load, its distance beyond the known ones (reach), the factor
    (1 or more) of the model error away from calibrated speeds and roads (unseen), and all of it as a posterior.

    is_settled: the lag at which roll was removed equals the lag found, and the searches converged. loudness (p,) is
    each sensor's noise amplitude over the largest expected; is_noisy: so large that the fit includes it.
    """

    spectra: CrossSpectra
    located: Located
    reach: float
    unseen: float
    posterior: Posterior
    is_settled: bool
    loudness: F64
    is_noisy: bool


def by_cross_spectrum(
    batch: Batch, calibration: CrossSpectrumCalibration, prior: ShapePrior | None, blank: Estimate
) -> Estimate:
    """``blank`` with payload, front share and diagnostics of the batch, or with the reason for a refusal.

    ``prior`` is that of the load's shape; None: the shape of the known loads.
    """
    watched = replace(blank, diagnostics=_watched(batch, calibration))
    found = weigh(batch, calibration, prior)
    if isinstance(found, Why):
        return replace(watched, rejected=(found,))
    diagnosed = replace(watched, diagnostics={**_diagnostics(found, calibration), **watched.diagnostics})
    why = disbelieved(found, calibration)
    if why is not None:
        return replace(diagnosed, rejected=(why,))
    answer = diagnosed.answered(found.posterior)
    located = found.located
    return with_roll_share(answer, located.point, calibration) if located.sideways else answer


def weigh(batch: Batch, calibration: CrossSpectrumCalibration, prior: ShapePrior | None) -> Weighed | Why:
    """The most probable load of a batch, however badly it fits, or why it cannot be compared with the model."""
    spectra = cross_spectra_of([batch], calibration.reading)
    why = _unfit(batch, spectra, calibration) or _off_its_speeds(batch, calibration) or _unlike(batch, calibration)
    if spectra is None or (why is not None and why not in _BY_NOISE):
        return why or Why.TOO_SHORT
    floor, expected = floor_of(batch), _expected_floor(spectra, calibration)
    noise = noise_over(floor, expected)
    is_noisy = bool(noise.any())
    if why is not None:
        return Why.SENSOR_NOISY if is_noisy else why
    spectra = _with_noise(spectra, noise)
    unseen = _unseen(batch.mean_speed_mps, spectra.acceleration_rms_mps2, calibration)
    taken_out_s = float(calibration.parameters[INDEX["gyro_lag_s"]])
    for _ in range(MOST_LAGS):
        located = locate(spectra, calibration, prior)
        lag_s = float(located.point.theta[INDEX["gyro_lag_s"]])
        is_settled = located.sideways is None or abs(lag_s - taken_out_s) <= MOST_LAG_LEFT_S
        if is_settled:
            break
        again = cross_spectra_of([batch], calibration.reading.with_gyro_late_by(lag_s))
        spectra = spectra if again is None else _with_noise(again, noise)
        taken_out_s = lag_s
    reach = beyond(located.point.load, calibration.known_loads, calibration.empty_mass_kg)
    gain = gain_of(batch.gravity_mps2, calibration.gravity_mps2)
    posterior = posterior_of(located, calibration, unseen, reach, gain)
    return Weighed(
        spectra,
        located,
        reach,
        unseen,
        posterior,
        is_settled=is_settled and located.is_converged,
        loudness=np.sqrt(floor[: len(expected)] / expected[: len(floor)]),
        is_noisy=is_noisy,
    )


def _with_noise(spectra: CrossSpectra, noise: F64) -> CrossSpectra:
    """The spectra with the sensors' noise (p,) in excess of calibration."""
    if not noise.any():
        return spectra
    with_roll = spectra.roll is not None
    return replace(spectra, noise=as_read(noise, spectra.reading, spectra.freq_hz[1:-1], with_roll=with_roll))


def _expected_floor(spectra: CrossSpectra, calibration: CrossSpectrumCalibration) -> F64:
    """(p,) largest expected noise of the sensors at this amplitude of movement; empty if the calibration has none."""
    times = (spectra.acceleration_rms_mps2 / calibration.acceleration_rms_mps2) ** 2
    return np.empty(0) if calibration.floor is None else expected_floor(calibration.floor, times)


def _unfit(batch: Batch, spectra: CrossSpectra | None, calibration: CrossSpectrumCalibration) -> Why | None:
    """The reason why a fit makes no sense; None if it does."""
    if spectra is None:
        return why_no_spectra(batch, calibration.reading)
    if (
        spectra.acceleration_rms_mps2 < LEAST_POWER_SHARE * calibration.acceleration_rms_mps2
        or spectra.pitch_rate_rms_radps < LEAST_POWER_SHARE * calibration.pitch_rate_rms_radps
    ):
        return Why.NOT_ENOUGH_EXCITATION
    freq_hz = spectra.freq_hz[1:-1]
    seen = (freq_hz >= COHERENCE_BAND_HZ[0]) & (freq_hz <= COHERENCE_BAND_HZ[1])
    return None if float(np.mean(spectra.coherence[seen])) >= LEAST_COHERENCE else Why.SENSOR_DISAGREEMENT


def _off_its_speeds(batch: Batch, calibration: CrossSpectrumCalibration) -> Why | None:
    """SPEED_UNCALIBRATED for a calibration from one load, away from its speeds: its zero point drifts with speed,
    because a single load cannot show the model's error.
    """
    if calibration.payload_seen_kg[0] < calibration.payload_seen_kg[1]:
        return None
    slowest, fastest = calibration.speed_seen_mps
    margin = 1.0 + ZERO_POINT_SPEED_MARGIN
    return None if slowest / margin <= batch.mean_speed_mps <= fastest * margin else Why.SPEED_UNCALIBRATED


def _unlike(batch: Batch, calibration: CrossSpectrumCalibration) -> Why | None:
    """SENSOR_CHANGED if gravity shows another gain or axis of the accelerometer, or bends another gain of the gyro."""
    usual_mps2 = calibration.gravity_mps2
    is_heavier = usual_mps2 is not None and abs(batch.gravity_mps2 - usual_mps2) > MOST_GRAVITY_CHANGE_MPS2
    is_turned_more = is_gyro_gain_changed(gyro_gain_ratio(batch.gyro_gain, calibration.gyro_gain))
    return Why.SENSOR_CHANGED if is_heavier or is_turned_more else None


def posterior_of(
    located: Located,
    calibration: CrossSpectrumCalibration,
    unseen: float,
    reach: float,
    gain: tuple[float, float],
) -> Posterior:
    """The load in kg and percent, with the lateral place if roll shows it, and its error by source.

    ``gain`` is the logarithm of the accelerometer's gain and its standard deviation.
    """
    side, outward = located.sideways, _outward(located)
    load = located.point.load
    mean = np.array([load.payload_kg, load.front_share_pct, *([side.cg_left_m] if side else [])])
    mean -= outward @ located.gain_moves * gain[0]
    own = outward @ located.own @ outward.T
    moves = moves_of(located, len(calibration.parameters))
    columns = {name: of_load @ outward.T for name, of_load in located.columns.items()}
    if side is not None:
        own[2, 2] += side.own_variance
        columns[Source.DAY][:, 2] += side.day
    by_calibration = moves @ calibration.directions
    left_over = moves @ calibration.covariance @ moves.T - by_calibration @ by_calibration.T
    left_over += outward @ located.rival_covariance @ outward.T
    grown = np.array([*(1.0 + per_reach * reach for per_reach in calibration.model_per_reach), 1.0])
    unlike = math.hypot(unseen, wear_of(located.freed))
    of_place = math.hypot(math.sqrt(1.0 - UNSEEN_PLACE_PART**2), UNSEEN_PLACE_PART * unlike)
    unlikes = np.array([unlike, unlike, of_place])
    of_model = np.diag((np.array(calibration.model_std) * unlikes * grown)[: len(mean)])
    return Posterior(
        mean=mean,
        own=own,
        sources={
            Source.CALIBRATION: by_calibration.T,
            **columns,
            Source.SENSOR: gain[1] * (outward @ located.gain_moves)[None],
            Source.MODEL: np.vstack([of_model, _root(left_over)]),
        },
        tails=located.tails,
    )


def _outward(located: Located) -> F64:
    """(d, 2) derivative of payload (kg), front share (%) and lateral place (m) by the model's payload and front
    share.
    """
    outward = np.diag([1.0, 100.0])
    return outward if located.sideways is None else np.vstack([outward, located.sideways.moves_with_load])


def moves_of(located: Located, n_parameters: int) -> F64:
    """(d, n) derivative of the answer (kg, %, m) by each parameter of a calibration."""
    outward = _outward(located)
    moves = np.zeros((len(outward), n_parameters))
    moves[:, : located.moves.shape[1]] = outward @ located.moves
    if located.sideways is not None:
        moves[2] += located.sideways.moves
    return moves


def _root(covariance: F64) -> F64:
    """(d, d) columns whose squares add up to ``covariance`` (d, d); eigenvalues below zero from rounding are set to
    zero.
    """
    values, vectors = np.linalg.eigh(0.5 * (covariance + covariance.T))
    root: F64 = np.sqrt(np.maximum(values, 0.0))[:, None] * vectors.T
    return root


def _watched(batch: Batch, calibration: CrossSpectrumCalibration) -> dict[str, float]:
    """Diagnostics of the sensors that need no weighing."""
    ratio = gyro_gain_ratio(batch.gyro_gain, calibration.gyro_gain)
    return {} if ratio is None else {"gyro_gain_ratio": ratio[0], "gyro_gain_ratio_std": ratio[1]}


def _diagnostics(found: Weighed, calibration: CrossSpectrumCalibration) -> dict[str, float]:
    spectra, located, theta = found.spectra, found.located, found.located.point.theta
    return {
        "reach": found.reach,
        "misfit": located.misfit,
        "n_segments": float(spectra.n_total),
        "amplitude_ratio": math.exp(spectra.log_amplitude_mean),
        "damper_front_ratio": _ratio(located, calibration, "damper_front_nspm"),
        "damper_rear_ratio": _ratio(located, calibration, "damper_rear_nspm"),
        **dict(zip(FREED, np.exp(located.freed).tolist(), strict=True)),
        "delay_scale": float(theta[INDEX["delay_scale"]]),
        "tension": located.tension,
        "sensor_position_score": located.scores.position,
        "sensor_noise_score": located.scores.noise,
        "soft_mass_score": located.soft_mass.score,
        "soft_mass_kg": located.soft_mass.kg,
        "soft_mass_hz": located.soft_mass.resonance_hz,
        **dict(zip(SENSOR_OF, found.loudness.tolist(), strict=False)),
        "payload_gyration_m2": math.exp(theta[INDEX["payload_gyration_m2"]]),
        "payload_mode_hz": math.exp(theta[INDEX["payload_mode_hz"]]),
        "payload_damping_ratio": math.exp(theta[INDEX["payload_damping_ratio"]]),
        "delay_s": spectra.delay_mean_s,
        "delay_std_s": spectra.delay_std_s,
    }


def disbelieved(found: Weighed, calibration: CrossSpectrumCalibration) -> Why | None:
    """Why an answer is not accepted; SENSOR_NOISY if a noisy sensor may be the cause."""
    why = _disbelieved(found, calibration)
    if why is None and found.located.soft_mass.is_there:
        return Why.SOFT_LOAD
    return Why.SENSOR_NOISY if found.is_noisy and why in (*_BY_NOISE, Why.SENSOR_CHANGED) else why


def _disbelieved(found: Weighed, calibration: CrossSpectrumCalibration) -> Why | None:
    """Why an answer is not accepted. Beyond the known loads the half-car itself errs, so there the signs of a changed
    sensor prove nothing.
    """
    located = found.located
    if located.is_reversed:
        return Why.WRONG_SIGN
    if not located.misfit <= most_misfit_at(calibration.misfit_limit, found.unseen):
        return Why.MODEL_MISFIT
    is_moved = (
        (located.sideways is not None and located.sideways.is_mount_changed)
        or is_gyro_turned(located.point, calibration, found.loudness)
        or is_gyro_late(located.point, calibration)
    )
    if is_moved or located.scores.is_changed(calibration):
        as_known = beyond(located.as_known, calibration.known_loads, calibration.empty_mass_kg)
        return Why.SENSOR_CHANGED if is_moved or min(found.reach, as_known) == 0.0 else Why.MODEL_MISFIT
    if located.tension > MOST_TENSION:
        return Why.MODEL_MISFIT
    if found.is_settled and found.posterior.std(PAYLOAD) <= MOST_PAYLOAD_STD_SHARE * calibration.empty_mass_kg:
        return None
    too_wide = Why.AMBIGUOUS if located.is_ambiguous else Why.TOO_UNCERTAIN
    return too_wide if found.is_settled else Why.NO_SOLUTION


def most_misfit_at(misfit_limit: float, unseen: float) -> float:
    """The misfit above which an answer is not believed so far from the calibration's speeds and roads (``unseen``)."""
    return misfit_limit * math.exp(MISFIT_QUANTILE * MISFIT_ON_OTHER_ROADS * (unseen - 1.0))


def _unseen(speed_mps: float, shaken_mps2: float, calibration: CrossSpectrumCalibration) -> float:
    """Factor of the model error away from the calibrated conditions; 1 at calibrated speeds on equally rough roads.

    ``shaken_mps2`` is the batch's vertical acceleration (root mean square within the band).
    """
    slowest, fastest = calibration.speed_seen_mps
    faster = max(0.0, math.log(slowest / speed_mps), math.log(speed_mps / fastest))
    rougher = math.log(shaken_mps2 / calibration.acceleration_rms_mps2)
    return math.hypot(1.0, faster / UNSEEN_SPEED_SCALE, rougher / UNSEEN_ROUGHNESS_SCALE)


def _ratio(located: Located, calibration: CrossSpectrumCalibration, name: str) -> float:
    return math.exp(off_calibration(located.point, calibration, name))
