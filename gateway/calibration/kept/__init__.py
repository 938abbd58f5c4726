"""Batches stored by the running service for calibration, without raw logs.

A batch is stored as it was estimated and is read back bit for bit, with the facts that inspection needs of its rows. So
a fit from stored batches equals the fit from the logs of the same batches.
docs/architecture.md says why whole batches are stored and not grouped spectra.
"""
