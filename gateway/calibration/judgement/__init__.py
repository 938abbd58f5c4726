"""The accuracy of a calibration: its estimates compared with the truth, and a verdict.

The outcome of a calibration, or batches of known load with a calibration file, come in. Out go the error table (12)
(``error_table``), the same by what calibration knew of the batches (``Assessment``), the coverage of intervals
(``coverage_of``), a verdict with reasons (``verdicts_of``) and the errors with fewer known loads (``curve_of``).
"""

from gateway.calibration.judgement.answers import LEVELS, Answers, answers_of, observed_coverage, standardised
from gateway.calibration.judgement.assessment import (
    PART_NAMES,
    PART_TEXT,
    Assessment,
    BatchSet,
    Judgement,
    assess_calibration,
    assess_evaluation,
    stated_budget,
)
from gateway.calibration.judgement.coverage import Coverage, coverage_of
from gateway.calibration.judgement.evaluation import (
    TARGETS,
    Comparison,
    Errors,
    ErrorTable,
    Judged,
    Target,
    TargetErrors,
    error_table,
    errors_of,
    judge,
)
from gateway.calibration.judgement.learning_curve import LearningCurve, Rung, ScoreSpread, curve_of
from gateway.calibration.judgement.sideways import CgLeftErrors, WheelErrors
from gateway.calibration.judgement.verdict import Grade, Verdict, verdicts_of
from gateway.calibration.judgement.width import Width, width_of

__all__ = [
    "LEVELS",
    "PART_NAMES",
    "PART_TEXT",
    "TARGETS",
    "Answers",
    "Assessment",
    "BatchSet",
    "CgLeftErrors",
    "Comparison",
    "Coverage",
    "ErrorTable",
    "Errors",
    "Grade",
    "Judged",
    "Judgement",
    "LearningCurve",
    "Rung",
    "ScoreSpread",
    "Target",
    "TargetErrors",
    "Verdict",
    "WheelErrors",
    "Width",
    "answers_of",
    "assess_calibration",
    "assess_evaluation",
    "coverage_of",
    "curve_of",
    "error_table",
    "errors_of",
    "judge",
    "observed_coverage",
    "standardised",
    "stated_budget",
    "verdicts_of",
    "width_of",
]
