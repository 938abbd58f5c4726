"""The spectral matrix that the two sensors should show of a vehicle, for every group of segments, and its slopes.

Both axles meet one road, so the matrix is that of two coherent paths; what is not coherent is added to
it. Three things make groups differ that carry the same load:

- speed, by the delay of the rear axle, and by the tracks: axles whose wheels do not run in one track
  meet roads that resemble each other the less the shorter the waves are;
- how much the vehicle moves, by the friction of its axles;
- sensor noise, which is the same on every road, so that it counts for more on a smooth one.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.special import k0, k1

from gateway.core.cross_spectrum.measured import CrossSpectra
from gateway.core.cross_spectrum.model.friction import at_levels, level_weights
from gateway.core.cross_spectrum.model.half_car import frequency_response
from gateway.core.cross_spectrum.model.parameters import (
    HALF_CAR_PARAMETERS,
    INDEX,
    SLACK_ACCELERATION,
    SLACK_PITCH_RATE,
    Ground,
    half_car,
    slack_weights,
)
from gateway.records import C128, F64

ROAD_EXPONENT: Final = -2.0  # displacement density of a road falls about as frequency squared (ISO 8608)
SLACK_FLOOR: Final = 0.01
STEP: Final = 1e-5
PAYLOAD_STEP_KG: Final = 0.1


@dataclass(frozen=True, slots=True)
class SpectralModel:
    """Vehicles theta (..., p) with their loads, solved but not yet driven at any speed.

    The four responses (..., 3, m) are to a unit of road under one axle, at three amplitudes of movement; slack
    (..., m) is a share of each sensor's power, noise (..., 1) a density in the square of the sensor's unit per hertz.
    """

    responses: tuple[C128, C128, C128, C128]
    slack_acceleration: F64
    slack_pitch_rate: F64
    noise_acceleration: F64
    noise_pitch_rate: F64
    track_offset_m: F64
    delay_scale: F64
    rear_lag_s: F64
    wheelbase_m: float


@dataclass(frozen=True, slots=True)
class _Paths:
    """What groups see: responses (..., b, m), and the rear axle's phase times its coherence with the front's."""

    acceleration_front: C128
    acceleration_rear: C128
    pitch_rate_front: C128
    pitch_rate_rear: C128
    phase: C128


Matrix = tuple[F64, F64, C128]  # acceleration, pitch rate, pitch rate times conjugate of acceleration


def spectral_model(theta: F64, payload_kg: F64, front_share: F64, ground: Ground, freq_hz: F64) -> SpectralModel:
    """Solve for parameter vectors theta (..., p) and loads (...,) at freq_hz (m,)."""

    def positive(name: str) -> F64:
        found: F64 = np.exp(theta[..., INDEX[name], None])
        return found

    return SpectralModel(
        responses=_responses(theta, payload_kg, front_share, ground, freq_hz),
        slack_acceleration=_slack(theta, SLACK_ACCELERATION, freq_hz),
        slack_pitch_rate=_slack(theta, SLACK_PITCH_RATE, freq_hz),
        noise_acceleration=positive("noise_acceleration_m2ps3"),
        noise_pitch_rate=positive("noise_pitch_rate_rad2ps"),
        track_offset_m=positive("track_offset_m"),
        delay_scale=theta[..., INDEX["delay_scale"], None],
        rear_lag_s=theta[..., INDEX["rear_lag_s"], None],
        wheelbase_m=ground.wheelbase_m,
    )


def expected_spectra(model: SpectralModel, spectra: CrossSpectra) -> Matrix:
    """Acceleration, pitch rate and cross-spectrum (..., b, m) for the groups of ``spectra``, up to the road's level.

    A Hann taper mixes neighbouring frequencies, weighing them 1:4:1; the road's slope is in.
    """
    matrix = _tapered(_without_noise(_paths(model, spectra), model), spectra)
    noise_a, noise_g = _noise(model, matrix, spectra)
    return matrix[0] + noise_a, matrix[1] + noise_g, matrix[2]


def spectral_slopes(
    theta: F64,
    load: tuple[float, float],
    ground: Ground,
    spectra: CrossSpectra,
    free: list[int],
    is_load_free: bool,
) -> Matrix:
    """Derivatives (k, b, m) of :func:`expected_spectra` for the ``free`` entries of theta (p,), then the load's two.

    ``load`` is payload in kg and front share (0..1). Those of the vehicle are central differences of the
    half-car, carried on by the chain rule; the others are closed forms.
    """
    model = spectral_model(theta, np.array(load[0]), np.array(load[1]), ground, spectra.freq_hz)
    paths = _paths(model, spectra)
    k, (b, m) = len(free) + 2 * is_load_free, paths.phase.shape
    d_aa, d_gg, d_ga = np.zeros((k, b, m)), np.zeros((k, b, m)), np.zeros((k, b, m), np.complex128)
    vehicle = [row for row, entry in enumerate(free) if entry in HALF_CAR_PARAMETERS]
    rows = vehicle + list(range(len(free), k))
    if rows:
        moved = _moved_responses(theta, load, ground, spectra, [free[row] for row in vehicle], is_load_free)
        d_aa[rows], d_gg[rows], d_ga[rows] = _by_response(paths, moved, model)
    for row, entry in enumerate(free):
        if entry not in HALF_CAR_PARAMETERS:
            d_aa[row], d_gg[row], d_ga[row] = _by_other(entry, theta, paths, model, spectra)
    matrix = _tapered(_without_noise(paths, model), spectra)
    slopes = _tapered((d_aa, d_gg, d_ga), spectra)
    return _with_noise_slopes(slopes, matrix, model, spectra, free)


def _responses(
    theta: F64, payload_kg: F64, front_share: F64, ground: Ground, freq_hz: F64
) -> tuple[C128, C128, C128, C128]:
    """Responses (..., 3, m) of acceleration to front and rear, then of pitch rate, at each of friction.LEVELS."""
    r = frequency_response(
        half_car(at_levels(theta), ground),
        np.asarray(payload_kg)[..., None, None],
        np.asarray(front_share)[..., None, None],
        freq_hz,
    )
    return r.acceleration_front, r.acceleration_rear, r.pitch_rate_front, r.pitch_rate_rear


def _slack(theta: F64, knots: range, freq_hz: F64) -> F64:
    """Slack (..., m) of one sensor: log-linear between its knots, above a floor."""
    slack: F64 = SLACK_FLOOR + np.exp(theta[..., knots.start : knots.stop] @ slack_weights(freq_hz))
    return slack


def _paths(model: SpectralModel, spectra: CrossSpectra) -> _Paths:
    weights = level_weights(spectra.log_amplitude)
    later_s = spectra.delay_s * model.delay_scale[..., None, :] + model.rear_lag_s[..., None, :]
    phase = spectra.delay_phase * np.exp(-2j * np.pi * spectra.freq_hz * later_s)
    x = _track_argument(model, spectra)
    fa, ra, fg, rg = (weights @ response for response in model.responses)
    return _Paths(fa, ra, fg, rg, phase=phase * (x * k1(x)))


def _track_argument(model: SpectralModel, spectra: CrossSpectra) -> F64:
    """2 pi n d (..., b, m), wavenumber n = f/v times the offset d of the tracks.

    On a road that is alike in all directions, of displacement density n^-2, two parallel tracks have
    the coherence x K1(x) (K. M. A. Kamash and J. D. Robson, J. Sound Vib. 57, 1978).
    """
    per_metre = spectra.freq_hz * spectra.delay_s / model.wheelbase_m
    x: F64 = 2.0 * np.pi * per_metre * model.track_offset_m[..., None, :]
    return x


def _power(x: C128) -> F64:
    power: F64 = x.real**2 + x.imag**2
    return power


def _without_noise(p: _Paths, model: SpectralModel) -> Matrix:
    """The matrix (..., b, m) per unit of road: |front|^2 + |rear|^2 + phase rear conj(front) + its conjugate."""
    fa, ra, fg, rg = p.acceleration_front, p.acceleration_rear, p.pitch_rate_front, p.pitch_rate_rear
    slack_a, slack_g = 1.0 + model.slack_acceleration[..., None, :], 1.0 + model.slack_pitch_rate[..., None, :]
    auto_a = slack_a * (_power(fa) + _power(ra)) + 2.0 * np.real(p.phase * ra * np.conj(fa))
    auto_g = slack_g * (_power(fg) + _power(rg)) + 2.0 * np.real(p.phase * rg * np.conj(fg))
    late_a, late_g = p.phase * ra, p.phase * rg
    cross = fg * np.conj(fa + late_a) + rg * np.conj(ra) + late_g * np.conj(fa)
    return auto_a, auto_g, cross


def _by_response(p: _Paths, moved: tuple[C128, C128, C128, C128], model: SpectralModel) -> Matrix:
    """Change of the matrix with changes ``moved`` (k, b, m) of the four responses."""
    dfa, dra, dfg, drg = moved
    fa, ra, fg, rg = p.acceleration_front, p.acceleration_rear, p.pitch_rate_front, p.pitch_rate_rear
    slack_a, slack_g = 1.0 + model.slack_acceleration, 1.0 + model.slack_pitch_rate
    back = np.conj(p.phase)

    def auto(front: C128, rear: C128, slack: F64, d_front: C128, d_rear: C128) -> F64:
        by_front, by_rear = np.conj(slack * front + p.phase * rear), np.conj(slack * rear + back * front)
        changed: F64 = 2.0 * np.real(by_front * d_front + by_rear * d_rear)
        return changed

    cross = dfg * np.conj(fa + p.phase * ra) + np.conj(dfa) * (fg + p.phase * rg)
    cross += drg * np.conj(ra + back * fa) + np.conj(dra) * (rg + back * fg)
    return auto(fa, ra, slack_a, dfa, dra), auto(fg, rg, slack_g, dfg, drg), cross


def _by_other(entry: int, theta: F64, p: _Paths, model: SpectralModel, spectra: CrossSpectra) -> Matrix:
    """Change of the matrix (b, m) with a parameter that is not the half-car's; noise comes later and has none."""
    zero = np.zeros(p.phase.shape)
    weights = slack_weights(spectra.freq_hz)
    if entry in SLACK_ACCELERATION:
        share = (model.slack_acceleration - SLACK_FLOOR) * weights[SLACK_ACCELERATION.index(entry)]
        return share * (_power(p.acceleration_front) + _power(p.acceleration_rear)), zero, zero.astype(np.complex128)
    if entry in SLACK_PITCH_RATE:
        share = (model.slack_pitch_rate - SLACK_FLOOR) * weights[SLACK_PITCH_RATE.index(entry)]
        return zero, share * (_power(p.pitch_rate_front) + _power(p.pitch_rate_rear)), zero.astype(np.complex128)
    return _by_phase(_phase_slope(entry, p, model, spectra), p)


