"""Plans: a first campaign from [vehicle] alone, what to drive after a calibration, and loads to one side."""

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import block_diag
from support.calibrated import calibration_file
from support.commands import called, printed
from support.half_car_road import VAN, batch_over_road
from support.known_runs import split_run

from gateway.calibration.calibrate import Outcome
from gateway.calibration.half_car.fit import CrossSpectrumFit, calibrate_cross_spectrum
from gateway.calibration.half_car.prior import prior_of
from gateway.calibration.inspection.campaign import Inspection
from gateway.calibration.inspection.finding import RunVerdict
from gateway.calibration.known_run import KnownRun
from gateway.calibration.plan.loads import PlacedLoad
from gateway.calibration.plan.plan import (
    FIRST_DRIVE,
    N_FIRST,
    Advice,
    Expected,
    LoadPlan,
    OffCentreLoad,
    plan_first,
    plan_next,
    sideways_load,
    stated_widths,
    usual_drive,
)
from gateway.calibration.plan.words import best_next, plan_sentences, widths_sentence
from gateway.core.cross_spectrum.predicted import Drive
from gateway.core.vehicle import Carries
from gateway.core.weights.on_the_road import weights_of
from gateway.errors import CalibrationImpossibleError, CampaignError
from gateway.posterior import exactly
from gateway.reports.calibration.runs import plan_section

DRAFT = """
[vehicle]
name = "van"
empty_mass_kg = 1240.0
wheelbase_m = 2.8
sensor_position_m = 3.1
payload_range_kg = [0.0, 450.0]
"""


def improves(plan: LoadPlan) -> bool:
    """Whether each run of the plan lowers what is expected of payload and share together."""
    steps: list[Expected] = [*([plan.now] if plan.now else []), *(advice.expected for advice in plan.advice)]
    loss = [(step.payload_std_kg / 450.0) ** 2 + (step.front_share_std_pct / 20.0) ** 2 for step in steps]
    return loss == sorted(loss, reverse=True)


def test_a_first_campaign_begins_empty_and_spreads_the_load() -> None:
    plan = plan_first(VAN)
    loads = [advice.load for advice in plan.advice]
    assert plan.now is None
    assert len(loads) == N_FIRST
    assert loads[0].payload_kg == 0.0
    assert all(load.payload_kg > 0.0 for load in loads[1:])
    places_m = [load.position_m for load in loads[1:] if load.position_m is not None]
    assert max(places_m) - min(places_m) > 0.5 * VAN.wheelbase_m
    assert improves(plan)
    assert plan.advice[-1].expected.reach_share is not None
    assert plan.advice[-1].expected.reach_share > 0.9


def test_axle_limits_bound_what_is_advised() -> None:
    limited = replace(VAN, unsprung_front_kg=80.0, unsprung_rear_kg=85.0, rear_axle_limit_kg=900.0)
    for advice in plan_first(limited).advice:
        weights = weights_of(limited, exactly(advice.load.payload_kg, advice.load.front_share_pct))
        assert weights.rear_axle.kg <= 900.0


@pytest.fixture(scope="module")
def outcome() -> Outcome:
    """After the empty vehicle and one light load."""
    split = (split_run(1, 0.0, None), split_run(2, 150.0, 1.4))
    found = calibrate_cross_spectrum([one.identification for one in split], VAN)
    verdicts = tuple(RunVerdict(one.identification.number, one.identification.name) for one in split)
    return Outcome(calibration_file(), Inspection(split, verdicts, ()), cross_spectrum=CrossSpectrumFit(found, {}))


def test_after_two_runs_a_heavy_load_comes_next(outcome: Outcome) -> None:
    plan = plan_next(outcome, VAN)
    assert plan.n_driven == 2
    assert plan.advice[0].load.payload_kg > 300.0
    assert improves(plan)
    first, least = plan.advice[0].expected, plan.least.expected
    assert first.payload_std_kg < least.payload_std_kg <= plan.now.payload_std_kg * 1.001
    assert plan.drive.speed_mps == pytest.approx(14.0)
    assert plan.drive.duration_s == pytest.approx(200.0, rel=0.01)


