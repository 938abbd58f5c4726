"""The study of false facts: twenty, those that need no drive caught at once, and a page that says its numbers."""

import json
from pathlib import Path

import pytest
from pydantic import TypeAdapter, ValidationError

from benchmarks.accuracy.false_facts import FALSE, Fact, false_facts_page
from gateway.calibration.commissioning.answers import doubts_of
from gateway.stated.facts import VehicleAnswers

DOCS = Path(__file__).parents[2] / "docs"
VAN = {
    "kerb_front_axle_kg": 860.0,
    "kerb_rear_axle_kg": 540.0,
    "wheelbase_m": 2.75,
    "sensor_position_m": 3.2,
    "sensor_offset_left_m": 0.2,
    "track_width_m": 1.5,
}
BY_DRIVING = ("aboard", "of another model", "exchanged", "laden", "15 %", "10 %", "half a metre")


def is_asked_about(fact: Fact) -> bool:
    try:
        return bool(doubts_of(TypeAdapter(VehicleAnswers).validate_python(fact.falsify(dict(VAN)))))
    except ValidationError:
        return True


def test_there_are_twenty_and_the_truth_is_none_of_them() -> None:
    assert len({fact.words for fact in FALSE}) == 20
    assert not is_asked_about(Fact("true"))


@pytest.mark.parametrize(
    "fact", [fact for fact in FALSE if not any(word in fact.words for word in BY_DRIVING)], ids=lambda fact: fact.words
)
def test_what_no_vehicle_is_like_is_caught_before_any_drive(fact: Fact) -> None:
    assert is_asked_about(fact)


def test_the_page_says_the_numbers_of_the_study() -> None:
    found = json.loads((DOCS / "false-facts.json").read_text())
    assert (DOCS / "false-facts.md").read_text() == false_facts_page(found)
    assert [row["words"] for row in found["rows"]] == [fact.words for fact in FALSE]
