"""Stroke speed of each axle's springs in a drive, on which its friction depends.

The sensors show the movement of the body. The stroke of each axle depends in addition on load, speed and vehicle, and
follows from the model: the road's level is the one that makes the model's sensors move as measured. So a heavy load
that calms the body does not look like a smooth road, and the axles may differ.
"""

from dataclasses import replace

import numpy as np

from gateway.core.cross_spectrum.measured import CrossSpectra, log_amplitude_of
from gateway.core.cross_spectrum.model.expected import ROAD_EXPONENT, expected_of_driven, power
from gateway.core.cross_spectrum.model.half_car import strokes
from gateway.core.cross_spectrum.model.parameters import Ground, half_car, has_roll, upright
from gateway.core.cross_spectrum.model.slopes import solved_at
from gateway.core.vehicle import Load
from gateway.records import F64


def log_stroke_speeds(spectra: CrossSpectra, theta: F64, load: Load, ground: Ground) -> F64:
    """(b, 2) logarithm of the root mean square speed (m/s, within the band) of front and rear springs.

    For a vehicle theta (n,) with that load, on the centre line if it has roll, with its usual friction. The mean
    logarithm of periodograms, as in the amplitude of ``spectra``, is half of Euler's constant below that of the
    density.
    """
    reading = spectra.reading
    if reading.usual_log_amplitude is None:
        raise ValueError("these spectra do not say how much their vehicle usually moves")
    usually = replace(spectra.without_roll, log_strokes=np.zeros((len(spectra.log_amplitude), 2)))
    loaded = (load.payload_kg, load.front_share)
    model, driven = solved_at(theta, (*loaded, 0.0) if has_roll(theta) else loaded, ground, usually)
    shown = expected_of_driven(driven, model, usually)
    moved = spectra.log_amplitude[:, 0] + reading.usual_log_amplitude + 0.5 * np.euler_gamma
    log_road = moved - log_amplitude_of(shown.auto[0], shown.auto[1])
    freq_hz = spectra.freq_hz
    by_front, by_rear = strokes(half_car(upright(theta), ground), *loaded, freq_hz)
    stretched = power(by_front[:, None] + driven.phase * by_rear[:, None])
    speed = (2.0 * np.pi * freq_hz) ** 2 * freq_hz**ROAD_EXPONENT * stretched
    log_speed = 0.5 * np.log(np.sum(speed, axis=-1) * float(freq_hz[1] - freq_hz[0]))
    return np.asarray((log_road + log_speed).T, np.float64)


def with_strokes(spectra: CrossSpectra, theta: F64, load: Load, ground: Ground) -> CrossSpectra:
    """The spectra with each axle's stroke speed relative to the usual one; unchanged if the reading has none."""
    usual_mps = spectra.reading.usual_stroke_mps
    if usual_mps is None:
        return spectra
    return replace(spectra, log_strokes=log_stroke_speeds(spectra, theta, load, ground) - np.log(usual_mps))
