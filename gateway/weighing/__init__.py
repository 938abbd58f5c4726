"""Weighing: the estimators behind one interface, and the flow from rows to estimates for service and tools.

``Flow`` takes rows of motion as they arrive and yields an Estimate for each full batch, together with the load epoch of
the batch. The calibration comes in as a CalibratedVehicle. ``estimator`` has the table
of estimators and their common gates.
This package imports nothing itself, so that the command line starts without the modules that only estimation needs.
"""
