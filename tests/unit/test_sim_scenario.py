"""The front door of the simulator: a moving start, load steps, and the truth of them."""

import numpy as np
import pytest

from gateway.sim.instruments import Sensors
from gateway.sim.parameters import Load
from gateway.sim.road import PaperRoad
from gateway.sim.scenario import START_NS, LoadStep, simulate_drive
from gateway.sim.speed_profile import Leg, constant, drive_of, standstill
from gateway.sim.vans import PAPER_VAN

IDEAL = Sensors()
STOP_AND_GO = drive_of([Leg(10.0, 20.0), Leg(0.0, 1.0)]).then(standstill(20.0)).then(drive_of([Leg(10.0, 20.0)]))
AT_REST_S = 45.0


def test_a_moving_start_has_no_transient() -> None:
    """The first second is as lively as the others, for the vehicle has been driving before."""
    accel = simulate_drive(PAPER_VAN, (), PaperRoad(), constant(14.0, 60.0, np.random.default_rng(2)), IDEAL, 3)
    vertical = accel.recording.accel_mps2[:, 2]
    assert 0.4 < np.std(vertical[:200]) / np.std(vertical) < 1.8


def test_the_truth_has_every_load_step() -> None:
    steps = [LoadStep(0.0, ()), LoadStep(AT_REST_S, (Load(280.0, 2.1, 0.2), Load(20.0, 0.7)))]
    driven = simulate_drive(PAPER_VAN, steps, PaperRoad(), STOP_AND_GO, IDEAL, 1)
    truth = driven.truth
    assert truth.t_ns.tolist() == [START_NS, START_NS + 45_000_000_000]
    assert truth.payload_kg.tolist() == [0.0, 300.0]
    moment = 1240.0 * 1.4 + 280.0 * 2.1 + 20.0 * 0.7
    assert truth.front_share_pct == pytest.approx([50.0, 100.0 * (1.0 - moment / (1540.0 * 2.8))])
    assert truth.axle_loads_kg.sum(axis=1) == pytest.approx([1400.0, 1700.0])
    assert len(driven.recording.imu_t_ns) == round(STOP_AND_GO.duration_s * 100) + 1
    assert np.all(np.diff(driven.recording.imu_t_ns) == 10_000_000)


@pytest.mark.parametrize(
    ("steps", "complaint"),
    [
        ([LoadStep(5.0, ())], "first load step must be at 0 s"),
        ([LoadStep(0.0, ()), LoadStep(15.0, ())], r"vehicle moves at 10\.0 m/s"),
        ([LoadStep(0.0, ()), LoadStep(AT_REST_S, ()), LoadStep(AT_REST_S, ())], "out of order"),
        ([LoadStep(0.0, ()), LoadStep(1e4, ())], "after the drive's end"),
    ],
)
def test_load_steps_that_cannot_be_are_refused(steps: list[LoadStep], complaint: str) -> None:
    with pytest.raises(ValueError, match=complaint):
        simulate_drive(PAPER_VAN, steps, PaperRoad(), STOP_AND_GO, IDEAL, 1)
