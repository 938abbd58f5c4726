"""What a report of a calibration or an evaluation is made of: estimates held against known loads, by set."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

from gateway.calibration.calibrate import Outcome
from gateway.calibration.campaign import Campaign
from gateway.calibration.file.calibration_file import CalibrationFile
from gateway.calibration.judgement.evaluation import Judged, error_table, judge
from gateway.calibration.judgement.left_out import judged_left_out
from gateway.core.vehicle import Vehicle


class Part(StrEnum):
    """A set of known-load batches by what calibration knew of them."""

    LEFT_OUT = "left_one_run_out"
    IDENTIFICATION = "identification"
    VALIDATION = "validation"
    ALL = "all"


PART_NAMES: Mapping[Part, str] = {
    Part.LEFT_OUT: "runs left out",
    Part.IDENTIFICATION: "identification part (in-sample)",
    Part.VALIDATION: "validation part",
    Part.ALL: "all batches",
}
PART_TEXT: Mapping[Part, str] = {
    Part.LEFT_OUT: "Runs left out: every run's identification part, weighed by a calibration from the other runs.",
    Part.IDENTIFICATION: "Identification part: the batches that the calibration was fitted to, so errors look small.",
    Part.VALIDATION: "Validation part: later batches of the same runs, which no fit has seen; their loads it has.",
    Part.ALL: "All batches of the campaign, whether the calibration was fitted to them or not.",
}


@dataclass(frozen=True, slots=True)
class Judgement:
    """One estimator's answers beside the truth and their error tables (12), by set; a set without a batch is not there.

    ``dof`` are the degrees of freedom behind its intervals of payload and share; None: normal.
    """

    estimator: str
    judged: Mapping[Part, tuple[Judged, ...]]
    tables: Mapping[Part, dict[str, Any]]
    payload_dof: float | None = None
    front_share_dof: float | None = None

    @property
    def unseen(self) -> Part | None:
        """The set that tells most of loads yet to come: runs left out, else validation."""
        return next((part for part in (Part.LEFT_OUT, Part.VALIDATION, Part.ALL) if part in self.judged), None)


@dataclass(frozen=True, slots=True)
class Evidence:
    """A calibration file and how it did. ``outcome`` is how it came about; None where a file is only evaluated."""

    title: str
    file: CalibrationFile
    vehicle: Vehicle
    judgements: tuple[Judgement, ...]
    outcome: Outcome | None = None


def evidence_of_calibration(campaign: Campaign, outcome: Outcome) -> Evidence:
    """Every estimator judged on runs left out, on what it was fitted to and on the validation part."""
    judgements = [_judgement(campaign.vehicle, outcome, name) for name in outcome.file.estimators]
    title = f"Calibration of {campaign.vehicle.name}"
    return Evidence(title, outcome.file, campaign.vehicle, tuple(judgements), outcome)


def evidence_of_evaluation(
    campaign: Campaign, file: CalibrationFile, estimator: str, part: Part, judged: Sequence[Judged]
) -> Evidence:
    """One estimator of a calibration file judged on one part of a campaign."""
    judgement = _tabulated(campaign.vehicle, file, estimator, {part: judged})
    return Evidence(f"Evaluation of {campaign.vehicle.name}", file, campaign.vehicle, (judgement,))


def _judgement(vehicle: Vehicle, outcome: Outcome, estimator: str) -> Judgement:
    calibrated = outcome.file.for_core()
    found = {
        Part.LEFT_OUT: judged_left_out(outcome, estimator),
        Part.VALIDATION: [j for one in outcome.split for j in judge(one.validation, calibrated, estimator)],
        Part.IDENTIFICATION: [j for one in outcome.split for j in judge(one.identification, calibrated, estimator)],
    }
    return _tabulated(vehicle, outcome.file, estimator, {part: judged for part, judged in found.items() if judged})


def _tabulated(
    vehicle: Vehicle, file: CalibrationFile, estimator: str, found: Mapping[Part, Sequence[Judged]]
) -> Judgement:
    models = (file.ratio_index.payload, file.ratio_index.front_share) if file.ratio_index else (None, None)
    payload_dof, share_dof = (model.dof if model and estimator == "ratio_index" else None for model in models)
    return Judgement(
        estimator,
        {part: tuple(judged) for part, judged in found.items()},
        {part: error_table(judged, vehicle, estimator) for part, judged in found.items()},
        payload_dof,
        share_dof,
    )
