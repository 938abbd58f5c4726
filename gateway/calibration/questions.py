"""What is asked about statements that the drives contradict, one or all of a source: what was probably meant."""

from collections.abc import Iterator, Mapping
from typing import Final

import numpy as np

from gateway.calibration.assigned import BIAS
from gateway.calibration.found import FoundClaim
from gateway.core.vehicle import Vehicle
from gateway.quantity import Z95
from gateway.stated.statement import StatementRecord, StatementSource

NEAR: Final = 2.0  # chosen: standard deviations within which a slip explains the difference
SLIPS: Final = (
    ("in pounds", 1.0 / 2.20462),
    ("with a digit too many", 0.1),
    ("with a digit missing", 10.0),
    ("twice what was aboard", 0.5),
    ("half of what was aboard", 2.0),
)
"""Words, and how many times the stated payload was aboard."""


def question(claim: FoundClaim, record: StatementRecord, vehicle: Vehicle) -> str:
    """One sentence about a statement that is held or counts less, with what would explain it, and what to do."""
    shown = f"{claim.without_kg:.0f} ± {Z95 * claim.without_std_kg:.0f} kg"
    place = " at another place" if claim.is_of_place else ""
    meant = next(_slips(claim, record, vehicle), "is it of another drive, or of another vehicle?")
    return f"says {claim.said_kg:.0f} kg, the drive shows {shown}{place}: {meant}"


def _slips(claim: FoundClaim, record: StatementRecord, vehicle: Vehicle) -> Iterator[str]:
    if claim.exchanged_with is not None:
        yield f"was it exchanged with {claim.exchanged_with}?"
    if claim.is_of_place:
        is_of_axles = record.load.front_axle_kg is not None
        yield (
            "are front and rear axle exchanged?"
            if is_of_axles
            else "is the place measured from the front axle rearwards?"
        )
    if record.source is StatementSource.EMPTY:
        yield "was something aboard?"
    std_kg = float(np.hypot(claim.without_std_kg, claim.said_std_kg))
    for words, factor in SLIPS if record.load.payload_kg else ():
        if abs(factor * claim.said_kg - claim.without_kg) < NEAR * std_kg:
            yield f"is it {words}? then {factor * claim.said_kg:.0f} kg were aboard"
    if record.load.payload_kg and abs(claim.said_kg - vehicle.empty_mass_kg - claim.without_kg) < NEAR * std_kg:
        yield "is it the gross weight? then write gross_kg"


BIAS_SHOWN: Final = 0.03  # chosen: of the load; a smaller common error is not worth a question
SURE: Final = 1.64  # chosen: standard deviations


def common_errors(causes: Mapping[str, tuple[float, float]]) -> Iterator[str]:
    """A sentence for each source whose statements all err by the same part of the load."""
    is_weighed = bool({StatementSource.SCALE, StatementSource.AXLE_SCALES} & causes.keys())
    for source, (part, _) in BIAS.items():
        mean, std = causes.get(str(source), (0.0, 1.0))
        if part and abs(mean) > SURE * std and abs(part * mean) > BIAS_SHOWN:
            off, less = (
                f"{100.0 * part * abs(mean):.0f} ± {100.0 * Z95 * part * std:.0f} %",
                "less" if mean > 0.0 else "more",
            )
            yield (
                f"all {source.replace('_', ' ')}s say {off} {less} than is aboard: is it packaging, or what is always "
                f"in the vehicle? {'The scale is allowed for' if is_weighed else 'One weighing on a scale tells'}"
            )
