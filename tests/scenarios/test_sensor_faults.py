"""Every way a sensor can fail, over the bus and through the gates: (fault, the reason that a person reads)."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any, cast

import numpy as np
import pytest

from gateway.bus.signals import Decoder, load_signal_map
from gateway.core.batch_settings import BatchSettings
from gateway.estimates.batch_estimate import Estimate
from gateway.offline.campaigns import batches_of_motion
from gateway.records import F64, Bool, Frames, Why
from gateway.service.pipeline import Pipeline
from gateway.sim.instruments import REFERENCE, Recording
from gateway.sim.parameters import Load
from gateway.sim.road import iso_road
from gateway.sim.scenario import START_NS, simulate_drive
from gateway.sim.speed_profile import constant
from gateway.sim.vans import PAPER_VAN
from gateway.weighing.flow import Flow, Identity
from gateway.workbench.wiring import Wiring

WINDOW_S = 120.0
RATTLE = 300.0  # a unit on a loose bracket shakes this much harder than the body
IMU, GPS = ("imu_t_ns", "accel_mps2", "gyro_radps"), ("gps_t_ns", "gps_speed_mps", "gps_fix")
Spoil = Callable[[Recording, Bool, Bool], dict[str, Any]]


def held(samples: F64, is_faulty: Bool) -> F64:
    """The last sound sample again and again (the first one if none was sound)."""
    last = samples[max(int(np.argmax(is_faulty)) - 1, 0)]
    return np.where(is_faulty.reshape(-1, *[1] * (samples.ndim - 1)), last, samples)


def rattling(samples: F64, is_faulty: Bool, limit: float) -> F64:
    """Motion about its mean enlarged until it runs into the ends of the range."""
    middle = samples.mean(axis=0)
    return np.where(is_faulty[:, None], np.clip(middle + RATTLE * (samples - middle), -limit, limit), samples)


def turned(samples: F64, is_faulty: Bool, *signs: int) -> F64:
    return samples * np.where(is_faulty[:, None], signs, 1)


def edgewise(samples: F64, is_faulty: Bool) -> F64:
    return np.where(is_faulty[:, None], samples[:, ::-1], samples)


# the fault of a recording, given which samples of IMU and GPS are faulty, and the reason that a person reads
FAULTS: dict[str, tuple[Spoil, tuple[Why, ...]]] = {
    "accelerometer stuck": (lambda r, imu, _: {"accel_mps2": held(r.accel_mps2, imu)}, (Why.ACCELERATION_STUCK,)),
    "gyro stuck": (lambda r, imu, _: {"gyro_radps": held(r.gyro_radps, imu)}, (Why.PITCH_RATE_STUCK,)),
    "accelerometer saturated": (
        lambda r, imu, _: {"accel_mps2": rattling(r.accel_mps2, imu, 50.0)},
        (Why.ACCELERATION_SATURATED,),
    ),
    "gyro saturated": (lambda r, imu, _: {"gyro_radps": rattling(r.gyro_radps, imu, 5.0)}, (Why.PITCH_RATE_SATURATED,)),
    "IMU unplugged": (lambda r, imu, _: {name: getattr(r, name)[~imu] for name in IMU}, (Why.GAP,)),
    "GPS unplugged": (lambda r, _, gps: {name: getattr(r, name)[~gps] for name in GPS}, (Why.SPEED_MISSING,)),
    "GPS without a fix": (
        lambda r, _, gps: {"gps_speed_mps": np.where(gps, 0.0, r.gps_speed_mps), "gps_fix": r.gps_fix & ~gps},
        (Why.SPEED_MISSING,),
    ),
    "GPS frozen": (lambda r, _, gps: {"gps_speed_mps": held(r.gps_speed_mps, gps)}, (Why.SPEED_FROZEN,)),
    "unit on its edge, x and z exchanged": (
        lambda r, imu, _: {name: edgewise(getattr(r, name), imu) for name in IMU[1:]},
        (Why.GRAVITY_MISSING,),
    ),
    "acceleration turned over": (
        lambda r, imu, _: {"accel_mps2": turned(r.accel_mps2, imu, 1, 1, -1)},
        (Why.GRAVITY_MISSING,),
    ),
    # a rate has no gravity to tell its sign: calibration must notice
    "pitch rate turned over": (lambda r, imu, _: {"gyro_radps": turned(r.gyro_radps, imu, 1, -1, 1)}, ()),
}


def with_fault(recording: Recording, fault: str, from_s: float) -> Recording:
    """The recording as it would have been had the fault begun at this time."""
    from_ns = START_NS + round(from_s * 1e9)
    spoil, _ = FAULTS[fault]
    return replace(recording, **spoil(recording, recording.imu_t_ns >= from_ns, recording.gps_t_ns >= from_ns))


@pytest.fixture(scope="module")
def recording() -> Recording:
    drive = constant(14.0, WINDOW_S, np.random.default_rng(1))
    return simulate_drive(PAPER_VAN, (Load(200.0, 2.0),), iso_road("B"), drive, REFERENCE, 3).recording


def reasons(recording: Recording) -> list[tuple[Why, ...]]:
    signal_map = load_signal_map("springscale:reference")
    motion = Decoder(signal_map).decode(Wiring("reference").frames_of(recording))
    return [batch.rejected for batch in batches_of_motion(motion, signal_map, BatchSettings(window_s=WINDOW_S))]


def test_sound_sensors_pass(recording: Recording) -> None:
    assert reasons(recording) == [()]


@pytest.mark.parametrize("from_s", [0.0, 30.0])
@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_is_named(fault: str, from_s: float, recording: Recording) -> None:
    assert reasons(with_fault(recording, fault, from_s)) == [FAULTS[fault][1]]


@pytest.mark.parametrize("fault", ["accelerometer stuck", "gyro stuck", "GPS frozen", "IMU unplugged"])
def test_a_fault_at_the_very_end_costs_nothing(fault: str, recording: Recording) -> None:
    assert reasons(with_fault(recording, fault, 117.0)) == [()]


class Shelf:
    """Stands for inbox, store and board: hands frames out once, and takes what comes."""

    def __init__(self, frames: Frames) -> None:
        self._frames = [frames]
        self.told: list[Estimate] = []

    def drain(self, timeout_s: float) -> Frames | None:
        return self._frames.pop() if self._frames else None

    def write_window(self, found: Estimate) -> None:
        pass

    def publish(self, found: Estimate) -> None:
        self.told.append(found)


@pytest.mark.parametrize(("from_s", "share"), [(0.0, 0.0), (30.0, 0.25), (117.0, 1.0)])
def test_a_stuck_roll_rate_is_reported_without_refusals(from_s: float, share: float, recording: Recording) -> None:
    stuck = recording.gyro_radps.copy()
    stuck[recording.imu_t_ns >= START_NS + from_s * 1e9, 0] = 0.0
    signal_map = load_signal_map("springscale:reference")
    shelf = Shelf(Wiring("reference").frames_of(replace(recording, gyro_radps=stuck)))
    flow = Flow(BatchSettings(window_s=WINDOW_S), signal_map.traits, None, "cross_spectrum", Identity())
    pipeline = Pipeline(cast(Any, shelf), Decoder(signal_map), flow, cast(Any, shelf), cast(Any, shelf))
    pipeline.start()
    pipeline.stop()
    assert pipeline.failure is None
    assert [found.rejected for found in shelf.told] == [(Why.NO_CALIBRATION,)]
    assert shelf.told[0].roll_usable_share == pytest.approx(share, abs=0.02)
    assert (pipeline.roll_rate_fault is None) == (share == 1.0)
    if pipeline.roll_rate_fault is not None:
        assert f"known in only {100.0 * shelf.told[0].roll_usable_share:.0f}% of the last batch" in (
            pipeline.roll_rate_fault
        )
