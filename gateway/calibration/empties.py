"""Which drives of unknown load look empty: the lowest mode of their payloads. It is proposed, never taken.

The least payload of many is too low by chance; but empty drives are many, and their payloads alike. What drives do not
share of their error tells them apart, even if the zero is not known well.
"""

from collections.abc import Sequence
from statistics import median
from typing import Final

import numpy as np

from gateway.calibration.found import FoundLoad
from gateway.core.vehicle import Vehicle
from gateway.quantity import Z95

SCATTER_KG: Final = 5.0  # chosen: standard deviation of driver, tank and loose items
ALIKE: Final = 2.5  # chosen: standard deviations from the mode
LEAST_MEMBERS: Final = 2
SURE_SHARE: Final = 0.1  # chosen: of the largest payload; with a narrower interval about zero one drive is enough
STEP_KG: Final = 2.0  # chosen: of the search for the mode


def looking_empty(loads: Sequence[FoundLoad], vehicle: Vehicle) -> tuple[FoundLoad, ...]:
    """Those of these drives of unknown load that look empty, in the order given; none if no group is near zero."""
    if not loads:
        return ()
    payload_kg = np.array([one.load.payload_kg for one in loads])
    std_kg = np.hypot([one.own_std_kg for one in loads], SCATTER_KG)
    at_kg = np.arange(payload_kg.min() - STEP_KG, payload_kg.max() + 2.0 * STEP_KG, STEP_KG)
    density = np.sum(np.exp(-0.5 * ((at_kg[:, None] - payload_kg) / std_kg) ** 2) / std_kg, axis=1)
    modes = at_kg[1:-1][(density[1:-1] >= density[:-2]) & (density[1:-1] > density[2:])]
    for mode_kg in modes.tolist():
        members = [one for one, x, std in zip(loads, payload_kg, std_kg, strict=True) if abs(x - mode_kg) < ALIKE * std]
        if not members:
            continue
        half_kg = Z95 * float(np.hypot(median(one.payload_std_kg for one in members), SCATTER_KG))
        if mode_kg - half_kg > 0.0:
            return ()
        is_sure = abs(mode_kg) + half_kg < SURE_SHARE * vehicle.largest_payload_kg
        if len(members) >= LEAST_MEMBERS or is_sure:
            return tuple(members)
    return ()
