"""A calibration made on the vehicle itself: the fitter's answers, and the fit in a process of its own.

``doubts_of`` asks about unlikely answers, ``vehicle_table`` turns them into the vehicle of a campaign. A ``Job`` names
batches and a task; ``python -m gateway.calibration.commissioning.work FOLDER`` does it with low priority and bounded
memory and leaves a ``Result``. The service decides what is done when (gateway.service.commissioning).
"""
