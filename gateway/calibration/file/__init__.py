"""The vehicle calibration file: JSON whose id is the hash of its content, checked whole when it is read.

The estimators' results come in; the calibrations for the core go out (``CalibrationFile.for_core``). Here too:
the file's figures for people, the difference of two files, and the check of a file against the logs that it was made
from.
"""
