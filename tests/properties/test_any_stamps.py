"""Whatever stamps come, windows of any length: an answer or a reason, in bounded memory, and never an exception."""

import itertools
import tracemalloc

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.calibrated import ratio_index_calibration
from support.drives import SIGNALS, T0_NS, drive
from support.half_car_road import VAN, batch_over_road, taught_by

from gateway.bus.frames import LAST_SECOND
from gateway.calibration.stated_drive import known_drive
from gateway.core.batch import BatchWindow, build_batch
from gateway.core.batch_settings import BatchSettings
from gateway.core.scheduler import Scheduler
from gateway.estimates.as_json import estimate_to_json
from gateway.estimates.batch_estimate import Estimate
from gateway.records import I64, Batch, Motion, Why, json_line
from gateway.units import NS_PER_S
from gateway.weighing.calibrated import CalibratedVehicle
from gateway.weighing.estimator import ESTIMATORS, estimate
from gateway.weighing.flow import Flow, Identity

SETTINGS = BatchSettings(window_s=20.0, provisional_every_s=7.0)
MOST_BYTES = 64_000_000
LAST_NS = LAST_SECOND * NS_PER_S


@pytest.fixture(scope="module")
def calibrated() -> CalibratedVehicle:
    known = known_drive(1, "run 1", 0.0, 52.0, (batch_over_road(0.0, 52.0, seed=1),))
    return CalibratedVehicle(
        "sha256:ab",
        VAN,
        (0.0, 0.0),
        (0.0, 0.0),
        ratio_index=ratio_index_calibration(),
        cross_spectrum=taught_by([known]),
    )


@pytest.mark.parametrize("rate_hz", [50.0, 104.0, 200.0])
def test_a_window_of_any_length_is_answered(calibrated: CalibratedVehicle, rate_hz: float) -> None:
    """Between 0.16 and 0.25 s the low-pass was longer than the window, and the pipeline died of it."""
    rows = drive(22.0, None, rate_hz)
    lengths_ms = [*range(0, 2000, 5), *range(2000, 22_000, 500)]
    for length_ms in lengths_ms:
        window = BatchWindow(T0_NS, T0_NS + length_ms * 1_000_000, T0_NS)
        batch = build_batch(rows, window, BatchSettings(window_s=20.0), {})
        assert (Why.TOO_SHORT in batch.rejected) == (length_ms < 19_000)
        assert_answered(batch, calibrated)


def assert_answered(batch: Batch, calibrated: CalibratedVehicle) -> None:
    for name in ESTIMATORS:
        assert_whole(estimate(batch, calibrated, name))


def assert_whole(found: Estimate) -> None:
    assert found.counted == (not found.rejected)
    assert json_line(estimate_to_json(found))  # refuses a number that is none


FINE_NS = st.sampled_from([0, 1, 300, 2_000, 20_000, 10_000_000, 40_000_000])
COARSE_NS = st.sampled_from([9_000_000_000, 11_000_000_000, -(10**12)])  # nearly every row ends a window
JITTER = st.floats(0.0, 1.0)
STRETCHES = st.lists(
    st.tuples(FINE_NS, st.integers(1, 2500), JITTER) | st.tuples(COARSE_NS, st.integers(1, 60), JITTER),
    min_size=1,
    max_size=8,
)


def stamps_of(begin_ns: int, stretches: list[tuple[int, int, float]], seed: int) -> I64:
    """Stretches of so many rows, a step apart each, with so much of a step as jitter."""
    rng = np.random.default_rng(seed)
    steps = [step_ns + np.rint(jitter * abs(step_ns) * rng.standard_normal(n)) for step_ns, n, jitter in stretches]
    return begin_ns + np.clip(np.cumsum(np.concatenate(steps)).astype(np.int64), -begin_ns, LAST_NS - begin_ns)


@settings(max_examples=40, derandomize=True)
@given(
    begin_ns=st.sampled_from([0, T0_NS, LAST_NS - 10**11]),
    stretches=STRETCHES,
    seed=st.integers(0, 99),
    chunk=st.sampled_from([61, 400, 4000]),  # single rows: test_scheduler_chunks
)
def test_any_stamps_are_answered(
    calibrated: CalibratedVehicle, begin_ns: int, stretches: list[tuple[int, int, float]], seed: int, chunk: int
) -> None:
    t_ns = stamps_of(begin_ns, stretches, seed)
    rng = np.random.default_rng(seed)
    columns = rng.normal((9.81, 0.0, 15.0), (0.5, 0.02, 0.1), (len(t_ns), 3))
    motion = Motion(SIGNALS, t_ns, np.where(rng.random(columns.shape) < 0.3, np.nan, columns))
    for name in ESTIMATORS:
        flow = Flow(SETTINGS, {}, calibrated, name, Identity())
        edges = [*range(0, len(motion), chunk), len(motion)]
        for begin, end in itertools.pairwise(edges):
            for found in flow.feed(motion.part(begin, end)):
                assert_whole(found)
        for found in flow.flush():
            assert_whole(found)


def still(n: int, step_ns: int) -> Motion:
    rows = drive(60.0, None, 100.0)
    at = np.arange(n) % len(rows)
    return Motion(rows.signals, T0_NS + step_ns * np.arange(n), rows.columns[at])


@pytest.mark.parametrize("step_ns", [0, 2, 2_000])
@pytest.mark.parametrize("chunk", [101, 2000])
def test_frozen_stamps_end_the_window_with_a_reason(step_ns: int, chunk: int) -> None:
    """A window whose time never passes once held every row that came."""
    rows = still(200_000, step_ns)
    scheduler = Scheduler(BatchSettings(window_s=20.0), {})
    tracemalloc.start()
    batches = [b for a in range(0, len(rows), chunk) for b in scheduler.feed(rows.part(a, a + chunk))]
    _, peak_bytes = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert len(batches) == 3
    assert all(batch.rejected[:2] == (Why.TOO_SHORT, Why.TIME_STAMPS) for batch in batches)
    assert len({(batch.t_start_ns, batch.t_end_ns) for batch in batches}) == 3
    assert peak_bytes < MOST_BYTES


@pytest.mark.parametrize("step_ns", [1, 2_000, 20_000])
def test_a_window_of_stamps_close_together_costs_no_more_than_another(step_ns: int) -> None:
    window = BatchWindow(T0_NS, T0_NS + 300_000_000_000, T0_NS)
    rows = still(30_000, step_ns)
    tracemalloc.start()
    batch = build_batch(rows, window, BatchSettings(), {})
    _, peak_bytes = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert len(batch.usable) == 15_000
    assert batch.rejected
    assert peak_bytes < MOST_BYTES
