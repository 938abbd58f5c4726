"""A recording goes onto the bus and comes back as it was, to half a step of the DBC."""

from pathlib import Path

import cantools.database
import numpy as np
import pytest

from gateway.bus.logs import write_candump
from gateway.bus.signals import Decoder, load_signal_map, shipped_map
from gateway.core.batch_settings import BatchSettings
from gateway.errors import ConfigurationError
from gateway.offline.campaigns import batches_of_motion, read_whole_log
from gateway.records import EXTENDED_ID, Motion, Signal
from gateway.sim.instruments import REFERENCE, Clock, Gps, Imu, Recording, Sensors
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


def test_cantools_reads_every_axis_as_it_was_recorded(recording: Recording) -> None:
    frames = Wiring("reference").frames_of(recording)
    database = cantools.database.load_file(shipped_map("reference").parent / "springscale_reference.dbc")
    gyro = [row for row in range(len(frames)) if frames.can_id[row] == 289][:50]
    decoded = [database.decode_message(289, frames.payload[row].tobytes()) for row in gyro]
    names = ("RollRate", "PitchRate", "YawRate")
    read = np.array([[message[name] for name in names] for message in decoded])
    assert read == pytest.approx(np.rad2deg(recording.gyro_radps[:50]), abs=0.00251)
    assert [message["GyroCounter"] for message in decoded] == list(range(50))


def test_frames_leave_in_order_of_time(recording: Recording) -> None:
    frames = Wiring("reference").frames_of(recording)
    assert np.all(np.diff(frames.t_ns) >= 0)
    assert not np.any(frames.t_ns % 1000)


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


def test_batches_from_the_log_are_those_from_the_arrays(tmp_path: Path) -> None:
    """What the estimators see differs by the rounding of the DBC and by nothing else."""
    drive = constant(14.0, 130.0, np.random.default_rng(1))
    recording = simulate_drive(PAPER_VAN, (Load(200.0, 2.0),), PaperRoad(), drive, REFERENCE, 3).recording
    signal_map = load_signal_map("springscale:reference")
    settings = BatchSettings(window_s=60.0)
    write_candump(Wiring("reference").frames_of(recording), "can0", tmp_path / "can.log")
    from_log = batches_of_motion(read_whole_log(tmp_path / "can.log", signal_map)[0], signal_map, settings)
    from_arrays = batches_of_motion(motion_of_arrays(recording), signal_map, settings)
    assert len(from_log) == len(from_arrays) == 3
    for read, direct in zip(from_log, from_arrays, strict=True):
        assert read.rejected == direct.rejected
        assert np.array_equal(read.usable, direct.usable)
        assert read.gravity_mps2 == pytest.approx(direct.gravity_mps2, abs=1e-4)
        known = read.usable
        for name, tolerance in (
            ("vertical_acceleration_mps2", 3e-3),
            ("pitch_rate_radps", 1e-4),
            ("roll_rate_radps", 1e-4),
            ("speed_mps", 2e-3),
        ):
            apart = np.abs(getattr(read, name)[known] - getattr(direct, name)[known])
            assert np.max(apart) < tolerance


def motion_of_arrays(recording: Recording) -> Motion:
    """Rows as the decoder would make them, of the recording's own numbers, stamped in microseconds as a log is."""
    signals = (Signal.VERTICAL_ACCELERATION, Signal.PITCH_RATE, Signal.ROLL_RATE, Signal.SPEED)
    fixed = recording.gps_fix
    parts = (
        (recording.imu_t_ns, recording.accel_mps2[:, 2]),
        (recording.imu_t_ns + 250_000, recording.gyro_radps[:, 1]),
        (recording.imu_t_ns + 250_000, recording.gyro_radps[:, 0]),
        (recording.gps_t_ns[fixed], recording.gps_speed_mps[fixed]),
    )
    columns = np.full((sum(len(t_ns) for t_ns, _ in parts), len(signals)), np.nan)
    begin = 0
    for column, (t_ns, samples) in enumerate(parts):
        columns[begin : begin + len(t_ns), column] = samples
        begin += len(t_ns)
    stamps = np.concatenate([t_ns for t_ns, _ in parts]) // 1000 * 1000
    order = np.argsort(stamps, kind="stable")
    return Motion(signals, stamps[order], columns[order])


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
