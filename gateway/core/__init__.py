"""Pure estimation: decoded rows in, estimates out. No clock, no files, no bus.

``Flow`` is the one path. It takes rows of motion as they arrive and yields an Estimate for each full batch, together
with the load epoch of the batch and corrected by known weights. The calibration comes in as a CalibratedVehicle.
The two estimators have rooms of their own. Each turns a batch that passed the common gates into numbers or into
reasons; ``estimator`` lists them.
This package imports nothing itself, so that the command line starts without the modules that only estimation needs.
"""
