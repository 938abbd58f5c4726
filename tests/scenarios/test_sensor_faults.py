"""Every way a sensor can fail, over the bus and through the gates: (fault, the reason a person is told)."""

from dataclasses import replace
from typing import Any, cast

import numpy as np
import pytest
from support.sensor_faults import Fault, with_fault

from gateway.bus.signals import Decoder, load_signal_map
from gateway.core.flow import Flow, Identity
from gateway.core.settings import BatchSettings
from gateway.estimate import Estimate
from gateway.offline.campaigns import batches_of_motion
from gateway.records import Frames, Why
from gateway.service.pipeline import Pipeline
from gateway.sim.drive import constant
from gateway.sim.road import iso_road
from gateway.sim.scenario import START_NS, simulate_drive
from gateway.sim.sensors import REFERENCE, Recording
from gateway.sim.vans import PAPER_VAN
from gateway.sim.vehicle import Load
from gateway.workbench.wiring import Wiring

EXPECTED = {
    Fault.ACCELEROMETER_STUCK: Why.ACCELERATION_STUCK,
    Fault.GYRO_STUCK: Why.PITCH_RATE_STUCK,
    Fault.ACCELEROMETER_SATURATED: Why.ACCELERATION_SATURATED,
    Fault.GYRO_SATURATED: Why.PITCH_RATE_SATURATED,
    Fault.IMU_UNPLUGGED: Why.GAP,
    Fault.GPS_UNPLUGGED: Why.SPEED_MISSING,
    Fault.GPS_NO_FIX: Why.SPEED_MISSING,
    Fault.GPS_FROZEN: Why.SPEED_FROZEN,
    Fault.AXES_SWAPPED: Why.GRAVITY_MISSING,
    Fault.ACCELERATION_SIGN_FLIPPED: Why.GRAVITY_MISSING,
}
BEYOND_THE_GATES = {Fault.PITCH_SIGN_FLIPPED}  # a rate has no gravity to tell its sign: calibration must notice
WINDOW_S = 120.0


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


def test_every_fault_has_its_expectation() -> None:
    assert set(EXPECTED) | BEYOND_THE_GATES == set(Fault)


@pytest.mark.parametrize("from_s", [0, 30])
@pytest.mark.parametrize("fault", EXPECTED)
def test_a_fault_is_named(fault: Fault, from_s: int, recording: Recording) -> None:
    broken = with_fault(recording, fault, START_NS + from_s * 1_000_000_000)
    assert reasons(broken) == [(EXPECTED[fault],)]


@pytest.mark.parametrize("fault", [Fault.ACCELEROMETER_STUCK, Fault.GYRO_STUCK, Fault.GPS_FROZEN, Fault.IMU_UNPLUGGED])
def test_a_fault_at_the_very_end_costs_nothing(fault: Fault, recording: Recording) -> None:
    broken = with_fault(recording, fault, START_NS + 117_000_000_000)
    assert reasons(broken) == [()]


class Shelf:
    """Stands for inbox, store and board: hands frames out once, and takes what comes."""

    def __init__(self, frames: Frames) -> None:
        self._frames = [frames]
        self.told: list[Estimate] = []

    def drain(self, timeout_s: float) -> Frames | None:
        return self._frames.pop() if self._frames else None

    def write_estimate(self, record: dict[str, Any]) -> int:
        return 1

    def publish(self, found: Estimate) -> None:
        self.told.append(found)


@pytest.mark.parametrize(("from_s", "share"), [(0.0, 0.0), (30.0, 0.25), (117.0, 1.0)])
def test_a_stuck_roll_rate_refuses_nothing_and_is_told(from_s: float, share: float, recording: Recording) -> None:
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
