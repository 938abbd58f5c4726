"""Derivatives of the expected spectral matrix by each parameter of the vehicle and by its load."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np

from gateway.core.cross_spectrum.measured import CrossSpectra
from gateway.core.cross_spectrum.model.driven import (
    Driven,
    SpectralModel,
    along,
    are_in_motion,
    driven,
    numbers_about,
    spectral_model,
)
from gateway.core.cross_spectrum.model.expected import (
    by_tracks,
    noise,
    noise_scale,
    power,
    tapered,
    tapered_parts,
    without_noise,
)
from gateway.core.cross_spectrum.model.friction import level_weights
from gateway.core.cross_spectrum.model.matrix import PAIRS, SpectralMatrix
from gateway.core.cross_spectrum.model.motion import Motion
from gateway.core.cross_spectrum.model.parameters import (
    INDEX,
    NOISES,
    SLACK_KNOTS,
    Ground,
    slack_weights,
)
from gateway.core.cross_spectrum.model.tracks import coherence_of, coherence_slope_of
from gateway.records import C128, F64

FEW: Final = 12  # chosen: among as many entries none is hardly worth a search for parallel ones
PARALLEL: Final = 1e-12  # chosen: least squared sine between two changes of the numbers that differ
_OF_TWIST: Final = frozenset(INDEX[name] for name in ("tracks_apart_m", "twist_level"))
_OF_AXLES: Final = frozenset(INDEX[name] for name in ("delay_scale", "rear_lag_s", "track_offset_m"))


@dataclass(frozen=True)
class Solved:
    """A vehicle with its load, theta (n,): its model, its evaluation for the spectra's groups, and the matrix without
    noise.

    The load is payload in kg, front share (0..1) and, for a vehicle that rolls, the lateral place: entries n, n + 1 and
    n + 2. by_entry (5, q, k) is by how much the numbers in its equations of motion move with each of the ``moving``
    entries.
    """

    theta: F64
    load: tuple[float, ...]
    ground: Ground
    model: SpectralModel
    driven: Driven
    noiseless: SpectralMatrix
    by_entry: F64
    moving: list[int]

    @classmethod
    def at(
        cls, theta: F64, load: tuple[float, ...], ground: Ground, spectra: CrossSpectra, expected: Sequence[int]
    ) -> "Solved":
        """``expected`` are entries for which slopes are likely to be asked."""
        moving = are_in_motion(expected, len(theta))
        numbers, by_entry = numbers_about(theta, load, ground, moving)
        model = spectral_model(theta, load, ground, spectra.freq_hz, spectra.n_sensors, numbers)
        by = driven(model, spectra)
        noiseless = tapered(without_noise(by, model), spectra)
        return cls(theta, load, ground, model, by, noiseless, by_entry, moving)

    def numbers_by(self, entries: list[int]) -> F64:
        """(5, q, k) by how much the numbers move with ``entries``, which are in the equations of motion."""
        if set(entries) <= set(self.moving):
            return self.by_entry[..., [self.moving.index(entry) for entry in entries]]
        return numbers_about(self.theta, self.load, self.ground, entries)[1]

    @cached_property
    def by_response(self) -> F64:
        """(b, m, p^2, 2 p s) derivative of the matrix by the responses, both in real and imaginary parts."""
        return _by_response(self.driven, self.model)


def spectral_slopes(solved: Solved, spectra: CrossSpectra, free: Sequence[int]) -> tuple[F64, F64]:
    """Derivatives (b, m, p^2, r) of the expected spectra, in the order of SpectralMatrix.parts, and the combinations
    (r, k) of them by the ``free`` entries of theta (n,) and of the load.

    The entries in the equations of motion come first, then the others in rising order. The chain rule leads from
    parameters to the numbers in the equations of motion, to the responses and to the spectra, in closed forms and real
    matrix products. Entries that move the numbers alike share a column.
    """
    model, by = solved.model, solved.driven
    of_vehicle = are_in_motion(free, len(solved.theta))
    others = free[len(of_vehicle) :]
    by_direction, by_vehicle = solved.numbers_by(of_vehicle), np.eye(len(of_vehicle))
    if len(of_vehicle) > FEW:
        by_direction, by_vehicle = _directions(by_direction)
    r = len(by_vehicle)
    slopes = np.zeros((*by.phase.shape, spectra.n_sensors**2, r + len(others)))
    if r:
        slopes[..., :r] = _of_paths(_by_level(by_direction, model.motion), r, solved, spectra)
    of_others = slopes[..., r:]
    _fill_in_slack(of_others, others, by, model, spectra)
    if not _OF_AXLES.isdisjoint(others):
        _fill_in_axles(of_others, others, by, model, spectra)
    if not _OF_TWIST.isdisjoint(others):
        _fill_in_twist(of_others, others, by, model, spectra)
    slopes = tapered_parts(slopes, spectra)
    _add_noise(slopes, solved.noiseless, model, spectra)
    _fill_in_noise(slopes[..., r:], others, solved.noiseless, model, spectra)
    return slopes, beside(by_vehicle, np.eye(len(others)))


def beside(one: F64, other: F64) -> F64:
    """The block-diagonal matrix of two matrices."""
    (r, k), both = one.shape, np.zeros(np.add(one.shape, other.shape))
    both[:r, :k], both[r:, k:] = one, other
    return both


def _directions(by_entry: F64) -> tuple[F64, F64]:
    """The r columns of by_entry (5, q, k) that are no multiple of an earlier one, and the multiples (r, k) by entry.

    A spring's rate has many parameters, and bends beyond the load do not act.
    """
    columns = by_entry.reshape(-1, by_entry.shape[-1])
    acting = np.flatnonzero(columns.any(axis=0))
    columns = columns[:, acting] / np.maximum(np.abs(columns).max(axis=1, keepdims=True), np.finfo(float).tiny)
    products = columns.T @ columns
    squares = np.diag(products)
    first = np.argmax(products**2 >= (1.0 - PARALLEL) * np.outer(squares, squares), axis=0)
    chosen, row = np.unique(first, return_inverse=True)
    multiples = np.zeros((len(chosen), by_entry.shape[-1]))
    multiples[row, acting] = products[first, range(len(first))] / squares[first]
    return by_entry[..., acting[chosen]], multiples


def slopes_of_paths(solved: Solved, spectra: CrossSpectra, by_level: C128) -> F64:
    """(b, m, p^2, k) derivatives of the expected spectra, from those of the paths (5, k, p, s, m) at each of
    friction.levels().
    """
    k = by_level.shape[1]
    slopes = tapered_parts(_of_paths(_by_frequency(by_level), k, solved, spectra), spectra)
    _add_noise(slopes, solved.noiseless, solved.model, spectra)
    return slopes


def _of_paths(by_level: F64, k: int, solved: Solved, spectra: CrossSpectra) -> F64:
    """(b, m, p^2, k) derivatives of the matrix without taper and noise, from ``by_level`` (5, m 2 p s k)."""
    by = solved.driven
    moved = (level_weights(spectra.log_movement) @ by_level).reshape(*by.phase.shape, -1, k)
    slopes: F64 = solved.by_response @ moved
    return slopes


def solved_at(
    theta: F64, load: tuple[float, ...], ground: Ground, spectra: CrossSpectra
) -> tuple[SpectralModel, Driven]:
    """The model, and its evaluation for the groups of ``spectra``."""
    model = spectral_model(theta, load, ground, spectra.freq_hz, spectra.n_sensors)
    return model, driven(model, spectra)


def _by_level(by_entry: F64, motion: Motion) -> F64:
    """Changes (5, m 2 p s k) of the responses at each of friction.levels(): by frequency, sensor, way, real or
    imaginary part, entry.

    ``by_entry`` (5, q, k) is the derivative of the numbers in the equations of motion by the entries.
    """
    moving = np.flatnonzero(by_entry.any(axis=(0, 2)))
    slopes = motion.slopes(moving.tolist())
    n_levels, _, p, s, m = slopes.shape
    by_number = slopes.view(float).reshape(n_levels, len(moving), -1)
    by_level = by_number.transpose(0, 2, 1) @ by_entry[:, moving]
    return _in_order_of_frequency(by_level.reshape(n_levels, p, s, m, -1))


def _by_frequency(slopes: C128) -> F64:
    """(5, m 2 p s k) the real and imaginary parts of derivatives (5, k, p, s, m) of the paths."""
    n_levels, k, p, s, m = slopes.shape
    parts = np.ascontiguousarray(slopes).view(float).reshape(n_levels, k, -1).transpose(0, 2, 1)
    return _in_order_of_frequency(parts.reshape(n_levels, p, s, m, -1))


def _in_order_of_frequency(parts: F64) -> F64:
    """(5, m 2 p s k) of (5, p, s, m, 2 k)."""
    return parts.swapaxes(2, 3).swapaxes(1, 2).reshape(len(parts), -1)


def _by_response(by: Driven, model: SpectralModel) -> F64:
    """An auto-spectrum is F^* (slack F + phase R) plus terms without F, so a change d of the response F moves it by 2
    Re(conj(slack F + phase R) d), and likewise the others: each is the real part of a product with conj(z), or Re(z)
    Re(d) + Im(z) Im(d).
    """
    p, s, b, m = by.paths.shape
    whole = by.paths.copy()
    whole[:, ::2] += by.late
    whole[:, 1::2] += np.conj(by.phase) * by.front
    power_by = 2.0 * (whole + model.slack[:, None, None] * by.paths)
    if by.twist is not None:
        whole[:, 2:] *= by.twist
        power_by[:, 2:] *= by.twist
    turned = 1j * whole
    z = np.zeros((p * p, p, s, b, m), np.complex128)
    for i in range(p):
        z[i, i] = power_by[i]
    for row, (i, j) in enumerate(PAIRS[: p * (p - 1) // 2]):
        re, im = p + 2 * row, p + 2 * row + 1
        z[re, i], z[re, j] = whole[j], whole[i]
        z[im, i], z[im, j] = turned[j], -turned[i]
    return np.ascontiguousarray(z.reshape(-1, b * m).T).view(float).reshape(b, m, p * p, -1)


def _fill_in_slack(slopes: F64, free: Sequence[int], by: Driven, model: SpectralModel, spectra: CrossSpectra) -> None:
    """Derivatives by the knots of each sensor's slack, which affects only that sensor's own power."""
    for sensor, knots in enumerate(SLACK_KNOTS[: len(model.slack)]):
        rows = [row for row, entry in enumerate(free) if entry in knots]
        if not rows:
            continue
        own = by.of_tracks(power(by.front) + power(by.rear))[sensor]
        shares = slack_weights(spectra.freq_hz)[[free[row] - knots.start for row in rows]]
        changed = ((model.slack[sensor] - model.least_slack) * own)[..., None] * shares.T
        slopes[:, :, sensor, rows[0] : rows[-1] + 1] = changed


def _fill_in_axles(slopes: F64, free: Sequence[int], by: Driven, model: SpectralModel, spectra: CrossSpectra) -> None:
    """Derivatives by the delay of the rear axle, which turns its phase, and by the distance of its track from the
    front's, which reduces it: each by a real factor.
    """
    late = _late(by)
    turned = _with_conjugate(-2j * np.pi * spectra.freq_hz * late).parts
    for row, entry in enumerate(free):
        if entry == INDEX["delay_scale"]:
            slopes[..., row] = turned * spectra.delay_s[..., None]
        elif entry == INDEX["rear_lag_s"]:
            slopes[..., row] = turned
        elif entry == INDEX["track_offset_m"]:
            x = along(model.track_offset_m, model, spectra)
            slopes[..., row] = _with_conjugate(coherence_slope_of(x) / coherence_of(x) * late).parts


def _fill_in_twist(slopes: F64, free: Sequence[int], by: Driven, model: SpectralModel, spectra: CrossSpectra) -> None:
    """Derivatives by the distance of the tracks and by the level of their difference.

    With c = x K1(x), d((1 - c)/(1 + c))/dc = -2 / (1 + c)^2.
    """
    assert by.twist is not None
    assert model.tracks_apart_m is not None
    assert model.twist_level is not None
    both = by_tracks(by, model)
    against = SpectralMatrix(both.auto[:, 1], both.cross[:, 1]).parts
    for row, entry in enumerate(free):
        if entry == INDEX["twist_level"]:
            slopes[..., row] = by.twist[..., None] * against
        elif entry == INDEX["tracks_apart_m"]:
            x = along(model.tracks_apart_m, model, spectra)
            d_twist = model.twist_level[..., None, :] * -2.0 * coherence_slope_of(x) / (1.0 + coherence_of(x)) ** 2
            slopes[..., row] = d_twist[..., None] * against


def _late(by: Driven) -> C128:
    """(p, p, b, m) rear axle's reading of one sensor times the conjugate of the front's reading of another."""
    late: C128 = np.moveaxis(by.late, 1, 0)[:, :, None] * np.conj(np.moveaxis(by.front, 1, 0))[:, None]
    return late[0] if by.twist is None else np.asarray(late[0] + by.twist * late[1])


def _with_conjugate(x: C128) -> SpectralMatrix:
    """x (p, p, b, m) and its conjugate transpose together."""
    p = len(x)
    auto = 2.0 * np.real(x[range(p), range(p)])
    return SpectralMatrix(auto, np.stack([x[i, j] + np.conj(x[j, i]) for i, j in PAIRS[: p * (p - 1) // 2]]))


def _fill_in_noise(
    slopes: F64, free: Sequence[int], matrix: SpectralMatrix, model: SpectralModel, spectra: CrossSpectra
) -> None:
    """Derivatives by the density of each sensor's noise."""
    scale = noise_scale(matrix, spectra)
    for sensor, density in enumerate(model.noise):
        entry = INDEX[NOISES[sensor]]
        if entry in free:
            slopes[:, :, sensor, free.index(entry)] += density * scale


def _add_noise(slopes: F64, matrix: SpectralMatrix, model: SpectralModel, spectra: CrossSpectra) -> None:
    """Derivatives of the noise (expected.noise) of ``matrix``, which grows with the power of acceleration and pitch
    rate.
    """
    sums = matrix.auto[:2].sum(axis=-1).T
    grown = (0.5 / sums)[:, None] @ slopes[:, :, :2].sum(axis=1)  # of the noise, over it
    for sensor, one in enumerate(noise(model, matrix, spectra)):
        slopes[:, :, sensor] += one[:, :, None] * grown