def _phase_slope(entry: int, p: _Paths, model: SpectralModel, spectra: CrossSpectra) -> C128:
    turn = -2j * np.pi * spectra.freq_hz * p.phase
    if entry == INDEX["delay_scale"]:
        return np.asarray(turn * spectra.delay_s, np.complex128)
    if entry == INDEX["rear_lag_s"]:
        return np.asarray(turn, np.complex128)
    if entry == INDEX["track_offset_m"]:
        x = _track_argument(model, spectra)
        return np.asarray(p.phase * (-x * k0(x) / k1(x)), np.complex128)
    return np.zeros_like(p.phase)


def _by_phase(d_phase: C128, p: _Paths) -> Matrix:
    fa, ra, fg, rg = p.acceleration_front, p.acceleration_rear, p.pitch_rate_front, p.pitch_rate_rear
    d_aa = 2.0 * np.real(d_phase * ra * np.conj(fa))
    d_gg = 2.0 * np.real(d_phase * rg * np.conj(fg))
    return d_aa, d_gg, fg * np.conj(d_phase * ra) + d_phase * rg * np.conj(fa)


def _moved_responses(
    theta: F64, load: tuple[float, float], ground: Ground, spectra: CrossSpectra, free: list[int], is_load_free: bool
) -> tuple[C128, C128, C128, C128]:
    """Central differences (k, b, m) of the responses for the vehicle's ``free`` entries, then the load's two."""
    k = len(free) + 2 * is_load_free
    thetas = np.repeat(theta[None], 2 * k, axis=0)
    payload_kg, share = np.full(2 * k, load[0], float), np.full(2 * k, load[1], float)
    step = np.full(k, STEP)
    for row, entry in enumerate(free):
        thetas[2 * row : 2 * row + 2, entry] += (STEP, -STEP)
    if is_load_free:
        payload_kg[2 * k - 4 : 2 * k - 2] += (PAYLOAD_STEP_KG, -PAYLOAD_STEP_KG)
        share[2 * k - 2 :] += (STEP, -STEP)
        step[k - 2] = PAYLOAD_STEP_KG
    weights, per_step = level_weights(spectra.log_amplitude), 0.5 / step[:, None, None]
    fa, ra, fg, rg = (
        weights @ ((r[::2] - r[1::2]) * per_step)
        for r in _responses(thetas, payload_kg, share, ground, spectra.freq_hz)
    )
    return fa, ra, fg, rg


