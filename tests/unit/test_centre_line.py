"""A sensor beside the centre line takes roll for heave; the roll rate takes it back out."""

from dataclasses import replace

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from support import half_car_road
from support.calibrated import ratio_index_calibration
from support.half_car_road import RATE_HZ

from gateway.bus.signals import Decoder, load_signal_map
from gateway.calibration.ratio_index.spectra_table import spectrum_table
from gateway.calibration.stated_drive import StatedDrive, known_drive
from gateway.core.batch_settings import BatchSettings
from gateway.core.ratio_index.index import RatioIndexCalibration, acceleration_spectrum, indexes_of, mean_spectrum
from gateway.offline.campaigns import batches_of_motion
from gateway.records import F64, Batch
from gateway.sim.instruments import Gps, Imu, Mount, Sensors
from gateway.sim.parameters import Load
from gateway.sim.road import iso_road
from gateway.sim.scenario import simulate_drive
from gateway.sim.speed_profile import constant
from gateway.sim.vans import PAPER_VAN
from gateway.workbench.wiring import Wiring

N, N_SEGMENT = 9_000, 1024
FREQ_HZ = np.fft.rfftfreq(N, 1.0 / RATE_HZ)


def moving(seed: int) -> tuple[F64, F64]:
    """White motion from 0.5 to 10 Hz and its derivative, exactly."""
    rng = np.random.default_rng(seed)
    inside = np.abs(FREQ_HZ - 5.25) < 4.75
    spectrum = (rng.standard_normal(len(FREQ_HZ)) + 1j * rng.standard_normal(len(FREQ_HZ))) * inside
    return np.fft.irfft(spectrum, N), np.fft.irfft(2j * np.pi * FREQ_HZ * spectrum, N)


def batch_of(acceleration: F64, roll_rate: F64 | None) -> Batch:
    batch = half_car_road.batch_of(acceleration, acceleration[::-1].copy(), speed_mps=15.0)
    return replace(batch, roll_rate_radps=roll_rate)


def calibration(roll_lever_m: float) -> RatioIndexCalibration:
    return replace(ratio_index_calibration(), n_segment=N_SEGMENT, roll_lever_m=roll_lever_m)


@settings(max_examples=10, derandomize=True)
@given(seed=st.integers(0, 2**31), lever_m=st.floats(-1.0, 1.0))
def test_without_a_roll_rate_or_without_a_lever_nothing_changes(seed: int, lever_m: float) -> None:
    rate, acceleration = moving(seed)
    plain = batch_of(acceleration, None)
    silent = batch_of(acceleration, np.full(N, np.nan))
    told = batch_of(acceleration, rate)
    as_it_was = mean_spectrum(acceleration, plain.usable, N_SEGMENT, RATE_HZ)
    for batch, lever in ((plain, lever_m), (silent, lever_m), (told, 0.0)):
        found = acceleration_spectrum(batch, N_SEGMENT, lever)
        np.testing.assert_array_equal(found[1], as_it_was[1])
        assert indexes_of(batch, calibration(lever)) == indexes_of(plain, calibration(0.0))


def test_segments_without_a_roll_rate_are_left_out_while_enough_are_left() -> None:
    rate, acceleration = moving(4)
    half = np.where(np.arange(N) < N // 2, rate, np.nan)
    moved = acceleration_spectrum(batch_of(0.4 * acceleration, half), N_SEGMENT, 0.4)
    seen = acceleration_spectrum(batch_of(0.4 * acceleration, None), N_SEGMENT, 0.4)
    few = acceleration_spectrum(
        batch_of(0.4 * acceleration, np.where(np.arange(N) < 3000, rate, np.nan)), N_SEGMENT, 0.4
    )
    assert np.sum(moved[1]) < 0.1 * np.sum(seen[1])
    np.testing.assert_array_equal(few[1], seen[1])


def runs(*roll_rates: F64 | None) -> list[StatedDrive]:
    batches = [batch_of(moving(10 + i)[0], roll_rate) for i, roll_rate in enumerate(roll_rates)]
    return [known_drive(i, f"run {i}", 90.0 * i, 50.0, (batch,)) for i, batch in enumerate(batches)]


def test_a_campaign_is_moved_as_a_whole_or_not_at_all() -> None:
    rate, _ = moving(5)
    assert spectrum_table(runs(rate, rate), 0.3).roll_lever_m == 0.3
    one_silent = spectrum_table(runs(rate, None), 0.3)
    assert one_silent.roll_lever_m == 0.0
    np.testing.assert_array_equal(one_silent.spectra[0], spectrum_table(runs(None, None), 0.3).spectra[0])


def test_a_sensor_far_left_gives_the_same_answer_as_one_in_the_middle() -> None:
    """Signs, units and times together, from a simulated van to the index: the load stands on the right."""
    drive = constant(14.0, 130.0, np.random.default_rng(1))
    signal_map = load_signal_map("springscale:reference")
    found = []
    for left_m in (0.0, 0.4):
        sensors = Sensors(mount=Mount(left_m=left_m), imu=Imu(100.0), gps=Gps(5.0))
        driven = simulate_drive(PAPER_VAN, (Load(300.0, 2.0, left_m=-0.3),), iso_road("B"), drive, sensors, 3)
        motion = Decoder(signal_map).decode(Wiring("reference").frames_of(driven.recording))
        found.append(batches_of_motion(motion, signal_map, BatchSettings(window_s=125.0))[0])
    middle, left = found
    wanted = acceleration_spectrum(middle, N_SEGMENT, 0.0)
    seen = acceleration_spectrum(left, N_SEGMENT, 0.0)
    moved = acceleration_spectrum(left, N_SEGMENT, 0.4)
    turned = acceleration_spectrum(replace(left, roll_rate_radps=-left.roll_rate_radps), N_SEGMENT, 0.4)
    shaken = (wanted[0] > 1.0) & (wanted[0] < 9.5)
    off = [np.mean(np.abs(one[1][shaken] / wanted[1][shaken] - 1.0)) for one in (moved, seen, turned)]
    assert off[0] < 0.03
    assert off[1] > 0.15
    assert off[2] > off[1]
