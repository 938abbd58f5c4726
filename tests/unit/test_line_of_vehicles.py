"""A vehicle calibrated by one empty drive and what a sister's known loads tell; what makes a line and what does not."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from support.half_car_road import CAR, VAN, batch_over_road, weighed
from support.known_runs import LOADS, SIBLING, calibrated_on_loads, known_run

from gateway.calibration.half_car.fit import SPRINGS_FROM_PRIORS, UNTESTED, calibrate_cross_spectrum, fit_cross_spectrum
from gateway.calibration.half_car.prior import Prior, prior_of
from gateway.calibration.line.left_out import Sibling, with_siblings_left_out
from gateway.calibration.line.line import Line, Sister, line_of
from gateway.calibration.line.scatter import SCATTER_STD
from gateway.core.cross_spectrum.calibration import CrossSpectrumCalibration
from gateway.core.cross_spectrum.model.half_car import HalfCar
from gateway.core.cross_spectrum.model.parameters import INDEX, PARAMETERS
from gateway.errors import LineError


def sister(name: str, calibration: CrossSpectrumCalibration, line: Line | None = None) -> Sister:
    return Sister(name, VAN, calibration, line)


@pytest.fixture(scope="module")
def known() -> CrossSpectrumCalibration:
    """A sister, driven with known loads."""
    return calibrated_on_loads(seed=1)


@pytest.fixture(scope="module")
def line(known: CrossSpectrumCalibration) -> Line:
    return line_of([sister("a", known)])


@pytest.fixture(scope="module")
def inheriting(line: Line) -> CrossSpectrumCalibration:
    """Another vehicle, driven empty once."""
    empty = known_run(1, 0.0, None, seed=7, car=SIBLING)
    return fit_cross_spectrum([empty], VAN, inherited=line).calibration


@pytest.mark.parametrize(("payload_kg", "share_pct"), [(0.0, 52.0), (150.0, 50.0), (350.0, 45.0)])
def test_one_empty_drive_is_enough(inheriting: CrossSpectrumCalibration, payload_kg: float, share_pct: float) -> None:
    found = weighed(batch_over_road(payload_kg, share_pct, seed=99, car=SIBLING), inheriting)
    assert found.counted
    assert found.payload.number == pytest.approx(payload_kg, abs=25.0)
    assert found.front_share.number == pytest.approx(share_pct, abs=0.6)
    low, high = found.payload.interval95
    assert low < payload_kg < high


def test_it_is_believed_where_its_line_is(line: Line, inheriting: CrossSpectrumCalibration) -> None:
    assert inheriting.payload_seen_kg == (0.0, 400.0)
    assert set(line.seen.known_loads) <= set(inheriting.known_loads)
    assert not {SPRINGS_FROM_PRIORS, UNTESTED} & set(inheriting.warnings)
    assert inheriting.model_std == line.limits.model_std
    assert inheriting.usual_log_amplitude == line.usual.log_amplitude


def test_a_line_of_vehicles_that_were_only_driven_empty_knows_no_springs() -> None:
    empty = fit_cross_spectrum([known_run(1, 0.0, None, seed=3)], VAN).calibration
    of_empty = line_of([sister("a", empty)])
    again = fit_cross_spectrum([known_run(1, 0.0, None, seed=4)], VAN, inherited=of_empty).calibration
    assert SPRINGS_FROM_PRIORS in again.warnings


def test_more_drives_of_its_own_sharpen(line: Line, inheriting: CrossSpectrumCalibration) -> None:
    runs = [known_run(i, *load, seed=7, car=SIBLING) for i, load in enumerate(LOADS[:2])]
    more = fit_cross_spectrum(runs, VAN, inherited=line).calibration
    slopes = [INDEX["spring_slope_front_per_kn"], INDEX["spring_bend_front_0_per_kn"]]
    both = np.ix_(slopes, slopes)
    assert np.linalg.det(more.covariance[both]) < np.linalg.det(inheriting.covariance[both])
    assert np.linalg.slogdet(more.covariance)[1] < np.linalg.slogdet(inheriting.covariance)[1]


def test_without_scatter_it_is_the_joint_fit_of_all_drives(
    known: CrossSpectrumCalibration, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Sensor and road taken for the line's too."""
    monkeypatch.setattr("gateway.calibration.line.line._IS_INHERITED", np.ones(len(INDEX), dtype=bool))
    exact = replace(line_of([sister("a", known)]), scatter_std=np.zeros(len(INDEX)))
    own = known_run(9, 0.0, None, seed=1)
    inherited = fit_cross_spectrum([own], VAN, inherited=exact).calibration
    drives = [*(known_run(i, *load, seed=1) for i, load in enumerate(LOADS)), own]
    joint = calibrate_cross_spectrum(drives, VAN)
    std = np.sqrt(np.diag(joint.covariance))
    assert np.all(np.abs(inherited.parameters - joint.parameters) < 0.5 * std)
    assert np.all(np.diag(inherited.covariance) < 4.0 * std**2)


