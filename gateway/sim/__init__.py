"""A test bench of our own: road, vehicle, sensors, drives.

A vehicle with its loads, a road, a drive and a seed come in; what the sensors record and what was true go out. It
shares no model with core, so that it can prove the estimators wrong.
"""
