"""Fit for use or not: every rule by itself, on estimates made up for it."""

from dataclasses import replace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.calibrated import calibration_file
from support.paper_van import paper_van

from gateway.calibration.file import FoundPart
from gateway.calibration.from_drives import Outcome
from gateway.calibration.inspection.across_runs import Inspection
from gateway.calibration.inspection.facts import InspectedRun
from gateway.calibration.inspection.finding import Finding, Kind, Severity
from gateway.calibration.judgement.advice import Grade, Verdict, verdicts_of
from gateway.calibration.judgement.assessment import Assessment, BatchSet, Judgement
from gateway.calibration.judgement.evaluation import Judged, error_table
from gateway.calibration.stated_drive import known_drive
from gateway.estimates.batch_estimate import Estimate, Quantity
from gateway.records import Why

VAN = paper_van()  # ranges of 450 kg and of 20 points


def judged(run: int, error_kg: float = 0.0, half_kg: float = 20.0, error_pp: float = 0.0) -> Judged:
    payload_kg, share_pct = 200.0 + error_kg, 50.0 + error_pp
    estimate = Estimate(
        0, 1, "cross_spectrum",
        payload=Quantity(payload_kg, interval95=(payload_kg - half_kg, payload_kg + half_kg)),
        front_share=Quantity(share_pct, interval95=(share_pct - 4.0, share_pct + 4.0)),
    )  # fmt: skip
    return Judged(known_drive(run, f"{run}.log", 200.0, 50.0, ()), estimate)


def refused(run: int) -> Judged:
    return replace(judged(run), estimate=Estimate(0, 1, "cross_spectrum", rejected=(Why.GAP,)))


def judgement(parts: dict[BatchSet, list[Judged]], estimator: str = "cross_spectrum") -> Judgement:
    return Judgement(estimator, {part: error_table(rows, VAN, estimator) for part, rows in parts.items()})


def verdict(
    left_out: list[Judged],
    validation: list[Judged] | None = None,
    warnings: tuple[str, ...] = (),
    runs: tuple[InspectedRun, ...] | None = None,
) -> Verdict:
    file = calibration_file().model_copy(update={"warnings": warnings})
    parts = {BatchSet.LEFT_OUT: left_out} if left_out else {}
    parts |= {BatchSet.VALIDATION: validation} if validation else {}
    outcome = None if runs is None else Outcome(file, Inspection(runs))
    (found,) = verdicts_of(Assessment("", file, VAN, (judgement(parts),), outcome))
    return found


def grade_of(found: Verdict, rule: str) -> Grade:
    return next(reason.grade for reason in found.reasons if reason.rule == rule)


TEN, FIVE = range(1, 11), range(1, 6)
LIMITS = [
    # errors of a tenth and a fifth of the range
    ("payload_error", [judged(run, 44.0, half_kg=110.0) for run in TEN], Grade.FIT),
    ("payload_error", [judged(run, 46.0, half_kg=110.0) for run in TEN], Grade.RESERVED),
    ("payload_error", [judged(run, 89.0, half_kg=110.0) for run in TEN], Grade.RESERVED),
    ("payload_error", [judged(run, 91.0, half_kg=110.0) for run in TEN], Grade.UNFIT),
    ("front_share_error", [judged(run, error_pp=1.9) for run in FIVE], Grade.FIT),
    ("front_share_error", [judged(run, error_pp=2.1) for run in FIVE], Grade.RESERVED),
    ("front_share_error", [judged(run, error_pp=4.1) for run in FIVE], Grade.UNFIT),
    # true intervals that hold nearly every load are of no use
    ("payload_half_width", [judged(run, half_kg=110.0) for run in FIVE], Grade.FIT),
    ("payload_half_width", [judged(run, half_kg=120.0) for run in FIVE], Grade.RESERVED),
    ("payload_half_width", [judged(run, half_kg=230.0) for run in FIVE], Grade.UNFIT),
    # narrow intervals are distinguished from bad luck: 30 kg of an interval of 20 are a miss; one batch a run
    ("payload_coverage", [judged(run, 1.0) for run in TEN], Grade.FIT),
    ("payload_coverage", [judged(run, 30.0 if run <= 3 else 1.0) for run in TEN], Grade.FIT),
    ("payload_coverage", [judged(run, 30.0 if run <= 5 else 1.0) for run in TEN], Grade.RESERVED),
    ("payload_coverage", [judged(run, 30.0 if run <= 9 else 1.0) for run in TEN], Grade.UNFIT),
    ("answered", [refused(run) if run <= 1 else judged(run) for run in TEN], Grade.FIT),
    ("answered", [refused(run) if run <= 3 else judged(run) for run in TEN], Grade.RESERVED),
    ("answered", [refused(run) if run <= 6 else judged(run) for run in TEN], Grade.UNFIT),
]


@pytest.mark.parametrize(("rule", "rows", "grade"), LIMITS)
def test_each_rule_has_its_limits(rule: str, rows: list[Judged], grade: Grade) -> None:
    found = verdict(rows)
    assert grade_of(found, rule) is grade
    assert found.grade.rank >= grade.rank


def test_without_anything_unseen_there_is_no_unreserved_verdict() -> None:
    found = verdict([])
    assert (found.grade, grade_of(found, "unseen")) == (Grade.RESERVED, Grade.RESERVED)


