"""A vehicle that learns from drives and statements, on exact spectra of a known half-car."""

from dataclasses import replace
from functools import cache

import pytest
from support.half_car_road import KNOWN, VAN, batch_over_road

from gateway.calibration.found import Taught
from gateway.calibration.stated_drive import StatedDrive
from gateway.calibration.statements import NOTHING_KNOWN, Statement, empty, load_prior_of
from gateway.calibration.teach import teach
from gateway.core.cargo import known_shape
from gateway.errors import CalibrationImpossibleError
from gateway.estimates.batch_estimate import Estimate
from gateway.model.weigh import by_cross_spectrum
from gateway.records import Batch
from gateway.stated.statement import StatementSource


def stated(payload_kg: float, share_pct: float) -> Statement:
    return Statement(
        source=StatementSource.KNOWN, payload_kg=payload_kg, front_share_pct=share_pct, left_m=0.0, is_compact=True
    )


def drive(i: int, statement: Statement, load: tuple[float, float], speed_mps: float = 14.0) -> StatedDrive:
    return StatedDrive(f"drive {i}", (batch_over_road(*load, seed=10 * i, speed_mps=speed_mps),), statement)


@cache
def known() -> Taught:
    return teach([drive(i, stated(*load), load) for i, load in enumerate(KNOWN)], VAN)


def estimated(batch: Batch, taught: Taught) -> Estimate:
    blank = Estimate(batch.t_start_ns, batch.t_end_ns, "cross_spectrum")
    return by_cross_spectrum(batch, taught.model, known_shape(*taught.model.known_shape), blank)


def test_one_empty_drive_and_unlabelled_drives_teach_a_vehicle() -> None:
    loads = ((0.0, 52.0), (300.0, 47.0), (150.0, 54.0), (400.0, 50.0))
    said = (empty(), NOTHING_KNOWN, NOTHING_KNOWN, NOTHING_KNOWN)
    speeds = (14.0, 11.0, 17.0, 20.0)
    drives = [drive(i, one, load, v) for i, (one, load, v) in enumerate(zip(said, loads, speeds, strict=True))]
    taught = teach(drives, VAN)
    for found, load in zip(taught.loads, loads, strict=True):
        assert abs(found.load.payload_kg - load[0]) < max(3.0 * found.payload_std_kg, 10.0)
    told = estimated(batch_over_road(220.0, 50.0, seed=98), taught)
    assert told.counted, told.rejected
    assert told.payload.interval95[0] < 220.0 < told.payload.interval95[1]


def test_only_the_statement_that_its_drive_contradicts_is_held() -> None:
    drives = [drive(i, stated(*load), load) for i, load in enumerate((*KNOWN, (120.0, 53.0)))]
    drives[2] = drive(2, stated(0.0, 52.0), KNOWN[2])
    found = teach(drives, VAN).loads
    assert [one.is_held for one in found] == [False, False, True, False, False]
    assert found[2].load.payload_kg == pytest.approx(KNOWN[2][0], abs=40.0)


def test_each_statement_is_compared_with_its_drive_weighed_without_it() -> None:
    """That is its test: the drive knows the load from the vehicle of the others alone."""
    for found, (payload_kg, _) in zip(known().loads, KNOWN, strict=True):
        assert abs(found.without_kg - payload_kg) < 3.0 * found.without_std_kg
        assert found.payload_std_kg < found.without_std_kg


def test_drives_without_steady_driving_teach_nothing() -> None:
    short = StatedDrive("short", (batch_over_road(0.0, 52.0, seed=1, duration_s=4.0),), empty())
    with pytest.raises(CalibrationImpossibleError, match="enough steady driving"):
        teach([short], VAN)


@pytest.mark.parametrize(
    ("statement", "payload_kg", "payload_std_kg"),
    [
        (empty(), 0.0, 5.1),
        (Statement(payload_kg=310.0, payload_plus_minus_kg=25.0), 310.0, 12.8),
        (NOTHING_KNOWN, 202.5, 315.0),
    ],
)
def test_plus_minus_is_half_a_95_percent_interval(
    statement: Statement, payload_kg: float, payload_std_kg: float
) -> None:
    prior = load_prior_of(statement, replace(VAN, payload_range_kg=(0.0, 450.0)))
    assert prior.payload_kg == pytest.approx(payload_kg)
    assert prior.payload_std_kg == pytest.approx(payload_std_kg, rel=0.01)


def test_a_place_that_is_not_known_leaves_the_share_wide() -> None:
    unknown = load_prior_of(Statement(payload_kg=300.0), VAN)
    placed = load_prior_of(Statement(payload_kg=300.0, position_m=1.4), VAN)
    assert unknown.front_share_std > 5.0 * placed.front_share_std
