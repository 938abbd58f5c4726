"""The prediction of what further driving or teaching would gain agrees with what they then do gain."""

from dataclasses import replace
from functools import cache

import pytest
from support.half_car_road import VAN, batch_over_road

from gateway.calibration.ahead import CANDIDATES, Ahead, next_steps
from gateway.calibration.stated_drive import StatedDrive, known_drive
from gateway.calibration.statements import NOTHING_KNOWN, Statement
from gateway.calibration.teach import teach
from gateway.core.vehicle import Load
from gateway.model.vehicle_model import VehicleModel
from gateway.stated.statement import StatementSource

EMPTY = Load(0.0, 52.0)
LOADED = Load(330.0, 54.0)
DRIVE_S = 300.0


def driven(load: Load, number: int) -> StatedDrive:
    return known_drive(number, "", *load, (batch_over_road(*load, seed=number, duration_s=DRIVE_S),))


@cache
def after_one_empty_drive() -> VehicleModel:
    return teach([driven(EMPTY, 1)], VAN).model


def known(load: Load) -> Statement:
    return Statement(
        source=StatementSource.KNOWN, payload_kg=load.payload_kg, front_share_pct=load.front_share_pct, is_compact=True
    )


def test_every_candidate_narrows_or_leaves_the_answer() -> None:
    steps = next_steps(after_one_empty_drive(), VAN)
    assert {step.candidate.name for step in steps} == {one.name for one in CANDIDATES}
    assert all(step.then_kg < step.now_kg for step in steps)
    assert [step.then_kg for step in steps] == sorted(step.then_kg for step in steps)


def test_empty_drives_alone_lead_to_the_advice_to_drive_a_known_load() -> None:
    best, *_, worst = next_steps(after_one_empty_drive(), VAN)
    assert best.candidate.name.startswith("known_load")
    assert best.then_kg < 0.95 * worst.then_kg
    assert best.text.startswith(best.candidate.words)


def test_a_drive_of_which_more_is_known_teaches_no_less() -> None:
    model = after_one_empty_drive()
    ahead = Ahead(model, VAN)
    note = Statement(payload_kg=LOADED.payload_kg, payload_plus_minus_kg=25.0)
    after = [ahead.stds(ahead.after(said, LOADED))[0] for said in (known(LOADED), note, NOTHING_KNOWN)]
    assert after == sorted(after)
    assert after[-1] <= ahead.stds(model.covariance)[0]


@pytest.mark.parametrize("load", [LOADED, EMPTY])
def test_teaching_gives_about_the_predicted_gain(load: Load) -> None:
    before = after_one_empty_drive()
    ahead = Ahead(before, VAN)
    predicted_kg, _ = ahead.stds(ahead.after(known(load), load, DRIVE_S))
    taught = teach([driven(EMPTY, 1), driven(load, 2)], VAN).model
    there = replace(taught, model_std=before.model_std, spread=before.spread)
    found_kg, _ = Ahead(there, VAN).stds(there.covariance)
    assert predicted_kg == pytest.approx(found_kg, rel=0.15)
