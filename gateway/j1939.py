"""Weights as SAE J1939-71 counts them: one table of parameters for the frames that are sent and the HTTP answer."""

import math
from dataclasses import dataclass
from typing import Final

from gateway.estimate import Estimate, Weights
from gateway.quantities import QUANTITIES

# SAE J1939-71, table 1, numbers of two bytes
NOT_AVAILABLE: Final = 0xFFFF
ERROR: Final = 0xFE00  # here: more than two bytes can say, or less than nothing
LARGEST: Final = 0xFAFF  # the last valid one


@dataclass(frozen=True, slots=True)
class Parameter:
    """A two-byte parameter: kilograms a bit, offset 0. ``signal`` is its name in dbc/j1939_weights.dbc."""

    pgn: int
    spn: int
    name: str
    kg_per_bit: float
    signal: str


AXLE_WEIGHT: Final = Parameter(65258, 582, "Axle Weight", 0.5, "AxleWeight")
CARGO_WEIGHT: Final = Parameter(65258, 181, "Cargo Weight", 2.0, "CargoWeight")
POWERED_WEIGHT: Final = Parameter(65136, 1585, "Powered Vehicle Weight", 10.0, "PoweredVehicleWeight")
GROSS_WEIGHT: Final = Parameter(65136, 1760, "Gross Combination Vehicle Weight", 10.0, "GrossCombinationVehicleWeight")
PARAMETERS: Final = (AXLE_WEIGHT, CARGO_WEIGHT, POWERED_WEIGHT, GROSS_WEIGHT)


@dataclass(frozen=True, slots=True)
class Count:
    """One parameter as it stands on the wire. ``axle`` counts from 1 at the front, None for the vehicle."""

    parameter: Parameter
    axle: int | None
    raw: int

    @property
    def kg(self) -> float | None:
        """None if the count is no weight."""
        return None if self.raw > LARGEST else self.raw * self.parameter.kg_per_bit


def counts_of(shown: Estimate | None, weights: Weights, *, draws_trailers: bool) -> list[Count]:
    """Every parameter of an estimate and its ``weights``; what is not known is "not available".

    A provisional estimate is not sent: J1939 has no word for it. Springs say nothing of a trailer: with
    ``draws_trailers`` the combination's weight stays unknown.
    """
    is_final = shown is not None and not shown.is_provisional
    counts = []
    for parameter in PARAMETERS:
        for one in QUANTITIES:
            if parameter.spn in one.spns:
                kg = getattr(weights, one.name).kg if one.is_weight else _payload_kg(shown)
                is_known = is_final and not (parameter is GROSS_WEIGHT and draws_trailers)
                raw = _raw(kg if is_known else math.nan, parameter.kg_per_bit)
                counts.append(Count(parameter, one.axle, raw))
    return counts


def _payload_kg(shown: Estimate | None) -> float:
    """Not below 0: an empty vehicle may be found a little lighter."""
    payload_kg = math.nan if shown is None else shown.payload.number
    return 0.0 if payload_kg < 0.0 else payload_kg


def _raw(kg: float, kg_per_bit: float) -> int:
    if math.isnan(kg):
        return NOT_AVAILABLE
    raw = kg / kg_per_bit
    return round(raw) if math.isfinite(raw) and 0 <= round(raw) <= LARGEST else ERROR
