"""A calibration made on the vehicle itself: the fitter's answers, and the fit in a process of its own.

``doubts_of`` asks about unlikely answers, ``vehicle_table`` turns them into the vehicle of a campaign. A ``Job`` names
batches and a task; ``python -m gateway.calibration.commissioning.work FOLDER`` does it with low priority and bounded
memory and leaves a ``Result``. The service decides what is done when (gateway.service.commissioning).
"""

from gateway.calibration.commissioning.answers import OF_THE_LINE, vehicle_table
from gateway.calibration.commissioning.job import JOB, RESULT, Drive, Found, Job, Learned, Result
from gateway.calibration.commissioning.plausible import NO_LINE, LineFacts, doubts_of

__all__ = [
    "JOB",
    "NO_LINE",
    "OF_THE_LINE",
    "RESULT",
    "Drive",
    "Found",
    "Job",
    "Learned",
    "LineFacts",
    "Result",
    "doubts_of",
    "vehicle_table",
]
