"""How a payload stands on its floor: firmly, as most do, or on something soft that lets it ring; and worn dampers.

A load on rubber, foam or a slack rack resonates near 10 Hz and shakes the body with what it is not: no other load
and no small change of the vehicle explains its spectra. It is sought as a possibility of its own beside the firm one,
and believed where it explains the spectra by far better. So are dampers that have worn since calibration, which are
sought where the search strains at what it believes of them. What they would answer widens the interval; they are the
answer themselves where they explain the spectra by far better.
"""

from dataclasses import dataclass, replace
from math import log
from typing import Final

from gateway.core.cross_spectrum.drift import DRIFTING, with_worn_dampers
from gateway.core.cross_spectrum.model.parameters import INDEX
from gateway.records import F64

SOFT_MODE_HZ: Final = 10.5  # within a standard deviation of the search's: 7.8 to 14 Hz
SOFT_COST: Final = 15.0
"""Logarithm of how much less probable it is, counted as a batch's evidence is (likelihood.EVIDENCE_WEIGHT): e^-3.
Chosen.
"""

WORN_COST: Final = 5.0  # likewise, e^-1; chosen
LEAST_STRAIN: Final = 4.6
"""Of dampers, chi-squared of two (drift.strain_of): chance exceeds it in every tenth batch."""

DECISIVE: Final = 100.0
"""By so much it must explain a batch better before it is the answer. Loads that stood on soft mounts gained 446 and
more (recorded drives, 9 Hz), firm ones at most 10; a real car, whose seats and people resonate too, up to 51.
"""
WORN_DECISIVE: Final = 80.0
"""Likewise of worn dampers. Healthy simulated vans gained at most 9, recorded drives 12 and, on the roughest road,
where friction hides much of what dampers do, 73. Dampers a third weaker gained 37 to 98 on both axles, 42 to 312 on
one.
"""


@dataclass(frozen=True, slots=True)
class Packing:
    """What the drifting parameters (k,) are expected to be and how precisely (k, k), the cost of taking a load to stand
    so, and by how much it must be better to be believed.
    """

    drifting: F64
    precision: F64
    cost: float = 0.0
    decisive: float = 0.0
    is_worn: bool = False


def worn(packing: Packing) -> Packing:
    """The same with dampers that may have worn."""
    return replace(
        packing,
        precision=with_worn_dampers(packing.precision),
        cost=packing.cost + WORN_COST,
        decisive=packing.decisive + WORN_DECISIVE,
        is_worn=True,
    )


def packings(parameters: F64, precision: F64) -> tuple[Packing, Packing]:
    """Firm as in calibration, and soft."""
    firm = parameters[DRIFTING]
    soft = firm.copy()
    soft[DRIFTING.index(INDEX["payload_mode_hz"])] = log(SOFT_MODE_HZ)
    return Packing(firm, precision), Packing(soft, precision, SOFT_COST, DECISIVE)
