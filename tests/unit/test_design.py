"""The advice on the next known load: laws of information, what the service itself would state, and whether it helps."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.half_car_road import CAR, VAN
from support.known_runs import known_run

from benchmarks.accuracy.sensor_bounds import cramer_rao
from gateway.calibration.half_car.fit import calibrate_cross_spectrum, half_car_calibration
from gateway.calibration.half_car.known_spectra import known_spectra
from gateway.calibration.half_car.most_probable_vehicle import fit_half_car
from gateway.calibration.half_car.prior import prior_of
from gateway.calibration.known_run import KnownRun
from gateway.calibration.plan.design import Design
from gateway.calibration.plan.loads import PlacedLoad, drivable_loads, empty, share_within_reach, weighed_loads
from gateway.core.calibrated import CalibratedVehicle
from gateway.core.cross_spectrum import locate
from gateway.core.cross_spectrum.calibration import CrossSpectrumCalibration
from gateway.core.cross_spectrum.drift import DRIFT_STD
from gateway.core.cross_spectrum.likelihood import Point, Whittle
from gateway.core.cross_spectrum.located import raw_moves
from gateway.core.cross_spectrum.measured import cross_spectra_of
from gateway.core.cross_spectrum.predicted import Drive, expected_of, steady_spectra
from gateway.core.vehicle import Load, front_share_pct
from gateway.core.weights.on_the_road import weights_of
from gateway.posterior import exactly

PRIOR = prior_of(VAN)
UNKNOWN = np.diag(PRIOR.std**2)
DRIVE = Drive(600.0, 14.0)
TARGETS = weighed_loads(VAN)


def placed(payload_kg: float, position_m: float) -> PlacedLoad:
    return PlacedLoad(payload_kg, position_m, front_share_pct(VAN, payload_kg, position_m))


@pytest.fixture(scope="module")
def design() -> Design:
    return Design(VAN, PRIOR.mean, DRIVE, TARGETS)


@pytest.fixture(scope="module")
def calibration() -> CrossSpectrumCalibration:
    """Two runs: empty and one load."""
    runs = [known_run(1, 0.0, None, seed=1), known_run(2, 300.0, 1.4, seed=1)]
    return calibrate_cross_spectrum(runs, VAN)


LOAD = st.sampled_from(drivable_loads(VAN))


@given(st.lists(LOAD, min_size=2, max_size=4))
def test_the_order_of_runs_does_not_matter_and_every_run_helps(design: Design, loads: list[PlacedLoad]) -> None:
    forward = backward = UNKNOWN
    losses = [design.loss(UNKNOWN)]
    for load in loads:
        forward = design.after(forward, load)
        losses.append(design.loss(forward))
    for load in reversed(loads):
        backward = design.after(backward, load)
    assert np.allclose(forward, backward, rtol=1e-4, atol=1e-9)
    assert all(after < before for before, after in itertools.pairwise(losses))
    assert np.all(np.diag(forward) <= np.diag(UNKNOWN) * (1.0 + 1e-9))


def test_with_a_vehicle_fully_known_the_spread_is_the_cramer_rao_bound(
    calibration: CrossSpectrumCalibration, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of parameters that drift each by itself, as the bound takes them."""
    target = placed(220.0, 1.9)
    by_itself = np.diag(np.array(list(DRIFT_STD.values())) ** -2.0)
    monkeypatch.setattr("gateway.core.cross_spectrum.located.drift_precision", lambda: by_itself)
    found = Design(VAN, calibration.parameters, DRIVE, [target]).spread(np.zeros_like(UNKNOWN))
    bound = cramer_rao(calibration, 220.0, target.front_share_pct, Drive(300.0, 14.0), DRIFT_STD)
    assert found.payload_std_kg == pytest.approx(bound.payload_std_kg, rel=1e-6)
    assert found.front_share_std_pct == pytest.approx(bound.front_share_std_pct, rel=1e-6)


def test_the_spread_is_what_the_service_would_state_of_such_a_batch(calibration: CrossSpectrumCalibration) -> None:
    target = placed(220.0, 1.9)
    point = Point.of(calibration.parameters, Load(220.0, target.front_share_pct))
    spectra = expected_of(steady_spectra(calibration.reading, Drive(300.0, 14.0)), point, calibration.ground)
    located = locate(spectra, calibration)
    found = Design(VAN, calibration.parameters, DRIVE, [target]).spread(calibration.covariance)
    assert located.point.payload_kg == pytest.approx(220.0, abs=1.0)
    own, moves = raw_moves(Whittle(spectra, calibration.ground), located.point)
    stated = np.sqrt(np.diag(own + moves @ calibration.covariance @ moves.T))
    assert found.payload_std_kg == pytest.approx(stated[0], rel=0.02)
    assert found.front_share_std_pct == pytest.approx(100.0 * stated[1], rel=0.02)


