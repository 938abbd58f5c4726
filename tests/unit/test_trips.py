"""Trips: distance, load and tonne-kilometres of each drive."""

from dataclasses import replace

import pytest
from support.days import batch, day, trips

from gateway.estimate import Place


def test_a_trip_adds_up_what_was_carried():
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
    [(1000.0, 4100.0, 3100.0, "odometer"), (1000.0, 9000.0, 3000.0, "speed"), (1000.0, 900.0, 3000.0, "speed")],
)
def test_the_odometer_is_believed_where_the_speed_agrees(first_m, last_m, distance_m, by):
    one = batch(0.0, 5.0, 300.0)
    one = replace(one, way=replace(one.way, odometer_start_m=first_m, odometer_end_m=last_m))
    (trip,) = trips([one])
    assert (trip["distance_m"], trip["distance_by"]) == (distance_m, by)


@pytest.mark.parametrize(
    ("odometer_m", "by"), [(2330, "speed"), (2340, "odometer"), (3990, "odometer"), (4010, "speed")]
)
def test_the_odometer_may_be_off_by_a_fifth_and_two_hundred_metres(odometer_m, by):
    one = batch(0.0, 5.0, 300.0)
    one = replace(one, way=replace(one.way, odometer_start_m=0.0, odometer_end_m=odometer_m))
    (trip,) = trips([one])
    assert trip["distance_by"] == by


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
