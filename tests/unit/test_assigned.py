"""From statements to what is stated of each drive: when one holds, which replaces which, and weights to payloads."""

from dataclasses import replace
from datetime import datetime, timedelta
from typing import Any

import pytest
from support.half_car_road import VAN as HALF_CAR

from gateway.calibration.assigned import Assigned, Fate, Piece, assign, cut, moments
from gateway.estimates.quantity import Z95
from gateway.stated.statement import StatementRecord

DAY = datetime.fromisoformat("2026-11-26T00:00:00Z")
VAN = replace(HALF_CAR, kerb_front_axle_kg=730.0, kerb_rear_axle_kg=680.0)  # 1240 kg sprung, 52 % in front
AT = int(DAY.timestamp()) * 10**9


def ns(clock: str) -> int:
    hours, minutes = clock.split(":")
    return AT + (int(hours) * 3600 + int(minutes) * 60) * 10**9


def when(clock: str) -> datetime:
    hours, minutes = clock.split(":")
    return DAY + timedelta(hours=int(hours), minutes=int(minutes))


def told(begin: str, until: str | None = None, source: str = "delivery_note", **said: Any) -> StatementRecord:
    ref, place, learn = said.pop("ref", None), said.pop("place", None), said.pop("learn", True)
    record = {"ref": ref, "from": when(begin), "until": None if until is None else when(until), "source": source}
    loaded = {"load": said, "place": place, "learn": learn} if said else {}
    return StatementRecord.model_validate(record | loaded).identified()


def drives(*spans: str) -> list[Piece]:
    """One for each of "07:50-08:30"."""
    return [Piece(*(ns(clock) for clock in span.split("-")), number) for number, span in enumerate(spans, 1)]


def payloads(found: Assigned) -> list[float | None]:
    return [None if one.payload_kg is None else round(one.payload_kg, 6) for one in found.statements]


def noted(begin: str, payload_kg: float, until: str | None = None, **said: Any) -> StatementRecord:
    return told(begin, until, payload_kg=payload_kg, **said)


MORNING = drives("07:50-08:30", "09:00-09:40", "13:00-13:30")
LESS, MORE = told("08:45", change_kg=-60.0), told("09:50", "14:00", change_kg=40.0)
HELD: dict[str, tuple[list[StatementRecord], list[float | None]]] = {  # records, and what they say of each drive
    "before its drive": ([noted("07:40", 310.0)], [310.0, None, None]),
    "during it": ([noted("08:00", 310.0)], [310.0, None, None]),
    "at its end it is of the next": ([noted("08:29", 310.0)], [None, 310.0, None]),
    "until it says": ([noted("07:40", 310.0, "10:00")], [310.0, 310.0, None]),
    "to the end of one drive": ([noted("07:40", 310.0, "08:31")], [310.0, None, None]),
    "said anew": ([noted("07:40", 310.0), noted("07:45", 200.0)], [200.0, None, None]),
    "a change of load": ([noted("07:40", 310.0, "10:00"), LESS], [310.0, 250.0, None]),
    "two changes": ([noted("07:40", 310.0), LESS, MORE], [310.0, 250.0, 290.0]),
    "empty ends it": ([noted("07:40", 310.0, "14:00"), told("09:50", source="empty")], [310.0, 310.0, 0.0]),
    "empty all day": ([told("07:40", "14:00", source="empty")], [0.0, 0.0, 0.0]),
    "only a check": ([noted("07:40", 310.0, learn=False)], [None, None, None]),
    "nothing said": ([], [None, None, None]),
}


@pytest.mark.parametrize("case", HELD)
def test_a_statement_holds_for_its_drives(case: str) -> None:
    records, expected = HELD[case]
    assert payloads(assign(records, MORNING, VAN)) == expected


