"""The simulator: road, vehicle, sensors, drives.

A vehicle with its loads, a road, a drive and a seed go in; the sensors' recording and the truth come out. It shares no
model with core, so that it can prove the estimators wrong.
"""
