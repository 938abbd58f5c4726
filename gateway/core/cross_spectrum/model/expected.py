"""The expected spectral matrix of a vehicle's sensors, for every group of segments.

Both axles meet one road, so the matrix is that of two coherent paths (with roll: four, for the mean and half the
difference of the tracks); the incoherent part is added.
"""

from typing import Final

import numpy as np

from gateway.core.cross_spectrum.measured import CrossSpectra
from gateway.core.cross_spectrum.model.driven import Driven, Spectra, SpectralModel, driven
from gateway.core.cross_spectrum.model.matrix import PAIRS, SpectralMatrix
from gateway.records import C128, F64

ROAD_EXPONENT: Final = -2.0  # displacement density of a road falls about as frequency squared (ISO 8608)


def expected_spectra(model: SpectralModel, spectra: CrossSpectra) -> SpectralMatrix:
    """Expected spectra of the groups of ``spectra``, (p, ..., b, m), up to the road's level.

    A Hann taper mixes neighbouring frequencies with weights 1:4:1; the road's slope is included.
    """
    return expected_of_driven(driven(model, spectra), model, spectra)


def expected_of_driven(by: Driven, model: SpectralModel, spectra: CrossSpectra) -> SpectralMatrix:
    """The same for a model already evaluated for the groups of ``spectra``."""
    return with_noise(tapered(without_noise(by, model), spectra), model, spectra)


def with_noise(matrix: SpectralMatrix, model: SpectralModel, spectra: CrossSpectra) -> SpectralMatrix:
    """``matrix``, expected of sensors without noise, with their noise added."""
    return SpectralMatrix(matrix.auto + noise(model, matrix, spectra), matrix.cross)


def without_noise(by: Driven, model: SpectralModel) -> SpectralMatrix:
    """The matrix (p, ..., b, m) per unit of road."""
    matrix = by_tracks(by, model)
    return SpectralMatrix(by.of_tracks(matrix.auto), by.of_tracks(matrix.cross))


def by_tracks(by: Driven, model: SpectralModel) -> SpectralMatrix:
    """The same (p, s / 2, ..., b, m) for both tracks alike, and for one against the other: |front|^2 + |rear|^2 + late
    conj(front) + its conjugate; slack multiplies the squares.
    """
    front, rear, late = by.front, by.rear, by.late
    slack = 1.0 + model.slack[:, None, ..., None, :]
    auto = slack * (power(front) + power(rear)) + 2.0 * (late.real * front.real + late.imag * front.imag)
    one, other = (list(each) for each in zip(*PAIRS[: len(front) * (len(front) - 1) // 2], strict=True))
    cross = front[one] * np.conj(front[other] + late[other]) + rear[one] * np.conj(rear[other])
    cross += late[one] * np.conj(front[other])
    return SpectralMatrix(auto, cross)


def power(x: C128) -> F64:
    """Squared magnitude."""
    squared: F64 = x.real**2 + x.imag**2
    return squared


def tapered(matrix: SpectralMatrix, spectra: CrossSpectra) -> SpectralMatrix:
    """The matrix with the road's slope, mixed by a Hann taper; one frequency fewer at either end."""
    road = _road(spectra)
    return SpectralMatrix(_mixed(matrix.auto * road), _mixed(matrix.cross * road))


def tapered_parts(slopes: F64, spectra: CrossSpectra) -> F64:
    """The same for changes (b, m, p^2, k) of a matrix's parts; the frequency axis comes before these."""
    rough = slopes * _road(spectra)[:, None, None]
    mixed: F64 = 4.0 * rough[:, 1:-1]
    mixed += rough[:, :-2]
    mixed += rough[:, 2:]
    return mixed


def _road(spectra: CrossSpectra) -> F64:
    road: F64 = spectra.freq_hz**ROAD_EXPONENT / 6.0
    return road


def _mixed(x: Spectra) -> Spectra:
    """Each value (..., m) mixed with its neighbours by weights 1:4:1."""
    mixed: Spectra = 4.0 * x[..., 1:-1]
    mixed += x[..., :-2]
    mixed += x[..., 2:]
    return mixed


def noise(model: SpectralModel, matrix: SpectralMatrix, spectra: CrossSpectra) -> F64:
    """Sensor noise (p, ..., b, 1) for ``matrix``, or (p, ..., b, m) if the spectra have noise in excess of the
    model's.
    """
    density = model.noise[..., None, :]
    if spectra.noise is not None:
        p, m = spectra.noise.shape
        density = density + spectra.noise.reshape(p, *(1,) * (density.ndim - 2), m)
    found: F64 = density * noise_scale(matrix, spectra)
    return found


def noise_scale(matrix: SpectralMatrix, spectra: CrossSpectra) -> F64:
    """(..., b, 1) factor of a noise density in spectra whose segments were divided by their power.

    That power is the geometric mean of acceleration's and pitch rate's; it is estimated as if they were ``matrix``.
    """
    acceleration, pitch_rate = matrix.auto[:2].sum(axis=-1, keepdims=True) / matrix.auto.shape[-1]
    per_density: F64 = spectra.inverse_power * np.sqrt(acceleration * pitch_rate)
    return per_density