ONE_REF = [noted("07:40", 310.0, ref="A"), noted("07:41", 130.0, ref="A")]
ONE_LOAD = [noted("07:40", 310.0, "09:00", ref="A"), noted("08:00", 200.0, "09:00", ref="B")]
ONE_MINUTE = "of the same time as that from 2026-11-26T07:40Z"
WEIGHED = told("07:45", source="scale", gross_kg=1720.0)
WAITING, MATCHED, OVERLAPPING = Fate.WAITING, Fate.MATCHED, Fate.OVERLAPPING
FATES: dict[str, tuple[list[StatementRecord], list[Fate], str]] = {
    "no drive yet": ([noted("15:00", 100.0)], [WAITING], "no drive within 12 hours"),
    "between drives": ([noted("10:00", 310.0, "11:00")], [WAITING], "no drive from"),
    "loaded before it drove": (
        [told("06:00", source="empty"), noted("07:00", 310.0)],
        [WAITING, MATCHED],
        "another statement began before the middle of the drive",
    ),
    "one ref twice": (ONE_REF, [Fate.REPLACED, MATCHED], "replaced by a later one with the ref A"),
    "two notes for one load": (ONE_LOAD, [OVERLAPPING] * 2, "of the same time as B"),
    "two notes from one minute": ([noted("07:40", 310.0), noted("07:40", 310.5)], [OVERLAPPING] * 2, ONE_MINUTE),
    "written to the minute": ([noted("07:40", 310.0, "08:50"), noted("08:49", 200.0, "09:50")], [MATCHED] * 2, ""),
    "a note and a weighing on a scale": ([noted("07:40", 310.0), WEIGHED], [MATCHED] * 2, ""),
}


@pytest.mark.parametrize("case", FATES)
def test_the_state_of_each_record_is_reported(case: str) -> None:
    records, fates, reason = FATES[case]
    found = assign(records, MORNING, VAN)
    assert list(found.fates) == fates
    assert found.reasons[0].startswith(reason)
    assert bool(found.reasons[0]) is bool(reason)


@pytest.mark.parametrize(
    ("said", "words"),
    [
        ({"payload_kg": 0.31}, "write 310 if these are tonnes"),
        ({"payload_kg": 1720.0}, "write gross_kg if that is the whole vehicle"),
        ({"payload_kg": 1100.0}, "more than 2 times what the vehicle may carry (450 kg): is it in pounds"),
        ({"source": "scale", "gross_kg": 310.0}, "1100 kg less than the empty vehicle: write payload_kg"),
        ({"source": "scale", "gross_kg": 3800.0}, "is it in pounds, or another vehicle's?"),
        (
            {"source": "axle_scales", "front_axle_kg": 90.0, "rear_axle_kg": 1600.0},
            "read the scale slip again, axle by axle",
        ),
        ({"payload_kg": 310.0, "place": {"behind_front_axle_m": 26.0}}, "from the front axle rearwards, in metres"),
        ({"change_kg": -60.0}, "no statement of the load before it"),
    ],
)
def test_impossible_statements_are_reported_with_the_probable_meaning(said: dict[str, Any], words: str) -> None:
    found = assign([told("07:40", **said)], MORNING, VAN)
    assert found.fates == (Fate.IMPOSSIBLE,)
    assert words in found.reasons[0]
    assert payloads(found) == [None, None, None]


@pytest.mark.parametrize(
    ("before", "change_kg", "words"),
    [
        (told("06:40", "07:00", payload_kg=310.0), -60.0, "the statement before it ended at 2026-11-26T07:00Z"),
        (told("07:40", payload_kg=310.0), -400.0, "would leave -90 kg of the 310 kg aboard"),
    ],
)
def test_a_change_needs_a_load_that_it_changes(before: StatementRecord, change_kg: float, words: str) -> None:
    found = assign([before, told("08:45", change_kg=change_kg)], MORNING, VAN)
    assert found.fates[1] is Fate.IMPOSSIBLE
    assert words in found.reasons[1]


def test_gross_weight_less_the_empty_vehicle_is_the_payload() -> None:
    (said, *_) = assign([told("07:40", source="scale", gross_kg=1720.0)], MORNING, VAN).statements
    assert said.payload_kg == pytest.approx(310.0)
    assert said.claims[0].stated_plus_minus_kg == pytest.approx(12.0)


