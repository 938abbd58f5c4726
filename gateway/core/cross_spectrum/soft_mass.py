"""A test for a mass on a soft support behind the rear axle, such as bicycles on a tow bar.

    soft_mass_of(whittle, point, calibration, packing) -> SoftMass

Such a mass follows the body only below its own resonance, and absorbs vibration there. No payload, shape or packing in
the model explains that, so the load that fits best may be wrong by more than the mass itself. A score test (C. R. Rao,
Proc. Camb. Phil. Soc. 44, 1948) at the answer looks for it, without another search: the slope of the likelihood towards
a small mass with one of a few resonances, with all free parameters following.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np

from gateway.core.cargo import TOW_BAR_BEHIND_AXLE_M
from gateway.core.cross_spectrum.calibration import CrossSpectrumCalibration
from gateway.core.cross_spectrum.drift import DRIFTING, NATURE_OF_STEADY, STEADY
from gateway.core.cross_spectrum.likelihood import Point, Whittle
from gateway.core.cross_spectrum.model.motion import Motion, Supported
from gateway.core.cross_spectrum.model.parameters import INDEX, PARAMETERS
from gateway.core.cross_spectrum.packing import Packing
from gateway.records import C128, F64

RESONANCES_HZ: Final = (2.0, 2.5, 3.0, 3.6, 4.4, 5.5, 7.0)
"""Chosen: a fifth apart, about the width of a resonance of the damping ratio below."""
DAMPING_RATIO: Final = 0.1  # chosen: of such a mount
GYRATION_STD: Final = 1.0  # chosen: of the logarithm of the load's squared radius of gyration, as free as cargo has it
MOST_SCORE: Final = 5.0
"""Chosen: standard deviations. Of 138 healthy batches of two recorded vans two exceeded it, with 3 and 5 kg; masses of
30 and 60 kg on a simulated tow bar, at 2.2 to 4.5 Hz, scored 6.6 to 17.7 where they were answered.
"""
MOST_KG: Final = 10.0
"""Chosen: a lighter mass moves the answer by less than its interval. Healthy batches with a score above 2.5 showed at
most 12 kg, a mass of 30 kg 21 to 26 kg.
"""

_GYRATION: Final = INDEX["payload_gyration_m2"]
_FOLLOWING: Final = [*DRIFTING, _GYRATION, len(PARAMETERS), len(PARAMETERS) + 1]
_OPEN: Final = [i for i in STEADY if i != _GYRATION]
_NATURE: Final = NATURE_OF_STEADY[np.ix_(*[[STEADY.index(i) for i in _OPEN]] * 2)]


@dataclass(frozen=True, slots=True)
class SoftMass:
    """The most significant mass on a soft support: in kg as one step of the search finds it, its resonance, and its
    score in standard deviations.
    """

    kg: float
    resonance_hz: float
    score: float

    @property
    def is_there(self) -> bool:
        """True if neither chance nor the half-car's own errors explain it, and it is heavy enough to matter."""
        return self.score > MOST_SCORE and self.kg > MOST_KG


def soft_mass_of(whittle: Whittle, point: Point, calibration: CrossSpectrumCalibration, packing: Packing) -> SoftMass:
    """The test at ``point``, the answer to the spectra of ``whittle`` under ``packing``.

    Drifting parameters, load and its shape follow within their priors. The score's variance includes what calibration
    and nature leave open of the other parameters.
    """
    n, n_known = len(point.theta), len(PARAMETERS) + 2

    def by_level(motion: Motion) -> C128:
        behind_m = calibration.wheelbase_m + TOW_BAR_BEHIND_AXLE_M
        return motion.by_suspended_mass(behind_m, mounted(whittle.spectra.freq_hz).felt)

    entries = [*range(len(PARAMETERS)), n, n + 1]
    known = whittle.curvature(point, entries)
    found, across = whittle.curvature_beside(point, entries, by_level)
    precision = np.zeros((n_known, n_known))
    precision[np.ix_(DRIFTING, DRIFTING)] = packing.precision
    precision[_GYRATION, _GYRATION] = GYRATION_STD**-2
    pull = known.gradient[_FOLLOWING]
    pull[: len(DRIFTING)] += packing.precision @ (point.theta[DRIFTING] - packing.drifting)
    covariance = np.linalg.inv((known.information + precision)[np.ix_(_FOLLOWING, _FOLLOWING)])
    along = across[:, _FOLLOWING] @ covariance
    slope = found.gradient - along @ pull
    own = np.diag(found.information) - np.sum(along * across[:, _FOLLOWING], axis=1)
    by_open = across[:, _OPEN] - along @ known.information[np.ix_(_FOLLOWING, _OPEN)]
    left_open = calibration.covariance[np.ix_(_OPEN, _OPEN)] + _NATURE
    scores = -slope / np.sqrt(own + np.sum((by_open @ left_open) * by_open, axis=1))
    best = int(np.argmax(scores))
    return SoftMass(float(-slope[best] / own[best]), RESONANCES_HZ[best], float(scores[best]))


def mounted(freq_hz: F64) -> Supported:
    """Such a mass at frequencies (m,), for each of RESONANCES_HZ: (k, m)."""
    return Supported(freq_hz / np.array(RESONANCES_HZ)[:, None], DAMPING_RATIO)
