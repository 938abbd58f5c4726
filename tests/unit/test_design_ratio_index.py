"""Leverage of the ratio index: the regression's own spread now, less of it after every run."""

from dataclasses import replace

import numpy as np
import pytest
from support.half_car_road import VAN, batch_over_road
from support.known_runs import known_run

from gateway.calibration.half_car.fit import calibrate_cross_spectrum
from gateway.calibration.plan.index_design import IndexDesign
from gateway.calibration.plan.loads import PlacedLoad, empty, weighed_loads
from gateway.core.ratio_index.index import Band, RatioIndexCalibration, indexes_of
from gateway.core.ratio_index.regression import MODEL_9_PAYLOAD, RegressionModel, term_columns
from gateway.core.vehicle import front_share_pct
from gateway.records import F64

SPEED_MPS = 14.0


def placed(payload_kg: float, position_m: float) -> PlacedLoad:
    return PlacedLoad(payload_kg, position_m, front_share_pct(VAN, payload_kg, position_m))


DRIVEN = (empty(VAN), placed(200.0, 1.4), placed(300.0, 1.4))


def index_calibration(payload: RegressionModel | None) -> RatioIndexCalibration:
    return RatioIndexCalibration(
        spectrum="amplitude",
        n_segment=1024,
        acceleration_bands=(Band(1.5, 0.5), Band(3.25, 0.5)),
        pitch_rate_bands=(Band(1.75, 0.5), Band(3.0, 0.5)),
        payload=payload,
        front_share=None,
        speed_range_mps=(13.0, 15.0),
        speed_std_max_mps=1.0,
    )


@pytest.fixture(scope="module")
def theta() -> F64:
    runs = [known_run(1, 0.0, None, seed=1), known_run(2, 300.0, 1.4, seed=1)]
    return calibrate_cross_spectrum(runs, VAN).parameters


@pytest.fixture(scope="module")
def design(theta: F64) -> IndexDesign:
    """The regression (9) on two batches of each of DRIVEN, at the indexes expected there."""
    blank = IndexDesign(index_calibration(None), VAN, theta, SPEED_MPS, weighed_loads(VAN))
    ra, rg = np.array([blank.indexes(load) for load in DRIVEN for _ in range(2)]).T
    raw = term_columns(MODEL_9_PAYLOAD, ra, rg)
    lows, highs = raw.min(axis=0), raw.max(axis=0)
    columns = np.column_stack([np.ones(6), 2.0 * (raw - lows) / (highs - lows) - 1.0])
    inverse = np.linalg.inv(columns.T @ columns)
    model = RegressionModel(MODEL_9_PAYLOAD, lows, highs, np.array([150.0, 150.0]), inverse, 25.0, 2.0)
    return replace(blank, calibration=index_calibration(model))


def test_the_half_car_says_which_indexes_a_drive_will_show(theta: F64) -> None:
    calibration = index_calibration(None)
    design = IndexDesign(calibration, VAN, theta, SPEED_MPS, ())
    for load in (placed(120.0, 2.2), placed(400.0, 1.0)):
        batch = batch_over_road(load.payload_kg, load.front_share_pct, 5, duration_s=900.0)
        assert design.indexes(load) == pytest.approx(indexes_of(batch, calibration), rel=0.12)


def test_the_spread_now_is_what_the_regression_states(design: IndexDesign) -> None:
    target = placed(250.0, 2.0)
    model = design.calibration.payload
    assert model is not None
    _, std_kg, _ = model.predict(*design.indexes(target))
    found = replace(design, targets=(target,)).spread()
    assert found.payload_std_kg == pytest.approx(std_kg)
    assert found.front_share_std_pct is None


def test_each_run_helps_and_a_distant_load_more_than_one_amid_the_others(design: IndexDesign) -> None:
    now = design.spread().payload_std_kg
    amid, distant = (design.spread((load,)).payload_std_kg for load in (placed(180.0, 1.4), placed(450.0, 1.4)))
    both = design.spread((placed(180.0, 1.4), placed(450.0, 1.4))).payload_std_kg
    assert now is not None
    assert amid is not None
    assert distant is not None
    assert both is not None
    assert both < distant < amid < now
    assert both > 25.0  # the scatter of one batch stays


def test_no_bands_give_no_index(theta: F64) -> None:
    deaf = replace(index_calibration(None), pitch_rate_bands=None)
    ra, rg = IndexDesign(deaf, VAN, theta, SPEED_MPS, ()).indexes(placed(100.0, 1.0))
    assert np.isfinite(ra)
    assert np.isnan(rg)
