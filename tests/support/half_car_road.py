"""A batch of exact spectra: sensors of a known half-car over a random road, made in the frequency domain."""

import numpy as np

from gateway.calibration.half_car.fit import calibrate_cross_spectrum
from gateway.calibration.known_run import KnownRun
from gateway.core.calibrated import CalibratedVehicle
from gateway.core.cross_spectrum import by_cross_spectrum
from gateway.core.cross_spectrum.calibration import CrossSpectrumCalibration
from gateway.core.cross_spectrum.model.half_car import Axle, HalfCar, frequency_response
from gateway.core.cross_spectrum.model.parameters import PARAMETERS, has_roll, is_positive, names_of
from gateway.core.estimator import estimate
from gateway.core.vehicle import Vehicle
from gateway.estimate import Estimate
from gateway.records import F64, Batch
from support.kept import kept

KNOWN = ((0.0, 52.0), (270.0, 55.5), (270.0, 47.0), (420.0, 41.5))  # payload (kg), front share (%)
RATE_HZ = 50.0
VAN = Vehicle(
    name="van",
    empty_mass_kg=1240.0,
    wheelbase_m=2.8,
    empty_front_share_pct=52.0,
    sensor_position_m=3.1,
    sensor_offset_left_std_m=1e-3,  # a half-car has no width
)
CAR = HalfCar(
    empty_mass_kg=1240.0,
    empty_front_share=0.52,
    wheelbase_m=2.8,
    front=Axle(62e3, 0.02, (), (), 3.9e3, 8e5, 3.6e5, 82.0),
    rear=Axle(70e3, 0.04, (), (), 4.1e3, 7e5, 3.8e5, 88.0),
    pitch_inertia_kgm2=2200.0,
    sensor_position_m=3.1,
    payload_gyration_m2=0.1,
    payload_mode_hz=28.0,
    payload_damping_ratio=0.15,
    gyro_lag_s=0.0,
)


def parameters_of(car: HalfCar) -> F64:
    """The car as the model's vector (p,), next to no slack or noise."""
    known = {name: getattr(car, name) for name in PARAMETERS if hasattr(car, name)}
    for end, axle in (("front", car.front), ("rear", car.rear)):
        known |= {
            f"spring_{end}_npm": axle.spring_npm,
            f"spring_slope_{end}_per_kn": axle.spring_slope_per_kn,
            f"damper_{end}_nspm": axle.damper_nspm,
            f"damper_mount_{end}_npm": axle.damper_mount_npm,
            f"tyre_{end}_npm": axle.tyre_npm,
            f"unsprung_{end}_kg": axle.unsprung_kg,
        }
    usual = dict.fromkeys(PARAMETERS, 0.0) | {name: 1e-30 for name in PARAMETERS if is_positive(name)}
    return np.array([np.log(x) if is_positive(name) else x for name, x in (usual | known).items()])


def as_if_fitted(theta: F64, std: F64, vehicle: Vehicle = VAN) -> CrossSpectrumCalibration:
    """As if a fit had ended with these parameters and standard deviations (n,)."""
    return CrossSpectrumCalibration(
        empty_mass_kg=vehicle.empty_mass_kg,
        empty_front_share_pct=vehicle.empty_front_share_pct,
        wheelbase_m=vehicle.wheelbase_m,
        band_hz=(1.1, 14.0),
        n_segment=256,
        names=names_of(theta),
        parameters=theta,
        covariance=np.diag(std**2),
        directions=np.zeros((len(theta), 0)),
        model_std=(10.0, 0.2, 0.002),
        misfit_limit=3.0,
        acceleration_rms_mps2=0.5,
        pitch_rate_rms_radps=0.05,
        payload_seen_kg=(0.0, 420.0),
        front_share_seen_pct=(40.0, 60.0),
        speed_seen_mps=(12.0, 15.0),
        track_width_m=vehicle.track_width_m if has_roll(theta) else None,
    )


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
    car: HalfCar = CAR,
    shaken_mps2: float = 0.8,
) -> Batch:
    """Constant speed; ``shaken_mps2`` is the acceleration's standard deviation, ``noise`` a share of each signal's.

    ``incoherent`` replaces that share of the pitch rate's amplitude by something unrelated to the road.
    """
    rng = np.random.default_rng(seed)
    n = int(duration_s * RATE_HZ)
    freq_hz = np.fft.rfftfreq(n, 1.0 / RATE_HZ)[1:]
    road = (rng.standard_normal(len(freq_hz)) + 1j * rng.standard_normal(len(freq_hz))) * freq_hz ** (-waviness / 2)
    r = frequency_response(car, payload_kg, front_share_pct / 100.0, freq_hz)
    later = np.exp(-2j * np.pi * freq_hz * car.wheelbase_m / speed_mps)
    in_band = (freq_hz > 0.5) & (freq_hz < 22.0)
    acceleration = _in_time((r.acceleration_front + r.acceleration_rear * later) * road * in_band, n)
    pitch_rate = _in_time((r.pitch_rate_front + r.pitch_rate_rear * later) * road * in_band, n)
    scale = shaken_mps2 / acceleration.std()
    acceleration, pitch_rate = acceleration * scale, pitch_rate * scale
    unrelated = pitch_rate.std() * rng.standard_normal(n)
    pitch_rate = pitch_sign * ((1.0 - incoherent) * pitch_rate + incoherent * unrelated)
    return batch_of(
        acceleration + noise * acceleration.std() * rng.standard_normal(n),
        pitch_rate + noise * pitch_rate.std() * rng.standard_normal(n),
        np.full(n, speed_mps),
    )


def batch_of(acceleration_mps2: F64, pitch_rate_radps: F64, speed_mps: F64) -> Batch:
    """A batch whose every sample is usable."""
    n = len(speed_mps)
    return Batch(
        t_start_ns=0,
        t_end_ns=int(n / RATE_HZ * 1e9),
        drive_start_ns=0,
        rate_hz=RATE_HZ,
        vertical_acceleration_mps2=acceleration_mps2,
        pitch_rate_radps=pitch_rate_radps,
        speed_mps=speed_mps,
        usable=np.ones(n, bool),
        gravity_mps2=9.81,
        gap_share=0.0,
        shares={},
    )


def _in_time(spectrum: F64, n: int) -> F64:
    return np.fft.irfft(np.r_[0.0, spectrum], n)


def run_over_road(number: int, payload_kg: float, share_pct: float) -> KnownRun:
    """Two batches of a known load."""
    batches = tuple(batch_over_road(payload_kg, share_pct, seed=10 * number + i) for i in range(2))
    return KnownRun(number, f"run {number}", payload_kg, share_pct, batches)


@kept
def calibrated_on_known_loads() -> CrossSpectrumCalibration:
    """Two batches of each of four loads."""
    return calibrate_cross_spectrum([run_over_road(i, *load) for i, load in enumerate(KNOWN)], VAN)


def weighed(batch: Batch, calibration: CrossSpectrumCalibration) -> Estimate:
    """What the cross spectrum tells of the batch, with no limit to the loads."""
    calibrated = CalibratedVehicle("sha256:ab", VAN, (0.0, 0.0), (0.0, 0.0), cross_spectrum=calibration)
    return estimate(batch, calibrated, "cross_spectrum")


def weighed_as_known(batch: Batch, calibration: CrossSpectrumCalibration) -> Estimate:
    """The same of a load that is known to have the shape of the known loads."""
    blank = Estimate(batch.t_start_ns, batch.t_end_ns, "cross_spectrum")
    return by_cross_spectrum(batch, calibration, None, blank)
