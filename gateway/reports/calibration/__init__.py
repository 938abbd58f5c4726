"""The report of a calibration, or of an evaluation alone: report.html with figures and report.json.

An outcome or an assessment comes in; one module writes each section (runs, plan, spectra, ratio index, half-car,
learning curve, accuracy, provenance), ``page`` sets them under the verdict, ``report`` puts the directory together.
"""
