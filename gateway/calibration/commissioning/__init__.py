"""A calibration made on the vehicle itself: what a fitter types, and the fit in a process of its own.

``vehicle_table`` makes of it the vehicle as a campaign states it. A ``Job`` names batches and what to make of them;
``python -m gateway.calibration.commissioning.work FOLDER`` does it with low priority and bounded memory and leaves a
``Result``. Who decides what is done when is the service (gateway.service.commissioning).
"""

from gateway.calibration.commissioning.answers import OF_THE_LINE, vehicle_table
from gateway.calibration.commissioning.job import JOB, RESULT, Drive, Found, Job, Learned, Result

__all__ = ["JOB", "OF_THE_LINE", "RESULT", "Drive", "Found", "Job", "Learned", "Result", "vehicle_table"]
