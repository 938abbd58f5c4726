"""The scatter between vehicles of one line, parameter by parameter.

Default standard deviations of the difference between two vehicles: relative for positive parameters, else in the unit
that ends the name. About their mean it is smaller by the root of two. We read tolerances that makers state as limits as
three standard deviations about the mean.
"""

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Final

import numpy as np

from gateway.calibration.line.evidence import Evidence
from gateway.core.cross_spectrum.model.parameters import BEND_SHARES, PARAMETERS, ROLL_PARAMETERS
from gateway.records import F64, Bool

LEAST_SIBLINGS: Final = 3  # chosen: from which the scatter is estimated
MOST_STEPS: Final = 500  # chosen: bound of the iteration
SETTLED: Final = 1e-4  # chosen: relative change of a variance at which the iteration ends
_RIDGE: Final = 1e-9  # chosen: of the scatter's precision; keeps mu finite where no vehicle informs it


def scatter_found(siblings: Sequence[Evidence], default_variance: F64, dof: float) -> F64:
    """(n,) variances of vehicles about their line's mean; those whose default is 0 stay 0.

    ``dof`` is the number of vehicles that the default counts for.
    """
    shared = np.flatnonzero(default_variance > 0.0)
    parts = [Evidence(one.information[np.ix_(shared, shared)], one.pull[shared]) for one in siblings]
    default = default_variance[shared]
    variance = default
    for _ in range(MOST_STEPS):
        squares = _expected_squares(parts, variance)
        told = (dof * default + squares) / (dof + len(parts))
        is_settled = np.allclose(told, variance, rtol=SETTLED, atol=0.0)
        variance = told
        if is_settled:
            break
    found = np.zeros_like(default_variance)
    found[shared] = variance
    return found


def _expected_squares(parts: Sequence[Evidence], variance: F64) -> F64:
    """(m,) sum over vehicles of E[(theta_i - mu)^2], given all evidence and this variance (m,)."""
    precision = np.diag(1.0 / variance)
    line = sum((one.of_another(variance) for one in parts), Evidence(_RIDGE * precision, np.zeros(len(variance))))
    of_mean = np.linalg.inv(line.information)
    mean = of_mean @ line.pull
    squares = np.zeros(len(variance))
    for one in parts:
        own = np.linalg.inv(one.information + precision)
        moves = own @ one.information
        off = own @ (one.pull - one.information @ mean)
        squares += off**2 + np.diag(own) + np.einsum("ij,jk,ik->i", moves, of_mean, moves)
    return squares


_ENDS: Final = ("front", "rear")

_OF_AXLE: Final[Mapping[str, float]] = MappingProxyType(
    {
        # makers of custom coils guarantee +-10 % of the rate (springs3d.com/en/tolerancias), car makers ask for less
        "spring_{}_npm": 0.03,
        "damper_{}_nspm": 0.10,  # wear, oil, makes; chosen: buyers agree on bands of their own
        # rubber of +-5 degrees Shore A (driventus.com on sourcing dampers) is +-20 % (gmt-rubber.com, figure 1.2)
        "damper_mount_{}_npm": 0.15,
        # chosen for a fleet that looks after its tyres, whose rate goes with the pressure: in a survey of 3950 light
        # trucks a third had one a quarter too low (NHTSA 2001)
        "tyre_{}_npm": 0.04,
        "unsprung_{}_kg": 0.03,  # wheels and tyres of other makes
        "damper_friction_{}": 0.05,  # chosen: a third of the 0.1 to 0.3 found in vans
        "spring_friction_{}": 0.02,  # likewise, of 0.03 to 0.09
        "spring_slope_{}_per_kn": 0.01,  # the coil's winding: a third of a usual slope of 0.03
    }
)
_OF_BODY: Final[Mapping[str, float]] = MappingProxyType(
    {
        "pitch_inertia_kgm2": 0.03,  # mass and centre of gravity differ by 1.5 %, its square by twice that
        "payload_gyration_m2": 0.3,  # loads, not vehicles
        "payload_mode_hz": 0.1,  # the same floor
        "payload_damping_ratio": 0.3,
        "rear_lag_s": 0.001,
        "roll_inertia_kgm2": 0.03,
        "payload_roll_gyration_m2": 0.3,
        "anti_roll_front_npm": 0.1,  # bars are steel; their bushes and links are not
        "anti_roll_rear_npm": 0.1,
        "damper_against_front": 0.1,
        "damper_against_rear": 0.1,
        "tracks_apart_m": 0.3,  # roads, not vehicles
        "twist_level": 0.3,
    }
)
BEND_STD_PER_KN: Final = (
    0.01  # chosen: of each bend of a spring's rate; bump stops and helper springs have one part number
)

SCATTER_STD: Final[Mapping[str, float]] = MappingProxyType(
    {name.format(end): std for name, std in _OF_AXLE.items() for end in _ENDS}
    | {f"spring_bend_{end}_{i}_per_kn": BEND_STD_PER_KN for end in _ENDS for i in range(len(BEND_SHARES))}
    | dict(_OF_BODY)
)
"""The inherited parameters."""

OWN: Final = frozenset(PARAMETERS + ROLL_PARAMETERS) - SCATTER_STD.keys()
"""Each vehicle's own parameters: sensor unit, its place, noise and lag, tracks, slack, centre of the empty body."""

SCATTER_DOF: Final = 4.0
"""Chosen: number of vehicles that the defaults count for, so that three siblings can double them."""


def is_inherited(names: Sequence[str]) -> Bool:
    """(n,) whether each parameter is inherited."""
    return np.array([name not in OWN for name in names])


def default_scatter_std(names: Sequence[str]) -> F64:
    """(n,) default scatter of the names; 0 if not inherited."""
    return np.array([SCATTER_STD.get(name, 0.0) for name in names])
