"""The report of a calibration, or of an evaluation alone: report.html with figures and report.json.

An outcome or an assessment goes in. One module writes each section (runs, spectra, ratio index, fitted vehicle,
accuracy, provenance), ``page`` puts them under the verdict, ``report`` writes the directory.
"""
