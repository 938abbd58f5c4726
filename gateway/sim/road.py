"""Roads in space: heights under the left and the right wheels, every few centimetres.

Everything is a function of the distance, so that the speed may vary. Spectra are one-sided over the
angular spatial frequency Omega [rad/m], as in ISO 8608.
"""

import math
from dataclasses import dataclass
from typing import Final, Protocol

import numpy as np
from scipy import fft

from gateway.records import F64
from gateway.sim.compiled import compiled

STEP_M: Final = 0.05  # chosen: finer than a tyre's contact patch

PAPER_CORNER_RADPM: Final = 0.15  # alpha_r of (1)
PAPER_SIGMA_M: Final = 0.006  # gives IRI 4 m/km


@dataclass(frozen=True, slots=True)
class Road:
    """Heights left_m and right_m (n,) at distances 0, step_m, 2 step_m, ..."""

    step_m: float
    left_m: F64
    right_m: F64

    @property
    def length_m(self) -> float:
        return self.step_m * (len(self.left_m) - 1)

    def enveloped(self, patch_m: float) -> "Road":
        """The road as a tyre averages it: each height is the mean over the contact patch (moving average)."""
        n_patch = round(patch_m / self.step_m)
        if n_patch < 2:
            return self
        return Road(self.step_m, _moving_mean(self.left_m, n_patch), _moving_mean(self.right_m, n_patch))


class RoadRecipe(Protocol):
    """Lays a road of any length; the same generator state gives the same road."""

    def lay(self, length_m: float, rng: np.random.Generator) -> Road: ...


@dataclass(frozen=True, slots=True)
class PaperRoad:
    """The paper's road (1): z' = -alpha_r v z + u, one profile under both wheels.

    In space dz/ds = -alpha_r z + white noise, an Ornstein-Uhlenbeck process, sampled exactly:
    variance sigma_m**2, autocovariance sigma_m**2 exp(-alpha_r |s|).
    """

    sigma_m: float = PAPER_SIGMA_M
    corner_radpm: float = PAPER_CORNER_RADPM
    step_m: float = STEP_M

    def lay(self, length_m: float, rng: np.random.Generator) -> Road:
        memory = math.exp(-self.corner_radpm * self.step_m)
        white = rng.standard_normal(_n_samples(length_m, self.step_m))
        white[1:] *= math.sqrt(1.0 - memory * memory)
        height = self.sigma_m * _first_order(white, memory)
        return Road(self.step_m, height, height.copy())


@dataclass(frozen=True, slots=True)
class SpectralRoad:
    """Two tracks with the ISO 8608 spectrum S(Omega) = C (Omega**2 + Omega_c**2)**(-w/2).

    roughness_m3 is C, the spectrum at 1 rad/m [m3/rad]; waviness is w; below corner_radpm the
    spectrum levels off, which bounds the hills. The tracks' coherence (square root of the magnitude
    squared one) is exp(-coherence_decay_m Omega): long waves lift both wheels, short ones one.
    """

    roughness_m3: float
    waviness: float = 2.0
    corner_radpm: float = 2.0 * math.pi / 100.0
    coherence_decay_m: float = 0.7
    step_m: float = STEP_M

    def lay(self, length_m: float, rng: np.random.Generator) -> Road:
        n = _n_samples(length_m, self.step_m)
        n_period = fft.next_fast_len(n + round(100.0 / self.step_m), real=True)
        omega = np.arange(n_period // 2 + 1, dtype=np.float64) * (2.0 * math.pi / (n_period * self.step_m))
        amplitude = np.sqrt(self.spectrum_m3(omega) * math.pi / self.step_m)
        coherence = np.exp(-self.coherence_decay_m * omega)
        common = _shaped(rng, amplitude * np.sqrt((1.0 + coherence) / 2.0), n_period)[:n]
        twist = _shaped(rng, amplitude * np.sqrt((1.0 - coherence) / 2.0), n_period)[:n]
        return Road(self.step_m, common + twist, common - twist)

    def spectrum_m3(self, omega_radpm: F64) -> F64:
        """One-sided height spectrum [m3/rad] at omega_radpm (m,)."""
        level: F64 = self.roughness_m3 * (omega_radpm**2 + self.corner_radpm**2) ** (-self.waviness / 2.0)
        return level


def iso_roughness_m3(road_class: str) -> float:
    """C [m3/rad] in the middle of the ISO 8608 class A (very good) to H: 1e-6 times 4 per class."""
    if len(road_class) != 1 or road_class not in "ABCDEFGH":
        raise ValueError(f"road class {road_class!r} is not one of A to H (ISO 8608)")
    return 1e-6 * 4.0 ** "ABCDEFGH".index(road_class)


def iso_road(road_class: str) -> SpectralRoad:
    """A road of two tracks in the middle of an ISO 8608 class."""
    return SpectralRoad(iso_roughness_m3(road_class))


def _n_samples(length_m: float, step_m: float) -> int:
    if not length_m > 0.0:
        raise ValueError(f"a road needs a positive length, not {length_m} m")
    return math.ceil(length_m / step_m) + 1


def _shaped(rng: np.random.Generator, amplitude: F64, n: int) -> F64:
    """White noise (n,) of unit variance through the gain ``amplitude`` (n // 2 + 1,), without its mean."""
    spectrum = fft.rfft(rng.standard_normal(n)) * amplitude
    spectrum[0] = 0.0
    shaped: F64 = fft.irfft(spectrum, n)
    return shaped


def _moving_mean(height_m: F64, n: int) -> F64:
    """Centred mean over n samples; the ends are continued by their own height."""
    padded = np.pad(height_m, (n // 2, n - 1 - n // 2), mode="edge")
    total = np.cumsum(np.concatenate(([0.0], padded)))
    mean: F64 = (total[n:] - total[:-n]) / n
    return mean


@compiled
def _first_order(white: F64, memory: float) -> F64:
    """y[k] = memory y[k-1] + white[k], y[0] = white[0]."""
    y = np.empty_like(white)
    y[0] = white[0]
    for k in range(1, white.size):
        y[k] = memory * y[k - 1] + white[k]
    return y