def _tapered(matrix: Matrix, spectra: CrossSpectra) -> Matrix:
    """With the road's slope, and mixed as a Hann taper does; one frequency fewer at either end."""
    road = spectra.freq_hz**ROAD_EXPONENT / 6.0

    def mixed(x: F64 | C128) -> F64 | C128:
        x = x * road
        return x[..., :-2] + 4.0 * x[..., 1:-1] + x[..., 2:]

    return np.real(mixed(matrix[0])), np.real(mixed(matrix[1])), np.asarray(mixed(matrix[2]), np.complex128)


def _size(matrix: Matrix) -> F64:
    """(..., b, 1): the level every segment was divided by, had it been this matrix."""
    size: F64 = np.sqrt(matrix[0].mean(axis=-1, keepdims=True) * matrix[1].mean(axis=-1, keepdims=True))
    return size


def _noise(model: SpectralModel, matrix: Matrix, spectra: CrossSpectra) -> tuple[F64, F64]:
    """Sensor noise (..., b, 1) beside ``matrix``: segments were divided by their power, and so their noise."""
    per_density = spectra.inverse_power * _size(matrix)
    return model.noise_acceleration[..., None, :] * per_density, model.noise_pitch_rate[..., None, :] * per_density


def _with_noise_slopes(
    slopes: Matrix, matrix: Matrix, model: SpectralModel, spectra: CrossSpectra, free: list[int]
) -> Matrix:
    d_aa, d_gg, d_ga = slopes
    noise_a, noise_g = _noise(model, matrix, spectra)
    grown = 0.5 * sum(
        d.mean(axis=-1, keepdims=True) / s.mean(axis=-1, keepdims=True)
        for d, s in ((d_aa, matrix[0]), (d_gg, matrix[1]))
    )
    d_aa, d_gg = d_aa + noise_a * grown, d_gg + noise_g * grown
    for row, entry in enumerate(free):
        d_aa[row] += noise_a * (entry == INDEX["noise_acceleration_m2ps3"])
        d_gg[row] += noise_g * (entry == INDEX["noise_pitch_rate_rad2ps"])
    return d_aa, d_gg, d_ga
