"""Reproduction of the paper's section 4 with our simulator: its numbers beside ours, on one page with figures.

Input of ``reproduce``: a directory and an extent. Output: campaigns, calibrations, figures, report.html and
report.json. ``experiments`` simulates and calibrates; ``figures`` and ``reproduce`` show the results.
"""