def test_the_same_load_again_helps_less_than_another(calibration: CrossSpectrumCalibration) -> None:
    design = Design(VAN, calibration.parameters, DRIVE, TARGETS)
    again, elsewhere = placed(300.0, 1.4), placed(400.0, 2.6)
    assert design.loss(design.after(calibration.covariance, elsewhere)) < design.loss(
        design.after(calibration.covariance, again)
    )
    assert design.best(calibration.covariance, [again, elsewhere]) == elsewhere
    assert design.worst(calibration.covariance, [again, elsewhere]) == again


def test_a_longer_drive_teaches_more() -> None:
    short, long = (Design(VAN, PRIOR.mean, Drive(s, 14.0), TARGETS) for s in (120.0, 1200.0))
    load = placed(300.0, 1.0)
    assert long.loss(long.after(UNKNOWN, load)) < short.loss(short.after(UNKNOWN, load))


# springs that stiffen under load more than most: what the empty vehicle taught is then not true of a laden one
STIFFENING = replace(
    CAR, front=replace(CAR.front, spring_slope_per_kn=0.1), rear=replace(CAR.rear, spring_slope_per_kn=0.14)
)


def test_what_is_advised_helps_more_than_what_is_not() -> None:
    """On simulated drives: after the empty vehicle a run as advised, or the least useful one."""
    first = known_run(1, 0.0, None, seed=1, car=STIFFENING)
    found = calibrated([first])
    design = Design(VAN, found.parameters, DRIVE, TARGETS)
    loads = drivable_loads(VAN)
    advised, least = design.best(found.covariance, loads), design.worst(found.covariance, loads)
    after_advised, after_least = (
        rms_error(calibrated([first, known_run(3, load.payload_kg, load.position_m, seed=4, car=STIFFENING)]))
        for load in (advised, least)
    )
    assert after_advised < 0.5 * after_least


def calibrated(runs: list[KnownRun]) -> CrossSpectrumCalibration:
    """From one start and with no run left out: the intervals do not matter here."""
    known = known_spectra(runs, VAN)
    return half_car_calibration(known, VAN, fit_half_car(known, PRIOR, PRIOR.mean))


def rms_error(found: CrossSpectrumCalibration) -> float:
    """Over drives with loads that nobody calibrated: of payload in 450 kg and of share in 20 points, together."""
    squares = []
    for i, (payload_kg, position_m) in enumerate([(430.0, 2.2), (350.0, 2.5), (250.0, 0.8), (150.0, 2.7)]):
        run = known_run(20 + i, payload_kg, position_m, seed=9, car=STIFFENING)
        spectra = cross_spectra_of(run.batches, found.reading)
        assert spectra is not None
        point = locate(spectra, found).point
        squares.append(((point.payload_kg - payload_kg) / 450.0) ** 2)
        squares.append(((100.0 * point.front_share - run.front_share_pct) / 20.0) ** 2)
    return float(np.sqrt(np.mean(squares)))


LIMITED = replace(VAN, unsprung_front_kg=80.0, unsprung_rear_kg=85.0, rear_axle_limit_kg=950.0, gross_limit_kg=1750.0)


def test_no_load_beyond_the_vehicle_is_asked_for() -> None:
    loads = drivable_loads(LIMITED)
    assert loads[0] == empty(LIMITED)
    assert len(loads) < len(drivable_loads(VAN))
    for load in (*loads, *weighed_loads(LIMITED)):
        weights = weights_of(LIMITED, exactly(load.payload_kg, load.front_share_pct))
        assert weights.rear_axle.kg <= 950.0
        assert weights.gross.kg <= 1750.0
        assert load.payload_kg <= LIMITED.payload_range_kg[1]
        assert load.position_m is None or 0.0 <= load.position_m <= 1.2 * LIMITED.wheelbase_m
    assert all(load.payload_kg % 10.0 == 0.0 for load in loads)


@given(st.lists(LOAD, min_size=2, max_size=4), LOAD)
def test_reach_is_where_the_service_does_not_answer_out_of_range(driven: list[PlacedLoad], target: PlacedLoad) -> None:
    payloads, shares = [load.payload_kg for load in driven], [load.front_share_pct for load in driven]
    reach = share_within_reach([target], driven)
    if len(set(payloads)) == 1 or len(set(shares)) == 1:
        assert reach is None
        return
    calibrated = CalibratedVehicle("x", VAN, (min(payloads), max(payloads)), (min(shares), max(shares)))
    answer = (target.payload_kg, target.payload_kg), (target.front_share_pct, target.front_share_pct)
    assert reach == (0.0 if calibrated.is_out_of_range(*answer) else 1.0)