def test_what_is_known_of_roll_changes_no_advice_and_widens_no_promise(outcome: Outcome) -> None:
    known = outcome.cross_spectrum.calibration
    roll = prior_of(replace(VAN, track_width_m=1.5), with_roll=True).roll
    rolling = replace(
        known,
        parameters=np.r_[known.parameters, roll.mean],
        covariance=block_diag(known.covariance, np.diag(roll.std**2)),
        directions=np.r_[known.directions, np.zeros((len(roll.mean), known.directions.shape[1]))],
        track_width_m=1.5,
    )
    with_roll = plan_next(replace(outcome, cross_spectrum=CrossSpectrumFit(rolling, {})), VAN)
    without = plan_next(outcome, VAN)
    assert [one.load for one in with_roll.advice] == [one.load for one in without.advice]
    # a batch whose roll is taken out counts more against the load's shape
    assert 0.9 * without.now.payload_std_kg < with_roll.now.payload_std_kg < without.now.payload_std_kg


def test_a_plan_is_told_in_sentences_and_in_numbers(outcome: Outcome) -> None:
    plan = plan_next(outcome, VAN)
    load = plan.advice[0].load
    text = plan_sentences(plan)
    assert f"load {load.payload_kg:g} kg with its centre {load.position_m:g} m behind the front axle" in text
    assert "2 runs driven" in text
    assert "least useful would be" in text
    read = json.loads(json.dumps(plan.to_json(), allow_nan=False))
    assert read["advice"][0]["load"]["payload_kg"] == load.payload_kg
    assert set(read["now"]) == {"payload_std_kg", "front_share_std_pct", "reach_share"}


def test_a_plan_says_when_enough_is_driven(outcome: Outcome) -> None:
    plan = plan_next(outcome, VAN)
    assert not plan.is_enough_driven
    assert "drive next, each" in plan_sentences(plan)
    assert "Enough" not in str(best_next(plan))
    nearly = replace(plan.advice[0], expected=replace(plan.advice[0].expected, reach_share=0.95))
    known = Expected(1.05 * nearly.expected.payload_std_kg, 1.05 * nearly.expected.front_share_std_pct, 0.95)
    enough = replace(plan, now=known, advice=(nearly,))
    assert enough.is_enough_driven
    assert "enough is driven" in plan_sentences(enough)
    assert str(best_next(enough)).startswith("Enough is driven")
    assert not replace(enough, now=replace(known, reach_share=0.5)).is_enough_driven
    assert not replace(enough, now=replace(known, payload_std_kg=2.0 * known.payload_std_kg)).is_enough_driven


def test_what_it_costs_to_say_nothing_of_the_loads_is_stated(outcome: Outcome) -> None:
    known = outcome.cross_spectrum.calibration
    widths = stated_widths(known, VAN, 14.0)
    assert widths.payload_kg == pytest.approx(0.5 * VAN.payload_range_kg[1])
    for one in widths.carries.values():  # spread goods are weighed too low by who takes them for compact ones
        assert one.unsaid.payload_kg < one.said.payload_kg < widths.payload_kg
    said = replace(VAN, carries=Carries.PARCELS)
    assert stated_widths(known, said, 14.0) is None
    text = widths_sentence(widths)
    parcels = widths.carries[Carries.PARCELS]
    assert f"{parcels.unsaid.payload_kg:.0f} ± {parcels.unsaid.half_width_kg:.0f} kg with parcels" in text
    assert set(json.loads(json.dumps(widths.to_json()))["carries"]) == {"pallets", "parcels", "long_goods", "tools"}


def test_without_the_half_car_there_is_no_plan(outcome: Outcome) -> None:
    with pytest.raises(CalibrationImpossibleError, match="cross-spectral"):
        plan_next(replace(outcome, cross_spectrum=None), VAN)


def test_runs_without_a_usable_batch_leave_the_usual_drive() -> None:
    assert usual_drive([replace(split_run(1, 0.0, None).identification, batches=())]) == FIRST_DRIVE


