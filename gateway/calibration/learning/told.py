"""What was learnt, as an object: for the command's JSON, and from the process that learns to its service."""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Final

import numpy as np

from gateway.calibration.ahead import Step
from gateway.calibration.assigned import BIAS, Assigned
from gateway.calibration.found import ClaimState, FoundClaim
from gateway.calibration.judgement.advice import WORTH_SAYING, Verdict
from gateway.calibration.learning.from_pieces import Learnt, faults_told
from gateway.calibration.learning.spans import STATES
from gateway.calibration.statements import Statement
from gateway.core.vehicle import Vehicle
from gateway.estimates.quantity import Z95
from gateway.records import iso_utc, rounded
from gateway.stated.statement import StatementRecord, StatementSource

Record = dict[str, Any]

NEAR: Final = 2.0  # chosen: standard deviations within which a slip explains the difference
SLIPS: Final = (
    ("in pounds", 1.0 / 2.20462),
    ("with a digit too many", 0.1),
    ("with a digit missing", 10.0),
    ("twice what was aboard", 0.5),
    ("half of what was aboard", 2.0),
)
"""Words, and how many times the stated payload was aboard."""
BIAS_SHOWN: Final = 0.03  # chosen: of the load; a smaller common error is not worth a question
SURE: Final = 1.64  # chosen: standard deviations


def drives_record(found: Learnt) -> list[Record]:
    """Each drive, with what is stated and found of its load."""
    drives = []
    for one in found.drives:
        driven, load = one.driven, one.load
        drives.append(
            {
                "number": one.number,
                "log": driven.source,
                "t_start": iso_utc(driven.piece.begin_ns),
                "t_end": iso_utc(driven.piece.end_ns),
                "driven_s": rounded(driven.usable_s, 1),
                "stated": _stated(one.statement),
                "found": load and _kg(load.load.payload_kg, load.payload_std_kg),
                "found_without_statement": load and _kg(load.without_kg, load.without_std_kg),
                "state": str(max((claim.state for claim in one.claims), key=_gravity)) if one.claims else None,
            }
        )
    return drives


def _stated(said: Statement) -> Record | None:
    if said.payload_kg is None:
        return None
    plus_minus_kg = min(claim.stated_plus_minus_kg for claim in said.claims)
    return {"payload_kg": rounded(said.payload_kg, 1), "plus_minus_kg": rounded(plus_minus_kg, 1)}


def _gravity(state: ClaimState) -> int:
    return list(ClaimState).index(state)


def _kg(payload_kg: float, std_kg: float) -> Record | None:
    if math.isnan(payload_kg):
        return None
    return {"payload_kg": rounded(payload_kg, 1), "plus_minus_kg": rounded(Z95 * std_kg, 1)}


def statements_record(records: Sequence[StatementRecord], assigned: Assigned, found: Learnt) -> list[Record]:
    """What became of each statement: its state, and what its drives said without it."""
    statements = []
    for i, (record, fate) in enumerate(zip(records, assigned.fates, strict=True)):
        drives = [one for one in found.drives if i in one.holding]
        claims = [claim for one in drives for claim in one.claims if claim.name == record.id]
        state, shown, asked = STATES[fate], None, None
        if claims:
            worst = max(claims, key=lambda one: (_gravity(one.state), one.disagreement))
            state, shown = str(worst.state), _kg(worst.without_kg, worst.without_std_kg)
            if worst.state is not ClaimState.USED:
                asked = f"{worst.drive} {question(worst, record, found.outcome.file.vehicle)}"
        elif not record.learn and (loads := [one.load for one in drives if one.load]):
            state, shown = "checked", _kg(loads[0].load.payload_kg, loads[0].payload_std_kg)
        told = record.model_dump(mode="json", by_alias=True)
        statements.append(
            {
                **told,
                "drives": [one.number for one in drives],
                "state": state,
                "found": shown,
                "question": asked,
                "reason": assigned.reasons[i] or None,
            }
        )
    return statements


def learning_record(found: Learnt, verdict: Verdict) -> Record:
    """How well a load is weighed now, and what would narrow it."""
    taught = found.outcome.cross_spectrum
    helps = [one for one in verdict.steps if one.then_kg <= (1.0 - WORTH_SAYING) * one.now_kg]
    return {
        "plus_minus_kg": rounded(verdict.steps[0].now_kg, 1) if verdict.steps else None,
        "useful_at_kg": rounded(found.outcome.file.vehicle.useful_half_width_kg, 1),
        "tested_on": len({one.run for one in taught.errors}) if taught else 0,
        "helps": [_help(one) for one in helps],
        "findings": list(_findings(found)),
    }


def _help(step: Step) -> Record:
    return {
        "do": step.candidate.name,
        "then_plus_minus_kg": rounded(step.then_kg, 1),
        "text": f"{step.candidate.words}: ± {step.now_kg:.0f} kg would become ± {step.then_kg:.0f} kg",
    }


def _findings(found: Learnt) -> Iterator[str]:
    taught = found.outcome.cross_spectrum
    if taught is not None:
        yield from common_errors(taught.causes)
    yield from (f"some drives are left out: {told}" for _, told in faults_told(found.findings))


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
