"""What latest says: the last good estimate, its age, and what came after it; points in time as clients write them."""

import json
from dataclasses import replace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.estimates import WINDOW_NS, make_estimate, make_record

from gateway.estimates.as_json import estimate_to_json
from gateway.estimates.batch_estimate import Lack, Quantity, Weight, Weights
from gateway.records import Why, iso_utc
from gateway.web.live.board import Board
from gateway.web.schemas import parse_instant


class Clock:
    now_s = 50.0

    def __call__(self) -> float:
        return self.now_s


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def board(clock: Clock) -> Board:
    return Board(stale_after_s=900.0, clock=clock)


def latest(board: Board) -> dict[str, Any]:
    told = json.loads(board.latest()[1])
    assert isinstance(told, dict)
    return told


def test_before_any_estimate_a_calibrated_vehicle_lacks_only_an_estimate(clock: Clock) -> None:
    gross = Weight(limit_kg=2000.0, lacks=Lack.ESTIMATE)
    board = Board(stale_after_s=900.0, clock=clock, unweighed=Weights(gross=gross))
    board.publish(make_estimate(1, Why.GAP))
    nothing = dict.fromkeys(("kg", "std_kg", "interval95_kg"))
    known = {"limit_kg": 2000.0, "is_over_limit": False, "lacks": "estimate", "is_unsprung_estimated": False}
    assert latest(board)["weights"]["gross"] == nothing | known


def test_a_rejection_is_shown_beside_the_estimate_without_renewing_it(board: Board, clock: Clock) -> None:
    board.publish(make_estimate(3))
    clock.now_s += 300.0
    board.publish(make_estimate(4, Why.TOO_SLOW, with_spectra=True))
    told = latest(board)
    assert told["payload_kg"] == 103.0
    assert told["age_s"] == 300.0
    expected = make_record(4, Why.TOO_SLOW)
    assert told["last_rejection"] == expected


def test_a_provisional_estimate_stands_in_until_the_drive_has_a_good_one(board: Board) -> None:
    board.publish(make_estimate(0, is_provisional=True))
    assert latest(board)["provisional"] is True
    board.publish(make_estimate(0))
    assert "provisional" not in latest(board)
    board.publish(make_estimate(1, is_provisional=True))
    assert latest(board)["payload_kg"] == 100.0
    assert "provisional" not in latest(board)


def test_an_early_look_without_an_answer_is_not_shown(board: Board) -> None:
    board.publish(make_estimate(0))
    board.publish(make_estimate(7, Why.NOT_ENOUGH_EXCITATION, is_provisional=True))
    told = latest(board)
    assert told["payload_kg"] == 100.0
    assert told["last_rejection"] is None


def test_the_tag_changes_with_all_but_the_age(board: Board, clock: Clock) -> None:
    tags = [board.latest()[0]]

    def is_new() -> bool:
        tags.append(board.latest()[0])
        return tags[-1] not in tags[:-1]

    board.publish(make_estimate(0, is_provisional=True))
    assert is_new()
    board.publish(make_estimate(0))
    assert is_new()
    clock.now_s += 10.0
    assert not is_new()
    board.publish(make_estimate(1, Why.GAP))
    assert is_new()
    clock.now_s += 1000.0
    assert is_new()


def test_latest_is_the_same_before_and_after_a_restart(board: Board, clock: Clock) -> None:
    thirds = replace(make_estimate(3), payload=Quantity(1000.0 / 3.0, 20.0 / 3.0), t_start_ns=3 * WINDOW_NS + 333)
    board.publish(thirds)
    clock.now_s += 12.34
    before = board.shown()
    assert (before.estimate.payload.number, before.age_s, before.is_stale) == (333.333333, 12.3, False)
    assert before.estimate.id == thirds.id
    again = Board(stale_after_s=900.0, clock=clock)
    again.restore(json.dumps(estimate_to_json(thirds)), None, age_s=12.34)
    assert again.shown() == before
    assert again.latest() == board.latest()


US_LAST = 253_402_300_799_999_999  # the end of 9999


@given(st.integers(0, US_LAST))
def test_written_times_are_read_back(t_us: int) -> None:
    assert parse_instant(iso_utc(t_us * 1000)) == t_us * 1000


def test_an_instant_has_a_zone_and_fractions() -> None:
    assert parse_instant("1970-01-01T01:00:00.5+01:00") == 500_000_000
    assert parse_instant("1969-12-31T23:59:59.5Z") == -500_000_000


NOT_AN_INSTANT = """
5
yesterday
2026-11-21
2026-11-21T04:00:00
2026-11-21T04:00:00 01:00
2026-13-01T00:00:00Z
2026-02-30T00:00:00Z
2026-11-21T24:00:01Z
2026-11-21T04:00:00+24:00
""".splitlines()


@pytest.mark.parametrize("text", [*NOT_AN_INSTANT, None, 7])
def test_anything_else_is_refused(text: object) -> None:
    with pytest.raises(ValueError, match="with its zone"):
        parse_instant(text)
