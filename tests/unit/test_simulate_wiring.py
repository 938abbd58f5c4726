"""A recording goes onto the bus and comes back as it was, to half a step of the DBC."""

import numpy as np
import pytest

from gateway.bus.signals import Decoder, load_signal_map
from gateway.errors import ConfigurationError
from gateway.records import EXTENDED_ID, Signal
from gateway.sim.instruments import Clock, Gps, Imu, Recording, Sensors
from gateway.sim.parameters import Load
from gateway.sim.road import PaperRoad
from gateway.sim.scenario import simulate_drive
from gateway.sim.speed_profile import Drive, constant
from gateway.sim.vans import PAPER_VAN
from gateway.workbench.wiring import WIRED_MAPS, Wiring, unrelated_traffic

SENSORS = Sensors(
    imu=Imu(corner_hz=40.0),
    gps=Gps(5.0, latency_s=0.2, noise_std_mps=0.05, dropouts_per_hour=200.0),
    clock=Clock(jitter_mean_s=1e-4, lost_share=0.01),
)


@pytest.fixture(scope="module")
def recording() -> Recording:
    drive = constant(14.0, 60.0, np.random.default_rng(1))
    return simulate_drive(PAPER_VAN, (Load(200.0, 2.0),), PaperRoad(), drive, SENSORS, 3).recording


@pytest.mark.parametrize("name", WIRED_MAPS)
def test_encoded_frames_decode_to_the_same_values(name: str, recording: Recording) -> None:
    signal_map = load_signal_map(f"springscale:{name}")
    motion = Decoder(signal_map).decode(Wiring(name).frames_of(recording))
    wanted = {
        Signal.VERTICAL_ACCELERATION: (recording.imu_t_ns, recording.accel_mps2[:, 2]),
        Signal.PITCH_RATE: (recording.imu_t_ns, recording.gyro_radps[:, 1]),
        Signal.ROLL_RATE: (recording.imu_t_ns, recording.gyro_radps[:, 0]),
        Signal.SPEED: (recording.gps_t_ns[recording.gps_fix], recording.gps_speed_mps[recording.gps_fix]),
    }
    assert 0.5 < np.mean(recording.gps_fix) < 1.0
    for signal, (t_ns, samples) in wanted.items():
        decoded_t_ns, decoded = motion.of(signal)
        assert len(decoded) == len(samples)
        assert np.max(np.abs(decoded - samples)) <= 0.5001 * signal_map.traits[signal].resolution
        assert np.all((decoded_t_ns - t_ns >= -1000) & (decoded_t_ns - t_ns < 1_000_000))


def test_unrelated_traffic_shares_no_identifier_with_the_sensors() -> None:
    frames = unrelated_traffic(0, 10.0, 60, np.random.default_rng(1))
    assert len(np.unique(frames.can_id)) == 60
    assert np.count_nonzero(np.unique(frames.can_id) & EXTENDED_ID) == 12
    assert np.all(np.diff(frames.t_ns) >= 0)
    for name in WIRED_MAPS:
        for id_filter in load_signal_map(f"springscale:{name}").filters:
            assert not id_filter.matches(frames.can_id).any()


def test_a_map_without_simulated_sensors_is_refused() -> None:
    with pytest.raises(ConfigurationError, match="choose reference, canmod_gps, j1939"):
        Wiring("xsens_mti")


@pytest.mark.parametrize("name", WIRED_MAPS)
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_bend_to_the_left_rolls_the_left_side_up(name: str, side: float) -> None:
    """The body leans outwards: its left side rises as a left bend begins, and that is a positive roll rate."""
    lateral_mps2 = side * np.interp(np.arange(401) * 0.01, [1.0, 1.8], [0.0, 2.0])
    bend = Drive(np.full(401, 14.0), lateral_mps2, 0.01)
    sensors = Sensors(imu=Imu(100.0), gps=Gps(5.0))
    recording = simulate_drive(PAPER_VAN, (), PaperRoad(sigma_m=1e-6), bend, sensors, 3).recording
    motion = Decoder(load_signal_map(f"springscale:{name}")).decode(Wiring(name).frames_of(recording))
    t_ns, roll_rate = motion.of(Signal.ROLL_RATE)
    begins = (t_ns - t_ns[0] > 1_000_000_000) & (t_ns - t_ns[0] < 1_800_000_000)
    assert side * np.mean(roll_rate[begins]) > 0.01
    assert np.abs(np.mean(motion.of(Signal.PITCH_RATE)[1][begins])) < 1e-3
