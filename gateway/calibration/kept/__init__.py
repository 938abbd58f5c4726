"""Batches as a calibration needs them, kept by the running service: no raw log is asked of anybody.

A batch goes in as it was estimated and comes out bit for bit, with what inspection asks of its rows, so that a fit from
kept batches is the fit from the logs of the same batches.
Why whole batches and no grouped spectra: docs/adr/kept-batches.md.
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
