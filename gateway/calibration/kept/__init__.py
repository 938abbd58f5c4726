"""Batches stored by the running service for calibration, without raw logs.

A batch is stored as it was estimated and is read back bit for bit, with the facts that inspection needs of its rows. So
a fit from stored batches equals the fit from the logs of the same batches.
docs/adr/kept-batches.md says why whole batches are stored and not grouped spectra.
"""

from gateway.calibration.kept.batch_file import KeptBatch, kept_batch_of, packed, unpacked
from gateway.calibration.kept.drive import KnownDrive, calibrate_kept, inspect_kept, split_run_of
from gateway.calibration.kept.shelf import Entry, Shelf, ShelfLimits

__all__ = [
    "Entry",
    "KeptBatch",
    "KnownDrive",
    "Shelf",
    "ShelfLimits",
    "calibrate_kept",
    "inspect_kept",
    "kept_batch_of",
    "packed",
    "split_run_of",
    "unpacked",
]
