"""Section 4 of the paper, driven again with our simulator: its numbers beside ours, on one page with its figures.

A directory and a extent come in (``reproduce``); campaigns, calibrations, figures, report.html, results.json and the
text of accuracy.md go out. ``experiments`` drives and calibrates, ``figures`` and ``table`` show.
"""
