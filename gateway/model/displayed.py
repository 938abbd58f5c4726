"""The fitted vehicle's spectra beside the measured ones of a batch, for people to compare.

    modelled_spectra(estimate.spectra, model, Fitted(...)) -> Spectra

Nothing is estimated here: the load and what it shows of the vehicle come from the estimator. Only the road's level, on
which they do not depend, is fitted to the spectra, as a straight line in logarithms of level and frequency (ISO 8608).
"""

from dataclasses import dataclass
from math import log

import numpy as np

from gateway.core.vehicle import Load
from gateway.model.expected import with_strokes
from gateway.model.spectra import CrossSpectra
from gateway.model.table import INDEX, LOG, UPRIGHT
from gateway.model.vehicle_model import VehicleModel
from gateway.model.whittle import Point, Whittle
from gateway.records import F64, Bool, Spectra


@dataclass(frozen=True, slots=True)
class Fitted:
    """The estimator's result for one batch.

    Damper ratios are relative to the calibrated ones, amplitude_ratio to the calibrated drives'. delay_s is the mean
    delay from axle to axle over the batch, delay_std_s its standard deviation. None: as calibrated.
    """

    payload_kg: float
    front_share_pct: float
    delay_s: float
    delay_std_s: float = 0.0
    damper_front_ratio: float = 1.0
    damper_rear_ratio: float = 1.0
    delay_scale: float | None = None
    payload_gyration_m2: float | None = None
    payload_mode_hz: float | None = None
    payload_damping_ratio: float | None = None
    amplitude_ratio: float = 1.0
    cg_left_m: float = 0.0


def modelled_spectra(seen: Spectra, model: VehicleModel, fitted: Fitted) -> Spectra:
    """Spectra (k,) of the fitted vehicle at the k of m measured frequencies that are within the calibrated band."""
    is_used = (seen.freq_hz >= model.band_hz[0]) & (seen.freq_hz <= model.band_hz[1])
    load, theta = Load(fitted.payload_kg, fitted.front_share_pct), _parameters(model, fitted)
    measured = with_strokes(_as_one_group(seen, is_used, fitted, model), theta, load, model.ground)
    auto_a, auto_g, real, imaginary = Whittle(measured, model.ground).expected(Point.of(theta, load, fitted.cg_left_m))[
        :, 0
    ]
    cross = real + 1j * imaginary
    level = _road_level(measured, auto_a, auto_g)
    return Spectra(
        freq_hz=seen.freq_hz[is_used],
        vertical_acceleration=np.sqrt(level * auto_a),
        pitch_rate=np.sqrt(level * auto_g),
        coherence=np.abs(cross) ** 2 / (auto_a * auto_g),
        phase_rad=np.angle(cross),
    )


def _parameters(model: VehicleModel, fitted: Fitted) -> F64:
    theta = model.parameters.copy()
    theta[INDEX["damper_front_nspm"]] += log(fitted.damper_front_ratio)
    theta[INDEX["damper_rear_nspm"]] += log(fitted.damper_rear_ratio)
    for name in ("delay_scale", "payload_gyration_m2", "payload_mode_hz", "payload_damping_ratio"):
        found = getattr(fitted, name)
        if found is not None:
            theta[INDEX[name]] = log(found) if UPRIGHT[INDEX[name]].scale == LOG else found
    return theta


def _as_one_group(seen: Spectra, is_used: Bool, fitted: Fitted, model: VehicleModel) -> CrossSpectra:
    """The spectra as one group of segments, with delays normally distributed about their mean."""
    step_hz = float(seen.freq_hz[1] - seen.freq_hz[0])
    freq_hz = seen.freq_hz[is_used]
    guarded_hz = np.r_[freq_hz[0] - step_hz, freq_hz, freq_hz[-1] + step_hz]
    turn = 2.0 * np.pi * guarded_hz
    a, g = seen.vertical_acceleration[is_used], seen.pitch_rate[is_used]
    cross = a * g * np.sqrt(seen.coherence[is_used]) * np.exp(1j * seen.phase_rad[is_used])
    return CrossSpectra(
        freq_hz=guarded_hz,
        parts=np.array([a**2, g**2, cross.real, cross.imag])[:, None],
        delay_phase=np.exp(-1j * turn * fitted.delay_s - 0.5 * (turn * fitted.delay_std_s) ** 2)[None],
        delay_s=np.array([[fitted.delay_s]]),
        n_segments=np.array([[1.0]]),
        inverse_power=np.array([[1.0 / np.sqrt(np.mean(a**2) * np.mean(g**2))]]),
        log_amplitude=np.array([[log(fitted.amplitude_ratio)]]),
        acceleration_rms_mps2=float("nan"),
        pitch_rate_rms_radps=float("nan"),
        reading=model.reading,
    )


def _road_level(measured: CrossSpectra, auto_a: F64, auto_g: F64) -> F64:
    """Level (k,) of the road: the line in logarithms that brings the model closest to both sensors' logarithms."""
    log_level = 0.5 * (np.log(measured.acceleration[0] / auto_a) + np.log(measured.pitch_rate[0] / auto_g))
    log_f = np.log(measured.freq_hz[1:-1])
    level: F64 = np.exp(np.polyval(np.polyfit(log_f, log_level, 1), log_f))
    return level
