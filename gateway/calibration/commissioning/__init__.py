"""A calibration made on the vehicle itself: what a fitter types, and the fit in a process of its own.

``doubts_of`` asks about what is unlikely of it, ``vehicle_table`` makes of it the vehicle as a campaign states it. A
``Job`` names batches and what to make of them;
``python -m gateway.calibration.commissioning.work FOLDER`` does it with low priority and bounded memory and leaves a
``Result``. Who decides what is done when is the service (gateway.service.commissioning).
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
