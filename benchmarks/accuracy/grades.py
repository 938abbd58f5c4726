"""The required quality of a sensor: the same fresh vans on the same drives, with sensors of other noise, resolution and
rate.

    grades(Scope(n_vans=3), seed) -> {"grades": [...], "lines": [...], ...}

Each van is calibrated and driven with each sensor, because a noisy sensor is used for calibration too. A drive as
calibrated and a mixed one carry loads within the calibrated range, near the centre line, as for the disturbances.
"""

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, replace
from functools import partial
from types import MappingProxyType
from typing import Any, Final

from benchmarks.accuracy.coverage_drives import AS_CALIBRATED, TRIPS, Scope, driven
from benchmarks.accuracy.coverage_table import JudgedBatch, coverage_table, judged_batches
from benchmarks.accuracy.disturbances import ESTIMATOR, WITHIN_PARTS, WITHIN_PLACES
from benchmarks.accuracy.disturbed import noisier
from benchmarks.accuracy.runner import OnDone, run_each
from benchmarks.accuracy.vans import fresh_van
from gateway.calibration.judgement import judge
from gateway.calibration.judgement.learning_curve import calibrated_on
from gateway.errors import CalibrationImpossibleError
from gateway.sim.sensors import CANMOD, REFERENCE, Sensors
from gateway.sim.vehicle import Load

SEED: Final = 20_285  # arbitrary, of this study alone
N_VANS: Final = 3  # chosen: one of each type
TIMES: Final = (2.0, 5.0, 10.0, 20.0)  # chosen: factors of the reference unit's noise


def _as_coarse_as_canmod(sensors: Sensors) -> Sensors:
    imu = sensors.imu
    accel = replace(imu.accel, resolution=CANMOD.imu.accel.resolution)
    return replace(
        sensors, imu=replace(imu, accel=accel, gyro=replace(imu.gyro, resolution=CANMOD.imu.gyro.resolution))
    )


def _sampled(rate_hz: float) -> Callable[[Sensors], Sensors]:
    """The unit's low-pass scales with the rate."""
    corner_hz = REFERENCE.imu.corner_hz * rate_hz / REFERENCE.imu.rate_hz
    return lambda sensors: replace(sensors, imu=replace(sensors.imu, rate_hz=rate_hz, corner_hz=corner_hz))


@dataclass(frozen=True, slots=True)
class Grade:
    """One sensor: its name, and its difference from the reference unit."""

    name: str
    sensors_of: Callable[[Sensors], Sensors] = lambda mounted: mounted


AS_SIMULATED: Final = Grade("reference unit")
GRADES: Final[Mapping[str, Grade]] = MappingProxyType(
    {
        one.name: one
        for one in (
            AS_SIMULATED,
            *(Grade(f"accelerometer's noise x {by:g}", noisier(accel=by)) for by in TIMES),
            *(Grade(f"gyro's noise x {by:g}", noisier(gyro=by)) for by in TIMES),
            *(Grade(f"both x {by:g}", noisier(by, by)) for by in TIMES),
            Grade("resolutions of CANmod.gps", _as_coarse_as_canmod),
            Grade("50 samples a second", _sampled(50.0)),
            Grade("one fix a second", lambda sensors: replace(sensors, gps=replace(sensors.gps, rate_hz=1.0))),
        )
    }
)


def grades(
    scope: Scope, seed: int = SEED, *, workers: int = 1, on_van: OnDone = lambda done, of: None
) -> dict[str, Any]:
    """Calibrate, drive and judge every van with every sensor: the table, and each sensor's noise and resolution.

    ``refused`` lists impossible calibrations.
    """
    batches: list[JudgedBatch] = []
    refused: list[str] = []
    for of_van, refused_of_van in run_each(partial(_of_one_van, scope, seed), scope.n_vans, workers, on_van):
        batches += of_van
        refused += refused_of_van
    sensors = [{"name": name, **_facts(grade.sensors_of(REFERENCE))} for name, grade in GRADES.items()]
    return {"grades": sensors, **asdict(coverage_table(batches, seed, refused))}


def _facts(sensors: Sensors) -> dict[str, float]:
    imu = sensors.imu
    return {
        "accel_noise_mps2_per_rthz": imu.accel.noise_density,
        "gyro_noise_radps_per_rthz": imu.gyro.noise_density,
        "accel_resolution_mps2": imu.accel.resolution,
        "gyro_resolution_radps": imu.gyro.resolution,
        "rate_hz": imu.rate_hz,
        "fixes_hz": sensors.gps.rate_hz,
    }


def _of_one_van(scope: Scope, seed: int, number: int) -> tuple[list[JudgedBatch], list[str]]:
    batches: list[JudgedBatch] = []
    refused: list[str] = []
    for name, grade in GRADES.items():
        fresh = fresh_van(scope, seed, number, grade.sensors_of)
        van = fresh.van
        try:
            calibrated = calibrated_on(fresh.runs, fresh.vehicle, ESTIMATOR)
        except CalibrationImpossibleError as fault:
            refused.append(f"{van.name}: {name}: {fault}")
            continue
        for trip, seeds in zip((AS_CALIBRATED, TRIPS["mixed"]), fresh.test_seed.spawn(2), strict=True):
            place_m = float(fresh.rng.uniform(*WITHIN_PLACES)) * van.wheelbase_m
            load = Load(float(fresh.rng.uniform(*WITHIN_PARTS)) * van.rated_payload_kg, place_m)
            run = driven(van, (load,), trip, scope, seeds, len(batches), fresh.sensors)
            judged = judge([run], calibrated, ESTIMATOR)
            batches += judged_batches(judged, fresh.vehicle, name, ESTIMATOR, run)
    return batches, refused
