"""Sensors read what physics puts before them, with the errors and faults asked for and no others."""

import math

import numpy as np
import pytest
from support.textbook import linearised

from gateway.records import F64
from gateway.sim.instruments import Channel, Clock, Engine, Gps, Imu, Mount, Recording, Sensors
from gateway.sim.ride import Ride, ride
from gateway.sim.road import PaperRoad
from gateway.sim.sensing import Felt, crank_rpm, felt_at, record
from gateway.sim.speed_profile import Drive, constant
from gateway.sim.vans import PAPER_VAN
from gateway.units import STANDARD_GRAVITY_MPS2

DEG = math.pi / 180.0


@pytest.fixture(scope="module")
def driven() -> Ride:
    rng = np.random.default_rng(1)
    return ride(PAPER_VAN, (), PaperRoad().lay(500.0, rng), constant(14.0, 30.0, rng))


def resting(seconds: float, force: tuple[float, float, float] = (0.0, 0.0, 9.8), speed_mps: float = 0.0) -> Felt:
    n = round(seconds / 0.002) + 1
    return Felt(0.002, np.tile(force, (n, 1)), np.zeros((n, 3)), np.full(n, speed_mps))


def read(felt: Felt, sensors: Sensors, seed: int = 1, start_ns: int = 0) -> Recording:
    return record(felt, sensors, np.random.default_rng(seed), start_ns)


def at_rest(n: int) -> Ride:
    """The van on a flat road for so many steps."""
    flat = PaperRoad(sigma_m=0.0).lay(20.0, np.random.default_rng(1))
    return ride(linearised(PAPER_VAN), (), flat, Drive(np.zeros(n), np.zeros(n)))


def test_behind_the_centre_of_gravity_pitch_adds_to_heave(driven: Ride) -> None:
    """z_s = heave + (x_s - x_cg) pitch."""
    middle, behind = (felt_at(driven, PAPER_VAN, Mount(position_m=x)).force_mps2[:, 2] for x in (1.4, 3.2))
    assert middle - STANDARD_GRAVITY_MPS2 == pytest.approx(driven.acceleration[:, 0])
    assert behind - middle == pytest.approx(1.8 * driven.acceleration[:, 1])


def test_left_of_the_centre_line_roll_adds_to_heave(driven: Ride) -> None:
    middle, left = (felt_at(driven, PAPER_VAN, Mount(left_m=y)).force_mps2[:, 2] for y in (0.0, 0.4))
    assert left - middle == pytest.approx(0.4 * driven.acceleration[:, 2])


def test_rates_are_roll_pitch_yaw(driven: Ride) -> None:
    rate = felt_at(driven, PAPER_VAN, Mount()).rate_radps
    assert rate[:, 0] == pytest.approx(driven.rate[:, 2])
    assert rate[:, 1] == pytest.approx(driven.rate[:, 1])
    assert rate[:, 2] == pytest.approx(driven.lateral_mps2 / driven.speed_mps)


@pytest.mark.parametrize(
    ("turned", "expected"),
    [
        (Mount(pitch_deg=3.0), (-math.sin(3.0 * DEG), 0.0, math.cos(3.0 * DEG))),  # nose of the unit down
        (Mount(roll_deg=2.0), (0.0, math.sin(2.0 * DEG), math.cos(2.0 * DEG))),  # its left side up
        (Mount(yaw_deg=90.0), (0.0, 0.0, 1.0)),
    ],
)
def test_a_turned_unit_sees_gravity_askew(turned: Mount, expected: tuple[float, float, float]) -> None:
    still = at_rest(3)
    force = felt_at(still, PAPER_VAN, turned).force_mps2[0]
    assert force / STANDARD_GRAVITY_MPS2 == pytest.approx(expected, abs=1e-9)


def test_an_ideal_unit_only_samples(driven: Ride) -> None:
    felt = felt_at(driven, PAPER_VAN, Mount())
    recording = read(felt, Sensors(imu=Imu(rate_hz=100.0)), start_ns=5_000_000_000)
    assert np.diff(recording.imu_t_ns) == pytest.approx(10_000_000)
    assert recording.imu_t_ns[0] == 5_000_000_000
    assert recording.accel_mps2 == pytest.approx(felt.force_mps2[::5])
    assert recording.gyro_radps == pytest.approx(felt.rate_radps[::5])


def test_noise_bias_drift_and_scale_are_as_asked() -> None:
    felt = resting(2000.0, (0.0, 0.0, 10.0))
    noisy = read(felt, Sensors(imu=Imu(100.0, accel=Channel(noise_density=0.002)))).accel_mps2
    assert np.std(noisy, axis=0) == pytest.approx(0.002 * math.sqrt(50.0), rel=0.02)
    assert noisy[:, 0].mean() == pytest.approx(0.0, abs=2e-4)
    drifting = [read(felt, Sensors(imu=Imu(10.0, gyro=Channel(drift_std=0.1))), seed).gyro_radps for seed in range(40)]
    assert np.std([d[-1] for d in drifting]) == pytest.approx(0.1 * math.sqrt(2000.0 / 3600.0), rel=0.2)
    short = resting(0.1, (0.0, 0.0, 10.0))
    biased = [read(short, Sensors(imu=Imu(accel=Channel(bias_std=0.1))), seed).accel_mps2[0, 0] for seed in range(300)]
    scaled = [
        read(short, Sensors(imu=Imu(accel=Channel(scale_std=0.01))), seed).accel_mps2[0, 2] for seed in range(300)
    ]
    assert np.std(biased) == pytest.approx(0.1, rel=0.15)
    assert np.std(scaled) == pytest.approx(0.1, rel=0.15)
    assert np.mean(scaled) == pytest.approx(10.0, abs=0.03)


