"""The vehicle calibration file: JSON whose id is the hash of its content, checked whole when it is read.

The estimators' results come in; the calibrations for the core go out (``CalibrationFile.for_core``). Here too:
the file's figures for people, the difference of two files, and the check of a file against the logs that it was made
from.
"""

from gateway.calibration.file.calibration_file import CalibrationFile, load_calibration
from gateway.calibration.file.check import Check, check_against_campaign
from gateway.calibration.file.comparison import Difference, FittedFigure, differences, figures_of
from gateway.calibration.file.line_file import LikeFile, LineFile, SiblingPart, load_like
from gateway.calibration.file.line_part import EvidencePart, LinePart
from gateway.calibration.file.parts import ExpectedErrorsPart, ProvenancePart, RunPart, SeenPart

__all__ = [
    "CalibrationFile",
    "Check",
    "Difference",
    "EvidencePart",
    "ExpectedErrorsPart",
    "FittedFigure",
    "LikeFile",
    "LineFile",
    "LinePart",
    "ProvenancePart",
    "RunPart",
    "SeenPart",
    "SiblingPart",
    "check_against_campaign",
    "differences",
    "figures_of",
    "load_calibration",
    "load_like",
]
