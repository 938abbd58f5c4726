"""Bends tell the gyro's gain, to what they say themselves."""

from dataclasses import replace

import numpy as np
import pytest
from support.half_car_road import CAR, as_if_fitted

from gateway.bus.signals import Decoder, load_signal_map
from gateway.core.batch import BatchWindow, build_batch
from gateway.core.batch_settings import BatchSettings
from gateway.core.bends import Bends, gyro_gain_of, joined_gains
from gateway.model.sensors import gyro_gain_ratio, is_changed
from gateway.model.vehicle_model import VehicleModel
from gateway.records import Batch, Motion, Signal
from gateway.sim.instruments import REFERENCE
from gateway.sim.road import iso_road
from gateway.sim.scenario import simulate_drive
from gateway.sim.speed_profile import rural
from gateway.sim.vans import VANS
from gateway.units import NS_PER_S, STANDARD_GRAVITY_MPS2
from gateway.workbench.wiring import Wiring

RATE_HZ = 50.0
GYRO = (Signal.PITCH_RATE, Signal.ROLL_RATE, Signal.YAW_RATE)


def winding(
    seconds: float = 300.0, gain: float = 1.0, bend_mps2: float = 0.5, noise_mps2: float = 0.02, seed: int = 1
) -> Bends:
    """A road that winds, by its own equations: the body leans out of each bend by 4 degrees per g."""
    rng = np.random.default_rng(seed)
    t_s = np.arange(round(seconds * RATE_HZ)) / RATE_HZ
    speed = 14.0 + 2.0 * np.sin(0.05 * t_s)
    pushed = bend_mps2 * (np.sin(0.31 * t_s) + np.sin(0.17 * t_s + 1.0))
    leant = 0.07 / STANDARD_GRAVITY_MPS2 * pushed
    return Bends(
        pushed + STANDARD_GRAVITY_MPS2 * leant + noise_mps2 * rng.standard_normal(len(t_s)) + 0.1,
        gain * pushed / speed + 0.002,
        gain * np.gradient(leant, 1.0 / RATE_HZ) + 0.001,
        speed,
    )


def gain_of(bends: Bends) -> tuple[float, float] | None:
    return gyro_gain_of(bends, np.ones(len(bends.speed_mps), bool), RATE_HZ)


@pytest.mark.parametrize("gain", [0.95, 1.0, 1.03])
def test_a_winding_road_gives_the_gyros_gain(gain: float) -> None:
    found = gain_of(winding(gain=gain))
    told, std = found
    assert std < 0.01
    assert told == pytest.approx(gain, abs=3.0 * std)


def test_a_straight_road_gives_no_gain() -> None:
    assert gain_of(winding(bend_mps2=0.005)) is None


def test_unusable_samples_are_not_counted() -> None:
    bends = winding()
    spoiled = bends.yaw_rate_radps.copy()
    spoiled[3000:6000] *= 3.0
    usable = np.ones(len(spoiled), bool)
    usable[2990:6010] = False
    assert gyro_gain_of(replace(bends, yaw_rate_radps=spoiled), usable, RATE_HZ) == pytest.approx(
        gyro_gain_of(bends, usable, RATE_HZ)
    )
    assert gyro_gain_of(bends, usable & (np.arange(len(usable)) % 900 > 20), RATE_HZ) is None  # pieces below 20 s


def test_short_drives_and_silence_show_no_gain() -> None:
    assert gain_of(winding(seconds=50.0)) is None
    silent = winding()
    assert gain_of(replace(silent, roll_rate_radps=np.full_like(silent.speed_mps, np.nan))) is None


def test_several_batches_give_a_smaller_error() -> None:
    assert joined_gains([None, (1.02, 0.01), (1.00, 0.01)]) == (pytest.approx(1.01), pytest.approx(0.01 / 2.0**0.5))
    assert joined_gains([None]) is None


def test_bends_of_a_country_road_show_the_gyros_gain() -> None:
    """Through sensors, frames and map; a gyro whose three rates are 5 % too large is told as such."""
    van = next(iter(VANS.values()))
    driven = simulate_drive(van, (), iso_road("B"), rural(360.0, np.random.default_rng(4)), REFERENCE, 5)
    rows = Decoder(load_signal_map("springscale:reference")).decode(Wiring("reference").frames_of(driven.recording))
    healthy, changed = batch_of(rows), batch_of(amplified(rows, 1.05))
    assert changed.gyro_gain is not None
    assert healthy.gyro_gain[0] == pytest.approx(1.0, abs=0.015)
    told = gyro_gain_ratio(changed.gyro_gain, healthy.gyro_gain)
    assert told[0] == pytest.approx(1.05, abs=0.01)
    assert is_changed(changed, of_gain(healthy.gyro_gain))


def of_gain(gain: tuple[float, float] | None) -> VehicleModel:
    """A calibrated vehicle whose drives gave the gyro this gain."""
    return replace(as_if_fitted(CAR, np.ones(len(CAR))), gyro_gain=gain)


def amplified(rows: Motion, by: float) -> Motion:
    columns = rows.columns.copy()
    columns[:, [rows.signals.index(signal) for signal in GYRO]] *= by
    return replace(rows, columns=columns)


def batch_of(rows: Motion) -> Batch:
    t_ns = int(rows.t_ns[0])
    settings = BatchSettings(window_s=360.0)
    return build_batch(rows, BatchWindow(t_ns, t_ns + 360 * NS_PER_S, t_ns), settings, {})
