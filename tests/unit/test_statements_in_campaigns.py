"""Campaigns of which not everything is known: what teaches, what is held, and what the file and the verdict say."""

from collections.abc import Sequence
from dataclasses import replace
from math import nan

import pytest
from support.half_car_road import VAN
from support.known_runs import campaign as known_campaign

from gateway.calibration.from_drives import Outcome, calibrate_inspected
from gateway.calibration.inspection.across_runs import Inspection
from gateway.calibration.inspection.facts import InspectedRun
from gateway.calibration.inspection.finding import Kind
from gateway.calibration.judgement.advice import Grade, verdicts_of
from gateway.calibration.judgement.assessment import BatchSet, assess_calibration
from gateway.calibration.stated_drive import known_drive


def split(**said: dict[str, float]) -> tuple[InspectedRun, ...]:
    """The known-load drives, in which other things are said of some: run_2={"payload_kg": nan}."""

    def told(one: InspectedRun) -> InspectedRun:
        run = one.identification
        load = {"payload_kg": run.payload_kg, "front_share_pct": run.front_share_pct}
        load |= said.get(f"run_{run.number}", {})
        return replace(one, identification=known_drive(run.number, run.log, batches=run.batches, **load))

    return tuple(told(one) for one in known_campaign())


def calibrated(runs: Sequence[InspectedRun], *others: str) -> Outcome:
    estimators = ["cross_spectrum", *others]
    return calibrate_inspected(VAN, Inspection(tuple(runs)), where="campaign.toml", sha256="", estimators=estimators)


UNKNOWN = {"payload_kg": nan, "front_share_pct": nan}
NOTE = {"front_share_pct": nan, "payload_plus_minus_kg": 25.0}


def test_an_unknown_load_teaches_and_is_found_and_is_not_judged() -> None:
    outcome = calibrated(split(run_3=UNKNOWN))
    told = outcome.file.provenance.drives[2]
    assert (told.statement.payload_kg, told.statement.front_share_pct) == (None, None)
    assert told.found is not None
    assert (told.found.without_statement_kg, told.found.is_held) == (None, False)
    assert told.found.payload_kg == pytest.approx(300.0, abs=60.0)
    (judgement,) = assess_calibration(outcome).judgements
    assert {one.drive.number for one in judgement.tables[BatchSet.LEFT_OUT].judged} == {1, 2, 4}
    validation = judgement.tables[BatchSet.VALIDATION]
    assert validation.errors.n_batches == 4
    answered = [one for one in validation.judged if one.is_covered("payload") is not None]
    assert {one.drive.number for one in answered} == {1, 2, 4}
    assert validation.to_json()["runs"][2]["true_payload_kg"] is None


def test_a_note_is_judged_by_its_kilograms_alone() -> None:
    outcome = calibrated(split(run_2=NOTE))
    told = outcome.file.provenance.drives[1].statement
    found = (told.payload_kg, told.payload_plus_minus_kg, told.front_share_pct, told.is_compact)
    assert found == (200, 25, None, False)
    (judgement,) = assess_calibration(outcome).judgements
    noted = [one for one in judgement.tables[BatchSet.VALIDATION].judged if one.drive.number == 2]
    assert all(one.is_covered("payload") is not None for one in noted)
    assert all(one.is_covered("front_share") is None for one in noted)


def test_only_the_wrong_statement_is_held() -> None:
    outcome = calibrated(split(run_3={"payload_kg": 0.0, "front_share_pct": 52.0}))
    assert [one.found.is_held for one in outcome.file.provenance.drives if one.found] == [False, False, True, False]
    assert outcome.file.provenance.drives[2].found is not None
    assert outcome.file.provenance.drives[2].found.payload_kg == pytest.approx(300.0, abs=60.0)
    (warning,) = [one for one in outcome.file.warnings if str(Kind.LOAD_DISAGREES) in one]
    assert warning.startswith("run 3: load_disagrees: the campaign says 0 kg at 52.0 % front, the drive shows ")
    assert outcome.file.seen.payload_kg == (0.0, 400.0)
    (verdict,) = verdicts_of(assess_calibration(outcome))
    (labels,) = [reason for reason in verdict.reasons if reason.rule == "labels"]
    assert "drive 3" in labels.text
    assert labels.grade is Grade.RESERVED


def test_the_ratio_index_is_left_out_where_no_load_is_known() -> None:
    outcome = calibrated(split(run_1=NOTE, run_2=UNKNOWN, run_3=UNKNOWN, run_4=UNKNOWN), "ratio_index")
    assert outcome.file.estimators == ("cross_spectrum",)
    assert "ratio_index: no run has a known payload and place" in outcome.file.warnings


def test_the_verdict_says_what_to_drive_next() -> None:
    outcome = calibrated(split()[:1])
    (verdict,) = verdicts_of(assess_calibration(outcome))
    assert verdict.advice.startswith("Next: a known load ")
    assert verdict.advice in verdict.text
