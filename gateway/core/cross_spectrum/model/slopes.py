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
    numbers_of,
    spectral_model,
)
from gateway.core.cross_spectrum.model.expected import noise, power, tapered, without_noise
from gateway.core.cross_spectrum.model.friction import level_weights
from gateway.core.cross_spectrum.model.matrix import SpectralMatrix
from gateway.core.cross_spectrum.model.motion import Motion
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
_OF_ROAD: Final = frozenset(
    INDEX[name] for name in ("delay_scale", "rear_lag_s", "track_offset_m", "tracks_apart_m", "twist_level")
)
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
        moved = _moved(theta, load, ground, spectra, [free[row] for row in rows], model.motion)
        changed = _by_response(by, moved, model)
        slopes.auto[:, rows], slopes.cross[:, rows] = changed.auto, changed.cross
    _fill_in_slack(slopes, free, by, model, spectra)
    for row, entry in enumerate(free):
        if entry in _OF_ROAD:
            changed = _by_road(entry, by, model, spectra)
            slopes.auto[:, row], slopes.cross[:, row] = changed.auto, changed.cross
    matrix = tapered(without_noise(by, model), spectra)
    return _with_noise(tapered(slopes, spectra), matrix, model, spectra, free)


def solved_at(
    theta: F64, load: tuple[float, ...], ground: Ground, spectra: CrossSpectra
) -> tuple[SpectralModel, Driven]:
    """The model, and how the groups of ``spectra`` drive it."""
    model = spectral_model(theta, load, ground, spectra.freq_hz, spectra.n_sensors)
    return model, driven(model, spectra)


def _moved(
    theta: F64, load: tuple[float, ...], ground: Ground, spectra: CrossSpectra, free: Sequence[int], motion: Motion
) -> Paths:
    """Changes (p, k, b, m) of the responses with ``free`` entries of the vehicle and its load.

    Central differences say how these move the numbers in the equations of motion, closed forms how the numbers move
    the responses.
    """
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
    numbers = numbers_of(thetas, tuple(loads), ground).all[..., 0]
    by_number = (numbers[:, ::2] - numbers[:, 1::2]) * (0.5 / step[:, None])
    moving = np.flatnonzero(by_number.any(axis=(1, 2)))
    by_number = np.ascontiguousarray(np.moveaxis(by_number[moving], (2, 1), (0, 1)))  # or BLAS cannot multiply it
    slopes = motion.slopes(moving.tolist())
    p, s, m = slopes.shape[2:]
    by_level = by_number @ slopes.view(float).reshape(len(slopes), len(moving), -1)
    by_group = level_weights(spectra.log_movement) @ by_level.reshape(len(by_level), -1)
    changed = by_group.view(complex).reshape(-1, k, p, s, m)
    return tuple(changed[:, :, :, way].transpose(2, 1, 0, 3) for way in range(s))


def _by_response(by: Driven, moved: Paths, model: SpectralModel) -> SpectralMatrix:
    """Change of the matrix with changes ``moved`` (p, k, b, m) of the responses."""
    slack, back = (1.0 + model.slack)[:, None, None], np.conj(by.phase)
    changed = SpectralMatrix.zeros(len(model.slack), moved[0].shape[1:])
    power_by = np.zeros(moved[0].shape, np.complex128)
    shares: tuple[float | F64, ...] = (1.0,) if by.twist is None else (1.0, by.twist)
    for way, share in enumerate(shares):
        front, rear = share * by.paths[2 * way], share * by.paths[2 * way + 1]
        for own, other, d in ((front, by.phase * rear, moved[2 * way]), (rear, back * front, moved[2 * way + 1])):
            power_by += np.conj(slack * own[:, None] + other[:, None]) * d
            whole = own + other
            for row, (i, j) in enumerate(changed.pairs):
                changed.cross[row] += d[i] * np.conj(whole[j])
                changed.cross[row] += np.conj(d[j]) * whole[i]
    return SpectralMatrix(2.0 * power_by.real, changed.cross)


def _fill_in_slack(
    slopes: SpectralMatrix, free: Sequence[int], by: Driven, model: SpectralModel, spectra: CrossSpectra
) -> None:
    """By the knots of each sensor's slack, which has a part in that sensor's own power alone."""
    for sensor, knots in enumerate(SLACK_KNOTS[: len(model.slack)]):
        rows = [row for row, entry in enumerate(free) if entry in knots]
        if not rows:
            continue
        own = power(by.paths[0][sensor]) + power(by.paths[1][sensor])
        if by.twist is not None:
            own = own + by.twist * (power(by.paths[2][sensor]) + power(by.paths[3][sensor]))
        shares = slack_weights(spectra.freq_hz)[[free[row] - knots.start for row in rows]]
        slopes.auto[sensor, rows] = (model.slack[sensor] - model.least_slack) * shares[:, None] * own


def _by_road(entry: int, by: Driven, model: SpectralModel, spectra: CrossSpectra) -> SpectralMatrix:
    """Change of the matrix (p, b, m) with a parameter of how axles and tracks meet the road."""
    if entry in (INDEX["tracks_apart_m"], INDEX["twist_level"]):
        return _by_twist(entry, by, model, spectra)
    return _by_phase(_phase_slope(entry, by, model, spectra), by)


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
    x = along(model.track_offset_m, model, spectra)
    return np.asarray(by.phase * (-x * k0(x) / k1(x)), np.complex128)


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
