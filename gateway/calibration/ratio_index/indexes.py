"""The two ratio indexes of known runs, batch by batch, as a calibrated vehicle shows them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gateway.calibration.known_run import KnownRun
from gateway.core.ratio_index.index import RatioIndexCalibration, indexes_of
from gateway.records import F64, I64


@dataclass(frozen=True, slots=True)
class IndexRows:
    """Run number, payload, front share, R_a and R_g (n,) of every batch that has the indexes its vehicle wants."""

    run: I64
    payload_kg: F64
    front_share_pct: F64
    ra: F64
    rg: F64


def index_rows(runs: Sequence[KnownRun], calibration: RatioIndexCalibration) -> IndexRows:
    """The ratio indexes of all sound batches of ``runs``; an index whose bands are not calibrated is NaN."""
    wanted = [calibration.acceleration_bands is not None, calibration.pitch_rate_bands is not None]
    rows = [
        (run.number, run.payload_kg, run.front_share_pct, *indexes_of(batch, calibration))
        for run in runs
        for batch in run.batches
        if not batch.rejected
    ]
    kept = np.array([row for row in rows if np.all(np.isfinite(row[3:])[wanted])], dtype=float).reshape(-1, 5)
    return IndexRows(kept[:, 0].astype(np.int64), *kept[:, 1:].T)
