"""Looks at the drives of a campaign before anything is fitted to them, and says what is wrong in words for a fitter.

Drives cut in two come in (``SplitRun``: batches, facts of the rows and of the log); an ``Inspection`` goes out: a
verdict with findings for every run, findings of all runs together, and why no calibration is possible, if so. Logs,
rows, axes and signs, and loads are asked in this order; a fault keeps its run out of the calibration.
``explained`` holds the words and the advice for every kind of finding, docs/findings.md is made from it.
"""

from gateway.calibration.inspection.campaign import Inspection, inspect_campaign
from gateway.calibration.inspection.finding import Finding, Kind, RunVerdict, Severity
from gateway.calibration.inspection.log import LogFacts, SplitRun
from gateway.calibration.inspection.roll import offset_findings, unmapped_roll_findings
from gateway.calibration.inspection.rows import RowFacts, row_facts

__all__ = [
    "Finding",
    "Inspection",
    "Kind",
    "LogFacts",
    "RowFacts",
    "RunVerdict",
    "Severity",
    "SplitRun",
    "inspect_campaign",
    "offset_findings",
    "row_facts",
    "unmapped_roll_findings",
]
