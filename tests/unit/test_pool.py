"""Stretches of one load are pooled until they make a batch; at a stop at which the load changed there are two."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from support.calibrated import calibration_file
from support.drives import drive, joined, later, without_rows

from gateway.core.batch_settings import BatchSettings
from gateway.core.pool import Part, spanned
from gateway.core.scheduler import Scheduler
from gateway.estimates.as_json import estimate_to_json
from gateway.estimates.batch_estimate import Estimate, Way
from gateway.estimates.posterior import Posterior, Source
from gateway.records import F64, Batch, Motion, Why
from gateway.units import NS_PER_S
from gateway.weighing import flow as flow_module
from gateway.weighing.flow import Flow, Identity

SETTINGS = BatchSettings(window_s=150.0)  # a batch has 90 s that are usable
CALIBRATED = calibration_file(payload_kg=12.0, front_share_pct=51.0).for_core()
OWN_KG = 10.0


@pytest.fixture(autouse=True)
def weighed(monkeypatch: pytest.MonkeyPatch) -> Callable[[float, float], None]:
    """The load is 100 kg until so many seconds into the drive, then so many; a mixture weighs what is between."""
    change: list[float] = [1e9, 100.0]

    def estimate(batch: Batch, calibrated: object, estimator: str) -> Estimate:
        blank = Estimate(batch.t_start_ns, batch.t_end_ns, estimator, rejected=batch.rejected)
        if batch.rejected or calibrated is None:
            return blank
        at_s = (batch.t_start_ns - batch.drive_start_ns) / NS_PER_S + np.arange(len(batch.usable)) / batch.rate_hz
        after = float(np.mean(at_s[batch.usable] > change[0]))
        kg = (1.0 - after) * 100.0 + after * change[1]
        own = np.diag([OWN_KG**2, 0.09])
        return blank.answered(Posterior(np.array([kg, 51.0]), own, {Source.DAY: np.diag([12.0, 0.4])}))

    monkeypatch.setattr(flow_module, "estimate", estimate)

    def set_change(at_s: float, kg: float) -> None:
        change[:] = [at_s, kg]

    return set_change


def driven_with_stops(*stops_s: tuple[float, float], speed_mps: float = 15.0) -> Callable[[F64], F64]:
    def speed(t_s: F64) -> F64:
        stands = np.zeros(len(t_s), bool)
        for begin_s, end_s in stops_s:
            stands |= (t_s >= begin_s) & (t_s < end_s)
        return np.where(stands, 0.0, speed_mps)

    return speed


def told(motion: Motion, settings: BatchSettings = SETTINGS) -> Iterator[Estimate]:
    flow = Flow(settings, {}, CALIBRATED, "cross_spectrum", Identity("van-17"))
    return iter([*flow.feed(motion), *flow.flush()])


def spans(found: Iterator[Estimate], motion: Motion) -> list[tuple[int, int, int | str]]:
    """Seconds from and to, and the payload, the reasons or that it is a remainder."""
    start_ns = int(motion.t_ns.min())
    return [
        (
            round((one.t_start_ns - start_ns) / NS_PER_S),
            round((one.t_end_ns - start_ns) / NS_PER_S),
            "rest" if one.is_remainder else round(one.payload.number) if one.counted else " ".join(one.rejected),
        )
        for one in found
    ]


def test_a_steady_drive_gives_its_batches_and_a_rest_that_is_neither_estimate_nor_refusal() -> None:
    motion = drive(460.0)
    assert spans(told(motion), motion) == [(0, 150, 100), (150, 300, 100), (300, 450, 100), (450, 460, "rest")]


def test_windows_with_too_little_driving_are_pooled_over_the_stops() -> None:
    motion = drive(420.0, driven_with_stops(*((t_s, t_s + 45.0) for t_s in (20.0, 100.0, 180.0, 260.0, 340.0))))
    assert spans(told(motion), motion) == [(0, 150, "rest"), (0, 300, 100), (300, 420, "rest")]


def test_short_drives_are_pooled_over_the_stops_between_them() -> None:
    hop = drive(80.0)
    motion = joined(hop, later(drive(80.0, seed=2), 140.0), later(drive(80.0, seed=3), 280.0))
    assert spans(told(motion), motion) == [(0, 80, "rest"), (0, 220, 100), (280, 360, "rest")]


def test_a_rest_too_short_to_be_weighed_is_not_mixed_with_the_load_after_a_long_stop() -> None:
    drives = [later(drive(80.0, seed=seed), at_s) for seed, at_s in ((2, 120.0), (3, 230.0))]
    motion = joined(drive(25.0), *drives)
    assert spans(told(motion), motion) == [(0, 25, "rest"), (120, 200, "rest"), (120, 310, 100)]
    waited = joined(drive(25.0), *(later(one, -55.0) for one in drives))  # the engine stopped for 40 s
    assert spans(told(waited), waited)[-1][0] == 0


def test_a_batch_of_the_next_drive_begins_with_that_drive() -> None:
    motion = joined(drive(100.0), later(drive(160.0, seed=2), 200.0))
    assert spans(told(motion), motion) == [(0, 100, "rest"), (200, 350, 100), (350, 360, "rest")]


def test_a_load_that_changed_at_a_stop_is_two_loads(weighed: Callable[[float, float], None]) -> None:
    weighed(80.0, 300.0)
    motion = drive(300.0, driven_with_stops((70.0, 90.0)))
    assert spans(told(motion), motion) == [(0, 80, 100), (80, 150, 300), (150, 300, 300)]


def test_a_load_of_which_too_little_was_driven_is_refused_for_it(weighed: Callable[[float, float], None]) -> None:
    weighed(50.0, 300.0)
    motion = drive(150.5, driven_with_stops((40.0, 60.0)))
    assert spans(told(motion), motion)[:2] == [(0, 50, "load_changed"), (50, 150, 300)]


def test_a_load_that_came_shortly_before_the_window_ended_waits(weighed: Callable[[float, float], None]) -> None:
    weighed(100.0, 300.0)
    motion = drive(300.0, driven_with_stops((90.0, 110.0)))
    assert spans(told(motion), motion) == [(0, 100, 100), (100, 150, "rest"), (100, 300, 300)]


def test_a_stop_in_traffic_does_not_separate_loads(weighed: Callable[[float, float], None]) -> None:
    weighed(80.0, 300.0)
    motion = drive(150.5, driven_with_stops((75.0, 84.0)))
    assert next(kg for *_, kg in spans(told(motion), motion)) not in (100, 300)


def test_a_load_that_stayed_is_weighed_as_if_there_were_no_border() -> None:
    motion = drive(150.5, driven_with_stops((70.0, 90.0)))
    (found, _) = told(motion)
    assert (round(found.payload.number), found.posterior.own[0, 0]) == (100, OWN_KG**2)


def test_crawling_alone_is_refused_as_too_slow() -> None:
    motion = drive(310.0, lambda t_s: np.full_like(t_s, 2.0))
    assert spans(told(motion), motion)[:2] == [(0, 150, "too_slow"), (150, 300, "too_slow")]


def test_half_an_hour_without_a_batch_is_refused_and_resets_the_pool() -> None:
    speed = driven_with_stops(*((t_s, t_s + 52.0) for t_s in np.arange(10.0, 3000.0, 60.0)))
    settings = replace(SETTINGS, usable_share_min=1.0, window_s=300.0)
    motion = drive(2110.0, speed)
    found = spans(told(motion, settings), motion)
    assert [span for span in found if span[2] != "rest"] == [(0, 1800, "too_slow")]


def test_a_break_of_an_hour_ends_the_pool() -> None:
    motion = joined(drive(80.0), later(drive(80.0, seed=2), 3700.0))
    assert {what for *_, what in spans(told(motion), motion)} == {"rest"}


def test_a_sensor_at_fault_is_refused_and_never_pooled() -> None:
    slow = driven_with_stops(*((t_s, t_s + 45.0) for t_s in (20.0, 100.0)))
    motion = without_rows(drive(150.5, slow), 0.0, 9.0)
    silent = without_rows(drive(300.5), 155.0, 164.0)
    assert spans(told(motion), motion)[0][2] == "rest"
    assert spans(told(silent), silent)[0][2] == 100
    columns = drive(150.5).columns.copy()
    columns[:, 0] = np.where(np.isfinite(columns[:, 0]), 9.81, np.nan)
    stuck = replace(drive(150.5), columns=columns)
    assert spans(told(stuck), stuck)[0][2] == str(Why.ACCELERATION_STUCK)


def test_batches_are_the_same_however_the_rows_are_chunked() -> None:
    motion = drive(420.0, driven_with_stops(*((t_s, t_s + 45.0) for t_s in (20.0, 100.0, 180.0, 260.0))))
    flow = Flow(SETTINGS, {}, CALIBRATED, "cross_spectrum", Identity("van-17", "WVWZZZ1JZXW000001"))
    cuts = [0, 100, 7_000, 31_000, len(motion)]
    chunked = [*(one for a, b in pairwise(cuts) for one in flow.feed(motion.part(a, b))), *flow.flush()]
    assert {(one.vehicle_id, one.vin) for one in chunked} == {("van-17", "WVWZZZ1JZXW000001")}
    batches = [estimate_to_json(replace(one, vin=None)) for one in chunked if not one.is_remainder]
    assert batches == [estimate_to_json(one) for one in told(motion) if not one.is_remainder]
    assert spans(iter(chunked), motion) == spans(told(motion), motion)


def test_missing_s_shrinks_with_every_usable_stretch() -> None:
    flow = Flow(SETTINGS, {}, CALIBRATED, "cross_spectrum", Identity("van-17"))
    assert flow.missing_s == pytest.approx(90.0)
    motion = drive(150.5, driven_with_stops((20.0, 60.0), (100.0, 150.0)))
    list(flow.feed(motion))
    assert flow.missing_s == pytest.approx(30.0, abs=2.0)


def test_pieces_of_a_window_hold_its_samples_and_no_segment_crosses_a_break() -> None:
    scheduler = Scheduler(SETTINGS, {})
    motion = drive(301.0)
    one, other = list(scheduler.feed(motion))
    parts = (Part(one, Way()), Part(other, Way()))
    whole = spanned(parts, one.t_start_ns, other.t_end_ns)
    assert len(whole.usable) == len(one.usable) + len(other.usable)
    assert not whole.usable[len(one.usable) - 1]
    assert whole.gravity_mps2 == pytest.approx((one.gravity_mps2 + other.gravity_mps2) / 2.0)
    piece = spanned(parts, one.t_start_ns + 50 * NS_PER_S, one.t_start_ns + 100 * NS_PER_S)
    assert len(piece.usable) == 50 * 50
    assert np.mean(piece.vertical_acceleration_mps2[piece.usable]) == pytest.approx(0.0, abs=1e-12)
    kept = spanned(parts, one.t_start_ns, one.t_end_ns)
    assert np.array_equal(kept.vertical_acceleration_mps2, one.vertical_acceleration_mps2, equal_nan=True)
