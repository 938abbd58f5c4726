"""Load events and trips: what a change of weight between stops becomes, how sure it is, and how later batches, or a
clock that is put right, change it."""

import math
from collections.abc import Iterator
from dataclasses import replace

import pytest
from support.days import OWN_KG, RULES, T0_NS, at, batch, day, events, posterior, told, trips

from gateway.core.events import ledger
from gateway.core.events.entry import Entry
from gateway.core.events.ledger import Ledger
from gateway.estimates.batch_estimate import Estimate, Place, Stop, Watched


def test_a_delivery_has_its_weight_time_and_both_loads():
    first, second = day(400.0, 220.0)
    (found,) = events([first, second])
    assert found["change_kg"] == pytest.approx(-180.0)
    low, high = found["change_interval95_kg"]
    assert low < -180.0 < high
    assert found["change_std_kg"] >= round(math.sqrt(2) * OWN_KG, 1)
    assert (found["before"]["payload_kg"], found["after"]["payload_kg"]) == (400.0, 220.0)
    assert found["t_start"].endswith(":18:20.000000Z") or found["t_start"] < found["t_end"]
    assert found["probability"] > 0.999
    assert not found["is_withdrawn"]
    assert found["revision"] == 1


def test_an_unchanged_load_gives_no_event():
    assert not events(day(300.0, 305.0, 297.0, 300.0, batches=2))


@pytest.mark.parametrize("kg", [300.0, 900.0])
@pytest.mark.parametrize("n_stops", [10, 40])
def test_a_round_of_hops_too_short_to_weigh_ends_in_one_event(n_stops, kg):
    """The door opened at every stop: the prior is 1 to the last digit, and the change beyond any chance."""
    (found,) = events(day(0.0, *[None] * n_stops, kg, door=True))
    assert found["probability"] == 1.0
    assert found["change_kg"] == pytest.approx(kg)
    assert len(found["stops"]) == n_stops + 1


def test_later_batches_sharpen_the_same_event():
    whole = day(400.0, 330.0, batches=3)
    ledger = Ledger(RULES)
    revisions = [entry for one in whole for entry in ledger.add(one) if entry.kind == "event"]
    assert len({entry.id for entry in revisions}) == 1
    assert [entry.revision for entry in revisions] == list(range(1, len(revisions) + 1))
    assert len(revisions) > 1
    assert revisions[-1].record["change_std_kg"] < revisions[0].record["change_std_kg"]


def test_an_event_that_later_batches_contradict_is_withdrawn():
    one = day(300.0, 300.0, batches=4)
    high = one[4].answered(posterior(334.0, 50.6))
    whole = [*one[:4], high, *one[5:]]
    ledger = Ledger(RULES)
    revisions = [entry.record for each in whole for entry in ledger.add(each) if entry.kind == "event"]
    assert revisions[0]["probability"] > 0.9
    assert revisions[-1]["is_withdrawn"]
    assert revisions[-1]["probability"] < 0.5
    assert revisions[-1]["id"] == revisions[0]["id"]


@pytest.mark.parametrize(("door", "is_told"), [(True, True), (None, True), (False, False)])
def test_a_door_that_stayed_shut_raises_the_evidence_needed(door, is_told):
    found = events(day(300.0, 257.0, door=door))
    assert bool(found) is is_told
    if found:
        assert found[0]["stops"][0]["door_opened"] is door


def test_two_stops_without_a_weighing_between_are_both_named():
    whole = day(400.0, None, 220.0)
    (found,) = events(whole)
    assert len(found["stops"]) == 2
    assert found["place"] is None
    assert found["t_start"] == found["stops"][0]["t_start"]
    assert found["t_end"] == found["stops"][1]["t_end"]


def test_an_open_door_decides_between_two_stops():
    first, middle, last = day(400.0, None, 220.0)
    middle = replace(middle, way=replace(middle.way, before=Watched(False, None)))
    last = replace(last, way=replace(last.way, before=Watched(True, None)))
    (found,) = events([first, middle, last])
    assert [stop["door_opened"] for stop in found["stops"]] == [True]