def test_readings_are_rounded_and_limited(driven: Ride) -> None:
    channel = Channel(resolution=0.125, limit=10.25)
    accel = read(felt_at(driven, PAPER_VAN, Mount()), Sensors(imu=Imu(accel=channel))).accel_mps2
    assert np.array_equal(accel, np.round(accel / 0.125) * 0.125)
    assert np.max(accel) == 10.25


@pytest.mark.parametrize("freq_hz", [2.0, 30.0, 80.0])
def test_the_low_pass_is_a_butterworth_of_second_order(freq_hz: float) -> None:
    t_s = np.arange(20_001) * 0.002
    wave = np.sqrt(2.0) * np.sin(2.0 * math.pi * freq_hz * t_s)
    felt = Felt(0.002, np.column_stack([wave] * 3), np.zeros((20_001, 3)), np.zeros(20_001))
    out = read(felt, Sensors(imu=Imu(rate_hz=500.0, corner_hz=30.0))).accel_mps2[2000:, 0]
    warped = math.tan(math.pi * freq_hz * 0.002) / math.tan(math.pi * 30.0 * 0.002)  # the bilinear transform's
    assert np.std(out) == pytest.approx(1.0 / math.sqrt(1.0 + warped**4), rel=0.01)


def test_the_satellites_speed_is_late_and_noisy() -> None:
    n = 30_001
    ramp = np.linspace(0.0, 30.0, n)  # 0.5 m/s per s
    felt = Felt(0.002, np.zeros((n, 3)), np.zeros((n, 3)), ramp)
    late = read(felt, Sensors(gps=Gps(5.0, latency_s=0.4)))
    seconds = late.gps_t_ns[5:] / 1e9
    assert late.gps_speed_mps[5:] == pytest.approx(0.5 * (seconds - 0.4))
    noisy = read(resting(2000.0, speed_mps=10.0), Sensors(gps=Gps(10.0, noise_std_mps=0.1)))
    assert np.std(noisy.gps_speed_mps) == pytest.approx(0.1, rel=0.05)


def test_drop_outs_read_zero_without_a_fix() -> None:
    gps = Gps(5.0, dropouts_per_hour=60.0, dropout_mean_s=6.0)
    recording = read(resting(3600.0, speed_mps=12.0), Sensors(gps=gps))
    assert np.array_equal(recording.gps_fix, recording.gps_speed_mps == 12.0)
    assert not recording.gps_speed_mps[~recording.gps_fix].any()
    assert np.mean(~recording.gps_fix) == pytest.approx(60 * 6.0 / 3600.0, rel=0.4)


def test_stamps_drift_jitter_and_lose_frames_as_asked() -> None:
    clock = Clock(error_ppm=1000.0, jitter_mean_s=5e-4, lost_share=0.02)
    recording = read(resting(1000.0), Sensors(clock=clock))
    assert len(recording.imu_t_ns) == pytest.approx(0.98 * 100_000 / 1.001, rel=0.003)
    assert np.all(np.diff(recording.imu_t_ns) >= 0)
    late_ns = recording.imu_t_ns - np.rint(recording.imu_t_ns / 10_010_000) * 10_010_000
    assert np.mean(late_ns) == pytest.approx(5e5, rel=0.05)
    assert len(recording.accel_mps2) == len(recording.gyro_radps) == len(recording.imu_t_ns)


def test_the_engine_shows_at_its_orders() -> None:
    engine = Engine(level_mps2=1.0, idle_rpm=900.0)
    accel = read(resting(60.0), Sensors(imu=Imu(rate_hz=500.0), engine=engine)).accel_mps2[:, 2]
    spectrum = np.abs(np.fft.rfft((accel - accel.mean()) * np.hanning(len(accel))))
    freq_hz = np.fft.rfftfreq(len(accel), 1.0 / 500.0)
    assert freq_hz[np.argmax(spectrum)] == pytest.approx(30.0, abs=0.05)  # second order of 15 turns a second
    heard = {order: np.max(spectrum[np.abs(freq_hz - 15.0 * order) < 0.1]) for order in (0.5, 1.0, 2.0, 3.0, 4.0)}
    assert heard[3.0] < 0.01 * min(heard[order] for order in (0.5, 1.0, 2.0, 4.0))


def test_gears_keep_the_crank_in_its_range() -> None:
    speed_mps: F64 = np.linspace(0.0, 35.0, 200)
    rpm = crank_rpm(speed_mps, Engine())
    assert rpm[0] == 850.0
    assert np.all(rpm[speed_mps < 30.0] <= 2600.0)
    assert np.count_nonzero(np.diff(rpm) < 0.0) == 4  # four times up
