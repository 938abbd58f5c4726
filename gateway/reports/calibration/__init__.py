"""The report of a calibration, or of an evaluation alone: report.html with figures and report.json.

An assessment goes in. One module writes each section (runs, fitted vehicle, accuracy, provenance);
``calibration_report`` puts them under the verdict and writes the directory.
"""
