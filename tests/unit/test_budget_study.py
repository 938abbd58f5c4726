"""The study of the budget: what is drawn follows the estimator's own statements, and its figures and page are right."""

import json
from dataclasses import replace

import numpy as np
import pytest
from support.half_car_road import CAR, VAN, batch_over_road
from support.known_runs import LOADS, calibrated_on_loads, known_run

from benchmarks.accuracy.budget.alone import Shift, row_of
from benchmarks.accuracy.budget.nature import (
    Gains,
    amplified,
    as_stated,
    drawn_day,
    drawn_gains,
    drawn_log_s,
    exactly_known,
    load_of_shape,
    on_that_day,
)
from benchmarks.accuracy.budget.response import day_covariance, response_to
from benchmarks.accuracy.budget.study import budget_page
from benchmarks.accuracy.budget.together import Weighing, refusals_of, rows_of_weighings
from gateway.core.cargo import shape_prior
from gateway.core.cross_spectrum.drift import NATURE_STD, NATURE_TOGETHER_STD, kind_of
from gateway.core.cross_spectrum.estimator import Weighed, weigh
from gateway.core.cross_spectrum.sensor_change import GAIN_STD
from gateway.core.vehicle import front_share_pct
from gateway.records import Motion, Signal
from gateway.sim.vans import VANS

PAPER_VAN = VANS["paper_van"]


def test_days_scatter_as_nature_does() -> None:
    rng = np.random.default_rng(1)
    days = [drawn_day(rng) for _ in range(20_000)]
    for name in days[0]:
        std = np.hypot(NATURE_STD[name], NATURE_TOGETHER_STD[kind_of(name)])
        assert np.std([day[name] for day in days]) == pytest.approx(std, rel=0.03)
    front, rear = (np.array([day[f"tyre_{end}_npm"] for day in days]) for end in ("front", "rear"))
    assert np.cov(front, rear)[0, 1] == pytest.approx(NATURE_TOGETHER_STD["tyre"] ** 2, rel=0.05)
    assert not any(name.startswith("payload") for name in days[0])


def test_a_day_changes_springs_tyres_and_dampers_and_nothing_else() -> None:
    day = dict.fromkeys(drawn_day(np.random.default_rng(1)), 0.0) | {"tyre_rear_npm": np.log(1.1)}
    changed = on_that_day(PAPER_VAN, day)
    assert changed.rear.wheel.tyre_npm == pytest.approx(1.1 * PAPER_VAN.rear.wheel.tyre_npm)
    rear = replace(changed.rear, wheel=replace(changed.rear.wheel, tyre_npm=PAPER_VAN.rear.wheel.tyre_npm))
    assert replace(changed, rear=rear) == PAPER_VAN


def test_gains_scatter_as_the_data_sheets_say_and_act_on_gravity_too() -> None:
    rng = np.random.default_rng(2)
    drawn = [drawn_gains(rng) for _ in range(20_000)]
    assert np.std([one.acceleration - one.rate for one in drawn]) == pytest.approx(GAIN_STD, rel=0.03)
    rows = Motion(
        (Signal.VERTICAL_ACCELERATION, Signal.PITCH_RATE), np.arange(2), np.array([[9.81, np.nan], [np.nan, 0.1]])
    )
    louder = amplified(rows, Gains(np.log(1.01), np.log(1.02), 0.05))
    assert louder.columns[0, 0] == pytest.approx(9.81 * 1.01 + 0.05)
    assert louder.columns[1, 1] == pytest.approx(0.102)
    assert np.isnan(louder.columns[0, 1])


def test_shapes_are_drawn_from_the_prior_and_loads_have_them() -> None:
    prior = shape_prior(VAN, 0.07, 0.2)
    rng = np.random.default_rng(3)
    drawn = np.array([drawn_log_s(prior, rng) for _ in range(20_000)])
    assert (drawn.mean(), drawn.var()) == pytest.approx((prior.mean, prior.variance), rel=0.05)
    load = load_of_shape(PAPER_VAN, 200.0, 1.4, np.log(0.5))
    assert load.pitch_inertia_kgm2 / 200.0 == pytest.approx(0.5)
    assert load.height_m == PAPER_VAN.cog_height_m
    known = exactly_known(np.log(0.5))
    assert (known.mean, known.probability.sum()) == pytest.approx((np.log(0.5), 1.0))


def test_a_fitter_who_errs_places_known_loads_by_the_share_that_was_stated() -> None:
    """The places are measured: shares of laden runs move by the empty vehicle's part of the mass."""
    runs = [known_run(i, *load, seed=1) for i, load in enumerate(LOADS)]
    vehicle, stated = as_stated(VAN, runs, 0.7)
    assert vehicle.empty_front_share_pct == VAN.empty_front_share_pct + 0.7
    for run, (payload_kg, position_m) in zip(stated, LOADS, strict=True):
        assert run.front_share_pct == pytest.approx(front_share_pct(vehicle, payload_kg, position_m))


