"""The content of a report on a calibration or an evaluation: estimates compared with known loads, by set."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from enum import StrEnum

from gateway.calibration.file import CalibrationFile
from gateway.calibration.from_drives import Outcome
from gateway.calibration.judgement.evaluation import ErrorTable, Judged, error_table, judge
from gateway.core.vehicle import Vehicle
from gateway.estimates.budget import BudgetLine, typical_budget


class BatchSet(StrEnum):
    """A set of known-load batches by what calibration knew of them."""

    LEFT_OUT = "left_one_run_out"
    IDENTIFICATION = "identification"
    VALIDATION = "validation"
    ALL = "all"


PART_NAMES: Mapping[BatchSet, str] = {
    BatchSet.LEFT_OUT: "drives left out",
    BatchSet.IDENTIFICATION: "identification part (in-sample)",
    BatchSet.VALIDATION: "validation part",
    BatchSet.ALL: "all batches",
}
PART_TEXT: Mapping[BatchSet, str] = {
    BatchSet.LEFT_OUT: "Drives left out: the identification part of each, weighed by a calibration from the others.",
    BatchSet.IDENTIFICATION: "Identification part: the batches of the fit, where errors look small.",
    BatchSet.VALIDATION: "Validation part: later batches of the same runs, new to the fit; their loads are not new.",
    BatchSet.ALL: "All batches of the campaign, whether the calibration was fitted to them or not.",
}


@dataclass(frozen=True, slots=True)
class Judgement:
    """One estimator's error tables (12) by set; a set without a batch is not there."""

    estimator: str
    tables: Mapping[BatchSet, ErrorTable]

    @property
    def unseen(self) -> BatchSet | None:
        """The set that predicts later loads best: runs left out, else validation."""
        return next(
            (part for part in (BatchSet.LEFT_OUT, BatchSet.VALIDATION, BatchSet.ALL) if part in self.tables), None
        )


@dataclass(frozen=True, slots=True)
class Assessment:
    """A calibration file and its accuracy. ``outcome`` is the run of the calibration; None if a file is only
    evaluated.
    """

    title: str
    file: CalibrationFile
    vehicle: Vehicle
    judgements: tuple[Judgement, ...]
    outcome: Outcome | None = None


def stated_budget(judgement: Judgement) -> tuple[BudgetLine, ...]:
    """The sources of the error that the service states, over batches weighed as it weighs; empty if none was.

    Runs left out are not such batches: their shape is known to be that of the other known loads.
    """
    part = next(
        (one for one in (BatchSet.VALIDATION, BatchSet.ALL, BatchSet.IDENTIFICATION) if one in judgement.tables), None
    )
    judged = judgement.tables[part].judged if part else ()
    budgets = [one.estimate.error_budget for one in judged if one.estimate.error_budget]
    return typical_budget(budgets) if budgets else ()


def assess_calibration(outcome: Outcome) -> Assessment:
    """Every estimator judged on runs left out, on the data of its fit and on the validation part."""
    file, vehicle, calibrated = outcome.file, outcome.file.vehicle, outcome.file.for_core()
    runs = outcome.inspection.usable
    judgements = []
    for estimator in file.estimators:
        judged = {
            BatchSet.LEFT_OUT: judged_left_out(outcome, estimator),
            BatchSet.VALIDATION: judge([run.validation for run in runs], calibrated, estimator),
            BatchSet.IDENTIFICATION: judge([run.identification for run in runs], calibrated, estimator),
        }
        tables = {part: error_table(rows, vehicle, estimator) for part, rows in judged.items() if rows}
        judgements.append(Judgement(estimator, tables))
    return Assessment(f"Calibration of {vehicle.name}", file, vehicle, tuple(judgements), outcome)


def assess_evaluation(vehicle: Vehicle, file: CalibrationFile, part: BatchSet, table: ErrorTable) -> Assessment:
    """One estimator of a calibration file judged on one part of a campaign."""
    judgement = Judgement(table.estimator, {part: table})
    return Assessment(f"Evaluation of {vehicle.name}", file, vehicle, (judgement,))


def judged_left_out(outcome: Outcome, estimator: str) -> list[Judged]:
    """Every identification batch with its estimate by a calibration from the other runs.

    Empty if fewer than three runs leave nothing to fit. The widening of intervals and the range of known loads stay as
    of all runs: the errors are those of a new load, the coverage is slightly optimistic.
    """
    whole, runs = outcome.file.for_core(), [one.identification for one in outcome.inspection.usable]
    if estimator == "ratio_index":
        ratio = outcome.ratio_index
        without = {n: replace(whole, ratio_index=fitted) for n, fitted in (ratio.without if ratio else {}).items()}
    else:
        taught = outcome.cross_spectrum.without if outcome.cross_spectrum else {}
        without = {
            run.number: replace(whole, cross_spectrum=taught[run.name], is_shape_known=run.statement.is_compact)
            for run in runs
            if run.name in taught
        }
    left_out = [run for run in runs if run.number in without]
    return [one for run in left_out for one in judge([run], without[run.number], estimator)]