def test_a_stop_has_a_place_and_a_time():
    arrived = Stop(at(4.0), at(5.0), Watched(True, None), Place(47.1, 8.5))
    first = batch(0.0, 5.0, 400.0, stops=(arrived,))
    (found,) = events([first, batch(12.0, 17.0, 200.0)])
    assert found["place"] == {"latitude_deg": 47.1, "longitude_deg": 8.5}
    assert found["stops"] == [
        {
            "t_start": "2026-09-21T14:17:20.000000Z",
            "t_end": "2026-09-21T14:25:20.000000Z",
            "door_opened": True,
            "ignition_off": None,
            "place": {"latitude_deg": 47.1, "longitude_deg": 8.5},
        }
    ]
    assert T0_NS == 1_790_000_000_000_000_000


def test_a_change_without_a_stop_needs_a_large_jump():
    rolling = [batch(5.0 * i, 5.0 * i + 5.0, kg) for i, kg in enumerate((300.0, 300.0, 270.0, 270.0))]
    assert not events(rolling)
    dropped = [batch(5.0 * i, 5.0 * i + 5.0, kg) for i, kg in enumerate((300.0, 300.0, 100.0, 100.0))]
    (found,) = events(dropped)
    assert found["stops"] == []


def test_batches_of_different_calibrations_are_not_compared():
    first, second = day(300.0, 100.0)
    assert not events([first, replace(second, calibration_id="sha256:2")])


def test_a_load_after_a_long_rest_is_an_event_and_ends_the_trip():
    before, after = (
        day(0.0, 300.0, batches=2)[:2],
        [batch(days * 1440.0, days * 1440.0 + 5.0, 300.0) for days in (9.0, 9.01)],
    )
    (found,) = events([*before, *after])
    assert found["change_kg"] == pytest.approx(300.0)
    first, *_ = [e.record for e in told([*before, *after]).values() if e.kind == "trip"]
    assert first["is_over"]


DAY_MIN = 24 * 60.0
AHEAD_MIN = 3 * DAY_MIN + 7.0


def moved(estimates: list[Estimate], minutes: float) -> list[Estimate]:
    """The batches by another clock; they have no stops of their own."""
    by_ns = round(minutes * 60e9)
    return [replace(one, t_start_ns=one.t_start_ns + by_ns, t_end_ns=one.t_end_ns + by_ns) for one in estimates]


def put_right(*kg_of_leg: float | None, ahead: int, ahead_min: float = AHEAD_MIN, **how) -> list[Estimate]:
    """A day whose first batches were driven by a clock that was ahead."""
    whole = day(*kg_of_leg, **how)
    return moved(whole[:ahead], ahead_min) + whole[ahead:]


def told_with(estimates: list[Estimate]) -> Iterator[tuple[int, Entry]]:
    ledger = Ledger(RULES)
    return ((n, entry) for n, one in enumerate(estimates) for entry in ledger.add(one))


@pytest.mark.parametrize("ahead_min", [18.0, 60.0, DAY_MIN, 3650 * DAY_MIN])
def test_a_clock_step_does_not_change_a_later_delivery(ahead_min):
    (expected,) = events(day(400.0, 400.0, 220.0))
    (found,) = events(put_right(400.0, 400.0, 220.0, ahead=1, ahead_min=ahead_min))
    assert found == expected
    assert found["stops"]


def test_a_clock_step_separates_trips():
    found = trips(put_right(300.0, 300.0, 300.0, ahead=1))
    assert [trip["is_over"] for trip in found] == [True, True, False]
    assert all(trip["t_start"] < trip["t_end"] for trip in found)


def test_a_load_during_a_clock_step_has_the_right_time():
    whole = put_right(400.0, 400.0, 100.0, 100.0, ahead=2)
    (found,) = events(whole)
    assert found["change_kg"] == pytest.approx(-300.0)
    assert found["t_start"] <= found["t_end"]
    (right,) = events(day(400.0, 400.0, 100.0, 100.0))
    assert found["t_end"] == right["t_end"]


def test_a_load_shortly_before_a_clock_step_keeps_its_order():
    """Two legs without a weighing, one by each clock: both stops are named that can have been long enough."""
    whole = put_right(400.0, None, None, 100.0, ahead=2)
    (found,) = events(whole)
    assert len(found["stops"]) == 2
    assert found["t_start"] <= found["t_end"]
    assert all(stop["t_start"] <= stop["t_end"] for stop in found["stops"])


def test_each_drive_that_begins_in_1970_hides_no_load():
    """No clock battery: the first batch of a day is of 1970, until the date is learned."""
    evening, morning = day(300.0), moved(day(100.0, 100.0), DAY_MIN)
    first = replace(batch(0.0, 1.0, None), t_start_ns=0, t_end_ns=60_000_000_000)
    (expected,) = events([*evening, *morning])
    (found,) = events([*evening, first, *morning])
    for name in ("change_kg", "t_start", "t_end", "before", "after"):
        assert found[name] == expected[name]


