"""An unsprung mass that nobody states is the one that calibration found, and its error joins those of the weights."""

import math
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from gateway.calibration.file.calibration_file import load_calibration
from gateway.core.cross_spectrum.model.parameters import INDEX
from gateway.core.vehicle import Vehicle
from gateway.core.weights.on_the_road import NOT_CALIBRATED, Unsprung, weighed, weights_of
from gateway.estimate import Estimate, Lack, Quantity, Weights
from gateway.estimate_json import estimate_from_json, estimate_to_json
from gateway.posterior import Posterior, exactly

PAPER_VAN = Path(__file__).parents[2] / "gateway" / "demo" / "paper_van.json"
UNSTATED = Vehicle(
    name="van",
    empty_mass_kg=1240.0,
    wheelbase_m=2.8,
    sensor_position_m=0.0,
    empty_front_share_pct=52.0,
    track_width_m=1.5,
)
STATED = replace(UNSTATED, unsprung_front_kg=90.0, unsprung_rear_kg=110.0)
KERB = replace(UNSTATED, kerb_front_axle_kg=740.0, kerb_rear_axle_kg=700.0)
FOUND = Unsprung(Quantity(75.0, 5.0), Quantity(85.0, 6.0), 0.8)
ROLL_SHARE = Quantity(0.58, 0.05)
STDS = np.array([8.0, 0.4, 0.004])
CORRELATIONS = np.array([[1.0, -0.6, 0.3], [-0.6, 1.0, -0.4], [0.3, -0.4, 1.0]])
AXLES = ("front_axle", "rear_axle")
WHEELS = ("front_left", "front_right", "rear_left", "rear_right")

payloads = st.floats(0.0, 800.0)
shares = st.floats(20.0, 80.0)
masses = st.floats(20.0, 400.0)
deviations = st.floats(0.1, 60.0)
correlations = st.floats(-1.0, 1.0)
found_masses = st.builds(
    Unsprung, st.builds(Quantity, masses, deviations), st.builds(Quantity, masses, deviations), correlations
)


def of(vehicle: Vehicle, unsprung: Unsprung, payload_kg: float = 270.0, share_pct: float = 48.0) -> Weights:
    posterior = Posterior(np.array([payload_kg, share_pct, 0.08]), CORRELATIONS * np.outer(STDS, STDS))
    return weights_of(vehicle, posterior, ROLL_SHARE, unsprung)


def kilograms(weights: Weights) -> list[float]:
    return [weight.kg for _, weight in weights.items()]


@given(found_masses, payloads, shares, st.sampled_from([STATED, KERB]))
def test_what_is_stated_or_weighed_is_taken_whatever_was_found(
    found: Unsprung, payload_kg: float, share_pct: float, vehicle: Vehicle
) -> None:
    weights = of(vehicle, found, payload_kg, share_pct)
    assert weights == of(vehicle, NOT_CALIBRATED, payload_kg, share_pct)
    assert not any(weight.is_unsprung_estimated for _, weight in weights.items())


@given(found_masses, payloads, shares)
@example(Unsprung(Quantity(20.0, 1.0), Quantity(20.0, 1.0), -1.0), 0.0, 20.0)  # the errors cancel in their sum
def test_what_was_found_weighs_as_if_it_were_stated(found: Unsprung, payload_kg: float, share_pct: float) -> None:
    stated = replace(UNSTATED, unsprung_front_kg=found.front.number, unsprung_rear_kg=found.rear.number)
    told, as_stated = of(UNSTATED, found, payload_kg, share_pct), of(stated, NOT_CALIBRATED, payload_kg, share_pct)
    assert kilograms(told) == kilograms(as_stated)
    assert all(weight.is_unsprung_estimated for _, weight in told.items())