def test_axle_weights_are_a_payload_and_a_front_share() -> None:
    """Statics by hand: 1240 kg sprung, 52 % in front, so that wheels and axles weigh 85.2 and 84.8 kg."""
    record = told("07:40", source="axle_scales", front_axle_kg=790.0, rear_axle_kg=930.0, plus_minus_kg=10.0)
    (said, *_) = assign([record], MORNING, VAN).statements
    assert said.payload_kg == pytest.approx(310.0)
    assert said.front_share_pct == pytest.approx(100.0 * (790.0 - 85.2) / 1550.0)
    assert said.claims[0].stated_plus_minus_kg == pytest.approx(10.0 * 2**0.5)
    assert said.front_share_plus_minus_pct == pytest.approx(100.0 * 10.0 / 1550.0 / 2**0.5, rel=0.02)
    assert said.placed_by == record.id


def test_unknown_unsprung_masses_are_an_error_of_every_weighing() -> None:
    bare = replace(VAN, kerb_front_axle_kg=None, kerb_rear_axle_kg=None)
    (said, *_) = assign([told("07:40", source="scale", gross_kg=1720.0)], MORNING, bare).statements
    assert said.payload_kg == pytest.approx(1720.0 - 1240.0 - 2 * 0.065 * 1240.0)
    assert dict(said.claims[0].shared)["scale"] > 30.0


def test_notes_share_an_error_and_each_has_its_own() -> None:
    records = [told("07:40", payload_kg=300.0, plus_minus_kg=20.0), told("08:45", payload_kg=100.0)]
    one, other, _ = (
        dict(said.claims[0].shared) if said.claims else {} for said in assign(records, MORNING, VAN).statements
    )
    assert one == {records[0].id: pytest.approx(20.0 / Z95), "delivery_note": pytest.approx(30.0)}
    assert other["delivery_note"] == pytest.approx(10.0)


def test_a_change_inherits_the_errors_of_what_it_changes() -> None:
    records = [told("07:40", payload_kg=300.0, plus_minus_kg=20.0), told("08:45", change_kg=-60.0, plus_minus_kg=5.0)]
    changed = assign(records, MORNING, VAN).statements[1].claims[0]
    assert set(dict(changed.shared)) == {records[0].id, "delivery_note", records[1].id}
    assert changed.std_kg > 20.0 / Z95


@pytest.mark.parametrize(
    ("source", "payload_kg", "plus_minus_kg"),
    [("delivery_note", 300.0, 25.0), ("delivery_note", 800.0, 40.0), ("known", 300.0, 4.0), ("scale", 300.0, 12.0)],
)
def test_each_source_has_its_usual_doubt(source: str, payload_kg: float, plus_minus_kg: float) -> None:
    (said, *_) = assign([told("07:40", source=source, payload_kg=payload_kg)], MORNING, VAN).statements
    assert said.claims[0].stated_plus_minus_kg == pytest.approx(plus_minus_kg)


def test_a_statement_of_a_load_has_place_and_goods() -> None:
    record = told("07:40", payload_kg=300.0, place={"behind_front_axle_m": 1.8, "plus_minus_m": 0.6, "left_m": -0.2})
    record = record.model_copy(update={"shape": record.model_validate(
        {**record.model_dump(by_alias=True), "shape": {"carries": "parcels"}}).shape})  # fmt: skip
    (said, *_) = assign([record], MORNING, VAN).statements
    assert (said.position_m, said.position_plus_minus_m, said.left_m, said.carries) == (1.8, 0.6, -0.2, "parcels")


def test_a_drive_is_cut_where_a_statement_begins_or_ends_inside_it() -> None:
    records = [told("07:40", "08:10", payload_kg=310.0), told("08:10", payload_kg=200.0), told("08:29", source="empty")]
    pieces = [Piece(*span, 1) for span in cut(ns("07:50"), ns("08:30"), moments(records))]
    assert [(one.begin_ns, one.end_ns) for one in pieces] == [(ns("07:50"), ns("08:10")), (ns("08:10"), ns("08:30"))]
    assert payloads(assign(records, pieces, VAN)) == [310.0, 200.0]
