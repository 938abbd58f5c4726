"""The packing of a payload: firm on its floor, as most are, or on a soft mount; and worn dampers.

A load on rubber, foam or a slack rack resonates near 10 Hz: no other load and no small change of the vehicle explains
its spectra. It is a hypothesis beside the firm load, and accepted if it explains the spectra far better. So are dampers
that have worn since calibration, tried where the search strains its prior of them. Rejected hypotheses widen the
interval.
"""

from dataclasses import dataclass, replace
from math import log
from typing import Final

from gateway.core.cross_spectrum.drift import DRIFTING, with_worn_dampers
from gateway.core.cross_spectrum.model.parameters import INDEX
from gateway.records import F64

SOFT_MODE_HZ: Final = 10.5  # chosen: a standard deviation of the search's prior spans 7.8 to 14 Hz
SOFT_COST: Final = 15.0
"""Chosen: cost of the soft hypothesis, weighted like a batch's evidence (likelihood.EVIDENCE_WEIGHT): e^-3."""

WORN_COST: Final = 5.0  # chosen: likewise of worn dampers, e^-1
LEAST_STRAIN: Final = 4.6
"""Chosen: of dampers, chi-squared of two (drift.strain_of); chance exceeds it in every tenth batch."""

DECISIVE: Final = 100.0
"""Chosen: gain in log-likelihood at which the soft hypothesis is accepted. Loads on soft mounts gained 446 and more
(recorded drives, 9 Hz), firm ones at most 10; a real car, whose seats and people resonate too, up to 51.
"""
WORN_DECISIVE: Final = 80.0
"""Chosen: likewise of worn dampers. Healthy simulated vans gained at most 9, recorded drives 12 and, on the roughest
road, where friction hides much of the dampers' effect, 73. Dampers a third weaker gained 37 to 98 on both axles, 42 to
312 on one.
"""


@dataclass(frozen=True, slots=True)
class Packing:
    """A hypothesis: the mean (k,) and precision (k, k) of the drifting parameters, its cost, and the gain at which it
    is accepted.
    """

    drifting: F64
    precision: F64
    cost: float = 0.0
    decisive: float = 0.0
    is_worn: bool = False


def worn(packing: Packing) -> Packing:
    """The same hypothesis with dampers that may have worn."""
    return replace(
        packing,
        precision=with_worn_dampers(packing.precision),
        cost=packing.cost + WORN_COST,
        decisive=packing.decisive + WORN_DECISIVE,
        is_worn=True,
    )


def packings(parameters: F64, precision: F64) -> tuple[Packing, Packing]:
    """The firm hypothesis, as in calibration, and the soft one."""
    firm = parameters[DRIFTING]
    soft = firm.copy()
    soft[DRIFTING.index(INDEX["payload_mode_hz"])] = log(SOFT_MODE_HZ)
    return Packing(firm, precision), Packing(soft, precision, SOFT_COST, DECISIVE)
