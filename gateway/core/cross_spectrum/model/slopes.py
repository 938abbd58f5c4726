"""How the expected spectral matrix changes with each parameter of the vehicle and with its load."""

from collections.abc import Sequence
from typing import Final

import numpy as np
from scipy.special import k0, k1

from gateway.core.cross_spectrum.measured import CrossSpectra
from gateway.core.cross_spectrum.model.driven import (
    Driven,
    Paths,
    SpectralModel,
    along,
    driven,
    responses,
    spectral_model,
)
from gateway.core.cross_spectrum.model.expected import noise, power, tapered, without_noise
from gateway.core.cross_spectrum.model.friction import level_weights
from gateway.core.cross_spectrum.model.matrix import SpectralMatrix
from gateway.core.cross_spectrum.model.parameters import (
    INDEX,
    NOISES,
    SLACK_KNOTS,
    VEHICLE_PARAMETERS,
    Ground,
    slack_weights,
)
from gateway.records import C128, F64

STEP: Final = 1e-5
LOAD_STEPS: Final = (0.1, STEP, STEP)  # payload in kg, front share, lateral place of the centre of gravity in m


def spectral_slopes(
    theta: F64,
    load: tuple[float, ...],
    ground: Ground,
    spectra: CrossSpectra,
    free: Sequence[int],
    solved: tuple[SpectralModel, Driven] | None = None,
) -> SpectralMatrix:
    """Derivatives (p, k, b, m) of the expected spectra for the ``free`` entries of theta (n,) and of the load.

    ``load`` is payload in kg, front share (0..1) and, for a vehicle that rolls, the lateral place: entries n, n + 1 and
    n + 2. Those of vehicle and load are central differences of the responses, carried on by the chain rule; the others
    are closed forms. ``solved`` is the model at this very point, where it is there already.
    """
    model, by = solved or solved_at(theta, load, ground, spectra)
    slopes = SpectralMatrix.zeros(spectra.n_sensors, (len(free), *by.phase.shape))
    is_solved = [entry in VEHICLE_PARAMETERS or entry >= len(theta) for entry in free]
    rows = np.flatnonzero(is_solved).tolist()
    if rows:
        moved = _moved(theta, load, ground, spectra, [free[row] for row in rows])
        changed = _by_response(by, moved, model)
        slopes.auto[:, rows], slopes.cross[:, rows] = changed.auto, changed.cross
    for row, entry in enumerate(free):
        if not is_solved[row]:
            changed = _by_other(entry, by, model, spectra)
            slopes.auto[:, row], slopes.cross[:, row] = changed.auto, changed.cross
    matrix = tapered(without_noise(by, model), spectra)
    return _with_noise(tapered(slopes, spectra), matrix, model, spectra, free)


def solved_at(
    theta: F64, load: tuple[float, ...], ground: Ground, spectra: CrossSpectra
) -> tuple[SpectralModel, Driven]:
    """The model, and how the groups of ``spectra`` drive it."""
    model = spectral_model(theta, load, ground, spectra.freq_hz, spectra.n_sensors)
    return model, driven(model, spectra)


def _moved(theta: F64, load: tuple[float, ...], ground: Ground, spectra: CrossSpectra, free: Sequence[int]) -> Paths:
    """Central differences (p, k, b, m) of the responses for ``free`` entries of the vehicle and its load."""
    k = len(free)
    thetas = np.repeat(theta[None], 2 * k, axis=0)
    loads = [np.full(2 * k, one, float) for one in load]
    step = np.full(k, STEP)
    for row, entry in enumerate(free):
        if entry < len(theta):
            thetas[2 * row : 2 * row + 2, entry] += (STEP, -STEP)
        else:
            step[row] = LOAD_STEPS[entry - len(theta)]
            loads[entry - len(theta)][2 * row : 2 * row + 2] += (step[row], -step[row])
    weights, per_step = level_weights(spectra.log_movement), 0.5 / step[:, None, None]
    solved = responses(thetas, tuple(loads), ground, spectra.freq_hz, spectra.n_sensors)
    return tuple(weights @ ((path[:, ::2] - path[:, 1::2]) * per_step) for path in solved)


def _by_response(by: Driven, moved: Paths, model: SpectralModel) -> SpectralMatrix:
    """Change of the matrix with changes ``moved`` (p, k, b, m) of the responses."""
    slack = (1.0 + model.slack)[:, None, None]
    changed = _of_two_paths(by.paths[0], by.paths[1], by.phase, slack, moved[0], moved[1])
    if by.twist is None:
        return changed
    against = _of_two_paths(by.paths[2], by.paths[3], by.phase, slack, moved[2], moved[3])
    return SpectralMatrix(changed.auto + by.twist * against.auto, changed.cross + by.twist * against.cross)


