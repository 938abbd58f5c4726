"""A batch of exact spectra: sensors of a known half-car over a random road, and what known loads teach of it."""

from dataclasses import replace

import numpy as np

from gateway.calibration.stated_drive import StatedDrive, known_drive
from gateway.calibration.teach import teach
from gateway.core.vehicle import Load, Vehicle
from gateway.estimates.batch_estimate import Estimate
from gateway.model.car import Ground
from gateway.model.vehicle_model import VehicleModel
from gateway.records import F64, Batch
from gateway.weighing.calibrated import CalibratedVehicle
from gateway.weighing.estimator import estimate
from support import model_road
from support.kept import kept
from support.model_road import HALF_UNITS, KNOWN, QUIET, RATE_HZ, UNCOUPLED, batch_of, paths_of, theta_of

# a half-car has no width
VAN = replace(model_road.VAN, track_width_m=None, sensor_offset_left_m=None, sensor_offset_left_std_m=1e-3)
GROUND = Ground.of(VAN)
WITHOUT_NOISE = dict.fromkeys(QUIET, 1e-30)
FIRM = {"payload_damping_ratio": 0.15, "track_offset_m": 1e-6}
CAR = theta_of(vehicle=VAN, **WITHOUT_NOISE, **UNCOUPLED, **HALF_UNITS, **FIRM)


def as_if_fitted(theta: F64, std: F64, vehicle: Vehicle = VAN) -> VehicleModel:
    """A fitted vehicle with these parameters and standard deviations (n,)."""
    loads = tuple(Load(kg, share) for kg in (0.0, 420.0) for share in (40.0, 60.0))
    return model_road.model_of(theta, np.diag(std**2), loads, vehicle)


def batch_over_road(
    payload_kg: float,
    front_share_pct: float,
    seed: int,
    duration_s: float = 300.0,
    speed_mps: float = 14.0,
    noise: float = 0.02,
    waviness: float = 2.0,
    pitch_sign: float = 1.0,
    incoherent: float = 0.0,
    car: F64 = CAR,
    shaken_mps2: float = 0.8,
) -> Batch:
    """Constant speed; ``shaken_mps2`` is the acceleration's standard deviation, ``noise`` a share of each signal's.

    ``incoherent`` replaces that share of the pitch rate's amplitude by something unrelated to the road.
    """
    rng = np.random.default_rng(seed)
    n = int(duration_s * RATE_HZ)
    freq_hz = np.fft.rfftfreq(n, 1.0 / RATE_HZ)[1:]
    road = (rng.standard_normal(len(freq_hz)) + 1j * rng.standard_normal(len(freq_hz))) * freq_hz ** (-waviness / 2)
    paths = paths_of(car, (payload_kg, front_share_pct / 100.0), freq_hz, speed_mps=speed_mps, ground=GROUND)
    later = np.exp(-2j * np.pi * freq_hz * VAN.wheelbase_m / speed_mps)
    sensed = (paths[:, 0] + paths[:, 1] * later) * road * ((freq_hz > 0.5) & (freq_hz < 22.0))
    acceleration, pitch_rate = np.fft.irfft(np.pad(sensed, ((0, 0), (1, 0))), n, axis=1)
    scale = shaken_mps2 / acceleration.std()
    acceleration, pitch_rate = acceleration * scale, pitch_rate * scale
    unrelated = pitch_rate.std() * rng.standard_normal(n)
    pitch_rate = pitch_sign * ((1.0 - incoherent) * pitch_rate + incoherent * unrelated)
    return batch_of(
        acceleration + noise * acceleration.std() * rng.standard_normal(n),
        pitch_rate + noise * pitch_rate.std() * rng.standard_normal(n),
        speed_mps=speed_mps,
    )


def run_over_road(number: int, payload_kg: float, share_pct: float) -> StatedDrive:
    """Two batches of a known load."""
    batches = tuple(batch_over_road(payload_kg, share_pct, seed=10 * number + i) for i in range(2))
    return known_drive(number, f"run {number}", payload_kg, share_pct, batches)


def taught_by(runs: list[StatedDrive], vehicle: Vehicle = VAN, sister: VehicleModel | None = None) -> VehicleModel:
    """The vehicle that these runs teach."""
    return teach(runs, vehicle, sister).model


@kept
def calibrated_on_known_loads() -> VehicleModel:
    """Two batches of each of four loads."""
    return taught_by([run_over_road(i, *load) for i, load in enumerate(KNOWN)])


def weighed(batch: Batch, model: VehicleModel) -> Estimate:
    """The cross spectrum's answer to the batch, whatever loads calibration saw."""
    vehicle = replace(VAN, payload_range_kg=(0.0, 2000.0))
    calibrated = CalibratedVehicle("sha256:ab", vehicle, (0.0, 0.0), (0.0, 0.0), cross_spectrum=model)
    return estimate(batch, calibrated, "cross_spectrum")
