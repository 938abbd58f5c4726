"""The fitted half-car's spectra beside the measured ones of a batch, for people to compare.

    modelled_spectra(estimate.spectra, calibration, Fitted(...)) -> Spectra

Nothing is estimated here: payload, front share and drift come from the cross-spectral estimator. Only the road's level,
on which they do not depend, is fitted to the spectra, as a straight line in logarithms of level and frequency (ISO
8608).
"""

from dataclasses import dataclass

import numpy as np

from gateway.core.cross_spectrum.calibration import CrossSpectrumCalibration
from gateway.core.cross_spectrum.likelihood import Point
from gateway.core.cross_spectrum.measured import CrossSpectra
from gateway.core.cross_spectrum.model.driven import spectral_model
from gateway.core.cross_spectrum.model.expected import expected_spectra
from gateway.core.cross_spectrum.model.parameters import INDEX
from gateway.core.cross_spectrum.model.strokes import with_strokes
from gateway.core.vehicle import Load
from gateway.records import F64, Bool, Spectra


@dataclass(frozen=True, slots=True)
class Fitted:
    """The estimator's result for one batch.

    Damper ratios are relative to the calibrated ones, amplitude_ratio to the calibrated drives'. delay_s is the mean
    delay from axle to axle over the batch, delay_std_s its standard deviation.
    """

    payload_kg: float
    front_share_pct: float
    delay_s: float
    delay_std_s: float = 0.0
    damper_front_ratio: float = 1.0
    damper_rear_ratio: float = 1.0
    delay_scale: float | None = None
    payload_mode_hz: float | None = None
    payload_damping_ratio: float | None = None
    amplitude_ratio: float = 1.0
    cg_left_m: float = 0.0


def modelled_spectra(seen: Spectra, calibration: CrossSpectrumCalibration, fitted: Fitted) -> Spectra:
    """Spectra (k,) of the fitted vehicle at the k of m measured frequencies that are within the calibrated band."""
    is_used = (seen.freq_hz >= calibration.band_hz[0]) & (seen.freq_hz <= calibration.band_hz[1])
    load = Load(fitted.payload_kg, fitted.front_share_pct)
    measured = _as_one_group(seen, is_used, fitted, calibration)
    measured = with_strokes(measured, calibration.parameters, load, calibration.ground)
    point = Point.of(_parameters(calibration, fitted), load, fitted.cg_left_m)
    model = spectral_model(point.theta, point.loaded, calibration.ground, measured.freq_hz)
    matrix = expected_spectra(model, measured)
    (auto_a, auto_g), cross = matrix.auto[:, 0], matrix.cross[0, 0]
    level = _road_level(measured, auto_a, auto_g)
    return Spectra(
        freq_hz=seen.freq_hz[is_used],
        vertical_acceleration=np.sqrt(level * auto_a),
        pitch_rate=np.sqrt(level * auto_g),
        coherence=np.abs(cross) ** 2 / (auto_a * auto_g),
        phase_rad=np.angle(cross),
    )


def _parameters(calibration: CrossSpectrumCalibration, fitted: Fitted) -> F64:
    theta = calibration.parameters.copy()
    theta[INDEX["damper_front_nspm"]] += np.log(fitted.damper_front_ratio)
    theta[INDEX["damper_rear_nspm"]] += np.log(fitted.damper_rear_ratio)
    if fitted.delay_scale is not None:
        theta[INDEX["delay_scale"]] = fitted.delay_scale
    if fitted.payload_mode_hz is not None:
        theta[INDEX["payload_mode_hz"]] = np.log(fitted.payload_mode_hz)
    if fitted.payload_damping_ratio is not None:
        theta[INDEX["payload_damping_ratio"]] = np.log(fitted.payload_damping_ratio)
    return theta


def _as_one_group(seen: Spectra, is_used: Bool, fitted: Fitted, calibration: CrossSpectrumCalibration) -> CrossSpectra:
    """The spectra as one group of segments, with delays normally distributed about their mean."""
    step_hz = float(seen.freq_hz[1] - seen.freq_hz[0])
    freq_hz = seen.freq_hz[is_used]
    guarded_hz = np.r_[freq_hz[0] - step_hz, freq_hz, freq_hz[-1] + step_hz]
    turn = 2.0 * np.pi * guarded_hz
    a, g = seen.vertical_acceleration[is_used], seen.pitch_rate[is_used]
    cross = a * g * np.sqrt(seen.coherence[is_used]) * np.exp(1j * seen.phase_rad[is_used])
    return CrossSpectra(
        freq_hz=guarded_hz,
        acceleration=a[None] ** 2,
        pitch_rate=g[None] ** 2,
        cross=cross[None],
        delay_phase=np.exp(-1j * turn * fitted.delay_s - 0.5 * (turn * fitted.delay_std_s) ** 2)[None],
        delay_s=np.array([[fitted.delay_s]]),
        n_segments=np.array([[1.0]]),
        inverse_power=np.array([[1.0 / np.sqrt(np.mean(a**2) * np.mean(g**2))]]),
        log_amplitude=np.array([[np.log(fitted.amplitude_ratio)]]),
        acceleration_rms_mps2=float("nan"),
        pitch_rate_rms_radps=float("nan"),
        reading=calibration.reading,
    )


def _road_level(measured: CrossSpectra, auto_a: F64, auto_g: F64) -> F64:
    """Level (k,) of the road: the line in logarithms that brings the model closest to both sensors' logarithms."""
    log_level = 0.5 * (np.log(measured.acceleration[0] / auto_a) + np.log(measured.pitch_rate[0] / auto_g))
    log_f = np.log(measured.freq_hz[1:-1])
    level: F64 = np.exp(np.polyval(np.polyfit(log_f, log_level, 1), log_f))
    return level