def test_old_entries_do_not_change_with_the_clock(monkeypatch):
    monkeypatch.setattr(ledger, "HORIZON", 60)
    monkeypatch.setattr(ledger, "SETTLED", 30)
    whole = put_right(400.0, 300.0, *[300.0] * 80, ahead=3)
    revisions = [(n, entry) for n, entry in told_with(whole) if entry.kind == "event"]
    assert len({entry.id for _, entry in revisions}) == 1
    assert max(n for n, _ in revisions) <= 31
    assert not revisions[-1][1].record["is_withdrawn"]


def test_a_trip_adds_up_its_loads():
    first, second = trips(day(0.0, 500.0, batches=2))
    assert (first["distance_m"], first["payload_kg"], first["carried_tkm"]) == (6000.0, 0.0, 0.0)
    assert first["empty_share"] == 1.0
    assert (second["distance_m"], second["payload_kg"]) == (6000.0, 500.0)
    assert second["carried_tkm"] == pytest.approx(0.5 * 6.0)
    low, high = second["carried_interval95_tkm"]
    assert high - low == pytest.approx(2 * 1.96 * second["payload_std_kg"] / 1000 * 6.0, rel=0.01)
    assert second["empty_share"] == 0.0
    assert first["overloaded_share"] == second["overloaded_share"] == 0.0
    assert (first["is_over"], second["is_over"]) == (True, False)


def test_overloaded_way_is_counted_by_the_load_as_all_its_batches_tell_it():
    (trip,) = trips(day(600.0, batches=2))
    assert trip["overloaded_share"] == 1.0


def test_a_drive_without_a_weighing_has_a_load_where_both_sides_agree():
    assert [trip["payload_kg"] for trip in trips(day(300.0, None, 300.0))] == [300.0, 300.0, 300.0]
    assert [trip["payload_kg"] for trip in trips(day(300.0, None, 100.0))] == [300.0, None, 100.0]


def test_a_rejected_rest_of_a_drive_carries_the_drive_s_load():
    (trip,) = trips([batch(0.0, 5.0, 300.0), batch(5.0, 6.0, None, metres=1000.0)])
    assert trip["distance_m"] == 4000.0
    assert trip["weighed_share"] == 1.0
    assert trip["carried_tkm"] == pytest.approx(1.2)


@pytest.mark.parametrize(
    ("first_m", "last_m", "distance_m", "by"),
    [
        (1000.0, 4100.0, 3100.0, "odometer"),
        (1000.0, 9000.0, 3000.0, "speed"),
        (1000.0, 900.0, 3000.0, "speed"),
        (0.0, 2330.0, 3000.0, "speed"),  # a fifth and two hundred metres less than by the speed
        (0.0, 2340.0, 2340.0, "odometer"),
        (0.0, 3990.0, 3990.0, "odometer"),
        (0.0, 4010.0, 3000.0, "speed"),
    ],
)
def test_the_odometer_is_believed_where_the_speed_agrees(first_m, last_m, distance_m, by):
    one = batch(0.0, 5.0, 300.0)
    one = replace(one, way=replace(one.way, odometer_start_m=first_m, odometer_end_m=last_m))
    (trip,) = trips([one])
    assert (trip["distance_m"], trip["distance_by"]) == (distance_m, by)


@pytest.mark.parametrize(("kg", "share"), [(59.0, 1.0), (61.0, 0.0)])
def test_empty_is_less_than_three_per_cent_of_the_vehicle(kg, share):
    (trip,) = trips([batch(0.0, 5.0, kg)])
    assert trip["empty_share"] == share


@pytest.mark.parametrize(("metres", "n_trips"), [(3.0, 0), (49.0, 0), (51.0, 1)])
def test_moving_the_vehicle_in_the_yard_is_no_trip(metres, n_trips):
    assert len(trips([batch(0.0, 5.0, 300.0, metres=metres)])) == n_trips


def test_a_trip_ends_where_it_stopped():
    (trip,) = trips([batch(0.0, 5.0, 300.0, place=Place(47.0, 8.0))])
    assert trip["to"] == {"latitude_deg": 47.0, "longitude_deg": 8.0}
    assert trip["from"] is None
