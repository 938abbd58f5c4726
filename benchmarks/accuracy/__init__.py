"""The accuracy of the estimators: studies that take minutes, on simulated vans and on a campaign's own runs.

``python -m benchmarks.accuracy NAME`` runs a study (``study``) and writes its numbers, NAME.json; docs/accuracy.md
shows them. The worlds are ``drives.TRIPS``, ``disturbed.DISTURBANCES`` and ``faulty_logs.FAULTS``. The
wheel has none of it.
"""
