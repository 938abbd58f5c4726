"""What ``springscale calibrate`` makes of runs, in memory."""

from collections.abc import Sequence

from gateway.calibration.ratio_index.index_fit import fit_ratio_index
from gateway.calibration.stated_drive import StatedDrive, sensor_rate_seen_hz
from gateway.calibration.teach import teach
from gateway.core.vehicle import Vehicle
from gateway.errors import CalibrationImpossibleError
from gateway.model.vehicle_model import VehicleModel
from gateway.weighing.calibrated import CalibratedVehicle


def taught_by(runs: Sequence[StatedDrive], vehicle: Vehicle) -> VehicleModel:
    """The vehicle that these runs teach. Raises CalibrationImpossibleError if they allow none."""
    return teach(runs, vehicle).model


def calibrated_on(runs: Sequence[StatedDrive], vehicle: Vehicle, estimator: str) -> CalibratedVehicle:
    """The calibration for one estimator. Raises CalibrationImpossibleError if the runs allow none."""
    with_batches = [run for run in runs if any(not batch.rejected for batch in run.batches)]
    if not with_batches:
        raise CalibrationImpossibleError("no batch of these runs can be used")
    payloads_kg = [run.payload_kg for run in with_batches]
    shares_pct = [run.front_share_pct for run in with_batches]
    is_ratio_index = estimator == "ratio_index"
    return CalibratedVehicle(
        id="study",
        vehicle=vehicle,
        payload_seen_kg=(min(payloads_kg), max(payloads_kg)),
        front_share_seen_pct=(min(shares_pct), max(shares_pct)),
        ratio_index=fit_ratio_index(runs, vehicle).calibration if is_ratio_index else None,
        cross_spectrum=None if is_ratio_index else taught_by(runs, vehicle),
        sensor_rate_seen_hz=sensor_rate_seen_hz(with_batches),
    )
