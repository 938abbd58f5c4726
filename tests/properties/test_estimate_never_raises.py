"""Whatever a batch holds, it ends as an estimate or with a reason: nothing that numbers can do ends the weighing."""

import json
import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support import model_road
from support.half_car_road import RATE_HZ, VAN, batch_of, batch_over_road, calibrated_on_known_loads, taught_by, weighed
from support.kept import kept
from support.model_road import LEFT, QUIET, theta_of

from gateway.calibration.stated_drive import known_drive
from gateway.core.batch_settings import BatchSettings
from gateway.core.change import Rules
from gateway.core.fusion import fused_epoch
from gateway.core.vehicle import Load
from gateway.estimates.as_json import estimate_to_json
from gateway.estimates.batch_estimate import Estimate
from gateway.model import fit, weigh
from gateway.model.vehicle_model import VehicleModel
from gateway.records import F64, Batch, Motion, Signal, Why
from gateway.weighing.calibrated import CalibratedVehicle
from gateway.weighing.estimator import estimate
from gateway.weighing.flow import Flow, Identity

GOOD = batch_over_road(200.0, 50.0, seed=3, duration_s=60.0)
LARGEST_FLOAT32 = 3.4e38  # what a signal of 32 bits can say


@pytest.fixture(scope="module")
def calibration() -> VehicleModel:
    return calibrated_on_known_loads()


@pytest.fixture(scope="module")
def credulous(calibration: VehicleModel) -> VehicleModel:
    """A weigher without gates: it weighs whatever moves to the end, however badly it fits."""
    return replace(calibration, acceleration_rms_mps2=1e-300, pitch_rate_rms_radps=1e-300, misfit_limit=math.inf)


@pytest.fixture(scope="module")
def rolling() -> VehicleModel:
    return taught_on_two_tracks()


def over_two_tracks(load: Load, seed: int) -> Batch:
    return model_road.batch_over_road(theta_of(with_roll=True, **QUIET, **LEFT), load, seed, duration_s=120.0)


@kept
def taught_on_two_tracks() -> VehicleModel:
    """A short drive with each of two loads."""
    loads = (Load(0.0, 52.0), Load(300.0, 46.0))
    runs = [known_drive(i, f"run {i}", *load, (over_two_tracks(load, 50 + i),)) for i, load in enumerate(loads)]
    return taught_by(runs, model_road.VAN)


def rolled(calibration: VehicleModel) -> Estimate:
    """The answer to a good batch with a roll rate."""
    calibrated = CalibratedVehicle("sha256:ab", model_road.VAN, (0.0, 300.0), (40.0, 60.0), cross_spectrum=calibration)
    return estimate(over_two_tracks(Load(200.0, 48.0), seed=7), calibrated, "cross_spectrum")


def stretches(n: int) -> st.SearchStrategy[list[slice]]:
    """A few runs of samples."""
    return st.lists(st.tuples(st.integers(0, n), st.integers(1, 400)), max_size=6).map(
        lambda runs: [slice(at, at + length) for at, length in runs]
    )


def put(x: F64, where: list[slice], number: float) -> F64:
    changed = x.copy()
    for one in where:
        changed[one] = number
    return changed


def ugly(x: F64) -> st.SearchStrategy[F64]:
    """Samples (n,) as nobody would wish for: constant, zero, enormous, tiny, in islands, periodic, a ramp, a spike."""
    n, t = len(x), np.arange(len(x))
    numbers = st.sampled_from([0.0, 1.0, -1.0, 9.81, 1e-300, 1e100, 1e300, np.nan, np.inf, -np.inf])
    return st.one_of(
        st.just(x),
        numbers.map(lambda c: np.full(n, c)),
        st.integers(-310, 307).map(lambda power: x * 10.0**power),
        st.tuples(stretches(n), numbers).map(lambda one: put(x, *one)),
        st.tuples(st.floats(0.01, 3.14), st.sampled_from([1.0, 1e5])).map(lambda one: one[1] * np.sin(one[0] * t)),
        st.sampled_from([1.0, 1e150]).map(lambda slope: slope * t),
        st.floats(1e-3, 10.0).map(lambda step: step * np.round(x / step)),
    )


@st.composite
def ugly_batches(draw: st.DrawFn) -> Batch:
    """Batches that no gate would let through; with a roll rate or without, some shorter than any segment."""
    n = draw(st.sampled_from([len(GOOD.speed_mps)] * 4 + [0, 1, 100, 700]))
    acceleration, pitch_rate = GOOD.vertical_acceleration_mps2[:n], GOOD.pitch_rate_radps[:n]
    sensed = draw(ugly(acceleration)), draw(st.one_of(ugly(pitch_rate), st.just(0.3 * acceleration)))
    constant = st.sampled_from([0.0, 1e-300, 1e-3, 14.0, 1e3, 1e300, -14.0]).map(lambda v: np.full(n, v))
    batch = batch_of(*sensed, speed_mps=draw(st.one_of(constant, ugly(GOOD.speed_mps[:n]))))
    usable = put(np.ones(n), draw(st.one_of(st.just([]), stretches(n))), 0.0) > 0.0
    gravity_mps2 = draw(st.sampled_from([9.81, 0.0, -9.81, np.nan, 1e300]))
    rolling = draw(st.sampled_from([None, pitch_rate, np.zeros(n)]))
    return replace(batch, usable=usable, gravity_mps2=gravity_mps2, roll_rate_radps=rolling)


