"""Simulated campaigns as candump logs, or as frames sent live to a bus by the sensors of a signal map.

Input: a kind of campaign and a van. Output: candump logs with their campaign file, or frames on a bus. This package
uses the simulator and the bus; it does not depend on the estimators.
"""
