"""Inspects the drives of a campaign before any fit, and says what is wrong in words for a fitter.

Drives cut in two come in (``InspectedRun``: batches, facts of the rows and of the log); an ``Inspection`` goes out: the
runs with their findings, findings about all runs together, and the reason if no calibration is possible. ``run_checks``
looks at the log, the rows and the cross-spectra of one run, ``across_runs`` at all runs together. A fault excludes its
run from the calibration. The table of kinds (``finding``) has the advice for each; docs/reasons.md says what it means,
too.
"""
