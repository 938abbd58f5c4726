"""The accuracy of the estimators: studies that take minutes, on simulated vans and on a campaign's own runs.

Campaign files and seeds go in; numbers (NAME.json) and their page (NAME.md), which docs/ shows, come out. ``study``
runs the cases of a study, ``markdown`` writes its page. Run a study by ``python -m benchmarks.accuracy NAME``; the
wheel has none of it.
"""