def test_with_boundless_scatter_it_is_the_fit_of_its_own_drives(line: Line) -> None:
    generic = prior_of(VAN)
    loose = replace(line, scatter_std=np.pad(100.0 * generic.std, (0, len(INDEX) - len(PARAMETERS))))
    told = loose.prior_of(VAN, with_roll=False)
    assert np.all(np.abs(told.mean - generic.mean) < 0.05 * generic.std)
    assert told.std == pytest.approx(generic.std, rel=1e-3)


def same(one: Prior, other: Prior) -> bool:
    return bool(np.array_equal(one.mean, other.mean) and np.array_equal(one.precision, other.precision))


def test_in_what_order_sisters_are_named_changes_nothing(known: CrossSpectrumCalibration) -> None:
    other = sister("b", calibrated_on_loads(seed=2, car=SIBLING))
    forward, backward = line_of([sister("a", known), other]), line_of([other, sister("a", known), other])
    assert forward.members == backward.members == ("a", "b")
    assert same(forward.prior_of(VAN, with_roll=False), backward.prior_of(VAN, with_roll=False))


def test_a_sister_brings_her_line_along_and_nothing_counts_twice(
    known: CrossSpectrumCalibration, line: Line, inheriting: CrossSpectrumCalibration
) -> None:
    child = sister("child", inheriting, line)
    grown = line_of([child])
    assert grown.members == ("a", "child")
    alike = line_of([sister("a", known), child])
    assert same(grown.prior_of(VAN, with_roll=False), alike.prior_of(VAN, with_roll=False))
    plain, told = line.prior_of(VAN, with_roll=False), grown.prior_of(VAN, with_roll=False)
    springs = [INDEX["spring_front_npm"], INDEX["spring_rear_npm"]]
    assert np.all(told.std[springs] < plain.std[springs])


def test_lines_that_share_vehicles_are_refused(line: Line, inheriting: CrossSpectrumCalibration) -> None:
    grown = line_of([sister("b", inheriting, line)])
    with pytest.raises(LineError, match="count twice"):
        line_of([sister("c", inheriting, line), sister("d", inheriting, grown)])


def test_from_three_on_scatter_is_estimated(known: CrossSpectrumCalibration) -> None:
    cars: Sequence[HalfCar] = (SIBLING, replace(CAR, rear=replace(CAR.rear, damper_nspm=0.6 * CAR.rear.damper_nspm)))
    sisters = [sister("a", known), *(sister(f"b{i}", calibrated_on_loads(i + 5, car)) for i, car in enumerate(cars))]
    two, three = line_of(sisters[:2]), line_of(sisters)
    assert (two.n_siblings, three.n_siblings) == (0, 3)
    damper = INDEX["damper_rear_nspm"]
    assert three.scatter_std[damper] > 1.2 * SCATTER_STD["damper_rear_nspm"] == 1.2 * two.scatter_std[damper]


@pytest.mark.parametrize("change", [{"wheelbase_m": 3.0}, {"empty_mass_kg": 1900.0}])
def test_another_model_is_refused(line: Line, change: dict[str, float]) -> None:
    with pytest.raises(LineError, match="another"):
        line.prior_of(replace(VAN, **change), with_roll=False)  # type: ignore[arg-type] # fields are not all numbers


def test_a_calibration_that_says_not_how_much_it_moved_is_refused(known: CrossSpectrumCalibration) -> None:
    with pytest.raises(LineError, match="calibrate it again"):
        line_of([sister("a", replace(known, usual_log_amplitude=None))])


def test_siblings_left_out_tell_how_far_intervals_are_widened(known: CrossSpectrumCalibration, line: Line) -> None:
    other = calibrated_on_loads(seed=2, car=SIBLING)
    siblings = [
        Sibling(sister(name, held), tuple(known_run(i, *load, seed=seed, car=car) for i, load in enumerate(LOADS)))
        for name, held, seed, car in (("a", known, 1, CAR), ("b", other, 2, SIBLING))
    ]
    whole = line_of([one.sister for one in siblings])
    left_out: list[None] = []
    tested = with_siblings_left_out(siblings, whole, lambda: left_out.append(None))
    assert len(left_out) == 2
    assert 0.0 < tested.payload_rms_kg < 25.0
    assert 0.0 < tested.front_share_rms_pct < 0.6
    assert all(std > 0.0 for std in tested.line.limits.model_std)
    assert tested.line.half_car is whole.half_car


def test_one_vehicle_alone_cannot_be_left_out(known: CrossSpectrumCalibration, line: Line) -> None:
    alone = Sibling(sister("a", known), (known_run(1, 0.0, None, seed=1),))
    with pytest.raises(LineError, match="no sibling can be left out"):
        with_siblings_left_out([alone], line)