def test_the_response_foretells_what_another_day_does() -> None:
    """In the half-car's own world: tyres 3 % stiffer, and the same load weighed."""
    calibration = calibrated_on_loads(seed=1)
    day = {"tyre_front_npm": 0.03, "tyre_rear_npm": 0.03}
    front, rear = (replace(end, tyre_npm=end.tyre_npm * np.exp(0.03)) for end in (CAR.front, CAR.rear))
    usual, other = (
        weigh(batch_over_road(300.0, 46.0, seed=7, car=car), calibration, None)
        for car in (CAR, replace(CAR, front=front, rear=rear))
    )
    assert isinstance(usual, Weighed)
    assert isinstance(other, Weighed)
    found, predicted = other.posterior.mean - usual.posterior.mean, response_to(usual, calibration, day)
    assert found[0] == pytest.approx(predicted[0], abs=0.35 * abs(predicted[0]) + 1.0)
    stated = day_covariance(usual, calibration)
    assert np.all(np.linalg.eigvalsh(stated) > 0.0)
    assert predicted[0] ** 2 < 9.0 * stated[0, 0]


def test_slopes_and_squares_by_hand() -> None:
    shifts = [
        Shift("day", np.array([9.0, 0.3]), np.array([10.0, 0.2]), np.array([100.0, 0.0])),
        Shift("day", np.array([-11.0, 0.1]), np.array([-10.0, -0.2]), np.array([100.0, 0.0])),
    ]
    row = row_of("day", shifts)
    assert (row["payload_slope"], row["payload_z2"]) == pytest.approx((1.0, (0.81 + 1.21) / 2.0))
    assert (row["payload_stated_kg"], row["payload_found_kg"]) == pytest.approx((10.0, np.sqrt(101.0)))
    assert (row["front_share_slope"], row["front_share_z2"]) == (None, None)


def weighing(i: int, error: float, *, half_width: float = 2.0) -> Weighing:
    score = 2.0 * half_width + 40.0 * max(abs(error) - half_width, 0.0)
    return Weighing(
        "van", f"van {i}", True, False, (), {"payload": (error, half_width, score, error**2)}, {"misfit": half_width}
    )


def test_the_figures_of_all_at_once_by_hand() -> None:
    refused = Weighing("van", "van 9", True, False, ("gap",), {}, {})
    rows = rows_of_weighings([weighing(1, 1.0), weighing(2, -1.5), weighing(3, 2.5), refused])
    (row,) = [one for one in rows if one["n_batches"]]
    payload = row["payload"]
    assert (row["n_batches"], row["n_rejected"], row["rejected_by_reason"]) == (4, 1, {"gap": 1})
    assert payload["mean_abs"] == pytest.approx(5.0 / 3.0)
    assert payload["coverage"]["share"] == pytest.approx(2.0 / 3.0)
    assert payload["interval_score"] == pytest.approx((4.0 + 4.0 + 4.0 + 20.0) / 3.0)
    assert payload["z2"] == pytest.approx((1.0 + 2.25 + 6.25) / 3.0)
    assert payload["coverage_by_van"] is None
    assert row["cg_left"]["n"] == 0


def test_refusals_of_healthy_vans_are_counted_by_reason_and_by_van() -> None:
    def batch(van: str, *rejected: str, misfit: float) -> Weighing:
        return Weighing(van, f"{van} 1", True, False, rejected, {}, {"misfit": misfit})

    rows = [batch("a", misfit=0.2), batch("a", "too_slow", misfit=0.3), batch("b", "sensor_changed", misfit=0.4)]
    found = refusals_of(rows)
    assert found["rate"]["share"] == pytest.approx(1.0 / 3.0)  # a slow drive is no fault of the instrument
    assert found["rate"]["low"] < 1.0 / 3.0 < found["rate"]["high"]
    assert found["watched"] == {"misfit": pytest.approx({"p50": 0.3, "p99": 0.398, "most": 0.4})}
    assert refusals_of([])["rate"] is None


def test_the_page_says_what_is_right_and_what_is_not() -> None:
    good = row_of("day", [Shift("day", np.array([10.0, 0.1]), np.array([10.0, 0.1]), np.array([100.0, 0.01]))])
    steep = row_of("sensor", [Shift("sensor", np.array([20.0, 0.1]), np.array([10.0, 0.1]), np.array([100.0, 0.01]))])
    found = {
        "seed": 1,
        "n_vans": 3,
        "alone": [good, steep],
        "together": rows_of_weighings([weighing(i, 1.0) for i in range(5)]),
    }
    page = budget_page(json.loads(json.dumps(found, allow_nan=False)))
    assert "- sensor, payload: slope is 2.00, above 1.25." in page
    assert "- sensor, payload: z squared is 4.00, above 1.4." in page
    assert "- day" not in page
    assert "intervals hold 100 % of the truths" in page
    assert "| yes | nothing | payload, % | 5 | 0 | 1.00 | 100 %" in page
    assert "| yes | 5 | none | 2.00, 2.00, 2.00 | none |" in page