def _of_two_paths(front: C128, rear: C128, phase: C128, slack: F64, d_front: C128, d_rear: C128) -> SpectralMatrix:
    """Change of expected's matrix of two paths (p, b, m) with changes (p, k, b, m) of these."""
    back = np.conj(phase)
    whole_front, whole_rear = front + phase * rear, rear + back * front
    by_front = np.conj(slack * front[:, None] + (phase * rear)[:, None])
    by_rear = np.conj(slack * rear[:, None] + (back * front)[:, None])
    auto = 2.0 * np.real(by_front * d_front + by_rear * d_rear)
    changed = SpectralMatrix.zeros(len(front), d_front.shape[1:])
    for row, (i, j) in enumerate(changed.pairs):
        cross = d_front[i] * np.conj(whole_front[j]) + np.conj(d_front[j]) * whole_front[i]
        cross += d_rear[i] * np.conj(whole_rear[j]) + np.conj(d_rear[j]) * whole_rear[i]
        changed.cross[row] = cross
    return SpectralMatrix(auto, changed.cross)


def _by_other(entry: int, by: Driven, model: SpectralModel, spectra: CrossSpectra) -> SpectralMatrix:
    """Change of the matrix (p, b, m) with a parameter that is not the vehicle's; noise comes later and has none."""
    for sensor, knots in enumerate(SLACK_KNOTS):
        if entry in knots:
            return _by_slack(sensor, knots.index(entry), by, model, spectra)
    if entry in (INDEX["tracks_apart_m"], INDEX["twist_level"]):
        return _by_twist(entry, by, model, spectra)
    return _by_phase(_phase_slope(entry, by, model, spectra), by)


def _by_slack(sensor: int, knot: int, by: Driven, model: SpectralModel, spectra: CrossSpectra) -> SpectralMatrix:
    changed = SpectralMatrix.zeros(len(model.slack), by.phase.shape)
    if sensor < len(model.slack):
        share = (model.slack[sensor] - model.least_slack) * slack_weights(spectra.freq_hz)[knot]
        own = power(by.paths[0][sensor]) + power(by.paths[1][sensor])
        if by.twist is not None:
            own = own + by.twist * (power(by.paths[2][sensor]) + power(by.paths[3][sensor]))
        changed.auto[sensor] = share * own
    return changed


def _by_twist(entry: int, by: Driven, model: SpectralModel, spectra: CrossSpectra) -> SpectralMatrix:
    """With c = x K1(x), dc/dlog x = -x^2 K0(x) and d((1 - c)/(1 + c))/dc = -2 / (1 + c)^2."""
    assert by.twist is not None
    assert model.tracks_apart_m is not None
    assert model.twist_level is not None
    one = Driven(by.paths[2:], by.phase, None)
    against = without_noise(one, model)
    d_twist = by.twist
    if entry == INDEX["tracks_apart_m"]:
        x = along(model.tracks_apart_m, model, spectra)
        d_twist = model.twist_level[..., None, :] * 2.0 * x**2 * k0(x) / (1.0 + x * k1(x)) ** 2
    return SpectralMatrix(d_twist * against.auto, d_twist * against.cross)


def _phase_slope(entry: int, by: Driven, model: SpectralModel, spectra: CrossSpectra) -> C128:
    turn = -2j * np.pi * spectra.freq_hz * by.phase
    if entry == INDEX["delay_scale"]:
        return np.asarray(turn * spectra.delay_s, np.complex128)
    if entry == INDEX["rear_lag_s"]:
        return np.asarray(turn, np.complex128)
    if entry == INDEX["track_offset_m"]:
        x = along(model.track_offset_m, model, spectra)
        return np.asarray(by.phase * (-x * k0(x) / k1(x)), np.complex128)
    return np.zeros_like(by.phase)


def _by_phase(d_phase: C128, by: Driven) -> SpectralMatrix:
    changed = SpectralMatrix.zeros(len(by.paths[0]), d_phase.shape)
    shares: tuple[float | F64, ...] = (1.0,) if by.twist is None else (1.0, by.twist)
    for front, rear, share in zip(by.paths[::2], by.paths[1::2], shares, strict=True):
        changed.auto[:] += share * (2.0 * np.real(d_phase * rear * np.conj(front)))
        for row, (i, j) in enumerate(changed.pairs):
            turned = front[i] * np.conj(d_phase * rear[j]) + d_phase * rear[i] * np.conj(front[j])
            changed.cross[row] += share * turned
    return changed


def _with_noise(
    slopes: SpectralMatrix, matrix: SpectralMatrix, model: SpectralModel, spectra: CrossSpectra, free: Sequence[int]
) -> SpectralMatrix:
    sensed = noise(model, matrix, spectra)
    grown = 0.5 * sum(
        slopes.auto[i].mean(axis=-1, keepdims=True) / matrix.auto[i].mean(axis=-1, keepdims=True) for i in (0, 1)
    )
    auto = slopes.auto + sensed[:, None] * grown
    for row, entry in enumerate(free):
        for sensor in range(len(auto)):
            if entry == INDEX[NOISES[sensor]]:
                auto[sensor, row] += sensed[sensor]
    return SpectralMatrix(auto, slopes.cross)
