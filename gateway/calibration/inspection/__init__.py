"""Inspects the drives of a campaign before any fit, and says what is wrong in words for a fitter.

Drives cut in two come in (``SplitRun``: batches, facts of the rows and of the log); an ``Inspection`` goes out: a
verdict with findings for every run, findings about all runs together, and the reason if no calibration is possible.
``run`` checks the log, the rows and the cross-spectra of one run, ``campaign`` all runs together. A fault excludes its
run from the calibration. The table of kinds (``finding``) has the advice for each; docs/reasons.md says what it means,
too.
"""
