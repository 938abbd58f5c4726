"""The result of teaching: the vehicle, each drive's load, and what became of each statement."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from math import nan

import numpy as np

from gateway.calibration.left_out import LeftOut
from gateway.core.vehicle import Load
from gateway.model.vehicle_model import VehicleModel
from gateway.records import F64


@dataclass(frozen=True, slots=True, eq=False)
class FoundLoad:
    """What a fit found of one drive: its load with what is stated of it, and what the drive says without.

    own_std_kg is the standard deviation that the payload would have if the vehicle were known: it tells the drives'
    loads apart. deviations (N_OWN,) are those of the vehicle's parameters on this drive. without and its standard
    deviation (kg) are NaN if nothing was stated of the payload. stated (kg) is what the statements say once their
    common errors are known, NaN if nothing is believed. ``is_held``: a statement disagrees beyond chance and taught
    nothing.
    """

    name: str
    load: Load
    deviations: F64
    payload_std_kg: float
    without_kg: float
    without_std_kg: float
    is_held: bool
    own_std_kg: float = nan
    stated_kg: float = nan
    stated_std_kg: float = nan


class ClaimState(StrEnum):
    """What a statement taught."""

    USED = "used"
    WEAK = "weak"
    HELD = "held"


@dataclass(frozen=True, slots=True)
class FoundClaim:
    """What the fit made of a statement about one drive.

    said (kg) is its payload with the whole error that was stated. disagreement is that of the statement with the drive
    as the others see it, in standard deviations of their difference; without (kg) is what the drive says without it.
    ``is_of_place``: its payload agrees, its place does not. ``exchanged_with`` is the drive whose statement explains
    this one, and which this statement explains.
    """

    name: str
    drive: str
    state: ClaimState
    disagreement: float
    said_kg: float
    said_std_kg: float
    without_kg: float
    without_std_kg: float
    is_of_place: bool = False
    exchanged_with: str | None = None

    def distance(self, other: "FoundClaim") -> float:
        """Of two statements, each from what the other's drive says, in standard deviations."""
        off = [
            (one.said_kg - drive.without_kg) / np.hypot(one.said_std_kg, drive.without_std_kg)
            for one, drive in ((self, other), (other, self))
        ]
        return float(np.hypot(*off))


@dataclass(frozen=True, slots=True, eq=False)
class Taught:
    """A vehicle as its drives taught it, the load of every drive, and by name the vehicle without each drive left out.

    claims are the statements with what became of them, causes the errors that they have in common: mean and standard
    deviation in units of the cause's own. errors are of batches of the drives left out.
    """

    model: VehicleModel
    loads: tuple[FoundLoad, ...]
    without: dict[str, VehicleModel]
    errors: tuple[LeftOut, ...] = ()
    claims: tuple[FoundClaim, ...] = ()
    causes: Mapping[str, tuple[float, float]] = field(default_factory=dict)

    def load_of(self, name: str) -> FoundLoad | None:
        """What was found of a drive's load; None if the drive taught nothing."""
        return next((one for one in self.loads if one.name == name), None)
