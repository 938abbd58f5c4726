"""Pure estimation: decoded rows in, estimates out. No clock, no files, no bus.

``Flow`` is the one path: rows of motion come in as they arrive; each batch that is full leaves as an Estimate, with
the load epoch it belongs to, and with what known weights taught. What calibration taught comes as a CalibratedVehicle.
The two estimators, in rooms of their own, turn a batch that passed the common gates into numbers or into reasons;
``estimator`` lists them.

It names nothing here: the command line starts without what only estimation needs.
"""