def test_warnings_reserve_but_not_those_about_the_other_estimator() -> None:
    rows = [judged(run) for run in range(1, 5)]
    assert verdict(rows, warnings=("ratio_index: needs two loads",)).grade is Grade.FIT
    assert verdict(rows, warnings=("springs_from_priors",)).grade is Grade.RESERVED


@pytest.mark.parametrize(
    ("severities", "grade"),
    [
        ((None, None, Severity.WARNING), None),
        ((None, None, Severity.FAULT), Grade.RESERVED),
        ((None, Severity.FAULT, Severity.FAULT), Grade.UNFIT),
    ],
)
def test_runs_that_cannot_be_used_count(severities: tuple[Severity | None, ...], grade: Grade | None) -> None:
    runs = tuple(
        InspectedRun(
            known_drive(number, "a.log", 0.0, 50.0, ()),
            findings=() if severity is None else (Finding(Kind.GAPS, severity, "gaps"),),
        )
        for number, severity in enumerate(severities, 1)
    )
    rows = [judged(run) for run in range(1, 5)]
    found = {reason.rule: reason.grade for reason in verdict(rows, runs=runs).reasons}
    assert found.get("runs") is grade


@pytest.mark.parametrize(("n_held", "grade"), [(0, None), (1, Grade.RESERVED), (2, Grade.RESERVED), (3, Grade.UNFIT)])
def test_held_statements_are_a_reservation_and_a_majority_makes_unfit(n_held: int, grade: Grade | None) -> None:
    file = calibration_file()
    (drive,) = file.provenance.drives
    kg = {"payload_kg": 5.0, "payload_std_kg": 9.0, "without_statement_kg": 5.0, "without_statement_std_kg": 9.0}
    found = FoundPart(**kg, front_share_pct=50.0, is_held=False)
    drives = tuple(
        drive.model_copy(update={"number": n, "found": found.model_copy(update={"is_held": n <= n_held})})
        for n in range(1, 6)
    )
    file = file.model_copy(update={"provenance": file.provenance.model_copy(update={"drives": drives})})
    parts = {BatchSet.LEFT_OUT: [judged(run) for run in range(1, 5)]}
    outcome = Outcome(file, Inspection(()))
    (told,) = verdicts_of(Assessment("", file, VAN, (judgement(parts),), outcome))
    labels = {reason.grade for reason in told.reasons if reason.rule == "labels"}
    assert labels == ({grade} if grade else set())


@pytest.mark.parametrize(
    ("figures", "told"),
    [
        ({}, None),
        ({"kerb_front_axle_kg": 700.0, "kerb_rear_axle_kg": 700.0}, None),
        (
            {"kerb_front_axle_kg": 1540.0, "kerb_rear_axle_kg": 1540.0, "empty_mass_kg": 2728.0},
            "3080 kg empty on a wheelbase of 2.8 m",
        ),
        ({"kerb_front_axle_kg": 700.0, "kerb_rear_axle_kg": 700.0, "payload_range_kg": (0.0, 9e3)}, None),
    ],
)
def test_unlikely_figures_of_the_vehicle_are_a_reservation(figures: dict[str, Any], told: str | None) -> None:
    """In pounds every weight is 2.2 times too large, and the drives cannot tell; the range only scales percentages."""
    file = calibration_file()
    vehicle = replace(file.vehicle, gross_limit_kg=None, **figures)
    outcome = Outcome(file.model_copy(update={"vehicle": vehicle}), Inspection(()))
    parts = {BatchSet.LEFT_OUT: [judged(run) for run in TEN]}
    (found,) = verdicts_of(Assessment("", outcome.file, VAN, (judgement(parts),), outcome))
    facts = [(one.grade, one.text.partition(":")[0]) for one in found.reasons if one.rule == "facts"]
    assert facts == ([(Grade.RESERVED, told)] if told else [])


def test_the_headline_judges_the_estimator_that_the_service_runs_though_the_other_is_better() -> None:
    file = calibration_file()
    bad = judgement({BatchSet.LEFT_OUT: [judged(run, 100.0, 200.0) for run in range(1, 5)]}, "cross_spectrum")
    good = judgement({BatchSet.LEFT_OUT: [judged(run, 10.0) for run in range(1, 5)]}, "ratio_index")
    found = verdicts_of(Assessment("", file, VAN, (good, bad)))
    assert [one.estimator for one in found] == ["cross_spectrum", "ratio_index"]
    assert found[0].grade is Grade.UNFIT


@given(errors_kg=st.lists(st.floats(0.0, 200.0), min_size=3, max_size=8), factor=st.floats(1.0, 3.0))
def test_larger_errors_never_make_it_fitter(errors_kg: list[float], factor: float) -> None:
    small = [judged(run, error, half_kg=60.0) for run, error in enumerate(errors_kg)]
    large = [judged(run, factor * error, half_kg=60.0) for run, error in enumerate(errors_kg)]
    assert verdict(large).grade.rank >= verdict(small).grade.rank


def test_a_missing_front_share_is_a_reservation_and_no_miss_of_its_interval() -> None:
    nothing = {"front_share": Quantity()}
    rows = [replace(one, estimate=replace(one.estimate, **nothing)) for one in (judged(1), judged(2), judged(3))]
    found = verdict(rows)
    assert found.grade is Grade.RESERVED
    assert not any(reason.rule == "front_share_coverage" for reason in found.reasons)