@given(found_masses, payloads, shares)
def test_its_error_joins_the_others(found: Unsprung, payload_kg: float, share_pct: float) -> None:
    stated = replace(UNSTATED, unsprung_front_kg=found.front.number, unsprung_rear_kg=found.rear.number)
    told, exact = of(UNSTATED, found, payload_kg, share_pct), of(stated, NOT_CALIBRATED, payload_kg, share_pct)
    own = {"front_axle": found.front.std, "rear_axle": found.rear.std}
    own |= {wheel: 0.5 * own["front_axle" if wheel.startswith("front") else "rear_axle"] for wheel in WHEELS}
    for place, std_kg in own.items():
        assert getattr(told, place).std_kg == pytest.approx(math.hypot(getattr(exact, place).std_kg, std_kg))
    assert told.gross.std_kg == pytest.approx(math.hypot(exact.gross.std_kg, found.both.std))


@pytest.mark.parametrize("correlation", [-1.0, -0.3, 0.0, 0.8, 1.0])
def test_the_sum_is_the_surer_the_more_the_errors_oppose(correlation: float) -> None:
    both = replace(FOUND, correlation=correlation).both
    assert both.number == 160.0
    assert both.std == pytest.approx(math.sqrt(25.0 + 36.0 + 60.0 * correlation))


def test_one_axle_may_be_stated_and_the_other_found() -> None:
    weights = of(replace(UNSTATED, unsprung_front_kg=90.0), FOUND)
    assert [getattr(weights, place).is_unsprung_estimated for place in ("gross", *AXLES)] == [True, False, True]
    assert weights.front_axle == of(STATED, NOT_CALIBRATED).front_axle
    assert weights.gross.std_kg == pytest.approx(math.hypot(8.0, 6.0))


def test_what_was_neither_stated_nor_found_is_unknown() -> None:
    weights = of(UNSTATED, NOT_CALIBRATED)
    assert {weight.lacks for _, weight in weights.items()} == {Lack.UNSPRUNG_MASS}
    assert not any(weight.is_unsprung_estimated for _, weight in weights.items())


def test_an_unknown_wheel_has_nothing_estimated_in_it() -> None:
    wheel = weights_of(UNSTATED, exactly(270.0, 48.0), unsprung=FOUND).front_left
    assert (wheel.lacks, wheel.is_unsprung_estimated) == (Lack.ROLL_RATE, False)


def test_a_calibration_tells_masses_as_sure_as_their_logarithms() -> None:
    calibrated = load_calibration(PAPER_VAN).for_core()
    entries = [INDEX["unsprung_front_kg"], INDEX["unsprung_rear_kg"]]
    parameters, covariance = calibrated.cross_spectrum.parameters.copy(), calibrated.cross_spectrum.covariance.copy()
    parameters[entries] = np.log([75.0, 85.0])
    covariance[np.ix_(entries, entries)] = [[0.0049, 0.0028], [0.0028, 0.0064]]
    knows = replace(
        calibrated, cross_spectrum=replace(calibrated.cross_spectrum, parameters=parameters, covariance=covariance)
    )
    told = knows.unsprung
    assert [told.front.number, told.front.std, told.rear.number, told.rear.std, told.correlation] == pytest.approx(
        [75.0, 5.25, 85.0, 6.8, 0.5]
    )
    assert replace(calibrated, cross_spectrum=None).unsprung == NOT_CALIBRATED


def test_a_record_says_so() -> None:
    answer = Estimate(0, 300_000_000_000, "cross_spectrum").answered(exactly(270.0, 48.0))
    record = estimate_to_json(weighed(answer, UNSTATED, FOUND))
    assert record["weights"]["gross"]["is_unsprung_estimated"]
    assert estimate_from_json(record).weights.gross.is_unsprung_estimated


def test_the_surer_the_mass_the_surer_the_axle() -> None:
    stds = [of(UNSTATED, replace(FOUND, front=Quantity(75.0, std))).front_axle.std_kg for std in (1.0, 5.0, 20.0)]
    assert all(surer < less for surer, less in pairwise(stds))
