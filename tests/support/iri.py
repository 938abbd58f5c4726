"""International Roughness Index, ASTM E1926: the golden quarter car at 80 km/h.

The index is the mean of |z_s' - z_u'| over the way, the rectified slope of the suspension's travel,
in m/km (mm/m).
"""

from typing import Final

import numpy as np
from scipy.linalg import expm

from gateway.records import F64
from gateway.sim.compiled import compiled

SPEED_MPS: Final = 80.0 / 3.6
K1: Final = 653.0  # tyre rate over sprung mass [1/s2]
K2: Final = 63.3  # spring rate over sprung mass [1/s2]
C: Final = 6.0  # damper rate over sprung mass [1/s]
MU: Final = 0.15  # unsprung over sprung mass
BASE_M: Final = 0.25  # tyre enveloping: moving average
START_M: Final = 11.0  # the first half second at 80 km/h sets the initial slopes


def iri_m_per_km(height_m: F64, step_m: float) -> float:
    """IRI of a profile of heights (n,) every step_m.

    Raises ValueError for a step over 0.25 m and for a profile shorter than the 11 m from which the
    initial state is taken.
    """
    return float(np.mean(np.abs(_travel_slopes(height_m, step_m)))) * 1000.0


def iri_by_section(height_m: F64, step_m: float, section_m: float) -> F64:
    """IRI of each full section_m of the profile (k,), the quarter car running on through all of them."""
    per_section = round(section_m / step_m)
    slopes = np.abs(_travel_slopes(height_m, step_m))
    k = len(slopes) // per_section
    return slopes[: k * per_section].reshape(k, per_section).mean(axis=1) * 1000.0


def golden_car() -> tuple[F64, F64]:
    """dx/dt = A x + B y: y the road's slope; x the slopes of the sprung and unsprung paths and their rates of change.

    x = (z_s', dz_s'/dt, z_u', dz_u'/dt), A (4, 4), B (4,).
    """
    a = np.array(
        [
            [0.0, 1.0, 0.0, 0.0],
            [-K2, -C, K2, C],
            [0.0, 0.0, 0.0, 1.0],
            [K2 / MU, C / MU, -(K1 + K2) / MU, -C / MU],
        ]
    )
    return a, np.array([0.0, 0.0, 0.0, K1 / MU])


def _travel_slopes(height_m: F64, step_m: float) -> F64:
    """z_s' - z_u' (m,) at each step."""
    if not 0.0 < step_m <= BASE_M:
        raise ValueError(f"the profile needs a step of at most {BASE_M} m (ASTM E1926), not {step_m} m")
    n_base = max(round(BASE_M / step_m), 1)
    n_start = round(START_M / step_m)
    if len(height_m) <= max(n_start, n_base):
        raise ValueError(f"the profile must be longer than {START_M} m")
    slopes = (height_m[n_base:] - height_m[:-n_base]) / (n_base * step_m)  # of the 250 mm moving average
    start = (height_m[n_start] - height_m[0]) / (n_start * step_m)
    transition, drive = _over_one_step(step_m)
    return _respond(np.ascontiguousarray(slopes), start, transition, drive)


def _over_one_step(step_m: float) -> tuple[F64, F64]:
    """Exact solution of the golden car over step_m for a slope that stays the same within it."""
    a, b = golden_car()
    extended = np.zeros((5, 5))
    extended[:4, :4], extended[:4, 4] = a, b
    solution = np.asarray(expm(extended * (step_m / SPEED_MPS)), dtype=np.float64)
    return np.ascontiguousarray(solution[:4, :4]), np.ascontiguousarray(solution[:4, 4])


@compiled
def _respond(slopes: F64, start: float, transition: F64, drive: F64) -> F64:
    """Step the golden car over the slopes, sprung and unsprung mass first following ``start``."""
    state, following = np.array([start, 0.0, start, 0.0]), np.zeros(4)
    travel = np.empty_like(slopes)
    for k in range(slopes.size):
        for i in range(4):
            following[i] = drive[i] * slopes[k]
            for j in range(4):
                following[i] += transition[i, j] * state[j]
        state[:] = following
        travel[k] = state[0] - state[2]
    return travel