def is_told(found: Estimate) -> bool:
    """Either finite numbers that can be fused with others, or a reason; and JSON whatever they are."""
    json.dumps(estimate_to_json(found), allow_nan=False)
    if found.rejected:
        return found.posterior is None and math.isnan(found.payload.number)
    assert fused_epoch(None, found, Rules()) is not None
    ends = (*found.payload.interval95, *found.front_share.interval95)
    return all(map(math.isfinite, ends)) and ends[0] < found.payload.number < ends[1]


@settings(max_examples=60)
@given(batch=ugly_batches(), has_gates=st.booleans())
def test_an_ugly_batch_is_weighed_or_refused(
    calibration: VehicleModel, credulous: VehicleModel, batch: Batch, has_gates: bool
) -> None:
    assert is_told(weighed(batch, calibration if has_gates else credulous))


@st.composite
def ugly_rows(draw: st.DrawFn) -> Motion:
    """A minute of frames as sensors gone mad send them, within what a signal of 32 bits can say."""
    columns = (GOOD.vertical_acceleration_mps2 + 9.81, GOOD.pitch_rate_radps, GOOD.speed_mps)
    signals = (Signal.VERTICAL_ACCELERATION, Signal.PITCH_RATE, Signal.SPEED)
    sent = [np.clip(draw(ugly(one)), -LARGEST_FLOAT32, LARGEST_FLOAT32) for one in columns]
    t_ns = np.arange(len(GOOD.speed_mps)) * round(1e9 / RATE_HZ)
    return Motion(signals, t_ns, np.column_stack(sent))


@settings(max_examples=25)
@given(rows=ugly_rows())
def test_ugly_frames_are_weighed_or_refused(calibration: VehicleModel, rows: Motion) -> None:
    calibrated = CalibratedVehicle("sha256:ab", VAN, (0.0, 0.0), (0.0, 0.0), cross_spectrum=calibration)
    flow = Flow(BatchSettings(window_s=60.0), {}, calibrated, "cross_spectrum", Identity())
    assert all(is_told(found) for found in (*flow.feed(rows), *flow.flush()))


def test_a_batch_at_no_speed_is_refused(calibration: VehicleModel) -> None:
    """The time from axle to axle is infinite, and the search meets numbers that are none."""
    found = weighed(replace(GOOD, speed_mps=np.zeros_like(GOOD.speed_mps)), calibration)
    assert found.rejected == (Why.NO_SOLUTION,)


def singular(*_: object) -> F64:
    raise np.linalg.LinAlgError("Singular matrix")


def indefinite(matrix: F64) -> F64:
    """An inverse that rounding has turned over."""
    return -np.eye(len(matrix))


@pytest.mark.parametrize(
    ("room", "routine", "fails"),
    [
        (np.linalg, "inv", singular),
        (np.linalg, "solve", singular),
        (np.linalg, "eigh", singular),
        (np.linalg, "inv", indefinite),
    ],
    ids=["inv", "solve", "eigh", "an indefinite inverse"],
)
def test_a_routine_that_fails_refuses_the_batch(
    calibration: VehicleModel, monkeypatch: pytest.MonkeyPatch, room: object, routine: str, fails: Callable[..., object]
) -> None:
    assert weighed(GOOD, calibration).counted
    monkeypatch.setattr(room, routine, fails)
    found = weighed(GOOD, calibration)
    assert found.rejected
    assert is_told(found)
    if fails is not indefinite:
        assert found.rejected == (Why.NO_SOLUTION,)


def test_a_search_that_runs_out_of_steps_refuses_the_batch(
    credulous: VehicleModel, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(fit, "MOST_STEPS", 1)
    assert weighed(GOOD, credulous).rejected == (Why.NO_SOLUTION,)


def test_a_lag_without_a_fixed_point_refuses_the_batch(rolling: VehicleModel, monkeypatch: pytest.MonkeyPatch) -> None:
    assert rolled(rolling).counted
    monkeypatch.setattr(weigh, "MOST_LAG_LEFT_S", -1.0)  # no change is small enough
    assert rolled(rolling).rejected == (Why.NO_SOLUTION,)


def test_an_answer_with_one_nan_is_refused(rolling: VehicleModel) -> None:
    """Payload and share are sound, the error of the lateral place is not: weights of wheels would be none."""
    assert rolled(replace(rolling, model_std=(*rolling.model_std[:2], math.nan))).rejected == (Why.NO_SOLUTION,)
