"""Calibrations made for a study: on chosen runs, in memory, held against others. No file is written."""

from collections.abc import Iterable, Sequence

from gateway.calibration.evaluation import Judged
from gateway.calibration.grey_box import calibrate_cross_spectrum
from gateway.calibration.ratio_index_fit import fit_ratio_index
from gateway.core.calibrated import CalibratedVehicle
from gateway.core.known_run import KnownRun
from gateway.core.vehicle import Vehicle
from gateway.errors import CalibrationImpossibleError
from gateway.offline.calibrate import judge

IN_MEMORY_ID = "study"


def calibrated_on(runs: Sequence[KnownRun], vehicle: Vehicle, estimator: str) -> CalibratedVehicle:
    """What ``springscale calibrate`` would find on these runs for one estimator.

    Raises CalibrationImpossibleError where they carry no calibration.
    """
    with_batches = [run for run in runs if any(not batch.rejected for batch in run.batches)]
    if not with_batches:
        raise CalibrationImpossibleError("no batch of these runs can be used")
    payloads_kg = [run.payload_kg for run in with_batches]
    shares_pct = [run.front_share_pct for run in with_batches]
    is_ratio_index = estimator == "ratio_index"
    return CalibratedVehicle(
        id=IN_MEMORY_ID,
        vehicle=vehicle,
        payload_seen_kg=(min(payloads_kg), max(payloads_kg)),
        front_share_seen_pct=(min(shares_pct), max(shares_pct)),
        ratio_index=fit_ratio_index(runs, vehicle).calibration if is_ratio_index else None,
        cross_spectrum=None if is_ratio_index else calibrate_cross_spectrum(runs, vehicle),
    )


def judged_all(runs: Iterable[KnownRun], calibrated: CalibratedVehicle, estimator: str) -> list[Judged]:
    """Every batch of every run with its estimate."""
    return [one for run in runs for one in judge(run, calibrated, estimator)]