def test_the_command_plans_from_a_vehicle_alone(tmp_path: Path) -> None:
    draft = tmp_path / "campaign.toml"
    draft.write_text(DRAFT, encoding="utf-8")
    assert "1. the empty vehicle" in printed("calibrate", draft, "--plan")
    assert json.loads(printed("calibrate", draft, "--plan", "--json"))["plan"]["n_driven"] == 0


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--output", "absent/v.json"), "there is no folder"),
        (("--output", "."), "is a folder"),
        (("--plan", "--report", "campaign.toml"), "is a file"),
    ],
)
def test_a_place_that_cannot_be_written_is_told_before_anything_is_read(
    options: tuple[str, ...], said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("campaign.toml").write_text(DRAFT, encoding="utf-8")
    done = called("calibrate", "campaign.toml", *options)
    assert done.exit_code == 2
    assert said in done.output


def test_a_plan_asks_what_the_vehicle_may_carry(tmp_path: Path) -> None:
    """A van of 3.5 t was told to drive the 450 kg of a small one."""
    draft = tmp_path / "campaign.toml"
    draft.write_text(re.sub("payload_range_kg.*\n", "", DRAFT), encoding="utf-8")
    with pytest.raises(CampaignError, match=r"payload_range_kg: not stated.* write what the vehicle may carry"):
        printed("calibrate", draft, "--plan")


def test_neither_a_file_nor_a_plan_asked_for_is_a_usage_error(tmp_path: Path) -> None:
    draft = tmp_path / "campaign.toml"
    draft.write_text(DRAFT, encoding="utf-8")
    told = called("calibrate", draft)
    assert told.exit_code == 2
    assert "--output" in told.stderr


STRAIGHT = batch_over_road(0.0, 52.0, seed=1, duration_s=60.0)
ROLLING = replace(STRAIGHT, roll_rate_radps=np.zeros_like(STRAIGHT.pitch_rate_radps))
WIDE = replace(VAN, track_width_m=1.6)
EXPECTED = Expected(payload_std_kg=10.0, front_share_std_pct=0.5, reach_share=0.4)


def run(payload_kg: float = 0.0, left_m: float | None = None) -> KnownRun:
    return KnownRun(1, "1.log", payload_kg, 52.0, (ROLLING,), left_m)


def test_the_heaviest_load_goes_a_quarter_of_the_track_to_one_side() -> None:
    advised = sideways_load([run(), run(300.0)], WIDE)
    assert (advised.load.payload_kg, advised.payload_left_m) == (450.0, 0.4)
    assert abs(advised.load.front_share_pct - WIDE.empty_front_share_pct) < 2.0
    of_unknown_track = sideways_load([run()], VAN)
    assert of_unknown_track.payload_left_m == 0.4  # a quarter of 1.5 m, in steps of 0.05 m


def test_nothing_is_advised_without_a_roll_rate_or_after_such_a_run() -> None:
    assert sideways_load([replace(run(), batches=(STRAIGHT,))], WIDE) is None
    assert sideways_load([run(), run(300.0, -0.3)], WIDE) is None
    assert sideways_load([run(300.0, 0.05)], WIDE) is not None


def test_a_limit_of_single_wheels_bounds_the_load() -> None:
    weighed = replace(WIDE, unsprung_front_kg=80.0, unsprung_rear_kg=85.0)
    limited = replace(weighed, front_wheel_limit_kg=470.0, rear_wheel_limit_kg=470.0)
    advised = sideways_load([run()], limited)
    assert 0.0 < advised.load.payload_kg < 450.0
    assert sideways_load([run()], replace(weighed, rear_wheel_limit_kg=300.0)) is None


def test_people_read_it() -> None:
    load = PlacedLoad(450.0, 1.4, 51.0)
    plan = LoadPlan("van", 3, Drive(600.0, 14.0), EXPECTED, (Advice(load, EXPECTED),), None)
    advised = replace(plan, sideways=OffCentreLoad(load, 0.4))
    assert "payload_left_m = 0.4 or -0.4" in plan_sentences(advised)
    assert "payload_left_m" not in plan_sentences(plan)
    assert "450 kg 0.4 m left of the centre line" in " ".join(plan_section(advised).paragraphs)
    assert advised.to_json()["sideways"] == {
        "load": {"payload_kg": 450.0, "position_m": 1.4, "front_share_pct": 51.0},
        "payload_left_m": 0.4,
    }
    assert plan.to_json()["sideways"] is None
